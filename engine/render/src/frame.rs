//! A frame: the nodes that the census calls for, in order.

use crate::census::Effect;
use crate::environment_tables::Called;
use crate::methods::{self, Finish, Reads, Shading};
use crate::passes::GlintTiles;
use crate::renderer::{Renderer, glints};
use crate::scene::{AlphaMode, Material, Scene};
use crate::{GlintMaterial, MadeTable, OcclusionBackend, RaysOfPass, RenderError, View, passes};
use mica_graph::{Buffer, Effects, Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_shaders::{effects as e, types};
use std::sync::Arc;

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
    /// Derivatives of the flakes' texture coordinates over the pixel: du/dx, dv/dx, du/dy, dv/dy. None where nothing glints.
    pub footprint: Option<Image>,
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
    /// How many tiles of 8x8 pixels passes over glints run on: a [`mica_shaders::types::TileList`] for each glinting material that is
    /// shown, in the order of the scene, and then perhaps one for each layer. None where nothing glints.
    pub tile_lists: Option<Buffer>,
    /// The passes, by index in the graph, that bring tables up to date rather than draw.
    pub updates: std::ops::Range<usize>,
    /// The passes that trace rays, each with how many; a name may occur more than once.
    pub rays: Vec<RaysOfPass>,
    /// The effects that its shaders are specialised for. Passes that the caller declares next on the same graph are so too, until
    /// [`Graph::specialize`] says otherwise.
    pub effects: Effects,
    /// The tables that it makes and brings back, where a cache was asked for them in vain ([`Renderer::keep_tables`]).
    pub made: Vec<MadeTable>,
    /// What the frame does without.
    pub left_out: Vec<LeftOut>,
}

impl Renderer {
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
        let effects = self.effects();
        let occlusion = self.occlusion != OcclusionBackend::None;
        let glinting = self.glinting();
        let mut layers = self.layers(&glinting);
        let layered: Vec<(GlintMaterial, u32)> = with_layers(&glinting, &layers);
        let asks = |layers: &[(Finish, Vec<GlintMaterial>)]| layers.iter().any(|(finish, _)| finish.mirror_occlusion);
        // A view without glints keeps what those with them need.
        if !(effects.contains(e::SHADOWS) || asks(&layers) || self.traces) {
            self.occluders = None;
        }
        if !view.glints {
            layers.clear();
        }
        let mirror_occlusion = asks(&layers);

        g.specialize(effects);
        let first_update = g.passes().len();
        self.update_scene(g, effects.contains(e::SHADOWS) || (occlusion && mirror_occlusion))?;
        self.update_tables(g, effects, &glinting, view.glints);
        let updates = first_update..g.passes().len();
        // Like the frame's constants: no table is made from them.
        self.buffers.upload_materials(g, &layered);

        g.because("every frame");
        let frame = self.upload_frame(g, view);
        self.newest = Some(frame.resource().id);
        let ids = passes::visibility::visibility(g, &self.buffers, &frame, extent);
        let footprint = effects.contains(e::GLINTS).then(|| g.image("footprint", Format::Rgba32Float, extent));
        let gbuffer = passes::surface::surface(g, &self.buffers, &frame, ids, footprint);
        let mut rays = Vec::new();
        let shadow_mask = match &self.occluders {
            Some(occluders) if effects.contains(e::SHADOWS) => {
                g.because(format!("{} lights cast shadows", self.buffers.light_count));
                let (mask, counted) = passes::shadows::shadows(g, &self.buffers, occluders, &frame, &gbuffer);
                rays.push(counted);
                Some(mask)
            }
            _ => None,
        };
        g.because("every frame");
        // Where nothing casts shadows no shader reads it.
        let mask = shadow_mask.as_ref().unwrap_or(&self.no_shadows);
        let base = passes::base::base(g, &self.buffers, &self.environment, &frame, &gbuffer, mask);
        let environment = &self.environment;
        let mut radiance = base;
        let mut visibility = Vec::new();
        let mut tile_lists = None;
        if let (Some(footprint), false) = (&gbuffer.footprint, layers.is_empty()) {
            g.because("passes over glints run on the tiles that show them");
            let blurred: Vec<bool> = layers.iter().map(|(finish, _)| finish.glint_blur > 0).collect();
            let (scene, frame) = (&self.buffers, &frame);
            let tiles = passes::glint_tiles::glint_tiles(g, scene, frame, &gbuffer, &glinting, &blurred);
            let shading =
                Shading { scene, frame, gbuffer: &gbuffer, footprint, shadow_mask: mask, environment, tiles: &tiles };
            for (layer, (finish, materials)) in layers.iter().enumerate() {
                let tiles = (&tiles, tiles.of_layer(layer));
                let glints = self.specular_layer(g, materials, &shading, *finish, tiles);
                let free = self.mirror_visibility(g, &shading, *finish, tiles, &mut rays);
                g.because("what the flakes reflect is added to the rest");
                passes::composite::composite(g, frame, &gbuffer, tiles, &glints, free.as_ref(), &mut radiance);
                visibility.extend(free);
            }
            tile_lists = Some(tiles.lists);
        }
        let left_out = self.left_out(view, mirror_occlusion);
        let radiance = self.accumulate(g, &frame, radiance, earlier);
        g.because("every frame");
        let display = passes::tonemap::tonemap(g, &frame, &radiance, view.exposure);
        let passes::GBuffer { ids, footprint, position, normal, uv, specular, .. } = gbuffer;
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
            tile_lists,
            updates,
            rays,
            effects,
            made: self.kept.take_made(),
            left_out,
        })
    }

    /// The effects of a frame: those that the census calls for, and those that are simulated whatever it says.
    pub(crate) fn effects(&self) -> Effects {
        let occlusion = self.occlusion != OcclusionBackend::None;
        let forced = if occlusion { self.forced } else { self.forced.without(e::SHADOWS) };
        self.census().effects(occlusion) | forced
    }

    /// The materials that glint and are shown.
    pub(crate) fn glinting(&self) -> Vec<GlintMaterial> {
        let shown = |material: &&GlintMaterial| self.census().materials[material.index].triangles > 0;
        self.materials().iter().filter(|material| glints(material)).filter(shown).cloned().collect()
    }

    /// Materials that ask for the same after shading share a layer.
    pub(crate) fn layers(&mut self, glinting: &[GlintMaterial]) -> Vec<(Finish, Vec<GlintMaterial>)> {
        let mut layers: Vec<(Finish, Vec<GlintMaterial>)> = Vec::new();
        for material in glinting {
            let method = self.methods.entry(material.method.name).or_insert_with(|| methods::start(material.method));
            let finish = method.finish(material);
            match layers.iter_mut().find(|(of, _)| *of == finish) {
                Some((_, materials)) => materials.push(material.clone()),
                None => layers.push((finish, vec![material.clone()])),
            }
        }
        layers
    }

    /// Declares what brings the tables up to date that these effects and materials call for, and gives back the others. A view
    /// without glints makes none for them, but keeps what there is of the methods in use.
    fn update_tables(&mut self, g: &mut Graph, effects: Effects, glinting: &[GlintMaterial], seen: bool) {
        let irradiance = effects.contains(e::ENVIRONMENT | e::DIFFUSE);
        let mirrors = effects.contains(e::SMOOTH_SPECULAR) || effects.contains(e::CLEAR_COAT);
        let ggx = effects.contains(e::ENVIRONMENT) && mirrors;
        self.environment.update(g, &mut self.kept, effects.contains(e::ENVIRONMENT), Called { irradiance, ggx });
        let mut lobe = false;
        let mut cones = Vec::new();
        for material in glinting {
            let Some(method) = self.methods.get_mut(material.method.name) else { continue };
            let gamma_deg = material.values.number("gamma_deg");
            let reads = method.reads();
            lobe |= reads == Reads::Lobe;
            cones.extend((reads == Reads::Cones).then_some(gamma_deg.to_radians()));
            if !seen {
                continue;
            }
            let name = &material.name;
            match reads {
                Reads::Lobe => {
                    g.because(format!("material {name}: smooth lobe under the environment; first frame"));
                    self.environment.call_for_beckmann(g, &mut self.kept);
                }
                Reads::Cones => {
                    g.because(format!(
                        "material {name}: what cones of {gamma_deg} degrees mirror; first frame with them"
                    ));
                    self.environment.call_for_cones(g, &mut self.kept, gamma_deg.to_radians());
                }
                Reads::Map => {}
            }
        }
        self.environment.keep(lobe, &cones);
        let of = |name: &'static str| glinting.iter().filter(move |material| material.method.name == name);
        self.methods.retain(|name, _| of(name).next().is_some());
        for (name, method) in self.methods.iter_mut().filter(|_| seen) {
            method.update(g, &mut self.kept, &of(name).cloned().collect::<Vec<_>>(), &self.environment);
        }
    }

    /// What the flakes of each pixel reflect, by the method of its material.
    fn specular_layer(
        &self,
        g: &mut Graph,
        glinting: &[GlintMaterial],
        shading: &Shading,
        finish: Finish,
        tiles: (&GlintTiles, u32),
    ) -> Image {
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
            layer = passes::blur::blur_glints(g, shading.frame, tiles, layer, finish.glint_blur);
        }
        layer
    }

    /// How free the mirror direction of each pixel is, if a method asks for it.
    fn mirror_visibility(
        &self,
        g: &mut Graph,
        shading: &Shading,
        finish: Finish,
        tiles: (&GlintTiles, u32),
        rays: &mut Vec<RaysOfPass>,
    ) -> Option<Image> {
        let occluders = self.occluders.as_ref().filter(|_| finish.mirror_occlusion)?;
        g.because("the method dims glints whose mirror direction is occluded");
        let (visibility, counted) =
            passes::occlusion::occlusion(g, shading.scene, occluders, shading.frame, shading.gbuffer, tiles);
        rays.push(counted);
        Some(match finish.visibility_blur {
            0 => visibility,
            radius => passes::blur::blur_visibility(g, shading.frame, tiles, visibility, radius),
        })
    }

    /// What this scene and these settings do not call for, and what no pass renders yet.
    fn left_out(&self, view: &View, mirror_occlusion: bool) -> Vec<LeftOut> {
        let occlusion = self.occlusion != OcclusionBackend::None;
        let effects = self.census().effect_list(occlusion).into_iter();
        let mut left_out: Vec<LeftOut> =
            effects.filter(|effect| !effect.called_for).map(|Effect { what, why, .. }| LeftOut { what, why }).collect();
        let glint = !self.glinting().is_empty();
        if glint && !view.glints {
            left_out.push(LeftOut { what: "glints", why: "the view is without them".to_owned() });
        }
        if !mirror_occlusion {
            left_out.push(LeftOut { what: "occlusion", why: "no method in use asks for it".to_owned() });
        } else if !occlusion {
            left_out.push(LeftOut { what: "occlusion", why: "occlusion is off".to_owned() });
        }
        left_out.extend(unrendered(self.scene()).into_iter().map(|(what, why)| LeftOut { what, why }));
        left_out
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
            has_environment: u32::from(self.environment.census().is_some()),
            ..view.frame(self.buffers.center)
        };
        let mut frame = g.buffer("frame", size_of::<types::Frame>() as u64);
        g.upload(&mut frame, Arc::<[u8]>::from(bytemuck::bytes_of(&constants)));
        frame
    }
}

/// Each of the materials with the number of its layer.
pub(crate) fn with_layers(
    glinting: &[GlintMaterial],
    layers: &[(Finish, Vec<GlintMaterial>)],
) -> Vec<(GlintMaterial, u32)> {
    let holds = |of: &[GlintMaterial], material: &GlintMaterial| of.iter().any(|other| other.index == material.index);
    let layer = |material| (0..).zip(layers).find(|(_, (_, of))| holds(of, material)).map_or(0, |(layer, _)| layer);
    glinting.iter().map(|material| (material.clone(), layer(material))).collect()
}

/// What the scene has that no pass renders yet.
pub(crate) fn unrendered(scene: &Scene) -> Vec<(&'static str, String)> {
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
