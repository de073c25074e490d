//! The environment: what the flakes of a footprint reflect of light from everywhere.
//!
//! The truth is each flake by itself, which mirrors its own cone. The other rungs know less of what is mirrored: its mean, its
//! mean and mean square, or a table of both by normal and view. The error is that of the distribution of pixels.

use super::moments::{MomentTables, TwoMoments, shade};
use super::resample::resampled;
use super::{Chart, EXACTNESS_SCHEMA, Effort, ExactnessError, ExactnessLine, in_turn, pass_ns, spread};
use crate::{Condition, Estimate, Machine, Stage};
use mica_gpu::{Executor, Timing};
use mica_graph::{Format, Graph, Image};
use mica_oracle::statistics::wasserstein_1;
use mica_render::scene::{EquirectMap, SmallLight, procedural};
use mica_render::{Environment, Progress};

/// Roughness and half-angle of the cone, degrees.
const MATERIALS: [[f64; 2]; 2] = [[0.1, 6.0], [0.5, 2.0]];
/// Environments, and how far they are turned, degrees: the sun of the second lies where flakes may mirror it.
const ENVIRONMENTS: [(&str, f64); 2] = [("studio", 0.0), ("clear", 24.0)];
/// Flakes expected in a footprint.
const FLAKES: [f64; 6] = [0.5, 2.0, 8.0, 30.0, 100.0, 1000.0];

/// Who shades.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shading {
    /// A method of the renderer.
    Method(&'static str),
    TwoMoments(TwoMoments),
}

struct Rung {
    name: &'static str,
    what: &'static str,
    shading: Shading,
}

const RUNGS: [Rung; 7] = [
    Rung {
        name: "split sum",
        what: "A prefiltered map and the lobe's albedo (Karis 2013): the mean, which does not sparkle (`smooth`).",
        shading: Shading::Method("smooth"),
    },
    Rung {
        name: "4D table",
        what: "A table by normal and view, and the quadtree of flakes (Wang et al. 2020 as printed, without its blur).",
        shading: Shading::Method("wang2020"),
    },
    Rung {
        name: "two moments, 1 normal",
        what: "Mean and mean square from two prefiltered maps, looked up once; one draw from the law that they have.",
        shading: Shading::TwoMoments(TwoMoments { normals: [0, 0], each_below: 0, lights: false }),
    },
    Rung {
        name: "two moments",
        what: "The same maps looked up about 24 normals of the distribution.",
        shading: Shading::TwoMoments(TwoMoments { normals: [3, 8], each_below: 0, lights: false }),
    },
    Rung {
        name: "two moments + lights",
        what: "The same after small bright lights were taken out, of which flakes are lit by a binomial law.",
        shading: Shading::TwoMoments(TwoMoments { normals: [3, 8], each_below: 0, lights: true }),
    },
    Rung {
        name: "two moments + lights + few",
        what: "The same, and where there are 12 flakes or fewer each mirrors its own direction.",
        shading: Shading::TwoMoments(TwoMoments { normals: [3, 8], each_below: 12, lights: true }),
    },
    Rung {
        name: "each flake",
        what: "Each flake in the footprint mirrors its own cone (`flakes`): the truth, with other flakes.",
        shading: Shading::Method("flakes"),
    },
];

/// A stage under an environment for each rung.
pub struct Sky {
    environment: Environment,
    /// The lights that were taken out of its map, and what is left.
    parted: (Vec<SmallLight>, EquirectMap),
    /// By method; two moments shade the pixels of the first.
    stages: Vec<(&'static str, Stage)>,
    /// Without and with lights taken out.
    tables: Option<[MomentTables; 2]>,
    gamma_deg: f64,
}

/// The condition of a footprint with so many flakes: seen at 45 degrees.
pub fn condition([alpha, gamma_deg]: [f64; 2], flakes: f64) -> Condition {
    Condition { alpha, gamma_deg, flakes, theta_i_deg: 0.0, theta_o_deg: 45.0, phi_deg: 0.0 }
}

impl Sky {
    /// A sky by the name of its environment, turned by so many degrees.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(map: EquirectMap, rotation_deg: f64) -> Result<Self, ExactnessError> {
        let environment = Environment { map, rotation_radians: rotation_deg.to_radians() };
        let parted = environment.map.part_small_lights();
        let mut stages = Vec::new();
        for method in ["smooth", "wang2020", "flakes"] {
            let mut stage = Stage::lit(method, &condition([0.1, 6.0], 1.0), &[], Some(&environment))?;
            let settings: &[(&str, &str)] = match method {
                "wang2020" => &[("blur", "false"), ("depth", "10")],
                "flakes" => &[("most", "2000")],
                _ => &[],
            };
            for (key, value) in settings {
                stage.set(key, value)?;
            }
            stages.push((method, stage));
        }
        Ok(Self { environment, parted, stages, tables: None, gamma_deg: 0.0 })
    }

    fn stage(&mut self, method: &str) -> &mut Stage {
        let found = self.stages.iter().position(|(name, _)| *name == method).unwrap_or(0);
        &mut self.stages[found].1
    }

    /// Makes the moments' tables if the cone is another.
    fn prepare(&mut self, executor: &mut Executor, gamma_deg: f64) -> Result<(), ExactnessError> {
        if self.tables.is_some() && self.gamma_deg == gamma_deg {
            return Ok(());
        }
        let mut g = Graph::new();
        let (lights, rest) = &self.parted;
        let whole = MomentTables::new(&mut g, &self.environment.map, &[], gamma_deg);
        let parted = MomentTables::new(&mut g, rest, lights, gamma_deg);
        executor.run(g, Timing::Overlapped)?;
        self.tables = Some([whole, parted]);
        self.gamma_deg = gamma_deg;
        Ok(())
    }

    /// Declares a frame; what is shown, and the name of the pass that shades.
    fn declare(
        &mut self,
        g: &mut Graph,
        shading: Shading,
        condition: &Condition,
        [side, seed]: [u32; 2],
    ) -> Result<(Image, &'static str), ExactnessError> {
        match shading {
            Shading::Method(method) => {
                let frame = self.stage(method).frame(g, condition, [side, seed], true)?;
                // Methods whose shader says no more than a lobe share its pass' name.
                Ok((frame.radiance, if method == "smooth" { "smooth" } else { "glints" }))
            }
            Shading::TwoMoments(how) => {
                let frame = self.stage("smooth").frame(g, condition, [side, seed], false)?;
                let tables = self.tables.as_ref().map(|tables| &tables[usize::from(how.lights)]);
                let mut shown = g.image("moment_glints", Format::Rgba32Float, frame.ids.extent());
                if let Some(tables) = tables {
                    shade(g, tables, how, condition, seed, &frame, &mut shown);
                }
                Ok((shown, "environment_moments"))
            }
        }
    }
}

/// Pixels along a side of a frame, and how many frames: a footprint of many flakes takes long, and its pixels differ less.
fn pixels(flakes: f64, effort: &Effort) -> [u32; 2] {
    match flakes {
        ..10.0 => [128, effort.frames()],
        ..500.0 => [64, effort.frames()],
        _ => [32, effort.frames()],
    }
}

impl Sky {
    /// Luminance of `side` x `side` pixels of flakes of a seed: of each flake, or by two moments.
    ///
    /// # Errors
    /// Those of the device.
    pub fn shown(
        &mut self,
        executor: &mut Executor,
        how: Option<TwoMoments>,
        condition: &Condition,
        [side, seed]: [u32; 2],
    ) -> Result<Vec<f64>, ExactnessError> {
        self.prepare(executor, condition.gamma_deg)?;
        let shading = how.map_or(Shading::Method("flakes"), Shading::TwoMoments);
        self.samples(executor, shading, condition, ([side, 1], seed))
    }

    /// Luminance of so many pixels as a rung shades them.
    fn samples(
        &mut self,
        executor: &mut Executor,
        shading: Shading,
        condition: &Condition,
        ([side, frames], first_seed): ([u32; 2], u32),
    ) -> Result<Vec<f64>, ExactnessError> {
        let mut samples = Vec::new();
        for seed in first_seed..first_seed + frames {
            let mut g = Graph::new();
            let (shown, _) = self.declare(&mut g, shading, condition, [side, seed])?;
            let download = g.download_image(&shown);
            let bytes = executor.run(g, Timing::Overlapped)?.take(download);
            let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
            let luminance =
                |[r, g, b, _]: [f32; 4]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
            samples.extend(pixels.into_iter().map(luminance));
        }
        Ok(samples)
    }

    /// Nanoseconds that each rung takes for a pixel: the time of the pass that shades.
    fn time(
        &mut self,
        executor: &mut Executor,
        condition: &Condition,
        rounds: usize,
    ) -> Result<Vec<Estimate>, ExactnessError> {
        const SIDE: u32 = 64;
        let times = in_turn(rounds, RUNGS.len(), |rung| {
            let mut g = Graph::new();
            let (shown, pass) = self.declare(&mut g, RUNGS[rung].shading, condition, [SIDE, 0])?;
            g.export(&shown);
            let run = executor.run(g, Timing::Isolated)?;
            Ok::<_, ExactnessError>(pass_ns(executor, &run, pass)? / f64::from(SIDE * SIDE))
        })?;
        Ok(times.iter().map(|times| spread(times)).collect())
    }
}

/// Distance between two sets of pixels over the mean of the second, with what is seen of its interval.
fn apart(samples: &[f64], truth: &[f64]) -> Estimate {
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    resampled(samples.len().min(truth.len()), |picks| {
        let of = |values: &[f64]| picks.iter().map(|pick| values[*pick]).collect::<Vec<f64>>();
        // The truth's pixels are others, drawn in the same way.
        wasserstein_1(&of(samples), &of(truth)).unwrap_or(f64::NAN) / mean
    })
}

/// The lines of the chart.
///
/// # Errors
/// Those of the device.
pub fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let mut lines = Vec::new();
    let mut times: Vec<Vec<Estimate>> = Vec::new();
    let mut done = 0;
    for (sky_index, (name, rotation_deg)) in ENVIRONMENTS.into_iter().enumerate() {
        let map = procedural::environment(name).unwrap_or_else(|| EquirectMap::constant([1.0; 3]));
        let mut sky = Sky::new(map, rotation_deg)?;
        let conditions = MATERIALS.into_iter().flat_map(|material| FLAKES.map(|flakes| condition(material, flakes)));
        for (index, condition) in conditions.enumerate() {
            progress("flakes under an environment", done, (ENVIRONMENTS.len() * MATERIALS.len() * FLAKES.len()) as u64);
            done += 1;
            sky.prepare(executor, condition.gamma_deg)?;
            if sky_index == 0 {
                // The time does not depend on what is mirrored.
                times.push(sky.time(executor, &condition, effort.frame_rounds())?);
            }
            let count = pixels(condition.flakes, effort);
            let truth = sky.samples(executor, Shading::Method("flakes"), &condition, (count, 1000))?;
            for (rung, ns) in RUNGS.iter().zip(&times[index]) {
                let samples = sky.samples(executor, rung.shading, &condition, (count, 1))?;
                lines.push(ExactnessLine {
                    schema: EXACTNESS_SCHEMA.to_owned(),
                    chart: Chart::Environment.name().to_owned(),
                    case: format!(
                        "{name}, alpha {}, gamma {} deg, {} flakes",
                        condition.alpha, condition.gamma_deg, condition.flakes
                    ),
                    rung: rung.name.to_owned(),
                    what: rung.what.to_owned(),
                    error_of:
                        "Wasserstein-1 distance of pixel luminance from that of each flake over the mean, with its 95 \
                               % interval"
                            .to_owned(),
                    error: apart(&samples, &truth),
                    ns: *ns,
                    per: "pixel, by the device's timestamps".to_owned(),
                    machine: machine.clone(),
                });
            }
        }
    }
    Ok(lines)
}
