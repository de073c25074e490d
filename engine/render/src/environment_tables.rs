//! The environment on the device: the map with its levels, and the tables made from it once something needs them.

use crate::passes;
use crate::scene::{EquirectMap, SmallLight};
use mica_graph::{Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_shaders::{constants as c, types};
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
    fn new(name: &str) -> Self {
        let prefiltered =
            ImageDesc { layers: c::SPECULAR_LAYERS, ..ImageDesc::new(Format::Rgba32Float, Extent::new(256, 128)) };
        let albedo = ImageDesc::new(Format::Rg32Float, Extent::new(c::ALBEDO_SIZE, c::ALBEDO_SIZE));
        Self {
            prefiltered: Image::new(format!("environment_{name}"), prefiltered, Lifetime::Scene),
            albedo: Image::new(format!("albedo_{name}"), albedo, Lifetime::Scene),
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

/// The environment, or its absence.
pub(crate) struct EnvironmentTables {
    present: bool,
    map: Image,
    pending: Option<Arc<[u8]>>,
    /// The map, or its first level that is no wider than [`CONE_MAP_WIDTH`].
    cone_map: EquirectMap,
    irradiance: Image,
    irradiance_ready: bool,
    ggx: Lobe,
    ggx_ready: bool,
}

impl EnvironmentTables {
    /// The tables of a map; without one, of a single black texel that no shader reads.
    pub fn new(map: Option<&EquirectMap>) -> Self {
        let black = EquirectMap { width: 1, height: 1, texels: vec![[0.0; 3]] };
        let mut levels = levels(map.unwrap_or(&black));
        let extent = Extent::new(levels[0].width, levels[0].height);
        let desc = ImageDesc { mips: levels.len() as u32, ..ImageDesc::new(Format::Rgba32Float, extent) };
        let bytes = rgba_bytes(levels.iter().flat_map(|level| &level.texels));
        let fits = levels.iter().position(|level| level.width <= CONE_MAP_WIDTH).unwrap_or(0);
        let cone_map = levels.swap_remove(fits);
        let lobe = if map.is_some() { Lobe::new("ggx") } else { Self::absent_lobe() };
        let irradiance_extent = if map.is_some() { Extent::new(64, 32) } else { Extent::new(1, 1) };
        Self {
            present: map.is_some(),
            map: Image::new("environment", desc, Lifetime::Scene),
            pending: Some(bytes),
            cone_map,
            irradiance: Image::new(
                "environment_irradiance",
                ImageDesc::new(Format::Rgba32Float, irradiance_extent),
                Lifetime::Scene,
            ),
            irradiance_ready: map.is_none(),
            ggx: lobe,
            ggx_ready: map.is_none(),
        }
    }

    fn absent_lobe() -> Lobe {
        let one = Extent::new(1, 1);
        Lobe {
            prefiltered: Image::new(
                "environment_absent",
                ImageDesc { layers: 1, ..ImageDesc::new(Format::Rgba32Float, one) },
                Lifetime::Scene,
            ),
            albedo: Image::new("albedo_absent", ImageDesc::new(Format::Rg32Float, one), Lifetime::Scene),
        }
    }

    /// Whether there is an environment.
    pub fn present(&self) -> bool {
        self.present
    }

    /// The map with its levels.
    pub fn map(&self) -> &Image {
        &self.map
    }

    /// Irradiance by normal, over pi.
    pub fn irradiance(&self) -> &Image {
        &self.irradiance
    }

    /// The tables of the materials' lobe.
    pub fn ggx(&self) -> &Lobe {
        &self.ggx
    }

    /// Declares the upload of the map and the tables that base shading reads, the first time.
    pub fn update(&mut self, g: &mut Graph) {
        if let Some(bytes) = self.pending.take() {
            g.upload_image(&mut self.map, bytes);
        }
        if !self.irradiance_ready {
            g.because("diffuse surfaces under the environment; first frame with this map");
            passes::environment::irradiance(g, &self.map, &mut self.irradiance);
            self.irradiance_ready = true;
        }
        if !self.ggx_ready {
            g.because("smooth reflections of the environment; first frame with this map");
            passes::environment::specular(g, &self.map, Ndf::Ggx, &mut self.ggx);
            self.ggx_ready = true;
        }
    }

    /// What flakes whose cones have this half-angle mirror; declares the uploads.
    ///
    /// Computed here, in f64: this is what other methods are held against. A light that is larger than a cone is left in the map, which is
    /// fine enough for it.
    pub fn cones(&self, g: &mut Graph, half_angle_radians: f64) -> Cones {
        let (mut lights, _) = self.cone_map.part_small_lights();
        lights.retain(|light| light.radius_radians <= half_angle_radians);
        // As fine as the map, within reason, and never so coarse that linear interpolation shows.
        let width = if self.present { self.cone_map.width.clamp(256, 1024) } else { 1 };
        let means = self.cone_map.without(&lights).cone_means(half_angle_radians, width);
        let extent = Extent::new(means.width, means.height);
        let mut table = Image::new("environment_cone", ImageDesc::new(Format::Rgba32Float, extent), Lifetime::Settings);
        g.upload_image(&mut table, rgba_bytes(&means.texels));
        let (rings, buffer) = upload_lights(g, &lights, half_angle_radians);
        Cones { means: table, rings, lights: buffer, light_count: lights.len() as u32 }
    }

    /// The tables of the flakes' smooth limit; declares the passes that fill them.
    pub fn beckmann(&self, g: &mut Graph) -> Lobe {
        if !self.present {
            return Self::absent_lobe();
        }
        let mut lobe = Lobe::new("beckmann");
        passes::environment::specular(g, &self.map, Ndf::Beckmann, &mut lobe);
        lobe
    }
}

/// Texels as an image of four channels holds them.
fn rgba_bytes<'a>(texels: impl IntoIterator<Item = &'a [f32; 3]>) -> Arc<[u8]> {
    let texels: Vec<[f32; 4]> = texels.into_iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    Arc::from(bytemuck::cast_slice::<_, u8>(&texels))
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
    let desc = ImageDesc {
        layers: described.len() as u32,
        ..ImageDesc::new(Format::Rgba32Float, Extent::new(size[0], size[1]))
    };
    let mut rings = Image::new("light_rings", desc, Lifetime::Settings);
    g.upload_image(&mut rings, rgba_bytes(&texels));
    let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&described));
    let mut buffer = Buffer::new("small_lights", bytes.len() as u64, Lifetime::Settings);
    g.upload(&mut buffer, bytes);
    (rings, buffer)
}

/// The map and every coarser level down to one texel high.
fn levels(map: &EquirectMap) -> Vec<EquirectMap> {
    let mut levels = vec![map.clone()];
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        let next = last.half();
        levels.push(next);
    }
    levels
}
