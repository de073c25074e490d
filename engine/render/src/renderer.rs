//! A scene made into frames.

use crate::environment_tables::EnvironmentTables;
use crate::methods::{self, Finish, Method, Shading};
use crate::occluders::Occluders;
use crate::scene::{AlphaMode, Atlas, AtlasLimits, EquirectMap, Light, Material, Scene};
use crate::scene_buffers::SceneBuffers;
use crate::settings::{SettingError, Value};
use crate::{Cache, DEFAULT_METHOD, GlintMaterial, OcclusionBackend, Question, RaysOfPass, RenderError, View, passes};
use glam::{DAffine3, DVec3};
use mica_gpu::Executor;
use mica_graph::{Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Pass, ResourceId};
use mica_shaders::{constants as c, types};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Light from everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Its radiance.
    pub map: EquirectMap,
    /// How far it is turned about +Y, counter-clockwise seen from above, in radians.
    pub rotation_radians: f64,
}

/// Something that was not simulated, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// The effect or pass.
    pub what: &'static str,
    /// Why this scene or these settings do not call for it.
    pub why: String,
}

/// A frame that was declared.
pub struct Frame {
    /// Linear, scene-referred radiance.
    pub radiance: Image,
    /// Tone-mapped, sRGB-encoded.
    pub display: Image,
    /// What is seen through each pixel: its instance, counted from 1, and its triangle; 0 where nothing is.
    pub ids: Image,
    /// Derivatives of the flakes' texture coordinates over the pixel: du/dx, dv/dx, du/dy, dv/dy.
    pub footprint: Image,
    /// Where each pixel's surface is, in scene space, and the first of two octahedral numbers of its triangle's normal.
    pub position: Image,
    /// Its shading normal, on the viewer's side, and the second of them.
    pub normal: Image,
    /// The flakes' texture coordinates, then the clear coat's weight and roughness.
    pub uv: Image,
    /// Reflectance at normal incidence, and the weight of the smooth lobe.
    pub specular: Image,
    /// The camera and the environment's rotation: [`mica_shaders::types::Frame`].
    pub constants: Buffer,
    /// One bit for each light that does not reach it; none where nothing casts shadows.
    pub shadow_mask: Option<Image>,
    /// How free the mirror direction of each glinting pixel is, as it dims each layer of glints whose method asks for it.
    pub visibility: Vec<Image>,
    /// The passes, by index in the graph, that bring tables up to date rather than draw.
    pub updates: std::ops::Range<usize>,
    /// The passes that trace rays, each with how many; a name may occur more than once.
    pub rays: Vec<RaysOfPass>,
    /// What the frame does without.
    pub left_out: Vec<LeftOut>,
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
    buffers: SceneBuffers,
    environment: EnvironmentTables,
    rotation_radians: f64,
    occlusion: OcclusionBackend,
    /// Present once something asks, unless occlusion is off.
    occluders: Option<Occluders>,
    /// Graphs that the scene was brought up to date in.
    graphs: u64,
    /// Something in the last of them, and in no other.
    newest: Option<ResourceId>,
    materials: Vec<GlintMaterial>,
    methods: BTreeMap<&'static str, Box<dyn Method>>,
    /// Stands for the shadow mask where there are no lights: shaders bind it but do not read it.
    no_lights: Image,
    /// The mean over the frames of one view, and how many there are in it.
    mean: Option<Image>,
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
        if all_lights.len() > c::MAX_LIGHTS as usize {
            return Err(RenderError::TooManyLights { count: all_lights.len(), limit: c::MAX_LIGHTS as usize });
        }
        for (what, why) in unrendered(&scene) {
            log::warn!("{what}: {why}");
        }
        let atlas = Atlas::pack(&scene.textures, AtlasLimits::default());
        let buffers = SceneBuffers::new(&scene, &all_lights, &atlas)?;
        let environment_tables = EnvironmentTables::new(environment.map(|environment| &environment.map));
        let materials = glint_materials(&scene);
        let one = ImageDesc::new(Format::R32Uint, Extent::new(1, 1));
        Ok(Self {
            scene,
            buffers,
            environment: environment_tables,
            rotation_radians: environment.map_or(0.0, |environment| environment.rotation_radians),
            occlusion,
            occluders: None,
            graphs: 0,
            newest: None,
            materials,
            methods: BTreeMap::new(),
            no_lights: Image::new("no_lights", one, Lifetime::Scene),
            mean: None,
        })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The glinting materials, with their settings.
    pub fn materials(&self) -> &[GlintMaterial] {
        &self.materials
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
        if instance.world_from_local != world_from_local {
            instance.world_from_local = world_from_local;
            self.buffers.note_moved(index);
            if let Some(occluders) = &mut self.occluders {
                occluders.note_moved(index);
            }
        }
        Ok(())
    }

    /// Changes the method of one glinting material, by name, or of all of them. What was set is kept as far as the new
    /// method has it and accepts the value; the rest is at the new method's defaults.
    pub fn set_method(&mut self, material: Option<&str>, method: &str) -> Result<(), SettingError> {
        let info = methods::method(method)?;
        for material in self.chosen(material)? {
            let mut values = info.values();
            values.adopt(&material.values);
            material.values = values;
            material.method = info;
        }
        let used: Vec<&str> = self.materials.iter().map(|material| material.method.name).collect();
        // The tables of a method that nothing uses any more are given back.
        self.methods.retain(|name, _| used.contains(name));
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
        for material in self.materials.iter().filter(|material| glints(material)) {
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

    /// Declares a frame: updates of what changed since the last one, then the passes that draw.
    ///
    /// With `earlier`, the frame shows the mean of itself and so many frames before it, each from its own
    /// [`View::sample`]; `Some(0)` starts anew, and so does another size or a frame without.
    ///
    /// The frame has to be executed, and frames in the order in which they were declared: what is uploaded or built in
    /// one is there for the next. After a frame that was lost, make a new renderer.
    pub fn frame(&mut self, g: &mut Graph, view: &View, earlier: Option<u32>) -> Result<Frame, RenderError> {
        let [width, height] = view.size;
        let extent = Extent::new(width, height);
        let mut left_out = Vec::new();
        let glinting: Vec<GlintMaterial> = self.materials.iter().filter(|material| glints(material)).cloned().collect();
        let lit = self.buffers.light_count > 0;

        // Materials that ask for the same after shading share a layer.
        let mut layers: Vec<(Finish, Vec<GlintMaterial>)> = Vec::new();
        for material in &glinting {
            let method = self.methods.entry(material.method.name).or_insert_with(|| methods::start(material.method));
            let finish = method.finish(material);
            match layers.iter_mut().find(|(of, _)| *of == finish) {
                Some((_, materials)) => materials.push(material.clone()),
                None => layers.push((finish, vec![material.clone()])),
            }
        }
        for (name, method) in &mut self.methods {
            let of_method = glinting.iter().filter(|material| material.method.name == *name);
            method.keep(&of_method.cloned().collect::<Vec<_>>());
        }
        if !view.glints {
            layers.clear();
        }
        let mirror_occlusion = layers.iter().any(|(finish, _)| finish.mirror_occlusion);

        let first_update = g.passes().len();
        self.update_scene(g, lit || mirror_occlusion)?;
        g.because("first frame of the environment");
        self.environment.update(g);
        for material in glinting.iter().filter(|_| view.glints) {
            if let Some(method) = self.methods.get_mut(material.method.name) {
                method.update(g, material, &mut self.environment);
            }
        }
        let updates = first_update..g.passes().len();
        // Like the frame's constants: no table is made from them.
        self.buffers.upload_materials(g, &glinting);

        g.because("every frame");
        let frame = self.upload_frame(g, view);
        self.newest = Some(frame.resource().id);
        let ids = passes::visibility::visibility(g, &self.buffers, &frame, extent);
        let gbuffer = passes::surface::surface(g, &self.buffers, &frame, ids);
        let mut rays = Vec::new();
        let shadow_mask = match &self.occluders {
            Some(occluders) if lit => {
                g.because(format!("{} lights cast shadows", self.buffers.light_count));
                let (mask, counted) = passes::shadows::shadows(g, &self.buffers, occluders, &frame, &gbuffer);
                rays.push(counted);
                Some(mask)
            }
            _ => {
                let why = if lit { "occlusion is off" } else { "no point, directional or spot lights" };
                left_out.push(LeftOut { what: "shadows", why: why.to_owned() });
                lit.then(|| {
                    g.because("occlusion is off: every light arrives");
                    let mut open = g.image("shadow_mask", Format::R32Uint, extent);
                    g.clear(&mut open, 0.0);
                    open
                })
            }
        };
        g.because("every frame");
        // Without lights no shader reads it.
        let mask = shadow_mask.as_ref().unwrap_or(&self.no_lights);
        let base = passes::base::base(g, &self.buffers, &self.environment, &frame, &gbuffer, mask);
        let environment = self.environment.map();
        let shading =
            Shading { scene: &self.buffers, frame: &frame, gbuffer: &gbuffer, shadow_mask: mask, environment };
        let mut radiance = base;
        let mut visibilities = Vec::new();
        for (finish, materials) in &layers {
            let layer = self.specular_layer(g, materials, &shading, *finish);
            let visibility = self.mirror_visibility(g, &shading, *finish, &mut rays);
            g.because("what the flakes reflect is added to the rest");
            radiance = passes::composite::composite(g, &frame, &gbuffer, &radiance, &layer, visibility.as_ref());
            visibilities.extend(visibility);
        }
        self.explain_absent(view.glints, &glinting, mirror_occlusion, &mut left_out);
        let radiance = self.accumulate(g, &frame, radiance, earlier);
        g.because("every frame");
        let display = passes::tonemap::tonemap(g, &frame, &radiance, view.exposure);
        let passes::GBuffer { ids, footprint, position, normal, uv, specular, .. } = gbuffer;
        let visibility = visibilities;
        Ok(Frame {
            radiance,
            display,
            ids,
            footprint,
            position,
            normal,
            uv,
            specular,
            constants: frame,
            shadow_mask,
            visibility,
            updates,
            rays,
            left_out,
        })
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
        self.update_scene(g, true)?;
        // What masks are made of.
        let glinting: Vec<GlintMaterial> = self.materials.iter().filter(|material| glints(material)).cloned().collect();
        self.buffers.upload_materials(g, &glinting);
        let Some(occluders) = &self.occluders else { return Err(RenderError::NoOcclusion) };
        g.because("rays of the caller's own");
        let counted = passes::trace::trace(g, &self.buffers, occluders, (rays, count), question, answers);
        self.newest = Some(counted.counts.resource().id);
        Ok(counted.counts)
    }

    /// Declares what brings the scene up to date on the device, occluders too if something asks for them.
    fn update_scene(&mut self, g: &mut Graph, occlusion_asked: bool) -> Result<(), RenderError> {
        // What can fail comes first: nothing is declared then.
        let occluders = match &mut self.occluders {
            _ if !occlusion_asked => None,
            Some(occluders) => {
                occluders.follow(&self.scene, &self.buffers)?;
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

    /// What the flakes of each pixel reflect, by the method of its material.
    fn specular_layer(&self, g: &mut Graph, glinting: &[GlintMaterial], shading: &Shading, finish: Finish) -> Image {
        let mut layer = g.image("specular_layer", Format::Rgba32Float, shading.gbuffer.ids.extent());
        g.because("each material writes its own pixels only");
        g.clear(&mut layer, 0.0);
        for material in glinting {
            g.because(format!("material {} glints by method {}", material.name, material.method.name));
            if let Some(method) = self.methods.get(material.method.name) {
                method.shade(g, material, shading, &mut layer);
            }
        }
        if finish.glint_blur > 0 {
            g.because("the method blurs its glints");
            layer = passes::blur::blur_glints(g, shading.frame, layer, finish.glint_blur);
        }
        layer
    }

    /// How free the mirror direction of each pixel is, if a method asks for it.
    fn mirror_visibility(
        &self,
        g: &mut Graph,
        shading: &Shading,
        finish: Finish,
        rays: &mut Vec<RaysOfPass>,
    ) -> Option<Image> {
        let occluders = self.occluders.as_ref().filter(|_| finish.mirror_occlusion)?;
        g.because("the method dims glints whose mirror direction is occluded");
        let (visibility, counted) =
            passes::occlusion::occlusion(g, shading.scene, occluders, shading.frame, shading.gbuffer);
        rays.push(counted);
        Some(match finish.visibility_blur {
            0 => visibility,
            radius => passes::blur::blur_visibility(g, shading.frame, visibility, radius),
        })
    }

    /// Says what this scene and these settings do not call for, and what no pass renders yet.
    fn explain_absent(
        &self,
        drawn: bool,
        glinting: &[GlintMaterial],
        mirror_occlusion: bool,
        left_out: &mut Vec<LeftOut>,
    ) {
        let mut leave = |what, why: String| left_out.push(LeftOut { what, why });
        if !drawn {
            leave("glints", "the view is without them".to_owned());
        } else if glinting.is_empty() {
            leave("glints", "no material glints (glint_count is absent or 0 everywhere)".to_owned());
        }
        if !self.environment.present() {
            leave("environment", "the scene has none".to_owned());
        }
        if !mirror_occlusion {
            leave("occlusion", "no method in use asks for it".to_owned());
        } else if self.occlusion == OcclusionBackend::None {
            leave("occlusion", "occlusion is off".to_owned());
        }
        for (what, why) in unrendered(&self.scene) {
            leave(what, why);
        }
    }

    /// The mean of this frame and those before it, if it is not the only one.
    fn accumulate(&mut self, g: &mut Graph, frame: &Buffer, radiance: Image, earlier: Option<u32>) -> Image {
        let Some(earlier) = earlier else {
            self.mean = None;
            return radiance;
        };
        let desc = ImageDesc::new(Format::Rgba32Float, radiance.extent());
        let (mean, earlier) = match self.mean.take() {
            Some(mean) if mean.desc() == desc => (mean, earlier),
            _ => (Image::new("mean", desc, Lifetime::Settings), 0),
        };
        let mean = self.mean.insert(mean);
        g.because("several samples a pixel");
        passes::accumulate::accumulate(g, frame, &radiance, mean, earlier);
        let mut shown = g.image("radiance", Format::Rgba32Float, radiance.extent());
        g.copy_image(mean, &mut shown);
        shown
    }

    fn upload_frame(&self, g: &mut Graph, view: &View) -> Buffer {
        let (sin, cos) = self.rotation_radians.sin_cos();
        let constants = types::Frame {
            // Directions of the scene are turned back into the map's.
            environment: [cos as f32, sin as f32, 1.0, 0.0],
            light_count: self.buffers.light_count,
            has_environment: u32::from(self.environment.present()),
            ..view.frame(self.buffers.center)
        };
        let mut frame = g.buffer("frame", size_of::<types::Frame>() as u64);
        g.upload(&mut frame, Arc::<[u8]>::from(bytemuck::bytes_of(&constants)));
        frame
    }
}

/// What the scene has that no pass renders yet.
fn unrendered(scene: &Scene) -> Vec<(&'static str, String)> {
    let mut found = Vec::new();
    for Material { name, sheen, clearcoat, alpha, .. } in &scene.materials {
        if sheen.is_some() {
            found.push(("sheen", format!("no pass renders that of material {name} yet")));
        }
        if clearcoat.is_some_and(|coat| coat.normal_texture.is_some()) {
            found.push(("clear coat normal map", format!("the coat of material {name} follows the base's normal yet")));
        }
        match alpha {
            AlphaMode::Opaque | AlphaMode::Mask { .. } => {}
            AlphaMode::Blend => {
                let why = format!("material {name} is shown where its alpha is at least 0.5, and nowhere else, yet");
                found.push(("alpha blending", why));
            }
        }
    }
    found
}

/// Whether there is anything to glint: at least one flake in a square of texture space.
fn glints(material: &GlintMaterial) -> bool {
    material.flakes() > 0
}

/// The scene's glinting materials, with the settings that its file gives them.
fn glint_materials(scene: &Scene) -> Vec<GlintMaterial> {
    let with_glints = scene.materials.iter().enumerate().filter_map(|(index, material)| {
        let glint = material.glint.as_ref()?;
        let asked = glint.method.as_deref().unwrap_or(DEFAULT_METHOD);
        let info = methods::method(asked).unwrap_or_else(|error| {
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
        Some(GlintMaterial { index, name: material.name.clone(), method: info, values, uv_set: glint.uv_set })
    });
    with_glints.collect()
}
