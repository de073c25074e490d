//! The command line: what may be typed, and what it means.

mod scene;
mod values;

pub use scene::{DeviceArgs, OcclusionChoice, SceneArgs};
pub use values::{
    ALPHAS, Angles, CameraChoice, GAMMAS_DEG, LARGEST_COORDINATE, Parallelogram, camera, exposure, finite, light,
    numbers, power, size,
};

use crate::accuracy::AccuracyArgs;
use crate::bench::BenchArgs;
use crate::budget::BudgetArgs;
use crate::edit::Edit;
use crate::render_help;
use crate::stability::StabilityArgs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use values::{alpha, angles, count, footprint, gamma_deg};

/// Render, measure and explain glints, without a window.
#[derive(Debug, Parser)]
#[command(
    name = "mica",
    version,
    args_override_self = true,
    after_help = "Exit codes: 0 done; 2 bad input or usage; 3 no device or driver that can do it; 4 out of memory or device lost; \
                  130 interrupted, with what was finished kept."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene, and say what each pass costs.
    Render(RenderArgs),
    /// List the embedded scenes and environments.
    Scenes(JsonFlag),
    /// List the methods, with their settings.
    Methods(JsonFlag),
    /// Print the plan of a frame: its passes, what they read and write, and what was left out.
    Explain(ExplainArgs),
    /// Measure how long parts of the renderer take, alone.
    Bench(BenchArgs),
    /// Measure what methods show against what is true, and lay them side by side.
    Accuracy(AccuracyArgs),
    /// Say whether this machine can render, and what is missing if not.
    Doctor(DoctorArgs),
    /// Evaluate the glint model in f64, flake by flake, without a GPU.
    Oracle(OracleArgs),
    /// Run the numerical hard cases on a device: naive forms, stable ones, and how wrong each is.
    Stability(StabilityArgs),
}

/// For commands that print little.
#[derive(Debug, Args)]
pub struct JsonFlag {
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `mica render`.
#[derive(Debug, Args)]
#[command(after_help = render_help::SAME_BYTES, after_long_help = render_help::at_length())]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where the picture goes (repeatable): .exr holds linear, scene-referred radiance in 32-bit floats, .png is
    /// tone-mapped. Without it, frames are only timed.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Frames that are measured for each kind of timing, after those that warm up; 0 measures nothing.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub frames: u32,
    /// Samples of each pixel, averaged.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// What is measured: `isolated` times each pass with a barrier around it, `overlapped` the frame as it really runs.
    /// Default: both, in frames of their own.
    #[arg(long, value_enum)]
    pub timing: Option<TimingChoice>,
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// After the first frame, makes an edit and renders a frame (repeatable); the report says what each edit made anew. An
    /// edit is a setting, or one of: `light=` and another light, or `none` for no lights at all; `env=`, `env-rotate=`,
    /// `camera=`, `exposure=`, `size=` and what the option of that name takes; `move=INSTANCE:X,Y,Z`, an instance by its name
    /// or number and how far it moves, in metres. All else that is reported, and the picture, are of the last state.
    #[arg(long, value_name = "[MATERIAL:]KEY=VALUE|WORD=VALUE", value_parser = Edit::parse)]
    pub edit: Vec<Edit>,
    /// Writes the report as JSON; `-` is stdout, in place of the table.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Prints neither table nor progress.
    #[arg(long)]
    pub quiet: bool,
}

/// `mica explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Renders frames with and without each effect that is left out, in turns, and says what time it would cost.
    #[arg(long)]
    pub cost: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `mica doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// The device to try, by its number or a part of its name or of its driver's name and version. Default: the best
    /// there is.
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Ask the device what its arithmetic does, and say what that means for results.
    #[arg(long)]
    pub canaries: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `mica oracle`.
#[derive(Debug, Args)]
#[command(after_long_help = crate::oracle::DEFINITIONS)]
pub struct OracleArgs {
    /// Roughness: slopes of flakes have the variance alpha^2 / 2 along each axis.
    #[arg(long, value_name = "A", default_value_t = 0.3, value_parser = alpha, allow_hyphen_values = true)]
    pub alpha: f64,
    /// Half-angle of the cone into which a flake reflects, degrees.
    #[arg(long, value_name = "G", default_value_t = 3.0, value_parser = gamma_deg, allow_hyphen_values = true)]
    pub gamma_deg: f64,
    /// Flakes in each square of texture, rounded to a whole number.
    #[arg(long, value_name = "N", default_value_t = 1e5, value_parser = count, allow_hyphen_values = true)]
    pub count: f64,
    /// The footprint in texture space: a corner and the two sides that begin there.
    #[arg(long, value_name = "PU,PV,E1U,E1V,E2U,E2V", default_value = "0.1,0.2,0.05,0,0,0.05", value_parser = footprint)]
    #[arg(allow_hyphen_values = true)]
    pub footprint: Parallelogram,
    /// Towards the light: degrees from the normal, and about it.
    #[arg(long, value_name = "THETA,PHI", default_value = "30,180", value_parser = angles, allow_hyphen_values = true)]
    pub light: Angles,
    /// Towards the viewer: degrees from the normal, and about it.
    #[arg(long, value_name = "THETA,PHI", default_value = "30,0", value_parser = angles, allow_hyphen_values = true)]
    pub view: Angles,
    /// How many sets of flakes are drawn, with the seeds 0 to K - 1.
    #[arg(long, value_name = "K", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub seeds: u32,
    /// Flakes one by one in place of drawn ones: a NumPy file of N x 5 f64, the columns u, v, mx, my, mz.
    #[arg(long, value_name = "FILE.npy", requires = "queries", conflicts_with_all = ["alpha", "gamma_deg", "count", "footprint", "light", "view", "seeds"])]
    pub flakes: Option<PathBuf>,
    /// What is asked of these flakes: a JSON array of {"alpha", "gamma_deg", "i": [x, y, z], "o": [x, y, z], "para": [pu, pv,
    /// e1u, e1v, e2u, e2v]}. Prints an array of {"in_area", "count", "f"} in the same order.
    #[arg(long, value_name = "FILE.json", requires = "flakes")]
    pub queries: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TimingChoice {
    Isolated,
    Overlapped,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
