//! The scene as the shaders read it: buffers and texture atlases, filled once.

use crate::scene::bvh::{MeshBvh, SceneBvh};
use crate::scene::{AlphaMode, Atlas, AtlasImage, AtlasRecord, Light, Material, Scene, TextureRef, Wrap};
use crate::{GlintMaterial, RenderError};
use glam::{DAffine3, DVec3};
use mica_graph::{Buffer, Draw, Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_shaders::{constants as c, types};
use std::sync::Arc;

/// A buffer that is filled once.
pub(crate) struct Filled {
    /// What passes read.
    pub buffer: Buffer,
    pending: Option<Arc<[u8]>>,
}

impl Filled {
    /// A list as bytes; an empty one is held as 16 zero bytes, as no buffer may be empty.
    fn new<T: bytemuck::NoUninit>(name: &str, list: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(list);
        let bytes: Arc<[u8]> = if bytes.is_empty() { Arc::from([0u8; 16]) } else { Arc::from(bytes) };
        Self { buffer: Buffer::new(name, bytes.len() as u64, Lifetime::Scene), pending: Some(bytes) }
    }

    /// Declares its upload, the first time.
    fn upload(&mut self, g: &mut Graph) {
        if let Some(bytes) = self.pending.take() {
            g.upload(&mut self.buffer, bytes);
        }
    }
}

/// An image that is filled once.
pub(crate) struct FilledImage {
    /// What passes read.
    pub image: Image,
    pending: Option<Arc<[u8]>>,
}

impl FilledImage {
    fn new(name: &str, desc: ImageDesc, bytes: Arc<[u8]>) -> Self {
        Self { image: Image::new(name, desc, Lifetime::Scene), pending: Some(bytes) }
    }

    fn upload(&mut self, g: &mut Graph) {
        if let Some(bytes) = self.pending.take() {
            g.upload_image(&mut self.image, bytes);
        }
    }
}

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
    pub light_count: u32,
    /// Present once something asks for occlusion.
    pub bvh: Option<Bvh>,
    base_materials: Vec<types::Material>,
    uploaded_materials: Option<Arc<[u8]>>,
}

/// The hierarchy that occlusion is asked of.
pub(crate) struct Bvh {
    pub nodes: Filled,
    pub triangles: Filled,
    pub instances: Filled,
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
        let mut places = Vec::new();
        for mesh in &scene.meshes {
            let count = mesh.positions.len();
            places.push((indices.len() as u32, positions.len() as u32));
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
        let mut draws = Vec::new();
        let mut instances = Vec::new();
        for (index, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            let (first_index, first_vertex) = places[instance.mesh];
            let flag = |set: bool, flag: u32| if set { flag } else { 0 };
            let scene_from_local = DAffine3::from_translation(-center) * instance.world_from_local;
            instances.push(types::Instance {
                scene_from_local: rows(&scene_from_local),
                material: mesh.material as u32,
                first_index,
                first_vertex,
                flags: flag(instance.mirrors(), c::INSTANCE_MIRRORED)
                    | flag(!mesh.tangents.is_empty(), c::INSTANCE_HAS_TANGENTS)
                    | flag(mesh.has_uv, c::INSTANCE_HAS_UV)
                    | flag(!mesh.colors.is_empty(), c::INSTANCE_HAS_COLORS),
            });
            draws.push(Draw { vertices: mesh.indices.len() as u32, instance: index as u32 });
        }
        let light_data: Vec<types::Light> = lights.iter().map(|light| light_record(light, center)).collect();
        let records: Vec<types::TextureRecord> = atlas.records.iter().map(texture_record).collect();
        let base_materials: Vec<types::Material> = scene.materials.iter().map(|m| material_record(m, atlas)).collect();

        let materials_bytes = (base_materials.len().max(1) * size_of::<types::Material>()) as u64;
        Ok(Self {
            center,
            scene_unit: scene_unit(scene, center),
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
            lights: Filled::new("lights", &light_data),
            light_count: light_data.len() as u32,
            bvh: None,
            base_materials,
            uploaded_materials: None,
        })
    }

    /// Builds the hierarchy for occlusion, if it is not there yet.
    pub fn build_bvh(&mut self, scene: &Scene) -> Result<(), RenderError> {
        if self.bvh.is_some() {
            return Ok(());
        }
        let meshes = scene
            .meshes
            .iter()
            .map(|mesh| MeshBvh::build(&mesh.positions, &mesh.indices))
            .collect::<Result<Vec<_>, _>>()?;
        let to_scene = DAffine3::from_translation(-self.center);
        let placements: Vec<(usize, DAffine3)> =
            scene.instances.iter().map(|instance| (instance.mesh, to_scene * instance.world_from_local)).collect();
        let bvh = SceneBvh::build(&placements, &meshes)?;
        self.bvh = Some(Bvh {
            nodes: Filled::new("bvh_nodes", &bvh.nodes),
            triangles: Filled::new("bvh_triangles", &bvh.triangles),
            instances: Filled::new("bvh_instances", &bvh.instances),
        });
        Ok(())
    }

    /// Declares the uploads that are still to be done.
    pub fn upload(&mut self, g: &mut Graph) {
        let bvh = self.bvh.iter_mut().flat_map(|bvh| [&mut bvh.nodes, &mut bvh.triangles, &mut bvh.instances]);
        let buffers = [
            &mut self.instances,
            &mut self.indices,
            &mut self.positions,
            &mut self.normals,
            &mut self.tangents,
            &mut self.uvs,
            &mut self.colors,
            &mut self.textures,
            &mut self.lights,
        ];
        for filled in buffers {
            filled.upload(g);
        }
        g.because("the first frame that asks for occlusion");
        for filled in bvh {
            filled.upload(g);
        }
        g.because("first frame of the scene");
        self.atlas_srgb.upload(g);
        self.atlas_linear.upload(g);
    }

    /// Declares the upload of the materials with the glints' part as it is now, if that differs from the last one.
    pub fn upload_materials(&mut self, g: &mut Graph, glints: &[GlintMaterial]) {
        let mut materials = self.base_materials.clone();
        for glint in glints {
            let material = &mut materials[glint.index];
            let [r, g, b] = glint.values.color("color");
            material.glint_color = [r, g, b, glint.values.number("uv_scale") as f32];
            material.glint_uv_set = glint.uv_set;
            material.flags |= c::MATERIAL_GLINTS;
        }
        if materials.is_empty() {
            materials.push(types::Material::default());
        }
        let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&materials));
        if self.uploaded_materials.as_ref() != Some(&bytes) {
            g.because(if self.uploaded_materials.is_some() {
                "a material changed"
            } else {
                "first frame of the scene"
            });
            g.upload(&mut self.materials, bytes.clone());
            self.uploaded_materials = Some(bytes);
        }
    }
}

/// The least power of two that no coordinate of the scene exceeds, about its centre; 1 for a scene of points or nothing.
fn scene_unit(scene: &Scene, center: DVec3) -> f32 {
    let reach = scene.bounds().map_or(0.0, |bounds| (bounds.max - center).max_element());
    if reach > 0.0 { reach.log2().ceil().clamp(-100.0, 100.0).exp2() as f32 } else { 1.0 }
}

/// The elements, and zeros up to `count`.
fn padded<const N: usize>(elements: &[[f32; N]], count: usize) -> impl Iterator<Item = [f32; N]> + '_ {
    elements.iter().copied().chain(std::iter::repeat([0.0; N])).take(count)
}

/// The three rows of an affine map.
fn rows(map: &DAffine3) -> [[f32; 4]; 3] {
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

fn material_record(material: &Material, atlas: &Atlas) -> types::Material {
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
                texture: atlas.index_of(texture.texture),
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
