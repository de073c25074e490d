//! A scene made into frames.

use crate::census::{Census, Counted, LightCensus};
use crate::environment_tables::EnvironmentTables;
use crate::frame::{unrendered, with_layers};
use crate::kept::Kept;
use crate::methods::{self, Method};
use crate::occluders::Occluders;
use crate::scene::{Atlas, AtlasLimits, EquirectMap, Light, Material, Scene};
use crate::scene_buffers::SceneBuffers;
use crate::settings::{SettingError, Value};
use crate::{
    AUTO_METHOD, Cache, DEFAULT_METHOD, GlintMaterial, MethodInfo, OcclusionBackend, Question, RenderError, passes,
};
use glam::{DAffine3, DVec3};
use mica_gpu::{DeviceInfo, Executor};
use mica_graph::{Buffer, Effects, Extent, Format, Graph, Image, ImageDesc, Lifetime, Pass, ResourceId};
use mica_shaders::constants as c;
use std::collections::BTreeMap;

/// Light from everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Its radiance.
    pub map: EquirectMap,
    /// How far it is turned about +Y, counter-clockwise seen from above, in radians.
    pub rotation_radians: f64,
}

/// Hears how far long work has come: what it is, steps done, steps in all.
pub type Progress<'a> = &'a mut dyn FnMut(&str, u64, u64);

/// Work that brought a table up to date.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Update {
    /// The pass.
    pub pass: String,
    /// What changed.
    pub why: String,
    /// How long it took, in nanoseconds.
    pub ns: u64,
}

/// A scene on a device.
pub struct Renderer {
    scene: Scene,
    counted: Counted,
    pub(crate) buffers: SceneBuffers,
    pub(crate) environment: EnvironmentTables,
    pub(crate) rotation_radians: f64,
    pub(crate) occlusion: OcclusionBackend,
    /// Present once something asks, and until nothing does, unless occlusion is off.
    pub(crate) occluders: Option<Occluders>,
    /// Whether the caller traced rays of its own: what blocks them is kept from then on.
    pub(crate) traces: bool,
    /// Graphs that the scene was brought up to date in.
    graphs: u64,
    /// Something in the last of them, and in no other.
    pub(crate) newest: Option<ResourceId>,
    materials: Vec<GlintMaterial>,
    pub(crate) methods: BTreeMap<&'static str, Box<dyn Method>>,
    /// Tables that are kept between runs.
    pub(crate) kept: Kept,
    /// Effects that are simulated whatever the census says.
    pub(crate) forced: Effects,
    /// Stands for the shadow mask where there is none: shaders bind it but do not read it.
    pub(crate) no_shadows: Image,
    /// The mean over the frames of one view, and how many there are in it.
    pub(crate) mean: Option<Image>,
}

impl Renderer {
    /// Prepares a scene: nothing touches the device until a frame that was declared is executed.
    ///
    /// `lights` are added to the scene's own.
    pub fn new(
        scene: Scene,
        lights: &[Light],
        environment: Option<&Environment>,
        occlusion: OcclusionBackend,
    ) -> Result<Self, RenderError> {
        let all_lights: Vec<Light> = scene.lights.iter().chain(lights).copied().collect();
        check_lights(&all_lights)?;
        for (what, why) in unrendered(&scene) {
            log::warn!("{what}: {why}");
        }
        let atlas = Atlas::pack(&scene.textures, AtlasLimits::default());
        let buffers = SceneBuffers::new(&scene, &all_lights, &atlas)?;
        let environment_tables = EnvironmentTables::new(environment.map(|environment| &environment.map));
        let materials: Vec<GlintMaterial> =
            (0..).zip(&scene.materials).filter_map(|(index, material)| glint_material(index, material)).collect();
        let of_environment = environment_tables.census().cloned();
        let counted = Counted::new(&scene, &materials, LightCensus::of(&all_lights), of_environment);
        let one = ImageDesc::new(Format::R32Uint, Extent::new(1, 1));
        let mut renderer = Self {
            scene,
            counted,
            buffers,
            environment: environment_tables,
            rotation_radians: environment.map_or(0.0, |environment| environment.rotation_radians),
            occlusion,
            occluders: None,
            traces: false,
            graphs: 0,
            newest: None,
            materials,
            methods: BTreeMap::new(),
            kept: Kept::default(),
            forced: Effects::NONE,
            no_shadows: Image::new("no_shadows", one, Lifetime::Scene),
            mean: None,
        };
        renderer.note_materials();
        Ok(renderer)
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The glinting materials, with their settings.
    pub fn materials(&self) -> &[GlintMaterial] {
        &self.materials
    }

    /// What there is to simulate: frames follow from it.
    pub fn census(&self) -> &Census {
        self.counted.census()
    }

    /// Simulates these effects (`mica_shaders::effects`) whatever the census says: the picture stays what it is, and shows what it
    /// costs. Shadows of nothing are not asked for where occlusion is off.
    pub fn simulate(&mut self, whatever: Effects) {
        self.forced = whatever;
    }

    /// Who answers questions about occlusion.
    pub fn occlusion(&self) -> OcclusionBackend {
        self.occlusion
    }

    /// Where scene space has its origin: it is world space about this point, which stays where it is when instances move.
    pub fn scene_center(&self) -> DVec3 {
        self.buffers.center
    }

    /// Moves an instance. The next frame updates what depends on it, and nothing else: a few bytes and the levels above the
    /// instances. Where f32 would lose an instance in its own space (one flattened, or badly skewed), its triangles are stored
    /// in scene space: to move it builds those anew, and with [`OcclusionBackend::Bvh`] uploads all of the hierarchy. Where the
    /// move itself changes how instances are stored, that body also builds over every mesh again, unless it did so before.
    ///
    /// # Errors
    /// [`RenderError::NoSuchInstance`] and [`RenderError::BadPlacement`]; nothing is changed then.
    pub fn place_instance(&mut self, index: usize, world_from_local: DAffine3) -> Result<(), RenderError> {
        let count = self.scene.instances.len();
        let Some(instance) = self.scene.instances.get_mut(index) else {
            return Err(RenderError::NoSuchInstance { index, count });
        };
        if !self.buffers.can_be_at(instance.mesh, world_from_local) {
            return Err(RenderError::BadPlacement { index });
        }
        let before = std::mem::replace(&mut instance.world_from_local, world_from_local);
        if before != world_from_local {
            self.counted.note_moved(index, before, world_from_local);
            self.buffers.moved.note(index, before, world_from_local);
            if let Some(occluders) = &mut self.occluders {
                occluders.moved.note(index, before, world_from_local);
            }
        }
        Ok(())
    }

    /// Replaces all lights, the scene's own too.
    ///
    /// # Errors
    /// [`RenderError::TooManyLights`]; nothing is changed then.
    pub fn set_lights(&mut self, lights: &[Light]) -> Result<(), RenderError> {
        check_lights(lights)?;
        self.buffers.set_lights(lights);
        self.counted.note_lights(LightCensus::of(lights));
        self.note_materials();
        Ok(())
    }

    /// Replaces the environment, or takes it away. The tables made from it are made anew; to turn it, use
    /// [`Renderer::turn_environment`].
    pub fn set_environment(&mut self, environment: Option<&Environment>) {
        self.environment.replace(environment.map(|environment| &environment.map));
        self.rotation_radians = environment.map_or(0.0, |environment| environment.rotation_radians);
        self.counted.note_environment(self.environment.census().cloned());
        self.note_materials();
    }

    /// Turns the environment about +Y, counter-clockwise seen from above, in radians. No table depends on it.
    pub fn turn_environment(&mut self, rotation_radians: f64) {
        self.rotation_radians = rotation_radians;
    }

    /// Replaces a material of the scene, its glints with their settings and their method too. Its textures are the scene's.
    ///
    /// # Errors
    /// [`RenderError::NoSuchMaterial`] and [`RenderError::NoSuchTexture`]; nothing is changed then.
    pub fn set_material(&mut self, index: usize, material: Material) -> Result<(), RenderError> {
        let count = self.scene.materials.len();
        let Some(before) = self.scene.materials.get_mut(index) else {
            return Err(RenderError::NoSuchMaterial { index, count });
        };
        let textures = self.scene.textures.len();
        if let Some(texture) = material.textures().map(|used| used.texture).find(|texture| *texture >= textures) {
            return Err(RenderError::NoSuchTexture { index: texture, count: textures });
        }
        self.buffers.set_material(index, &material);
        self.materials.retain(|glinting| glinting.index != index);
        self.materials.extend(glint_material(index, &material));
        self.materials.sort_by_key(|glinting| glinting.index);
        *before = material;
        self.note_materials();
        Ok(())
    }

    /// Brings the census up to date after an edit that the choice of methods may depend on.
    fn note_materials(&mut self) {
        let census = self.counted.census();
        let (lights, environment) = (census.lights, census.environment.as_ref());
        for material in self.materials.iter_mut().filter(|material| material.chosen.is_some()) {
            let (method, why) = methods::choose(material, lights, environment);
            use_method(material, method);
            material.chosen = Some(why);
        }
        self.counted.note_materials(&self.scene, &self.materials);
    }

    /// Changes the method of one glinting material, by name, or of all of them. What was set is kept as far as the new
    /// method has it and accepts the value; the rest is at the new method's defaults. [`AUTO_METHOD`] leaves the choice to the
    /// renderer, which makes it by the census, and makes it again whenever that changes.
    pub fn set_method(&mut self, material: Option<&str>, method: &str) -> Result<(), SettingError> {
        let asked = if method == AUTO_METHOD { None } else { Some(methods::method(method)?) };
        for material in self.chosen(material)? {
            material.chosen = asked.is_none().then(String::new);
            if let Some(method) = asked {
                use_method(material, method);
            }
        }
        self.note_materials();
        Ok(())
    }

    /// Changes a setting of one glinting material, by name, or of all of them. The next frame updates what depends on it.
    ///
    /// Without a name, a key that only some of the materials' methods have is set for those.
    pub fn set(&mut self, material: Option<&str>, key: &str, value: &str) -> Result<(), SettingError> {
        if material.is_none() && self.materials.is_empty() {
            // Nothing to set, but a mistake is one all the same.
            return methods::method(DEFAULT_METHOD)?.values().parse(DEFAULT_METHOD, key, value);
        }
        // Nothing is changed if anything is wrong.
        let mut known = Vec::new();
        let mut unknown = None;
        for material in self.chosen(material)? {
            let mut values = material.values.clone();
            match values.parse(material.method.name, key, value) {
                Ok(()) => known.push((material, values)),
                Err(error @ SettingError::Unknown { .. }) => unknown = Some(error),
                Err(error) => return Err(error),
            }
        }
        match unknown {
            Some(error) if known.is_empty() => Err(error),
            _ => {
                known.into_iter().for_each(|(material, values)| material.values = values);
                self.note_materials();
                Ok(())
            }
        }
    }

    fn chosen(&mut self, name: Option<&str>) -> Result<Vec<&mut GlintMaterial>, SettingError> {
        let known: Vec<String> = self.materials.iter().map(|material| material.name.clone()).collect();
        let chosen: Vec<_> =
            self.materials.iter_mut().filter(|material| name.is_none_or(|name| material.name == name)).collect();
        match name {
            Some(name) if chosen.is_empty() => {
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                Err(SettingError::NoMaterial { name: name.to_owned(), known })
            }
            _ => Ok(chosen),
        }
    }

    /// Makes what takes too long for a frame, or is worth keeping between runs, on a device of our own: tables of methods,
    /// and what blocks rays, if lights or methods ask for it. A host that only records frames does without: frames declare
    /// what they need themselves.
    pub fn precompute(
        &mut self,
        executor: &mut Executor,
        cache: Option<&Cache>,
        progress: Progress,
    ) -> Result<Vec<Update>, RenderError> {
        let mut updates = Vec::new();
        let mut occlusion_asked = self.buffers.light_count > 0;
        for material in &self.glinting() {
            let method = self.methods.entry(material.method.name).or_insert_with(|| methods::start(material.method));
            updates.extend(method.precompute(material, executor, cache, &mut *progress)?);
            occlusion_asked |= method.finish(material).mirror_occlusion;
        }
        if occlusion_asked && self.occluders.is_none() {
            let (scene, buffers) = (&self.scene, &mut self.buffers);
            let (occluders, built) = Occluders::precomputed(self.occlusion, scene, buffers, executor, progress)?;
            self.occluders = occluders;
            updates.extend(built);
        }
        Ok(updates)
    }

    /// From now on, frames on this device take tables that are dear to make from a cache where it has them, and bring the others
    /// back to be stored there ([`Frame::made`](crate::Frame::made)); with `None`, which is how a renderer starts, they make all they
    /// need. Bytes are the same either way.
    pub fn keep_tables(&mut self, cache: Option<(Cache, &DeviceInfo)>) {
        self.kept = cache.map(|(cache, device)| Kept::new(cache, device)).unwrap_or_default();
    }

    /// Declares rays of the caller's own: each of the first `count` in `rays`, [`Ray`](crate::Ray)s in scene space, gets a
    /// [`RayAnswer`](crate::RayAnswer) in `answers`. Returns the [`RayCounts`](crate::RayCounts). There may be as many as the
    /// device lets a shader bind (`max_storage_buffer_range_bytes` in [`mica_gpu::Limits`]): a run refuses more. What the occluders need is brought up to date
    /// first, and everything else is as for [`Renderer::frame`].
    ///
    /// # Errors
    /// [`RenderError::NoOcclusion`] without a backend, [`RenderError::RaysDoNotFit`], and those of [`Renderer::frame`];
    /// nothing is declared then.
    pub fn trace(
        &mut self,
        g: &mut Graph,
        rays: &Buffer,
        count: u32,
        question: Question,
        answers: &mut Buffer,
    ) -> Result<Buffer, RenderError> {
        if self.occlusion == OcclusionBackend::None {
            return Err(RenderError::NoOcclusion);
        }
        passes::trace::check_room(rays, count, answers)?;
        g.specialize(self.effects());
        self.update_scene(g, true)?;
        self.traces = true;
        // What masks are made of.
        let glinting = self.glinting();
        let layered = with_layers(&glinting, &self.layers(&glinting));
        self.buffers.upload_materials(g, &layered);
        let Some(occluders) = &self.occluders else { return Err(RenderError::NoOcclusion) };
        g.because("rays of the caller's own");
        let counted = passes::trace::trace(g, &self.buffers, occluders, (rays, count), question, answers);
        self.newest = Some(counted.counts.resource().id);
        Ok(counted.counts)
    }

    /// Declares what brings the scene up to date on the device, occluders too if something asks for them.
    pub(crate) fn update_scene(&mut self, g: &mut Graph, occlusion_asked: bool) -> Result<(), RenderError> {
        // What can fail comes first: nothing is declared then.
        let occluders = match &mut self.occluders {
            _ if !occlusion_asked => None,
            Some(occluders) => {
                occluders.follow(self.occlusion, &self.scene, &self.buffers)?;
                Some(occluders)
            }
            none => {
                *none = Occluders::new(self.occlusion, &self.scene, &self.buffers)?;
                none.as_mut()
            }
        };
        let newest = self.newest;
        let in_newest = |pass: &Pass| pass.uses.iter().any(|used| Some(used.resource.id) == newest);
        self.graphs += u64::from(!g.passes().iter().any(in_newest));
        self.buffers.update(g, &self.scene);
        if let Some(occluders) = occluders {
            occluders.update(g, &self.scene, &self.buffers, self.graphs);
        }
        Ok(())
    }
}

/// Whether there is anything to glint: at least one flake in a square of texture space.
pub(crate) fn glints(material: &GlintMaterial) -> bool {
    material.flakes() > 0
}

/// Renders a material by a method: what was set is kept as far as the method has it and accepts the value.
fn use_method(material: &mut GlintMaterial, method: &'static MethodInfo) {
    if material.method.name != method.name {
        let mut values = method.values();
        values.adopt(&material.values);
        material.values = values;
        material.method = method;
    }
}

/// A frame has a bit for each light.
fn check_lights(lights: &[Light]) -> Result<(), RenderError> {
    let (count, limit) = (lights.len(), c::MAX_LIGHTS as usize);
    if count > limit { Err(RenderError::TooManyLights { count, limit }) } else { Ok(()) }
}

/// A material as it glints, if it does, with the settings that its file gives it.
fn glint_material(index: usize, material: &Material) -> Option<GlintMaterial> {
    let glint = material.glint.as_ref().filter(|_| cfg!(feature = "glints"))?;
    let asked = glint.method.as_deref().unwrap_or(DEFAULT_METHOD);
    let chosen = (asked == AUTO_METHOD).then(String::new);
    let info = methods::method(if chosen.is_some() { DEFAULT_METHOD } else { asked }).unwrap_or_else(|error| {
        log::warn!("material {}: {error}: {DEFAULT_METHOD} renders it", material.name);
        methods::default_method()
    });
    let mut values = info.values();
    let [r, g, b, _] = material.base_color;
    for (key, value) in [
        ("count", Value::Number(glint.count)),
        ("alpha", Value::Number(glint.alpha)),
        ("gamma_deg", Value::Number(glint.gamma_deg)),
        ("seed", Value::Number(f64::from(glint.seed))),
        ("uv_scale", Value::Number(f64::from(glint.uv_scale))),
        ("color", Value::Color(glint.color.unwrap_or([r, g, b]).map(|part| part.clamp(0.0, 1.0)))),
    ] {
        values.set(key, value);
    }
    Some(GlintMaterial { index, name: material.name.clone(), method: info, chosen, values, uv_set: glint.uv_set })
}
