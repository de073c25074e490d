//! What `mica accuracy` is asked.

use crate::args::{DeviceArgs, OcclusionChoice, finite, size};
use crate::study::Lighting;
use clap::Args;
use mica_accuracy::exactness::Chart;
use std::path::PathBuf;

/// `mica accuracy`.
#[derive(Debug, Args)]
#[command(
    after_long_help = "A study (-o DIR) compares one frame of every method, with every rung of its ladder (see `mica methods`), with a \
    reference of the same place, and times it: DIR/points.jsonl has a line for each point, DIR/references.jsonl one for \
    each place, and each point names the command that renders it. A point that is there already is not measured again, \
    so that a study goes on after Ctrl-C, a kill or a new scene; scene, lighting, size, method, settings, what the scene holds, device, driver, \
    build and effort decide whether it is the same.\n\n\
    Glints are the radiance with them less that of the same view without, linear and scene-referred. The reference looks \
    at every flake in 8x8 and again in 9x9 parts of every pixel (4x4 and 5x5 with --quick), and says how far the two are \
    apart. W1 is the Wasserstein-1 distance between the luminances of pixels, by the number of flakes in a pixel, over \
    the reference's mean; mean ratio is over the reference's; FLIP compares the pictures as they are seen. After ± \
    stands the farther end of an interval of 95 %, of times of what rounds and sittings differ by, or +a/-b where the ends differ by more than a third; \
    `at most` stands before the upper end of a time no greater than its spread. The time of glints is that of a frame with them less that of the \
    same frame without, in turns in one run: processor time of the process where the device is the processor. \
    Repeating a study changes no error. \
    Each point is timed in three sittings, between which all others of the place are, so that a spread tells what \
    another run may find. Where neither \
    scenes nor methods are named, a study measures the charts of --exactness too, once.\n\n\
    --quick leaves out what takes longest on a processor: of `jakob` epsilon .5, .02 and 0, of `atanasov` 100 \
    enumerated, of `wang2018` depth 8, of `wang2020` samples 1024, and all scenes but shoe and cloth."
)]
pub struct AccuracyArgs {
    /// Scenes of a study: embedded ones or .gltf or .glb files. Default: all embedded ones but drift; with --quick, shoe
    /// and cloth.
    #[arg(value_name = "SCENE", conflicts_with_all = ["counts", "exactness", "sheet"])]
    pub scene: Vec<PathBuf>,
    /// A folder for what is measured: a study, which goes on where an earlier run of the same command ended. With
    /// --counts: `counts.jsonl`, a line each row, written as it comes; with --exactness: `exactness.jsonl`, to which lines
    /// are appended.
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// The law of the count: for each method, mean, variance, share of dark pixels and distance from the true
    /// distribution, from a tenth of a flake in a footprint to 100,000, for three materials.
    #[arg(long)]
    pub counts: bool,
    /// What each exactness costs on its own: ways to compute the probability that a flake is lit, the number of lit
    /// flakes, the footprint, the environment, occlusion, and formulas in which f32 loses digits, each with its error and
    /// its nanoseconds.
    #[arg(long, conflicts_with = "method")]
    pub exactness: bool,
    /// A chart of --exactness to measure (repeatable). Default: all.
    #[arg(long, value_name = "NAME", requires = "exactness", value_parser = chart)]
    pub chart: Vec<Chart>,
    /// A contact sheet of all methods on all embedded scenes but the large one.
    #[arg(long, value_name = "FILE.png")]
    pub sheet: Option<PathBuf>,
    /// Draws the report of a study anew from what is in its folder (-o), and measures nothing. Older charts in
    /// plots/ stay where there is none of their name any more.
    #[arg(long, requires = "output", conflicts_with_all = ["counts", "sheet", "exactness", "scene"])]
    pub redraw: bool,
    /// A method to look at (repeatable). Default: all.
    #[arg(long, value_name = "NAME")]
    pub method: Vec<String>,
    /// A study in minutes: two scenes at 320x180, smaller references, fewer rounds, no slow rungs. With --counts: fewer
    /// pixels, and larger errors of the figures.
    #[arg(long)]
    pub quick: bool,
    /// Size of the pictures of a study (repeatable; default 640x360, with --quick 320x180), or of a tile of the sheet
    /// (default 320x180).
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true)]
    pub size: Vec<[u32; 2]>,
    /// Which of a scene's lights shine in a study (repeatable): all its `own`, its `lights` without the environment, or
    /// its `environment` without the lights.
    #[arg(long, value_enum, default_values_t = [Lighting::Own])]
    pub lighting: Vec<Lighting>,
    /// Seconds that the rounds of a point may take in each of three sittings, as far as the fewest (2, with --quick 1) fit
    /// into them. Default: 7, with --quick 0.4.
    #[arg(long, value_name = "S", value_parser = seconds, allow_hyphen_values = true)]
    pub seconds: Option<f64>,
    /// Most rounds of a sitting, each a frame with glints and one without. Default: 5, with --quick 3.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub rounds: Option<u32>,
    /// Samples of each pixel of the sheet, averaged.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "sheet", conflicts_with = "scene", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Who answers what blocks light in a study, as in `mica render`.
    #[arg(long, value_enum, default_value_t = OcclusionChoice::Auto)]
    pub occlusion: OcclusionChoice,
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Prints neither table nor progress.
    #[arg(long)]
    pub quiet: bool,
}

fn chart(text: &str) -> Result<Chart, String> {
    let names = || Chart::ALL.map(Chart::name).join(", ");
    Chart::ALL.into_iter().find(|chart| chart.name() == text).ok_or_else(|| format!("expected one of {}", names()))
}

fn seconds(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|seconds| (0.0..=1e6).contains(seconds))
        .ok_or_else(|| "expected seconds from 0 to 1e6".into())
}
