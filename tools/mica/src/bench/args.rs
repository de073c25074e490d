//! What `mica bench` is asked.

use crate::args::{DeviceArgs, size};
use crate::study::Lighting;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// `mica bench`.
#[derive(Debug, Args)]
#[command(
    after_long_help = "Without --occlusion, --coverage and --paper, every method with every rung of its ladder (see `mica methods`) at every scene, size and \
    lighting. The time of glints is that of a frame with them less that of the same frame without, in turns in one \
    run: processor time of the process where the device is the processor, timestamps of the device elsewhere. Figures \
    are medians over the rounds of three sittings, between which all other points of the place are timed; after ± (+a/-b where these differ by more than a third) stands what rounds and \
    sittings differ by, and no less than 5 % of the frame; `at most` its upper end, where a time is no greater than its spread. Tables are those a method makes anew when a setting changes, without the compilation of \
    shaders."
)]
pub struct BenchArgs {
    /// What blocks rays: each body that the device offers, on the same rays in the same run. How long it takes to be
    /// ready, how many bytes it keeps, how many rays a second it answers, and how often the bodies disagree.
    #[arg(long, conflicts_with_all = ["method", "lighting"])]
    pub occlusion: bool,
    /// What glints cost as they fill more of the screen, from none to all of it: a fixed part, and one that grows with the tiles that
    /// show them. Of `--method`s, or of three.
    #[arg(long, conflicts_with_all = ["occlusion", "paper", "lighting", "scene"])]
    pub coverage: bool,
    /// The tables and figures of a paper for this implementation, with the paper's own numbers and hardware beside them:
    /// of Wang, Deng and Holzschuch 2020, Tables 1 to 3 and Figures 9 and 10, on shoe, snow and cloth up to 1920x1080.
    #[arg(long, value_enum, conflicts_with_all = ["occlusion", "method", "lighting"])]
    pub paper: Option<Paper>,
    /// Embedded scenes or .gltf or .glb files. Default: shoe; with --occlusion drift too, with its million triangles.
    #[arg(value_name = "SCENE")]
    pub scene: Vec<PathBuf>,
    /// A method to measure, with all its rungs (repeatable). Default: all.
    #[arg(long, value_name = "NAME")]
    pub method: Vec<String>,
    /// Which of a scene's lights shine (repeatable): all its `own`, its `lights` without the environment, or its
    /// `environment` without the lights.
    #[arg(long, value_enum, default_values_t = [Lighting::Own])]
    pub lighting: Vec<Lighting>,
    /// With --occlusion: rays from what the camera sees, into all directions, and as many at most towards the first light.
    #[arg(long, value_name = "N", default_value_t = 1 << 18, value_parser = clap::value_parser!(u32).range(1..), requires = "occlusion", conflicts_with_all = ["method", "lighting", "paper"])]
    pub rays: u32,
    /// Rounds of a sitting, of which there are three, after frames that warm up: fewer, but at least two, where they take
    /// more than 7 seconds.
    /// With --occlusion all of them, and each builds everything anew.
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub rounds: u32,
    /// Size of the picture in pixels (repeatable). Default: 640x360; with --occlusion, one ray of the camera passes
    /// through each pixel of 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true)]
    pub size: Vec<[u32; 2]>,
    /// Appends a line of JSON for each point, and measures no point that is there already; with --occlusion, writes one
    /// for each scene and body. `-` is stdout, in place of the table.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Prints neither table nor progress.
    #[arg(long)]
    pub quiet: bool,
}

/// A paper whose tables are drawn anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Paper {
    Wdh20,
}
