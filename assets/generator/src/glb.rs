//! A glTF 2.0 document and its binary form: JSON in order of declaration, then one chunk of vertices and indices.

use glam::DVec3;
use serde::Serialize;

use crate::maths;
use crate::surface::Mesh;

/// How a material sparkles: the flat keys that the renderer reads from a material's `extras`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Glint {
    /// Flakes per UV square.
    #[serde(rename = "glint_count")]
    pub count: f64,
    /// Beckmann roughness of the flakes' normals.
    #[serde(rename = "glint_alpha")]
    pub alpha: f32,
    /// Half-angle of a flake's reflection cone, degrees.
    #[serde(rename = "glint_gamma_deg")]
    pub gamma_deg: f32,
    /// Which of the many flake sets.
    #[serde(rename = "glint_seed")]
    pub seed: u32,
    /// Reflectance of a flake at normal incidence, linear RGB.
    #[serde(rename = "glint_color")]
    pub color: [f32; 3],
}

/// A clear lacquer over everything else (KHR_materials_clearcoat).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Clearcoat {
    /// How much of the surface it covers, 0 to 1.
    #[serde(rename = "clearcoatFactor")]
    pub factor: f32,
    /// Its own perceptual roughness.
    #[serde(rename = "clearcoatRoughnessFactor")]
    pub roughness: f32,
}

/// A metallic-roughness material.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// What it is.
    pub name: &'static str,
    /// Linear RGB: the diffuse albedo of a dielectric, the reflectance of a metal.
    pub color: [f32; 3],
    /// 0 for a dielectric, 1 for a metal.
    pub metallic: f32,
    /// Perceptual roughness, the square root of alpha.
    pub roughness: f32,
    /// Radiance that it gives off.
    pub emissive: [f32; 3],
    /// Whether its back is seen too.
    pub double_sided: bool,
    /// Flakes, if any.
    pub glint: Option<Glint>,
    /// Lacquer, if any.
    pub clearcoat: Option<Clearcoat>,
}

impl Material {
    /// A matte or glossy dielectric.
    pub fn dielectric(name: &'static str, color: [f32; 3], roughness: f32) -> Self {
        let metallic = 0.0;
        Self { name, color, metallic, roughness, emissive: [0.0; 3], double_sided: false, glint: None, clearcoat: None }
    }

    /// A smooth or brushed metal.
    pub fn metal(name: &'static str, color: [f32; 3], roughness: f32) -> Self {
        Self { metallic: 1.0, ..Self::dielectric(name, color, roughness) }
    }

    /// The same material with flakes; its roughness becomes theirs, so that viewers without flakes show the same lobe.
    pub fn with_glint(self, glint: Glint) -> Self {
        Self { glint: Some(glint), roughness: glint.alpha.sqrt(), ..self }
    }

    /// The same material seen from both sides.
    pub fn double_sided(self) -> Self {
        Self { double_sided: true, ..self }
    }
}

/// Where a mesh stands: scaled, then rotated, then moved.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// World position of the mesh's origin, metres.
    pub translation: DVec3,
    /// Unit quaternion, x y z w.
    pub rotation: [f64; 4],
    /// Per axis; negative mirrors.
    pub scale: DVec3,
}

impl Placement {
    /// Left where it was modelled.
    pub const IDENTITY: Self = Self { translation: DVec3::ZERO, rotation: [0.0, 0.0, 0.0, 1.0], scale: DVec3::ONE };

    /// Moved only.
    pub fn at(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// Turned about a unit axis after what it is turned by already.
    pub fn turned(self, axis: DVec3, degrees: f64) -> Self {
        let half_radians = degrees.to_radians() / 2.0;
        let (a, c) = (axis * maths::sin(half_radians), maths::cos(half_radians));
        let [x, y, z, w] = self.rotation;
        let (b, d) = (DVec3::new(x, y, z), w);
        let v = a * d + b * c + a.cross(b);
        Self { rotation: [v.x, v.y, v.z, c * d - a.dot(b)], ..self }
    }

    /// Mirrored or stretched.
    pub fn scaled(self, scale: DVec3) -> Self {
        Self { scale, ..self }
    }
}

/// A document under construction. Indices handed out are glTF indices.
pub struct Document {
    name: &'static str,
    environment: &'static str,
    materials: Vec<MaterialJson>,
    meshes: Vec<MeshJson>,
    nodes: Vec<NodeJson>,
    cameras: Vec<CameraJson>,
    lights: Vec<LightJson>,
    accessors: Vec<AccessorJson>,
    views: Vec<ViewJson>,
    bytes: Vec<u8>,
}

impl Document {
    /// An empty scene lit by the procedural environment of that name.
    pub fn new(name: &'static str, environment: &'static str) -> Self {
        Self {
            name,
            environment,
            materials: Vec::new(),
            meshes: Vec::new(),
            nodes: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            accessors: Vec::new(),
            views: Vec::new(),
            bytes: Vec::new(),
        }
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, material: Material) -> usize {
        let [r, g, b] = material.color;
        self.materials.push(MaterialJson {
            name: material.name,
            pbr: PbrJson { color: [r, g, b, 1.0], metallic: material.metallic, roughness: material.roughness },
            emissive: (material.emissive != [0.0; 3]).then_some(material.emissive.map(|e| e.min(1.0))),
            double_sided: material.double_sided,
            extensions: material.clearcoat.map(|clearcoat| MaterialExtensionsJson { clearcoat }),
            extras: material.glint,
        });
        self.materials.len() - 1
    }

    /// Adds a mesh of one primitive per part and returns its index. Every part has positions, normals and one UV set.
    pub fn mesh(&mut self, name: &'static str, parts: &[(&Mesh, usize)]) -> usize {
        let primitives = parts
            .iter()
            .map(|(mesh, material)| {
                let vertices = mesh.positions.len();
                let position = self.vectors(mesh.positions.iter().map(|p| p.to_array().map(|c| c as f32)), true);
                let normal = self.vectors(mesh.normals.iter().map(|n| n.to_array().map(|c| c as f32)), false);
                let uv = self.vectors(mesh.uvs.iter().map(|t| t.to_array().map(|c| c as f32)), false);
                let indices = self.indices(&mesh.indices, vertices);
                PrimitiveJson { attributes: AttributesJson { position, normal, uv }, indices, material: *material }
            })
            .collect();
        self.meshes.push(MeshJson { name, primitives });
        self.meshes.len() - 1
    }

    /// Stands a mesh in the scene.
    pub fn place(&mut self, name: &'static str, mesh: usize, placement: Placement) {
        let mut node = NodeJson::new(name, placement);
        node.mesh = Some(mesh);
        self.nodes.push(node);
    }

    /// Adds a mesh and stands it where it was modelled.
    pub fn add(&mut self, name: &'static str, parts: &[(&Mesh, usize)]) {
        let mesh = self.mesh(name, parts);
        self.place(name, mesh, Placement::IDENTITY);
    }

    /// The scene's camera: 16:9, looking from `eye` at `target`, world up.
    pub fn camera(&mut self, eye: DVec3, target: DVec3, vertical_degrees: f64) {
        self.cameras.push(CameraJson {
            kind: "perspective",
            perspective: PerspectiveJson {
                aspect_ratio: (16.0 / 9.0) as f32,
                yfov: vertical_degrees.to_radians() as f32,
                znear: 0.01,
            },
        });
        let mut node = NodeJson::new("camera", looking(eye, target - eye));
        node.camera = Some(self.cameras.len() - 1);
        self.nodes.push(node);
    }

    /// A distant light; `irradiance` is what it gives a surface that faces it, linear RGB.
    pub fn directional_light(&mut self, name: &'static str, towards_light: DVec3, irradiance: [f32; 3]) {
        self.light(name, "directional", looking(DVec3::ZERO, -towards_light), irradiance);
    }

    /// A small light; `intensity` divided by the distance squared is its irradiance, linear RGB.
    pub fn point_light(&mut self, name: &'static str, position: DVec3, intensity: [f32; 3]) {
        self.light(name, "point", Placement::at(position), intensity);
    }

    fn light(&mut self, name: &'static str, kind: &'static str, placement: Placement, power: [f32; 3]) {
        let intensity = power.into_iter().fold(0.0, f32::max);
        self.lights.push(LightJson { name, kind, color: power.map(|c| c / intensity), intensity });
        let mut node = NodeJson::new(name, placement);
        node.extensions = Some(NodeExtensionsJson { light: LightIndexJson { light: self.lights.len() - 1 } });
        self.nodes.push(node);
    }

    fn vectors<const N: usize>(&mut self, items: impl Iterator<Item = [f32; N]>, bounds: bool) -> usize {
        let offset = self.bytes.len();
        let (mut least, mut greatest, mut count) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N], 0);
        for item in items {
            for (axis, component) in item.into_iter().enumerate() {
                // Adding zero turns a negative zero into a plain one: the sign of nothing is not worth a byte's change.
                let component = component + 0.0;
                least[axis] = least[axis].min(component);
                greatest[axis] = greatest[axis].max(component);
                self.bytes.extend(component.to_le_bytes());
            }
            count += 1;
        }
        let view = self.view(offset, 34962);
        self.accessors.push(AccessorJson {
            view,
            component_type: 5126,
            count,
            kind: if N == 3 { "VEC3" } else { "VEC2" },
            min: bounds.then(|| least.to_vec()),
            max: bounds.then(|| greatest.to_vec()),
        });
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32], vertices: usize) -> usize {
        let offset = self.bytes.len();
        // The greatest value of a type is glTF's primitive restart and no index.
        let short = vertices < usize::from(u16::MAX);
        for &index in indices {
            let bytes = index.to_le_bytes();
            self.bytes.extend(if short { &bytes[..2] } else { &bytes[..] });
        }
        let view = self.view(offset, 34963);
        let component_type = if short { 5123 } else { 5125 };
        let count = indices.len();
        self.accessors.push(AccessorJson { view, component_type, count, kind: "SCALAR", min: None, max: None });
        self.accessors.len() - 1
    }

    fn view(&mut self, offset: usize, target: u32) -> usize {
        self.views.push(ViewJson { buffer: 0, offset, length: self.bytes.len() - offset, target });
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// The document as the bytes of a .glb file.
    pub fn to_glb(&self) -> Vec<u8> {
        let mut used = Vec::new();
        if !self.lights.is_empty() {
            used.push("KHR_lights_punctual");
        }
        if self.materials.iter().any(|m| m.extensions.is_some()) {
            used.push("KHR_materials_clearcoat");
        }
        let root = RootJson {
            asset: AssetJson { version: "2.0", generator: "mica make-scenes" },
            used,
            extensions: (!self.lights.is_empty())
                .then_some(RootExtensionsJson { lights: LightsJson { lights: &self.lights } }),
            scene: 0,
            scenes: [SceneJson {
                name: self.name,
                nodes: (0..self.nodes.len()).collect(),
                extras: SceneExtrasJson { environment: self.environment },
            }],
            nodes: &self.nodes,
            cameras: &self.cameras,
            meshes: &self.meshes,
            materials: &self.materials,
            accessors: &self.accessors,
            views: &self.views,
            buffers: [BufferJson { length: self.bytes.len() }],
        };
        let mut json = serde_json::to_vec(&root).expect("plain structs of numbers and strings always serialise");
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.bytes.len();
        let mut glb = Vec::with_capacity(length);
        glb.extend(b"glTF");
        for word in [2, length as u32, json.len() as u32] {
            glb.extend(word.to_le_bytes());
        }
        glb.extend(b"JSON");
        glb.extend(&json);
        glb.extend((self.bytes.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(&self.bytes);
        glb
    }
}

/// Turns the -Z axis of a node to `forward`, keeping world up up: first pitched about X, then yawed about Y.
fn looking(eye: DVec3, forward: DVec3) -> Placement {
    let level = maths::hypot(forward.x, forward.z);
    let pitch = maths::atan2(forward.y, level).to_degrees();
    let yaw = maths::atan2(-forward.x, -forward.z).to_degrees();
    Placement::at(eye).turned(DVec3::X, pitch).turned(DVec3::Y, yaw)
}

#[derive(Serialize)]
struct RootJson<'a> {
    asset: AssetJson,
    #[serde(rename = "extensionsUsed", skip_serializing_if = "Vec::is_empty")]
    used: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    extensions: Option<RootExtensionsJson<'a>>,
    scene: usize,
    scenes: [SceneJson; 1],
    nodes: &'a [NodeJson],
    cameras: &'a [CameraJson],
    meshes: &'a [MeshJson],
    materials: &'a [MaterialJson],
    accessors: &'a [AccessorJson],
    #[serde(rename = "bufferViews")]
    views: &'a [ViewJson],
    buffers: [BufferJson; 1],
}

#[derive(Serialize)]
struct AssetJson {
    version: &'static str,
    generator: &'static str,
}

#[derive(Serialize)]
struct RootExtensionsJson<'a> {
    #[serde(rename = "KHR_lights_punctual")]
    lights: LightsJson<'a>,
}

#[derive(Serialize)]
struct LightsJson<'a> {
    lights: &'a [LightJson],
}

#[derive(Serialize)]
struct LightJson {
    name: &'static str,
    #[serde(rename = "type")]
    kind: &'static str,
    color: [f32; 3],
    intensity: f32,
}

#[derive(Serialize)]
struct SceneJson {
    name: &'static str,
    nodes: Vec<usize>,
    extras: SceneExtrasJson,
}

#[derive(Serialize)]
struct SceneExtrasJson {
    environment: &'static str,
}

#[derive(Serialize)]
struct NodeJson {
    name: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<usize>,
    translation: [f32; 3],
    rotation: [f32; 4],
    scale: [f32; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    extensions: Option<NodeExtensionsJson>,
}

impl NodeJson {
    fn new(name: &'static str, placement: Placement) -> Self {
        Self {
            name,
            mesh: None,
            camera: None,
            translation: placement.translation.to_array().map(|c| c as f32 + 0.0),
            rotation: placement.rotation.map(|c| c as f32 + 0.0),
            scale: placement.scale.to_array().map(|c| c as f32),
            extensions: None,
        }
    }
}

#[derive(Serialize)]
struct NodeExtensionsJson {
    #[serde(rename = "KHR_lights_punctual")]
    light: LightIndexJson,
}

#[derive(Serialize)]
struct LightIndexJson {
    light: usize,
}

#[derive(Serialize)]
struct CameraJson {
    #[serde(rename = "type")]
    kind: &'static str,
    perspective: PerspectiveJson,
}

#[derive(Serialize)]
struct PerspectiveJson {
    #[serde(rename = "aspectRatio")]
    aspect_ratio: f32,
    yfov: f32,
    znear: f32,
}

#[derive(Serialize)]
struct MeshJson {
    name: &'static str,
    primitives: Vec<PrimitiveJson>,
}

#[derive(Serialize)]
struct PrimitiveJson {
    attributes: AttributesJson,
    indices: usize,
    material: usize,
}

#[derive(Serialize)]
struct AttributesJson {
    #[serde(rename = "POSITION")]
    position: usize,
    #[serde(rename = "NORMAL")]
    normal: usize,
    #[serde(rename = "TEXCOORD_0")]
    uv: usize,
}

#[derive(Serialize)]
struct MaterialJson {
    name: &'static str,
    #[serde(rename = "pbrMetallicRoughness")]
    pbr: PbrJson,
    #[serde(rename = "emissiveFactor", skip_serializing_if = "Option::is_none")]
    emissive: Option<[f32; 3]>,
    #[serde(rename = "doubleSided", skip_serializing_if = "std::ops::Not::not")]
    double_sided: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    extensions: Option<MaterialExtensionsJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    extras: Option<Glint>,
}

#[derive(Serialize)]
struct PbrJson {
    #[serde(rename = "baseColorFactor")]
    color: [f32; 4],
    #[serde(rename = "metallicFactor")]
    metallic: f32,
    #[serde(rename = "roughnessFactor")]
    roughness: f32,
}

#[derive(Serialize)]
struct MaterialExtensionsJson {
    #[serde(rename = "KHR_materials_clearcoat")]
    clearcoat: Clearcoat,
}

#[derive(Serialize)]
struct AccessorJson {
    #[serde(rename = "bufferView")]
    view: usize,
    #[serde(rename = "componentType")]
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<Vec<f32>>,
}

#[derive(Serialize)]
struct ViewJson {
    buffer: usize,
    #[serde(rename = "byteOffset")]
    offset: usize,
    #[serde(rename = "byteLength")]
    length: usize,
    target: u32,
}

#[derive(Serialize)]
struct BufferJson {
    #[serde(rename = "byteLength")]
    length: usize,
}
