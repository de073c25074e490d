//! The environment on the device: the map with its levels, and the tables made from it once something needs them.

use crate::passes;
use crate::scene::EquirectMap;
use mica_graph::{Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_shaders::constants as c;
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

/// The environment, or its absence.
pub(crate) struct EnvironmentTables {
    present: bool,
    map: Image,
    pending: Option<Arc<[u8]>>,
    irradiance: Image,
    irradiance_ready: bool,
    ggx: Lobe,
    ggx_ready: bool,
}

impl EnvironmentTables {
    /// The tables of a map; without one, of a single black texel that no shader reads.
    pub fn new(map: Option<&EquirectMap>) -> Self {
        let black = EquirectMap { width: 1, height: 1, texels: vec![[0.0; 3]] };
        let levels = levels(map.unwrap_or(&black));
        let extent = Extent::new(levels[0].width, levels[0].height);
        let desc = ImageDesc { mips: levels.len() as u32, ..ImageDesc::new(Format::Rgba32Float, extent) };
        let texels: Vec<[f32; 4]> =
            levels.iter().flat_map(|level| &level.texels).map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let lobe = if map.is_some() { Lobe::new("ggx") } else { Self::absent_lobe() };
        let irradiance_extent = if map.is_some() { Extent::new(64, 32) } else { Extent::new(1, 1) };
        Self {
            present: map.is_some(),
            map: Image::new("environment", desc, Lifetime::Scene),
            pending: Some(Arc::from(bytemuck::cast_slice::<_, u8>(&texels))),
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

    /// The environment averaged over the cone of this half-angle about each direction; declares the pass that fills it.
    pub fn cone(&self, g: &mut Graph, sin2_half_gamma: f64) -> Image {
        // As fine as the map, within reason, and never so coarse that linear interpolation shows.
        let width = self.map.extent().width.clamp(256, 1024);
        let extent = if self.present { Extent::new(width, width / 2) } else { Extent::new(1, 1) };
        let desc = ImageDesc::new(Format::Rgba32Float, extent);
        let mut cone = Image::new("environment_cone", desc, Lifetime::Settings);
        if self.present {
            passes::environment::cone(g, &self.map, sin2_half_gamma, &mut cone);
        }
        cone
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
