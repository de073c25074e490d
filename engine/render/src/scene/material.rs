//! How a surface looks: glTF's metallic-roughness model, its extensions that are read, and glints.

use std::ops::RangeInclusive;

/// A surface. Factors multiply their textures; colours are linear with Rec. 709 primaries.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// From the file, or made from the material's place in it.
    pub name: String,
    /// Albedo of a dielectric or reflectance of a metal, and opacity.
    pub base_color: [f32; 4],
    /// sRGB colour, alpha linear.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; the microfacet alpha is its square.
    pub roughness: f32,
    /// Roughness in green, metalness in blue.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Radiance given off, with `KHR_materials_emissive_strength` multiplied in.
    pub emissive: [f32; 3],
    /// sRGB colour.
    pub emissive_texture: Option<TextureRef>,
    /// Tangent-space normals; glTF's convention, +Y upwards (towards -v).
    pub normal_texture: Option<TextureRef>,
    /// Multiplies x and y of the normal texture's vectors.
    pub normal_scale: f32,
    /// Ambient occlusion in red.
    pub occlusion_texture: Option<TextureRef>,
    /// How much of the occlusion applies, 0 to 1.
    pub occlusion_strength: f32,
    /// What opacity means.
    pub alpha: AlphaMode,
    /// Whether the back is seen too (with its normal turned around).
    pub double_sided: bool,
    /// `KHR_materials_unlit`: shows its base colour whatever the light.
    pub unlit: bool,
    /// `KHR_materials_ior`: index of refraction; 1.5 when absent. 0 stands for a Fresnel of 1, as that extension says.
    pub ior: f32,
    /// `KHR_materials_specular`.
    pub specular: Specular,
    /// `KHR_materials_clearcoat`; none when absent or its factor is 0.
    pub clearcoat: Option<Clearcoat>,
    /// `KHR_materials_sheen`; none when absent or its colour is black.
    pub sheen: Option<Sheen>,
    /// The glitter in it; none when it does not glint.
    pub glint: Option<Glint>,
}

impl Material {
    /// The textures that it uses, but for those of what is not rendered yet.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> + use<> {
        let coat = self.clearcoat.as_ref();
        let textures = [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.occlusion_texture,
            self.emissive_texture,
            coat.and_then(|coat| coat.texture),
            coat.and_then(|coat| coat.roughness_texture),
            self.specular.texture,
            self.specular.color_texture,
        ];
        textures.into_iter().flatten()
    }
}

impl Default for Material {
    /// The material that glTF gives to a primitive without one.
    fn default() -> Self {
        Self {
            name: "default".to_owned(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            emissive: [0.0; 3],
            emissive_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: Specular::default(),
            clearcoat: None,
            sheen: None,
            glint: None,
        }
    }
}

/// What a material's opacity means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Nothing.
    Opaque,
    /// A hole where it is below the cutoff.
    Mask {
        /// The least opacity that is solid.
        cutoff: f32,
    },
    /// A blend with what lies behind.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Into [`Scene::textures`](super::Scene::textures).
    pub texture: usize,
    /// Which of [`Mesh::uv`](super::Mesh::uv): 0 or 1.
    pub uv_set: u32,
    /// Rows of the affine map (`KHR_texture_transform`): texture coordinate `k` is
    /// `dot(transform[k], (u, v, 1))`.
    pub transform: [[f32; 3]; 2],
}

impl TextureRef {
    /// The map that changes nothing.
    pub const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
}

/// `KHR_materials_specular`: the strength and colour of a dielectric's reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular {
    /// Strength, 0 to 1.
    pub factor: f32,
    /// Strength in alpha.
    pub texture: Option<TextureRef>,
    /// Colour of the reflection at normal incidence.
    pub color: [f32; 3],
    /// sRGB colour.
    pub color_texture: Option<TextureRef>,
}

impl Default for Specular {
    fn default() -> Self {
        Self { factor: 1.0, texture: None, color: [1.0; 3], color_texture: None }
    }
}

/// `KHR_materials_clearcoat`: a layer of varnish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// Strength, 0 to 1.
    pub factor: f32,
    /// Strength in red.
    pub texture: Option<TextureRef>,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Roughness in green.
    pub roughness_texture: Option<TextureRef>,
    /// The varnish's own normals.
    pub normal_texture: Option<TextureRef>,
    /// Multiplies x and y of their vectors.
    pub normal_scale: f32,
}

/// `KHR_materials_sheen`: the fuzz of cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Its reflectance.
    pub color: [f32; 3],
    /// sRGB colour.
    pub color_texture: Option<TextureRef>,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Roughness in alpha.
    pub roughness_texture: Option<TextureRef>,
}

/// The glitter of a material, from its `glint_*` extras (flat keys, as Blender exports custom properties).
#[derive(Clone, Debug, PartialEq)]
pub struct Glint {
    /// Flakes per unit area of texture space (one UV square).
    pub count: f64,
    /// Beckmann roughness of the flakes' normals.
    pub alpha: f64,
    /// Half-angle of the cone in which a flake reflects, degrees.
    pub gamma_deg: f64,
    /// Chooses the flakes.
    pub seed: u32,
    /// Reflectance of a flake; the base colour when absent.
    pub color: Option<[f32; 3]>,
    /// Texture space is multiplied by it before flakes are placed.
    pub uv_scale: f32,
    /// The method this material asks for; the renderer's choice when absent.
    pub method: Option<String>,
    /// Which of [`Mesh::uv`](super::Mesh::uv) the flakes lie in.
    pub uv_set: u32,
}

impl Glint {
    /// What `glint_count` may be.
    pub const COUNT_RANGE: RangeInclusive<f64> = 0.0..=1e12;
    /// What `glint_alpha` may be.
    pub const ALPHA_RANGE: RangeInclusive<f64> = 0.001..=1.0;
    /// What `glint_gamma_deg` may be: above 32.8 degrees a cone's probability exceeds 1 (WDH20, eq. 17).
    pub const GAMMA_DEG_RANGE: RangeInclusive<f64> = 0.01..=30.0;
    /// What `glint_uv_scale` may be.
    pub const UV_SCALE_RANGE: RangeInclusive<f64> = 1e-6..=1e6;
}

impl Default for Glint {
    /// What a material has that says only how many flakes: the leather of WDH20's shoe.
    fn default() -> Self {
        Self { count: 0.0, alpha: 0.1, gamma_deg: 6.0, seed: 0, color: None, uv_scale: 1.0, method: None, uv_set: 0 }
    }
}
