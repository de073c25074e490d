//! The command line: what may be typed, and what it means.

use crate::bench::BenchArgs;
use crate::budget::BudgetArgs;
use crate::change::Change;
use crate::render_help;
use crate::stability::StabilityArgs;
use crate::study::Lighting;
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use mica_accuracy::exactness::Chart;
use mica_render::scene::Light;
use std::ops::RangeInclusive;
use std::path::PathBuf;

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

/// A scene, and how it is rendered.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// An embedded scene (see `mica scenes`) or a .gltf or .glb file.
    #[arg(default_value = "shoe")]
    pub scene: PathBuf,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_hyphen_values = true)]
    pub size: [u32; 2],
    /// How glints are estimated, for all glinting materials (see `mica methods`). Default: what the scene says, or else
    /// wang2020.
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
            device: None,
            memory: None,
            validation: false,
            cache: None,
            no_cache: false,
        }
    }
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
    /// After the first frame, changes a setting and renders a frame (repeatable); the report says what each change made
    /// anew. All else that is reported, and the picture, are of the last state.
    #[arg(long, value_name = "[MATERIAL:]KEY=VALUE", value_parser = Change::of_any)]
    pub edit: Vec<Change>,
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
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

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
    stands the farther end of an interval of 95 %, or +a/-b where the ends differ by more than a third. The time of glints is that of a frame with them less that of the \
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
    /// A device, by its number or a part of its name or of its driver's name and version (see `mica doctor`). Default:
    /// the best there is.
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Most device memory to take, as in `mica render`.
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
    /// Prints neither table nor progress.
    #[arg(long)]
    pub quiet: bool,
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

/// A corner and two sides, as (u, v) each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram(pub [f64; 6]);

/// Degrees from the normal, and about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles(pub [f64; 2]);

/// Who answers questions about occlusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OcclusionChoice {
    Auto,
    RayQuery,
    Bvh,
    None,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TimingChoice {
    Isolated,
    Overlapped,
}

/// Where to look from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraChoice {
    /// Metres.
    pub eye: DVec3,
    /// Metres; not at the eye.
    pub target: DVec3,
    /// From bottom to top, within 0 and 180.
    pub vertical_fov_deg: f64,
}

/// Most pixels along a side: what every device with Vulkan 1.3 can be expected to stop at.
const LARGEST_SIDE: u32 = 16384;
/// Roughnesses, and half-angles of cones in degrees, that flakes may have.
pub const ALPHAS: RangeInclusive<f64> = 0.001..=1.0;
pub const GAMMAS_DEG: RangeInclusive<f64> = 0.01..=30.0;
/// Coordinates beyond this are meaningless in metres, and their squares leave f32.
pub const LARGEST_COORDINATE: f64 = 1e9;

fn chart(text: &str) -> Result<Chart, String> {
    let names = || Chart::ALL.map(Chart::name).join(", ");
    Chart::ALL.into_iter().find(|chart| chart.name() == text).ok_or_else(|| format!("expected one of {}", names()))
}

pub fn size(text: &str) -> Result<[u32; 2], String> {
    let wanted = || format!("expected WIDTHxHEIGHT, each 1 to {LARGEST_SIDE}, such as 1920x1080");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wanted)?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=LARGEST_SIDE).contains(side)).ok_or_else(wanted);
    Ok([side(width)?, side(height)?])
}

fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| "expected a finite number".into())
}

fn exposure(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|stops| stops.abs() <= 32.0).ok_or_else(|| "expected stops from -32 to 32".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|seconds| (0.0..=1e6).contains(seconds))
        .ok_or_else(|| "expected seconds from 0 to 1e6".into())
}

fn alpha(text: &str) -> Result<f64, String> {
    let accepted = |alpha: &f64| ALPHAS.contains(alpha);
    finite(text).ok().filter(accepted).ok_or_else(|| format!("expected {} to {}", ALPHAS.start(), ALPHAS.end()))
}

fn gamma_deg(text: &str) -> Result<f64, String> {
    let accepted = |gamma: &f64| GAMMAS_DEG.contains(gamma);
    let wanted = || format!("expected degrees from {} to {}", GAMMAS_DEG.start(), GAMMAS_DEG.end());
    finite(text).ok().filter(accepted).ok_or_else(wanted)
}

fn count(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|count| (0.0..=1e12).contains(count)).ok_or_else(|| "expected 0 to 1e12".into())
}

fn footprint(text: &str) -> Result<Parallelogram, String> {
    let fits = |numbers: &[f64; 6]| numbers.iter().all(|number| number.abs() <= LARGEST_COORDINATE);
    let wanted = || format!("expected six numbers PU,PV,E1U,E1V,E2U,E2V up to {LARGEST_COORDINATE:e}");
    numbers(text).filter(fits).map(Parallelogram).ok_or_else(wanted)
}

fn angles(text: &str) -> Result<Angles, String> {
    let wanted = || "expected THETA,PHI in degrees, THETA from -180 to 180".to_owned();
    numbers(text).filter(|[theta, _]: &[f64; 2]| theta.abs() <= 180.0).map(Angles).ok_or_else(wanted)
}

/// So many finite numbers between commas.
pub fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(finite).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

fn point(text: &str) -> Option<DVec3> {
    numbers::<3>(text).map(DVec3::from).filter(|point| point.abs().max_element() <= LARGEST_COORDINATE)
}

/// A radiance, intensity or irradiance: three numbers that are not negative and fit an f32 with room for sums.
pub fn power(rgb: [f64; 3]) -> Option<[f32; 3]> {
    rgb.iter().all(|channel| (0.0..=1e12).contains(channel)).then(|| rgb.map(|channel| channel as f32))
}

fn light(text: &str) -> Result<Light, String> {
    let wanted = || "expected point:X,Y,Z,R,G,B or dir:X,Y,Z,R,G,B, with R, G and B from 0 to 1e12".to_owned();
    let (kind, rest) = text.split_once(':').ok_or_else(wanted)?;
    let [x, y, z, r, g, b] = numbers(rest).ok_or_else(wanted)?;
    let power = power([r, g, b]).ok_or_else(wanted)?;
    let place = DVec3::new(x, y, z);
    if place.abs().max_element() > LARGEST_COORDINATE {
        return Err(format!("expected coordinates up to {LARGEST_COORDINATE:e}"));
    }
    match kind {
        "point" => Ok(Light::Point { position: place, radiant_intensity: power, range: None }),
        "dir" => {
            let direction =
                place.try_normalize().ok_or("expected the direction in which the light travels, not 0,0,0")?;
            Ok(Light::Directional { direction, irradiance: power })
        }
        _ => Err(wanted()),
    }
}

fn camera(text: &str) -> Result<CameraChoice, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [eye, target, fov] = parts[..] else { return Err("expected EYE:TARGET:FOV_DEG, as X,Y,Z:X,Y,Z:F".into()) };
    let eye = point(eye).ok_or("EYE: expected three numbers X,Y,Z, in metres")?;
    let target = point(target).ok_or("TARGET: expected three numbers X,Y,Z, in metres")?;
    let vertical_fov_deg = finite(fov)
        .ok()
        .filter(|degrees| (0.01..=179.0).contains(degrees))
        .ok_or("FOV_DEG: expected degrees from 0.01 to 179")?;
    if (target - eye).try_normalize().is_none() {
        return Err("EYE and TARGET are one point; expected two".into());
    }
    Ok(CameraChoice { eye, target, vertical_fov_deg })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes_have_two_sides_of_at_least_a_pixel() {
        assert_eq!(size("1920x1080"), Ok([1920, 1080]));
        for bad in ["", "x", "0x0", "5x0", "-1x4", "1e3x4", "640", "640x480x1", "16385x1", "99999999999x1", " 4x4"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn cameras_look_somewhere() {
        let camera = camera("-1,2,3.5:0,0,0:40").expect("a camera");
        assert_eq!((camera.eye, camera.vertical_fov_deg), (DVec3::new(-1.0, 2.0, 3.5), 40.0));
        for bad in
            ["", "0,0,0", "0,0,0:0,0,0:40", "1,0,0:0,0:40", "NaN,0,0:0,0,0:40", "1,0,0:0,0,0:180", "inf,0,0:1,1,1:4"]
        {
            assert!(super::camera(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lights_have_a_kind_a_place_and_a_power() {
        let Ok(Light::Directional { direction, irradiance }) = light("dir:0,-2,0,1,2,3") else { panic!("no light") };
        assert_eq!((direction, irradiance), (DVec3::NEG_Y, [1.0, 2.0, 3.0]));
        assert!(matches!(light("point:0,1,0,4,4,4"), Ok(Light::Point { .. })));
        for bad in [
            "",
            "point",
            "spot:0,0,0,1,1,1",
            "dir:0,0,0,1,1,1",
            "point:0,0,0,1,1",
            "point:0,0,0,-1,1,1",
            "point:0,nan,0,1,1,1",
        ] {
            assert!(light(bad).is_err(), "{bad}");
        }
    }
}
