//! Options that most commands share: which scene, how it is rendered, and on which device.

use super::values::{CameraChoice, camera, exposure, finite, light, size};
use crate::change::Change;
use clap::{Args, ValueEnum};
use mica_render::scene::Light;
use std::path::PathBuf;

/// A scene, and how it is rendered.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// An embedded scene (see `mica scenes`) or a .gltf or .glb file.
    #[arg(default_value = "shoe")]
    pub scene: PathBuf,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_hyphen_values = true)]
    pub size: [u32; 2],
    /// How glints are estimated, for all glinting materials (see `mica methods`), or `auto`, which chooses for
    /// each material by what the scene holds. Default: what the scene says, or else wang2020.
    #[arg(long, value_name = "NAME")]
    pub method: Option<String>,
    /// A setting of all glinting materials (repeatable; see `mica methods`).
    #[arg(long, value_name = "KEY=VALUE", value_parser = Change::of_all)]
    pub set: Vec<Change>,
    /// A setting of one glinting material (repeatable).
    #[arg(long, value_name = "MATERIAL:KEY=VALUE", value_parser = Change::of_one)]
    pub glint: Vec<Change>,
    /// Light from everywhere: an equirectangular .exr or .hdr file, a name (see `mica scenes`), `none`, or
    /// `constant:R,G,B`. Default: the scene's own; without one, `overcast` if there are no lights either, else `none`.
    #[arg(long, value_name = "FILE|NAME|none|constant:R,G,B")]
    pub env: Option<PathBuf>,
    /// Turns the environment about +Y, counter-clockwise seen from above.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub env_rotate: f64,
    /// A light beside the scene's own (repeatable): metres and W/sr, or the direction in which it travels and W/m2.
    #[arg(long, value_name = "point:X,Y,Z,R,G,B|dir:X,Y,Z,R,G,B", value_parser = light)]
    pub light: Vec<Light>,
    /// Drops the scene's own lights.
    #[arg(long)]
    pub no_lights: bool,
    /// Where to look from, as EYE:TARGET:FOV_DEG, the field of view from bottom to top. Default: the scene's first
    /// camera, or one that sees all of it.
    #[arg(long, value_name = "X,Y,Z:X,Y,Z:F", value_parser = camera, allow_hyphen_values = true)]
    pub camera: Option<CameraChoice>,
    /// Factor of the radiance before tone mapping, in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: f64,
    /// Who answers whether something lies between two points: ray queries of the device, a hierarchy of bounding volumes
    /// in compute shaders, or nobody, and everything is lit. `auto` takes ray queries on GPUs that offer them, else `bvh`.
    #[arg(long, value_enum, default_value_t = OcclusionChoice::Auto)]
    pub occlusion: OcclusionChoice,
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl SceneArgs {
    /// A scene, and nothing else said.
    pub fn of(scene: &str) -> Self {
        Self {
            scene: PathBuf::from(scene),
            size: [1280, 720],
            method: None,
            set: Vec::new(),
            glint: Vec::new(),
            env: None,
            env_rotate: 0.0,
            light: Vec::new(),
            no_lights: false,
            camera: None,
            exposure: 0.0,
            occlusion: OcclusionChoice::Auto,
            device: DeviceArgs::default(),
        }
    }
}

/// A device, and what is kept of it between runs.
#[derive(Clone, Debug, Default, Args)]
pub struct DeviceArgs {
    /// A device, by its number or a part of its name or of its driver's name and version (see `mica doctor`). Default:
    /// the best there is.
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Most device memory to take. Default: all of it; on a CPU device, three quarters of what is free.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(16..=1 << 30))]
    pub memory: Option<u64>,
    /// Runs under Vulkan's validation layer and prints what it says.
    #[arg(long)]
    pub validation: bool,
    /// Keeps tables and pipelines there. Default: `mica` in the user's cache folder.
    #[arg(long, value_name = "DIR", conflicts_with = "no_cache")]
    pub cache: Option<PathBuf>,
    /// Keeps nothing and uses nothing that was kept.
    #[arg(long)]
    pub no_cache: bool,
}

/// Who answers questions about occlusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OcclusionChoice {
    Auto,
    RayQuery,
    Bvh,
    None,
}
