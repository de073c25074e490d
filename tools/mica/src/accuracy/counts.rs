//! `mica accuracy --counts`: the law of the count, method by method, from a tenth of a flake in a footprint to 100,000.

use super::AccuracyArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::progress::Progress;
use crate::session::{cache, device, executor};
use crate::table::{Column, table};
use mica_accuracy::{Condition, CountErrors, CountLaw, Stage, StageError};
use mica_gpu::Executor;
use mica_render::{Cache, MethodInfo};
use serde_json::{Value as Json, json};
use std::path::Path;

/// Flakes expected in a footprint, lit or not.
const FLAKES: [f64; 7] = [0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5];
/// Roughness, and half-angle of the reflection cone in degrees: those of the embedded scenes, and one between.
const MATERIALS: [(f64, f64); 3] = [(0.1, 6.0), (0.3, 1.0), (0.5, 2.0)];
/// Of light and view from the normal, degrees, on both sides of it.
const ANGLES: (f64, f64) = (30.0, 36.0);

/// One line of the table.
struct Row {
    method: &'static MethodInfo,
    condition: Condition,
    lit: f64,
    errors: CountErrors,
}

/// Where rows go as they come: a file that is written anew with each.
struct Lines {
    destination: Destination,
    text: String,
}

/// Measures, writes and prints. What was measured before Ctrl-C or a failure is kept.
pub fn counts(
    args: &AccuracyArgs,
    methods: &[&'static MethodInfo],
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let mut lines = args.output.as_deref().map(Lines::create).transpose()?;
    let device = device(&args.device)?;
    let described = json!({ "name": device.info().name, "driver": device.info().driver });
    let kept = cache(&args.device);
    let mut executor = executor(device, kept.as_ref(), args.device.memory)?;
    interrupt.defer();
    let mut rows: Vec<Row> = Vec::new();
    let mut failed = None;
    let all: Vec<(f64, (f64, f64))> =
        MATERIALS.iter().flat_map(|material| FLAKES.map(|flakes| (flakes, *material))).collect();
    let total = (methods.len() * all.len()) as u64;
    'methods: for method in methods {
        let mut stage = None;
        for (flakes, (alpha, gamma_deg)) in &all {
            if interrupt.requested() {
                break 'methods;
            }
            progress.update(&format!("counting with {}", method.name), rows.len() as u64, total);
            let (theta_i_deg, theta_o_deg) = ANGLES;
            let condition = Condition {
                alpha: *alpha,
                gamma_deg: *gamma_deg,
                flakes: *flakes,
                theta_i_deg,
                theta_o_deg,
                phi_deg: 0.0,
            };
            match measure(method, condition, &mut stage, &mut executor, kept.as_ref(), args.quick) {
                Ok(row) => {
                    if let Some(lines) = &mut lines {
                        lines.add(&row.as_json(&described))?;
                    }
                    rows.push(row);
                }
                Err(failure) => {
                    // One method that this device cannot run is no reason to give up the others.
                    log::warn!("{}: {failure}", method.name);
                    failed = Some(failure);
                    continue 'methods;
                }
            }
        }
    }
    progress.clear();
    if !args.quiet {
        output::print(&for_people(&rows))?;
        if let Some(lines) = &lines {
            output::print(&format!("\n{}\n", lines.destination.path.display()))?;
        }
    }
    if interrupt.requested() {
        return Err(Failure::with_code(INTERRUPTED, format!("interrupted after {} rows, which were kept", rows.len())));
    }
    failed.map_or(Ok(()), Err)
}

/// One method under one condition.
fn measure(
    method: &'static MethodInfo,
    condition: Condition,
    stage: &mut Option<Stage>,
    executor: &mut Executor,
    cache: Option<&Cache>,
    quick: bool,
) -> Result<Row, Failure> {
    let law = CountLaw::of_method(method.name, &condition).map_err(|error| Failure::bad_input(error.to_string()))?;
    let stage = match stage {
        Some(stage) => stage,
        none => none.insert(Stage::new(method.name, &condition)?),
    };
    for (key, value) in AS_IT_IS.iter().filter(|(key, _)| method.settings.iter().any(|setting| setting.key == *key)) {
        stage.set(key, value)?;
    }
    stage.renderer().precompute(executor, cache, &mut |_, _, _| {})?;
    // Rare events need many pixels, many flakes much time.
    let (side, seeds) = match (condition.flakes, quick) {
        (..=10.0, false) => (128, 8),
        (..=1e3, false) => (128, 1),
        (..=1e4, false) => (64, 1),
        (_, false) => (32, 1),
        (..=1e3, true) => (64, 1),
        (_, true) => (32, 1),
    };
    let mut samples = Vec::new();
    for seed in 0..seeds {
        samples.extend(stage.samples(executor, &condition, side, seed)?);
    }
    let errors = CountErrors::of(&law, &samples).map_err(|error| Failure::bad_input(error.to_string()))?;
    Ok(Row { method, condition, lit: law.lit(), errors })
}

/// Blurs over pixels are no part of what a footprint shows, and the reference looks at every flake.
const AS_IT_IS: [(&str, &str); 2] = [("blur", "false"), ("most", "200000")];

impl From<StageError> for Failure {
    fn from(error: StageError) -> Self {
        match error {
            StageError::Setting(error) => error.into(),
            StageError::Render(error) => error.into(),
            StageError::Gpu(error) => error.into(),
        }
    }
}

impl Lines {
    /// Starts `counts.jsonl` in a folder, which is made if it is not there.
    fn create(folder: &Path) -> Result<Self, Failure> {
        output::make_folder(folder)?;
        Ok(Self { destination: Destination::check(&folder.join("counts.jsonl"))?, text: String::new() })
    }

    /// Each line is on the disk before the next is computed.
    fn add(&mut self, row: &Json) -> Result<(), Failure> {
        self.text += &format!("{row}\n");
        self.destination.write(self.text.as_bytes())
    }
}

impl Row {
    fn as_json(&self, device: &Json) -> Json {
        let Self { method, condition, lit, errors } = self;
        json!({
            "schema": "mica-counts-1",
            "method": method.name,
            "claim": method.claim.name(),
            "device": device,
            "alpha": condition.alpha,
            "gamma_deg": condition.gamma_deg,
            "theta_i_deg": condition.theta_i_deg,
            "theta_o_deg": condition.theta_o_deg,
            "flakes": condition.flakes,
            "lit": lit,
            "samples": errors.samples,
            "mean_ratio": errors.mean_ratio,
            "mean_ratio_error": errors.mean_ratio_error,
            "variance_ratio": errors.variance_ratio.is_finite().then_some(errors.variance_ratio),
            "variance_ratio_error": errors.variance_ratio_error,
            "none": errors.none,
            "none_error": errors.none_error,
            "w1": errors.w1,
            "w1_floor": errors.w1_floor,
        })
    }
}

fn for_people(rows: &[Row]) -> String {
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|Row { method, condition, lit, errors }| {
            let variance = if errors.variance_ratio.is_finite() {
                format!("{:.3} ± {:.3}", errors.variance_ratio, errors.variance_ratio_error)
            } else {
                "nothing lit".to_owned()
            };
            vec![
                method.name.to_owned(),
                method.claim.name().to_owned(),
                format!("{}, {}", condition.alpha, condition.gamma_deg),
                condition.flakes.to_string(),
                format!("{lit:.3e}"),
                format!("{:.3} ± {:.3}", errors.mean_ratio, errors.mean_ratio_error),
                variance,
                format!("{:+.4}", errors.none_error),
                format!("{:.4}", errors.w1),
                format!("{:.4}", errors.w1_floor),
            ]
        })
        .collect();
    let columns = [
        Column::Left("method"),
        Column::Left("claim"),
        Column::Left("alpha, gamma"),
        Column::Right("flakes"),
        Column::Right("lit"),
        Column::Right("mean ratio"),
        Column::Right("variance ratio"),
        Column::Right("P(0) error"),
        Column::Right("W1/mean"),
        Column::Right("W1 floor"),
    ];
    table(&columns, &cells)
        + "\nflakes: expected in a footprint; lit: of these, by the law. Ratios are to the law (variance: of value over mean);\n\
           after ± stands the standard error that pixels following the law would have. P(0) error: share of dark pixels less\n\
           the law's. W1: Wasserstein distance from the law; W1 floor: what as many pixels that follow the law would have.\n"
}
