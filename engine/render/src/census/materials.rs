//! The materials of a census.

use crate::GlintMaterial;
use crate::scene::{AlphaMode, Material, Scene};
use serde::Serialize;

/// A material, as far as something of it has to be simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialCensus {
    /// Its name.
    pub name: String,
    /// Triangles of all instances that show it: of a material without any, nothing is simulated.
    pub triangles: u64,
    /// It scatters light below its surface.
    pub diffuse: bool,
    /// It mirrors without glints.
    pub smooth_specular: bool,
    /// It gives off light.
    pub emissive: bool,
    /// It shows its base colour whatever the light.
    pub unlit: bool,
    /// It has holes where its alpha is low.
    pub alpha_mask: bool,
    /// How many textures it has.
    pub textures: usize,
    /// One of them holds normals, and triangles have tangents for it.
    pub normal_map: bool,
    /// Triangles of it have colours at their vertices.
    pub vertex_colors: bool,
    /// It lies under a clear coat.
    pub clear_coat: bool,
    /// Its glints.
    pub glints: Option<GlintCensus>,
}

/// Glints of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GlintCensus {
    /// The method that renders them.
    pub method: &'static str,
    /// Why the renderer chose it; none where it was asked for by name.
    pub chosen: Option<String>,
    /// Flakes in a square of texture space.
    pub count: u64,
    /// Whether they are more than a 32-bit float counts one by one: 2^24.
    pub beyond_floats: bool,
    /// Beckmann roughness of their normals.
    pub alpha: f64,
    /// Half-angle of the cone into which a flake reflects a ray, in degrees.
    pub gamma_deg: f64,
    /// Whether the cone is narrower beside the lobe than half a tenth of its width: P is then D times a solid angle.
    pub narrow_cone: bool,
    /// Least and greatest texture coordinates of the flakes on any triangle, scaled as they are placed; none without any.
    pub uv_range: Option<[[f64; 2]; 2]>,
    /// Whether they leave one square of texture space, so that flakes may repeat.
    pub tiles: bool,
}

/// What the meshes of one material hold, added up over their instances.
#[derive(Clone, Copy, Debug, Default)]
struct Shown {
    triangles: u64,
    tangents: bool,
    colors: bool,
    uv_ranges: [Option<[[f32; 2]; 2]>; 2],
}

/// By material, what instances show of it: nothing that an edit changes.
pub(super) struct Surfaces(Vec<Shown>);

impl Surfaces {
    pub fn of(scene: &Scene) -> Self {
        let mut placed = vec![0u64; scene.meshes.len()];
        for instance in &scene.instances {
            placed[instance.mesh] += 1;
        }
        let mut surfaces = vec![Shown::default(); scene.materials.len()];
        for (mesh, placed) in scene.meshes.iter().zip(placed) {
            let triangles = mesh.triangle_count() as u64 * placed;
            let Some(shown) = surfaces.get_mut(mesh.material).filter(|_| triangles > 0) else { continue };
            shown.triangles += triangles;
            shown.tangents |= !mesh.tangents.is_empty();
            shown.colors |= !mesh.colors.is_empty();
            for (range, uv) in shown.uv_ranges.iter_mut().zip(&mesh.uv) {
                *range = uv.iter().fold(*range, |range, &[u, v]| {
                    let [[u0, v0], [u1, v1]] = range.unwrap_or([[u, v]; 2]);
                    Some([[u0.min(u), v0.min(v)], [u1.max(u), v1.max(v)]])
                });
            }
        }
        Self(surfaces)
    }

    pub fn triangles(&self) -> u64 {
        self.0.iter().map(|shown| shown.triangles).sum()
    }

    pub fn materials(&self, scene: &Scene, glinting: &[GlintMaterial]) -> Vec<MaterialCensus> {
        let all = scene.materials.iter().zip(&self.0).enumerate();
        all.map(|(index, (material, shown))| {
            let glints = glinting.iter().find(|glint| glint.index == index && glint.flakes() > 0);
            census_of(material, shown, glints)
        })
        .collect()
    }
}

fn census_of(material: &Material, shown: &Shown, glints: Option<&GlintMaterial>) -> MaterialCensus {
    let Material { metallic, unlit, specular, clearcoat, .. } = *material;
    MaterialCensus {
        name: material.name.clone(),
        triangles: shown.triangles,
        diffuse: !unlit && (metallic < 1.0 || material.metallic_roughness_texture.is_some()),
        smooth_specular: !unlit && glints.is_none() && (metallic > 0.0 || specular.factor > 0.0),
        emissive: material.emissive.iter().any(|channel| *channel > 0.0),
        unlit,
        alpha_mask: material.alpha != AlphaMode::Opaque,
        textures: material.textures().count(),
        normal_map: material.normal_texture.is_some() && shown.tangents,
        vertex_colors: shown.colors,
        clear_coat: clearcoat.is_some_and(|coat| coat.factor > 0.0),
        glints: glints.map(|glints| glints_of(glints, shown)),
    }
}

fn glints_of(glints: &GlintMaterial, shown: &Shown) -> GlintCensus {
    let [alpha, gamma_deg, uv_scale] = ["alpha", "gamma_deg", "uv_scale"].map(|key| glints.values.number(key));
    let range = shown.uv_ranges[usize::from(glints.uv_set == 1)];
    let uv_range = range.map(|corners| corners.map(|corner| corner.map(|at| uv_scale * f64::from(at))));
    let squares = |[low, high]: [[f64; 2]; 2]| (0..2).any(|axis| high[axis].ceil() - low[axis].floor() > 1.0);
    GlintCensus {
        method: glints.method.name,
        chosen: glints.chosen.clone(),
        count: glints.flakes(),
        beyond_floats: glints.flakes() > 1 << 24,
        alpha,
        gamma_deg,
        narrow_cone: gamma_deg.to_radians() < 0.05 * alpha,
        uv_range,
        tiles: uv_range.is_some_and(squares),
    }
}
