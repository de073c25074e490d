//! Scenes that call for as little as possible, and what is added to them.

use glam::{DAffine3, DVec3};
use mica_graph::{Effects, Graph, Lifetime, Pass};
use mica_render::scene::{
    AlphaMode, Camera, Clearcoat, Encoding, EquirectMap, Glint, Instance, Light, Material, Mesh, Scene, Texture,
    TextureRef, Wrap,
};
use mica_render::{Environment, Frame, OcclusionBackend, Renderer, View};
use mica_shaders::effects;
use std::collections::BTreeSet;

/// A scene and all that a renderer is made from.
pub struct Variant {
    pub scene: Scene,
    pub lights: Vec<Light>,
    pub environment: Option<Environment>,
    pub occlusion: OcclusionBackend,
    pub glints_seen: bool,
}

/// Two squares side by side, each with a black material of its own: nothing that light could do anything to.
pub fn black() -> Variant {
    let square = |material: usize| Mesh {
        name: format!("square {material}"),
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uv: [vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], Vec::new()],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        has_uv: true,
        ..Mesh::default()
    };
    let material = |name: &str| Material { name: name.to_owned(), ..unlit() };
    let instance = |mesh: usize| Instance {
        mesh,
        world_from_local: DAffine3::from_translation(DVec3::X * mesh as f64),
        name: format!("square {mesh}"),
    };
    let scene = Scene {
        name: "squares".to_owned(),
        meshes: vec![square(0), square(1)],
        instances: vec![instance(0), instance(1)],
        materials: vec![material("left"), material("right")],
        ..Scene::default()
    };
    let (lights, environment) = (Vec::new(), None);
    Variant { scene, lights, environment, occlusion: OcclusionBackend::Bvh, glints_seen: true }
}

/// A material that shows its base colour, black, and nothing else.
pub fn unlit() -> Material {
    Material { base_color: [0.0, 0.0, 0.0, 1.0], unlit: true, ..Material::default() }
}

/// A metal: it mirrors, and scatters nothing.
pub fn metal() -> Material {
    Material { name: "metal".to_owned(), metallic: 1.0, roughness: 0.4, ..Material::default() }
}

/// A surface that scatters, and mirrors nothing.
pub fn chalk() -> Material {
    let mut chalk = Material { name: "chalk".to_owned(), metallic: 0.0, ..Material::default() };
    chalk.specular.factor = 0.0;
    chalk
}

/// A metal that glints by a method.
pub fn glitter(method: &str) -> Material {
    let glint = Glint { count: 1e6, alpha: 0.3, gamma_deg: 2.0, method: Some(method.to_owned()), ..Glint::default() };
    Material { name: format!("glitter by {method}"), glint: Some(glint), ..metal() }
}

pub fn coated(material: Material) -> Material {
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.1,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    Material { clearcoat: Some(coat), ..material }
}

pub fn masked(material: Material) -> Material {
    Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..material }
}

pub fn texture() -> TextureRef {
    TextureRef { texture: 0, uv_set: 0, transform: TextureRef::IDENTITY }
}

pub fn point() -> Light {
    Light::Point { position: DVec3::new(0.0, 0.0, 2.0), radiant_intensity: [1.0; 3], range: None }
}

pub fn sun() -> Light {
    Light::Directional { direction: DVec3::NEG_Z, irradiance: [1.0; 3] }
}

pub fn spot() -> Light {
    Light::Spot {
        position: DVec3::new(0.0, 0.0, 2.0),
        direction: DVec3::NEG_Z,
        radiant_intensity: [1.0; 3],
        range: None,
        inner_cone_radians: 0.2,
        outer_cone_radians: 0.4,
    }
}

/// The same light from everywhere.
pub fn sky() -> Environment {
    Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 }
}

impl Variant {
    pub fn left(mut self, material: Material) -> Self {
        self.scene.materials[0] = material;
        self
    }

    pub fn right(mut self, material: Material) -> Self {
        self.scene.materials[1] = material;
        self
    }

    pub fn light(mut self, light: Light) -> Self {
        self.lights.push(light);
        self
    }

    pub fn under_sky(mut self) -> Self {
        self.environment = Some(sky());
        self
    }

    pub fn without_occlusion(mut self) -> Self {
        self.occlusion = OcclusionBackend::None;
        self
    }

    /// Gives the scene a texture, of one texel.
    pub fn textured(mut self) -> Self {
        self.scene.textures.push(Texture {
            name: "texture".to_owned(),
            width: 1,
            height: 1,
            pixels: vec![128, 128, 255, 255],
            encoding: Encoding::Linear,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
        });
        self
    }

    /// Gives the left square tangents.
    pub fn with_tangents(mut self) -> Self {
        self.scene.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
        self
    }

    pub fn with_colors(mut self) -> Self {
        self.scene.meshes[0].colors = vec![[1.0; 4]; 4];
        self
    }

    /// Takes the left square out of the scene; its material stays.
    pub fn left_hidden(mut self) -> Self {
        self.scene.instances.remove(0);
        self
    }

    pub fn unseen_glints(mut self) -> Self {
        self.glints_seen = false;
        self
    }

    pub fn renderer(&self) -> Renderer {
        let environment = self.environment.as_ref();
        Renderer::new(self.scene.clone(), &self.lights, environment, self.occlusion).expect("a renderer")
    }

    pub fn view(&self) -> View {
        let camera = Camera::looking_at("test", DVec3::new(1.0, 0.5, 3.0), DVec3::new(1.0, 0.5, 0.0), 0.6, 0.01);
        View { glints: self.glints_seen, ..View::new(camera, [32, 32]) }
    }
}

/// What a frame is made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declared {
    /// The effects that it simulates, by name.
    pub effects: BTreeSet<&'static str>,
    /// The passes that draw, in order, with their variants in brackets.
    pub draws: Vec<String>,
    /// The passes that bring tables up to date.
    pub updates: Vec<String>,
    /// Each kept table or part of the scene that passes use, with its bytes.
    pub kept: BTreeSet<(String, u64)>,
}

pub fn names_of(bits: Effects) -> BTreeSet<&'static str> {
    effects::ALL.iter().filter(|(_, bit)| bits.contains(*bit)).map(|(name, _)| *name).collect()
}

/// Declares a frame.
pub fn declare(renderer: &mut Renderer, view: &View) -> Declared {
    let mut graph = Graph::new();
    let frame: Frame = renderer.frame(&mut graph, view, None).expect("a frame");
    let name = |pass: &Pass| match pass.work.shader() {
        Some(shader) if !shader.variant.is_empty() => format!("{} [{}]", pass.name, shader.variant),
        _ => pass.name.clone(),
    };
    let passes = graph.passes();
    let uses = passes.iter().flat_map(|pass| &pass.uses);
    let kept = uses.filter(|used| used.resource.lifetime != Lifetime::Frame);
    Declared {
        effects: names_of(frame.effects),
        draws: passes[frame.updates.end..].iter().map(name).collect(),
        updates: passes[frame.updates.clone()].iter().map(name).collect(),
        kept: kept.map(|used| (used.resource.name.clone(), used.resource.bytes())).collect(),
    }
}
