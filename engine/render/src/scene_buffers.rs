//! The scene as the shaders read it: buffers and texture atlases, filled once.

use crate::filled::{Filled, FilledImage};
use crate::moved::Moved;
use crate::scene::bvh::LARGEST_COORDINATE;
use crate::scene::{
    AlphaMode, Atlas, AtlasImage, AtlasRecord, Bounds, Instance, Light, Material, Mesh, Scene, TextureRef, Wrap,
};
use crate::{GlintMaterial, RenderError};
use glam::{DAffine3, DVec3};
use mica_graph::{Buffer, Draw, Extent, Format, Graph, ImageDesc, Lifetime, MeshRange};
use mica_shaders::{constants as c, types};
use std::sync::Arc;

const FIRST: &str = "first frame of the scene";

/// Everything about the scene that is on the device.
pub(crate) struct SceneBuffers {
    /// Scene space is world space about this point.
    pub center: DVec3,
    /// The power of two that the scene fits into about its centre.
    pub scene_unit: f32,
    /// Each instance of a mesh, one draw.
    pub draws: Arc<[Draw]>,
    pub instances: Filled,
    pub indices: Filled,
    pub positions: Filled,
    pub normals: Filled,
    pub tangents: Filled,
    pub uvs: Filled,
    pub colors: Filled,
    /// Uploaded again when an edit changes a material.
    pub materials: Buffer,
    pub textures: Filled,
    pub atlas_srgb: FilledImage,
    pub atlas_linear: FilledImage,
    pub lights: Filled,
    light_records: Vec<types::Light>,
    uploaded_lights: Option<Vec<types::Light>>,
    pub light_count: u32,
    /// Where each mesh lies in `indices` and `positions`.
    pub mesh_places: Vec<MeshRange>,
    mesh_bounds: Vec<Option<Bounds>>,
    /// The instances that moved since the last update.
    pub moved: Moved,
    base_materials: Vec<types::Material>,
    uploaded_materials: Option<Arc<[u8]>>,
}

impl SceneBuffers {
    /// Lays the scene out. `lights` are the scene's own and the caller's together.
    pub fn new(scene: &Scene, lights: &[Light], atlas: &Atlas) -> Result<Self, RenderError> {
        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let mut indices: Vec<u32> = Vec::new();
        let mut positions: Vec<[f32; 3]> = Vec::new();
        let mut normals: Vec<[f32; 3]> = Vec::new();
        let mut tangents: Vec<[f32; 4]> = Vec::new();
        let mut uvs: Vec<[f32; 4]> = Vec::new();
        let mut colors: Vec<[f32; 4]> = Vec::new();
        let has_tangents = scene.meshes.iter().any(|mesh| !mesh.tangents.is_empty());
        let has_uvs = scene.meshes.iter().any(|mesh| mesh.has_uv);
        let has_colors = scene.meshes.iter().any(|mesh| !mesh.colors.is_empty());
        let mut mesh_places = Vec::new();
        for mesh in &scene.meshes {
            let count = mesh.positions.len();
            mesh_places.push(MeshRange { first_index: indices.len() as u32, first_vertex: positions.len() as u32 });
            indices.extend(&mesh.indices);
            positions.extend(&mesh.positions);
            normals.extend(&mesh.normals);
            // Attributes are indexed alike in all meshes; one that no mesh has takes no bytes.
            if has_tangents {
                tangents.extend(padded(&mesh.tangents, count));
            }
            if has_uvs {
                let first = padded(&mesh.uv[0], count);
                let second = padded(&mesh.uv[1], count);
                uvs.extend(first.zip(second).map(|([u0, v0], [u1, v1])| [u0, v0, u1, v1]));
            }
            if has_colors {
                colors.extend(padded(&mesh.colors, count));
            }
        }
        if indices.len() > u32::MAX as usize || positions.len() > u32::MAX as usize {
            return Err(RenderError::TooLarge {
                what: "the scene's meshes together",
                limit: "2^32 vertices or indices",
            });
        }
        let draw = |(index, instance): (usize, &Instance)| Draw {
            vertices: scene.meshes[instance.mesh].indices.len() as u32,
            instance: index as u32,
        };
        let draws: Vec<Draw> = scene.instances.iter().enumerate().map(draw).collect();
        let instances = instance_records(scene, &mesh_places, center);
        let mesh_bounds: Vec<Option<Bounds>> = scene.meshes.iter().map(Mesh::bounds).collect();
        let light_records: Vec<types::Light> = lights.iter().map(|light| light_record(light, center)).collect();
        let records: Vec<types::TextureRecord> = atlas.records.iter().map(texture_record).collect();
        let base_materials: Vec<types::Material> = scene.materials.iter().map(material_record).collect();

        let materials_bytes = (base_materials.len().max(1) * size_of::<types::Material>()) as u64;
        Ok(Self {
            center,
            scene_unit: scene_unit(scene, &mesh_bounds, center),
            draws: draws.into(),
            instances: Filled::new("instances", &instances),
            indices: Filled::new("indices", &indices),
            positions: Filled::new("positions", &positions),
            normals: Filled::new("normals", &normals),
            tangents: Filled::new("tangents", &tangents),
            uvs: Filled::new("uvs", &uvs),
            colors: Filled::new("colors", &colors),
            materials: Buffer::new("materials", materials_bytes, Lifetime::Scene),
            textures: Filled::new("textures", &records),
            atlas_srgb: atlas_image("atlas_srgb", Format::Rgba8Srgb, &atlas.srgb),
            atlas_linear: atlas_image("atlas_linear", Format::Rgba8, &atlas.linear),
            lights: Filled::new("lights", &light_records),
            light_count: light_records.len() as u32,
            light_records,
            uploaded_lights: None,
            mesh_places,
            mesh_bounds,
            moved: Moved::default(),
            base_materials,
            uploaded_materials: None,
        })
    }

    /// From the space of an instance's mesh to scene space.
    pub fn scene_from_local(&self, instance: &Instance) -> DAffine3 {
        DAffine3::from_translation(-self.center) * instance.world_from_local
    }

    /// The corners of the box of a mesh, in its own space; none without triangles.
    pub fn box_corners(&self, mesh: usize) -> impl Iterator<Item = [f32; 3]> {
        corners(self.mesh_bounds[mesh], DAffine3::IDENTITY).map(|corner| corner.as_vec3().to_array())
    }

    /// Takes other lights; the next update uploads them if they differ from those that are there.
    pub fn set_lights(&mut self, lights: &[Light]) {
        self.light_records = lights.iter().map(|light| light_record(light, self.center)).collect();
        self.light_count = self.light_records.len() as u32;
    }

    /// Takes another material; its textures are the scene's.
    pub fn set_material(&mut self, index: usize, material: &Material) {
        self.base_materials[index] = material_record(material);
    }

    /// Whether an instance of a mesh can be there: within the coordinates that rays can be traced through.
    pub fn can_be_at(&self, mesh: usize, world_from_local: DAffine3) -> bool {
        let scene_from_local = DAffine3::from_translation(-self.center) * world_from_local;
        let limit = DVec3::splat(f64::from(LARGEST_COORDINATE));
        // Written so that NaN fails.
        scene_from_local.is_finite()
            && corners(self.mesh_bounds[mesh], scene_from_local).all(|corner| corner.abs().cmple(limit).all())
    }

    /// Declares the uploads that are still to be done, and those that follow from instances that moved.
    pub fn update(&mut self, g: &mut Graph, scene: &Scene) {
        if let Some(why) = self.moved.why() {
            self.scene_unit = scene_unit(scene, &self.mesh_bounds, self.center);
            g.because(if self.instances.is_pending() { FIRST.to_owned() } else { why });
            self.instances.replace(&instance_records(scene, &self.mesh_places, self.center));
            self.instances.upload(g);
            self.moved.clear();
        }
        g.because(FIRST);
        self.instances.upload(g);
        self.upload_triangles(g);
        let buffers = [&mut self.normals, &mut self.tangents, &mut self.uvs, &mut self.colors, &mut self.textures];
        for filled in buffers {
            filled.upload(g);
        }
        self.atlas_srgb.upload(g);
        self.atlas_linear.upload(g);
        self.upload_lights(g);
    }

    fn upload_lights(&mut self, g: &mut Graph) {
        if self.uploaded_lights.as_ref() != Some(&self.light_records) {
            g.because(if self.uploaded_lights.is_some() { "the lights changed" } else { FIRST });
            self.lights = Filled::new("lights", &self.light_records);
            self.lights.upload(g);
            self.uploaded_lights = Some(self.light_records.clone());
        }
    }

    /// Declares the uploads of what triangles are made of, if they are still to be done.
    pub fn upload_triangles(&mut self, g: &mut Graph) {
        self.indices.upload(g);
        self.positions.upload(g);
    }

    /// Declares the upload of the materials with the glints' part as it is now, if that differs from the last one.
    /// Each comes with the number of its layer of glints.
    pub fn upload_materials(&mut self, g: &mut Graph, glints: &[(GlintMaterial, u32)]) {
        let mut materials = self.base_materials.clone();
        for (list, (glint, layer)) in (1..).zip(glints) {
            let material = &mut materials[glint.index];
            material.glint_list = list;
            material.flags |= layer << c::MATERIAL_LAYER_SHIFT;
            let [r, g, b] = glint.values.color("color");
            material.glint_color = [r, g, b, glint.values.number("uv_scale") as f32];
            material.glint_uv_set = glint.uv_set;
            material.flags |= c::MATERIAL_GLINTS;
            if glint.method.repeats {
                material.flags |= c::MATERIAL_GLINT_REPEATS;
            }
        }
        if materials.is_empty() {
            materials.push(types::Material::default());
        }
        let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&materials));
        if self.uploaded_materials.as_ref() != Some(&bytes) {
            g.because(if self.uploaded_materials.is_some() { "a material changed" } else { FIRST });
            g.upload(&mut self.materials, bytes.clone());
            self.uploaded_materials = Some(bytes);
        }
    }
}

/// Each instance as shaders read it.
fn instance_records(scene: &Scene, mesh_places: &[MeshRange], center: DVec3) -> Vec<types::Instance> {
    let flag = |set: bool, flag: u32| if set { flag } else { 0 };
    let record = |instance: &Instance| {
        let mesh = &scene.meshes[instance.mesh];
        let MeshRange { first_index, first_vertex } = mesh_places[instance.mesh];
        types::Instance {
            scene_from_local: rows(&(DAffine3::from_translation(-center) * instance.world_from_local)),
            material: mesh.material as u32,
            first_index,
            first_vertex,
            flags: flag(instance.mirrors(), c::INSTANCE_MIRRORED)
                | flag(!mesh.tangents.is_empty(), c::INSTANCE_HAS_TANGENTS)
                | flag(mesh.has_uv, c::INSTANCE_HAS_UV)
                | flag(!mesh.colors.is_empty(), c::INSTANCE_HAS_COLORS),
        }
    };
    scene.instances.iter().map(record).collect()
}

/// The corners of a box after a map; none of no box.
fn corners(bounds: Option<Bounds>, map: DAffine3) -> impl Iterator<Item = DVec3> {
    bounds.into_iter().flat_map(move |Bounds { min, max }| {
        (0..8).map(move |k| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
            map.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        })
    })
}

/// The least power of two that no coordinate of the scene exceeds, about its centre; 1 for a scene of points or nothing.
fn scene_unit(scene: &Scene, mesh_bounds: &[Option<Bounds>], center: DVec3) -> f32 {
    let of_instance = |instance: &Instance| corners(mesh_bounds[instance.mesh], instance.world_from_local);
    let reach = scene
        .instances
        .iter()
        .flat_map(of_instance)
        .fold(0.0f64, |reach, corner| reach.max((corner - center).abs().max_element()));
    if reach > 0.0 { reach.log2().ceil().clamp(-100.0, 100.0).exp2() as f32 } else { 1.0 }
}

/// The elements, and zeros up to `count`.
fn padded<const N: usize>(elements: &[[f32; N]], count: usize) -> impl Iterator<Item = [f32; N]> + '_ {
    elements.iter().copied().chain(std::iter::repeat([0.0; N])).take(count)
}

/// The three rows of an affine map.
pub(crate) fn rows(map: &DAffine3) -> [[f32; 4]; 3] {
    let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation];
    std::array::from_fn(|row| columns.map(|column| column[row] as f32))
}

fn light_record(light: &Light, center: DVec3) -> types::Light {
    let local = |position: DVec3| (position - center).as_vec3().to_array();
    match *light {
        Light::Point { position, radiant_intensity, range } => types::Light {
            position: local(position),
            kind: c::LIGHT_POINT,
            color: radiant_intensity,
            range: range.unwrap_or(0.0),
            ..Default::default()
        },
        Light::Directional { direction, irradiance } => types::Light {
            kind: c::LIGHT_DIRECTIONAL,
            color: irradiance,
            direction: direction.as_vec3().to_array(),
            ..Default::default()
        },
        Light::Spot { position, direction, radiant_intensity, range, inner_cone_radians, outer_cone_radians } => {
            types::Light {
                position: local(position),
                kind: c::LIGHT_SPOT,
                color: radiant_intensity,
                range: range.unwrap_or(0.0),
                direction: direction.as_vec3().to_array(),
                cos_inner: inner_cone_radians.cos(),
                cos_outer: outer_cone_radians.cos(),
                ..Default::default()
            }
        }
    }
}

fn material_record(material: &Material) -> types::Material {
    let flag = |set: bool, flag: u32| if set { flag } else { 0 };
    // Reflectance at normal incidence by the index of refraction; 0 stands for total reflection (KHR_materials_ior).
    let ior = material.ior;
    let f0 = if ior == 0.0 { 1.0 } else { ((ior - 1.0) / (ior + 1.0)).powi(2) };
    let [r, g, b] = material.specular.color.map(|tint| f0 * tint);
    let coat = material.clearcoat;
    let mut textures = [types::TextureUse::default(); c::TEXTURE_SLOTS as usize];
    let mut texture_count = 0;
    let mut put = |slot: u32, texture: Option<TextureRef>| {
        if let Some(texture) = texture {
            textures[texture_count] = types::TextureUse {
                row_u: texture.transform[0],
                texture: texture.texture as u32,
                row_v: texture.transform[1],
                slot_and_set: slot << 1 | texture.uv_set,
            };
            texture_count += 1;
        }
    };
    put(c::TEXTURE_BASE_COLOR, material.base_color_texture);
    put(c::TEXTURE_METALLIC_ROUGHNESS, material.metallic_roughness_texture);
    put(c::TEXTURE_NORMAL, material.normal_texture);
    put(c::TEXTURE_OCCLUSION, material.occlusion_texture);
    put(c::TEXTURE_EMISSIVE, material.emissive_texture);
    put(c::TEXTURE_CLEARCOAT, coat.and_then(|coat| coat.texture));
    put(c::TEXTURE_CLEARCOAT_ROUGHNESS, coat.and_then(|coat| coat.roughness_texture));
    put(c::TEXTURE_SPECULAR, material.specular.texture);
    put(c::TEXTURE_SPECULAR_COLOR, material.specular.color_texture);
    let [er, eg, eb] = material.emissive;
    let cutoff = match material.alpha {
        AlphaMode::Mask { cutoff } => cutoff,
        // What would be blended is kept where it is more there than not.
        AlphaMode::Blend => 0.5,
        AlphaMode::Opaque => 0.0,
    };
    types::Material {
        base_color: material.base_color,
        emissive: [er, eg, eb, material.normal_scale],
        surface: [material.metallic, material.roughness, material.occlusion_strength, cutoff],
        dielectric: [r, g, b, material.specular.factor],
        coat: [coat.map_or(0.0, |coat| coat.factor), coat.map_or(0.0, |coat| coat.roughness), 0.0, 0.0],
        flags: flag(material.double_sided, c::MATERIAL_DOUBLE_SIDED)
            | flag(material.alpha != AlphaMode::Opaque, c::MATERIAL_ALPHA_MASK)
            | flag(material.unlit, c::MATERIAL_UNLIT)
            | flag(material.normal_texture.is_some(), c::MATERIAL_NORMAL_MAP),
        texture_count: texture_count as u32,
        textures,
        ..Default::default()
    }
}

fn texture_record(record: &AtlasRecord) -> types::TextureRecord {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    };
    let flag = |set: bool, flag: u32| if set { flag } else { 0 };
    types::TextureRecord {
        layer: record.layer,
        x: record.x,
        y: record.y,
        width: record.width,
        height: record.height,
        mips: record.mips,
        wrap: wrap(record.wrap[0]) | wrap(record.wrap[1]) << 2,
        flags: flag(record.srgb, c::TEXTURE_SRGB) | flag(record.nearest, c::TEXTURE_NEAREST),
    }
}

fn atlas_image(name: &str, format: Format, atlas: &AtlasImage) -> FilledImage {
    let desc = ImageDesc { layers: atlas.layers, ..ImageDesc::new(format, Extent::new(atlas.side, atlas.side)) };
    FilledImage::new(name, desc, Arc::from(atlas.bytes.as_slice()))
}
