//! The environment on the device: the map with its levels, and the tables made from it, each once something calls for it and until
//! nothing does.

use crate::census::EnvironmentCensus;
use crate::kept::{Inputs, Kept};
use crate::passes;
use crate::scene::{EquirectMap, SmallLight};
use mica_graph::{Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_shaders::{constants as c, types};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A distribution of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ndf {
    /// Of glTF's materials.
    Ggx,
    /// Of the flakes.
    Beckmann,
}

/// What a smooth lobe needs of the environment.
pub(crate) struct Lobe {
    /// The environment by the lobe's width, one roughness a layer.
    pub prefiltered: Image,
    /// The lobe's directional albedo by cosine and roughness.
    pub albedo: Image,
}

impl Lobe {
    fn new(ndf: Ndf) -> Self {
        let name = match ndf {
            Ndf::Ggx => "ggx",
            Ndf::Beckmann => "beckmann",
        };
        let extents = [Extent::new(256, 128), Extent::new(c::ALBEDO_SIZE, c::ALBEDO_SIZE)];
        Self::of_size(&[format!("environment_{name}"), format!("albedo_{name}")], extents, c::SPECULAR_LAYERS)
    }

    fn of_size([prefiltered, albedo]: &[String; 2], extents: [Extent; 2], layers: u32) -> Self {
        let desc = ImageDesc { layers, ..ImageDesc::new(Format::Rgba32Float, extents[0]) };
        Self {
            prefiltered: Image::new(prefiltered, desc, Lifetime::Scene),
            albedo: Image::new(albedo, ImageDesc::new(Format::Rg32Float, extents[1]), Lifetime::Scene),
        }
    }
}

/// What flakes of one half-angle mirror of the environment (`shared/cone_means.glsl`).
pub(crate) struct Cones {
    /// Means over the cone about each direction, of all but the small lights.
    pub means: Image,
    /// What cones hold of each small light that they may hold a part of.
    pub rings: Image,
    /// The small lights.
    pub lights: Buffer,
    /// How many there are.
    pub light_count: u32,
}

/// Widest map that means over cones are taken of, texels: a sixth of a degree each.
const CONE_MAP_WIDTH: u32 = 2048;

/// Which tables a frame calls for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Called {
    /// Something is diffuse.
    pub irradiance: bool,
    /// Something mirrors without glints.
    pub ggx: bool,
}

/// What shaders bind where there is no table, and do not read.
struct Absent {
    irradiance: Image,
    lobe: Lobe,
    cones: Cones,
}

/// The environment, or its absence.
pub(crate) struct EnvironmentTables {
    census: Option<EnvironmentCensus>,
    map: Image,
    pending: Option<Arc<[u8]>>,
    /// The map, or its first level that is no wider than [`CONE_MAP_WIDTH`].
    cone_map: EquirectMap,
    irradiance: Option<Image>,
    ggx: Option<Lobe>,
    beckmann: Option<Lobe>,
    /// By the half-angle in radians, as bits.
    cones: BTreeMap<u64, Cones>,
    absent: Absent,
    is_simulated: bool,
    generation: u64,
    fingerprint: Option<String>,
    /// What was exchanged since the last update, the only thing of which there may be something on the device.
    exchanged: Option<Box<EnvironmentTables>>,
}

impl EnvironmentTables {
    /// The tables of a map; without one, of a single black texel that no shader reads.
    pub fn new(map: Option<&EquirectMap>) -> Self {
        Self::of(map, map.map(EquirectMap::fingerprint), 0)
    }

    fn of(map: Option<&EquirectMap>, fingerprint: Option<String>, generation: u64) -> Self {
        let mut finest = map.cloned().unwrap_or_else(|| EquirectMap::constant([0.0; 3]));
        let bad_texels = finest.repair().bad_texels();
        let size = [finest.width, finest.height];
        let mut levels = levels(finest);
        let extent = Extent::new(size[0], size[1]);
        let desc = ImageDesc { mips: levels.len() as u32, ..ImageDesc::new(Format::Rgba32Float, extent) };
        let bytes = rgba_bytes(levels.iter().flat_map(|level| &level.texels));
        let fits = levels.iter().position(|level| level.width <= CONE_MAP_WIDTH).unwrap_or(0);
        let cone_map = levels.swap_remove(fits);
        let one = Extent::new(1, 1);
        let absent = ["irradiance", "environment", "albedo", "environment_cone", "light_rings", "small_lights"];
        let [irradiance, prefiltered, albedo, cone, rings, lights] = absent.map(|table| format!("{table}_absent"));
        Self {
            census: map.map(|_| EnvironmentCensus::of(size, &cone_map, bad_texels)),
            map: Image::new("environment", desc, Lifetime::Scene),
            pending: Some(bytes),
            cone_map,
            irradiance: None,
            ggx: None,
            beckmann: None,
            cones: BTreeMap::new(),
            absent: Absent {
                irradiance: Image::new(irradiance, ImageDesc::new(Format::Rgba32Float, one), Lifetime::Scene),
                lobe: Lobe::of_size(&[prefiltered, albedo], [one, one], 1),
                cones: Cones {
                    means: Image::new(cone, ImageDesc::new(Format::Rgba32Float, one), Lifetime::Scene),
                    rings: Image::new(rings, rings_desc(1, [1, 1]), Lifetime::Scene),
                    lights: Buffer::new(lights, size_of::<types::SmallLight>() as u64, Lifetime::Scene),
                    light_count: 0,
                },
            },
            is_simulated: false,
            generation,
            fingerprint,
            exchanged: None,
        }
    }

    /// Takes another map, or none: everything made from the last one is given back, once there is an update without it.
    pub fn replace(&mut self, map: Option<&EquirectMap>) {
        let fingerprint = map.map(EquirectMap::fingerprint);
        if fingerprint == self.fingerprint {
            return;
        }
        match self.exchanged.take() {
            Some(earlier) if earlier.fingerprint == fingerprint => *self = *earlier,
            earlier => {
                let next = Self::of(map, fingerprint, self.generation + 1);
                let last = std::mem::replace(self, next);
                self.exchanged = earlier.or_else(|| Some(Box::new(last)));
            }
        }
    }

    /// Counts the maps there have been: what was made from an earlier one is stale.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// What there is of it.
    pub fn census(&self) -> Option<&EnvironmentCensus> {
        self.census.as_ref()
    }

    /// The map with its levels.
    pub fn map(&self) -> &Image {
        &self.map
    }

    /// Irradiance by normal, over pi.
    pub fn irradiance(&self) -> &Image {
        self.irradiance.as_ref().unwrap_or(&self.absent.irradiance)
    }

    /// The tables of the materials' lobe.
    pub fn ggx(&self) -> &Lobe {
        self.ggx.as_ref().unwrap_or(&self.absent.lobe)
    }

    /// The tables of the flakes' smooth limit.
    pub fn beckmann(&self) -> &Lobe {
        self.beckmann.as_ref().unwrap_or(&self.absent.lobe)
    }

    /// What flakes whose cones have this half-angle mirror.
    pub fn cones(&self, half_angle_radians: f64) -> &Cones {
        self.cones.get(&half_angle_radians.to_bits()).unwrap_or(&self.absent.cones)
    }

    /// Whether the last frame was called for an environment, be it a black one.
    pub fn is_simulated(&self) -> bool {
        self.is_simulated
    }

    /// Declares the upload of the map and the tables that base shading calls for, where they are not there yet; gives back those
    /// that nothing calls for.
    pub fn update(&mut self, g: &mut Graph, kept: &mut Kept, simulated: bool, called: Called) {
        self.exchanged = None;
        self.is_simulated = simulated;
        if simulated && let Some(bytes) = self.pending.take() {
            g.because("first frame of the environment");
            g.upload_image(&mut self.map, bytes);
        }
        if !called.irradiance {
            self.irradiance = None;
        } else if self.irradiance.is_none() {
            g.because("diffuse surfaces under the environment; first frame with this map");
            let desc = ImageDesc::new(Format::Rgba32Float, Extent::new(64, 32));
            let table = Image::new("environment_irradiance", desc, Lifetime::Scene);
            let make = |g: &mut Graph, table: &mut Image| passes::environment::irradiance(g, &self.map, table);
            self.irradiance = Some(kept.table(g, self.inputs(), table, make));
        }
        if !called.ggx {
            self.ggx = None;
        } else if self.ggx.is_none() {
            g.because("smooth reflections of the environment; first frame with this map");
            self.ggx = Some(self.lobe(g, kept, Ndf::Ggx));
        }
    }

    /// Gives back what glints called for, as far as none of these methods' materials does any more.
    pub fn keep(&mut self, beckmann: bool, half_angles_radians: &[f64]) {
        if !beckmann {
            self.beckmann = None;
        }
        self.cones.retain(|kept, _| half_angles_radians.iter().any(|half_angle| half_angle.to_bits() == *kept));
    }

    /// What flakes whose cones have this half-angle mirror: declares the uploads, the first time, where there is an environment.
    ///
    /// Computed here, in f64: this is what other methods are held against. A light that is larger than a cone is left in the map, which is
    /// fine enough for it.
    pub fn call_for_cones(&mut self, g: &mut Graph, kept: &mut Kept, half_angle_radians: f64) {
        if !self.is_simulated || self.cones.contains_key(&half_angle_radians.to_bits()) {
            return;
        }
        let (mut lights, _) = self.cone_map.part_small_lights();
        lights.retain(|light| light.radius_radians <= half_angle_radians);
        // As fine as the map, within reason, and never so coarse that linear interpolation shows.
        let width = if self.census.is_some() { self.cone_map.width.clamp(256, 1024) } else { 1 };
        let extent = Extent::new(width, (width / 2).max(1));
        let mut table = Image::new("environment_cone", ImageDesc::new(Format::Rgba32Float, extent), Lifetime::Settings);
        let inputs = self.inputs().map(|inputs| {
            let code = [include_str!("scene/cone_means.rs"), include_str!("scene/small_lights.rs")];
            inputs.and(format_args!("{half_angle_radians} {code:?}"))
        });
        let means = kept.bytes(inputs, &table, || {
            rgba_bytes(&self.cone_map.without(&lights).cone_means(half_angle_radians, width).texels)
        });
        g.upload_image(&mut table, means);
        let (rings, buffer) = upload_lights(g, &lights, half_angle_radians);
        let cones = Cones { means: table, rings, lights: buffer, light_count: lights.len() as u32 };
        self.cones.insert(half_angle_radians.to_bits(), cones);
    }

    /// Declares the passes that fill the tables of the flakes' smooth limit, the first time, where there is an environment.
    pub fn call_for_beckmann(&mut self, g: &mut Graph, kept: &mut Kept) {
        if self.beckmann.is_none() && self.is_simulated {
            self.beckmann = Some(self.lobe(g, kept, Ndf::Beckmann));
        }
    }

    /// What tables that are made from the map alone depend on; none without a map.
    pub fn inputs(&self) -> Option<Inputs> {
        // The map is repaired, and its levels are made, by this code.
        let code = include_str!("scene/environment.rs");
        self.fingerprint.as_ref().map(|map| Inputs::default().and(format_args!("{map}")).and(format_args!("{code}")))
    }

    /// The tables of a lobe; declares what fills them.
    fn lobe(&self, g: &mut Graph, kept: &mut Kept, ndf: Ndf) -> Lobe {
        let Lobe { prefiltered, mut albedo } = Lobe::new(ndf);
        let make = |g: &mut Graph, table: &mut Image| passes::environment::specular(g, &self.map, ndf, table);
        let prefiltered = kept.table(g, self.inputs(), prefiltered, make);
        passes::environment::albedo(g, ndf, &mut albedo);
        Lobe { prefiltered, albedo }
    }
}

/// Texels as an image of four channels holds them.
fn rgba_bytes<'a>(texels: impl IntoIterator<Item = &'a [f32; 3]>) -> Arc<[u8]> {
    let texels: Vec<[f32; 4]> = texels.into_iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    Arc::from(bytemuck::cast_slice::<_, u8>(&texels))
}

fn rings_desc(layers: u32, [width, height]: [u32; 2]) -> ImageDesc {
    ImageDesc { layers, ..ImageDesc::new(Format::Rgba32Float, Extent::new(width, height)) }
}

/// The rings of lights, one a layer, and the lights; black ones where there are none.
fn upload_lights(g: &mut Graph, lights: &[SmallLight], half_angle_radians: f64) -> (Image, Buffer) {
    let size = if lights.is_empty() { [1, 1] } else { [c::RING_AZIMUTHS, c::RING_DISTANCES] };
    let mut texels = Vec::new();
    let mut described = Vec::new();
    for light in lights {
        let ring = light.ring(half_angle_radians, size);
        described.push(types::SmallLight {
            direction: light.direction.as_vec3().to_array(),
            inner_chord: ring.inner_chord as f32,
            tangent: ring.tangent.as_vec3().to_array(),
            per_chord: (1.0 / (ring.outer_chord - ring.inner_chord)) as f32,
            irradiance: light.irradiance.map(|c| c as f32),
            reserved: 0.0,
        });
        texels.extend(ring.radiance);
    }
    if lights.is_empty() {
        texels.push([0.0; 3]);
        described.push(bytemuck::Zeroable::zeroed());
    }
    let desc = rings_desc(described.len() as u32, size);
    let mut rings = Image::new("light_rings", desc, Lifetime::Settings);
    g.upload_image(&mut rings, rgba_bytes(&texels));
    let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&described));
    let mut buffer = Buffer::new("small_lights", bytes.len() as u64, Lifetime::Settings);
    g.upload(&mut buffer, bytes);
    (rings, buffer)
}

/// The map and every coarser level down to one texel high.
fn levels(map: EquirectMap) -> Vec<EquirectMap> {
    let mut levels = vec![map];
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        let next = last.half();
        levels.push(next);
    }
    levels
}
