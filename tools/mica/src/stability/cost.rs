//! What stable forms cost: whole frames with those that have a printed form to go back to (`shared/naive_forms.glsl`: of
//! microfacets, chances and areas) against the same frames with naive ones, in turns in one run.

use super::StabilityArgs;
use crate::args::{DeviceArgs, SceneArgs};
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::picture::Picture;
use crate::progress::Progress;
use crate::session::Session;
use crate::study::{Clock, spread};
use crate::table::{Column, table};
use mica_accuracy::Estimate;
use mica_gpu::Timing;
use mica_graph::Shader;
use mica_render::METHODS;
use mica_shaders::{base, base_naive, glints, glints_naive};
use serde::Serialize;

/// What is rendered, and how often.
const SCENE: &str = "shoe";
const SIZE: [u32; 2] = [320, 180];
const ROUNDS: usize = 9;

/// The passes of every method with their twins of naive forms.
macro_rules! twins {
    ($($method:ident),* $(,)?) => {
        [
            [&base::SHADER, &base_naive::SHADER],
            $([&glints::$method::SHADER, &glints_naive::$method::SHADER]),*
        ]
    };
}

const TWINS: [[&Shader; 2]; 13] = twins![
    smooth,
    flakes,
    jakob,
    wang2018,
    wang2020,
    atanasov,
    zirr_kaplanyan,
    wang_bowles,
    shopf,
    chermain,
    deliot_belcour,
    kemppinen,
];

/// Methods whose frames take seconds on a processor, left out of a quick run.
const SLOW: [&str; 3] = ["jakob", "wang2018", "atanasov"];

/// A method's frames.
#[derive(Serialize)]
pub struct CostRow {
    method: &'static str,
    /// Frames with stable forms over frames with naive ones: median of the rounds, least and greatest.
    ratio: Estimate,
    /// Nanoseconds of a frame with stable forms, and with naive ones: medians.
    frame_ns: [f64; 2],
    clock: &'static str,
    rounds: usize,
    /// Share of the pixels in which the two differ at all, and by more than a thousandth of the brightest.
    differing: [f64; 2],
    /// Channels that are no finite numbers with naive forms; there are none with stable ones.
    naive_not_finite: usize,
}

/// Measures each method, cheap ones only unless all are wanted. What was measured before a failure is in `rows`.
pub fn measure(
    args: &StabilityArgs,
    interrupt: &Interrupt,
    progress: &mut Progress,
    rows: &mut Vec<CostRow>,
) -> Result<(), Failure> {
    let device = DeviceArgs { device: args.device.clone(), ..DeviceArgs::default() };
    let scene = SceneArgs { size: SIZE, device, ..SceneArgs::of(SCENE) };
    let mut session = Session::new(&scene, progress)?;
    let clock = Clock::of(session.device())?;
    for method in METHODS.iter().filter(|method| args.full || !SLOW.contains(&method.name)) {
        session.renderer.set_method(None, method.name)?;
        session.precompute(progress)?;
        let (title, mut times) = (format!("frames by {}", method.name), Vec::new());
        let mut pictures: [Option<Picture>; 2] = [None, None];
        // The first round compiles shaders and makes tables.
        for round in 0..=ROUNDS {
            let mut ns = [0.0; 2];
            for naive in [round % 2, 1 - round % 2] {
                if interrupt.requested() {
                    return Err(Failure::with_code(INTERRUPTED, "interrupted"));
                }
                let exchanged = if naive == 1 { &TWINS[..] } else { &[] };
                let view = session.view.clone();
                let frame = progress.during(&title, || session.look_by(&view, Timing::Overlapped, exchanged));
                let (shot, count) = frame?;
                if naive == 1 && count < 2 {
                    return Err(Failure::bad_input(format!("{}: passes without a twin of naive forms", method.name)));
                }
                ns[naive] = clock.ns(&shot.run)?;
                pictures[naive] = shot.picture;
            }
            times.push(ns);
        }
        times.remove(0);
        let [Some(stable), Some(naive)] = &pictures else { continue };
        rows.push(row(method.name, clock, &times, [stable, naive]));
    }
    Ok(())
}

fn row(method: &'static str, clock: Clock, times: &[[f64; 2]], [stable, naive]: [&Picture; 2]) -> CostRow {
    let of = |index: usize| spread(times.iter().map(move |ns| ns[index]), 0.0).value;
    let brightest = stable.radiance.iter().copied().fold(0.0, f32::max);
    let pairs = || stable.radiance.chunks_exact(4).zip(naive.radiance.chunks_exact(4));
    let share = |least: f32| {
        // What is not a number is apart from everything.
        let close = |(a, b): (&f32, &f32)| (a - b).abs() <= least * brightest;
        let apart = |(a, b): &(&[f32], &[f32])| !a.iter().zip(*b).all(close);
        pairs().filter(apart).count() as f64 / pairs().count().max(1) as f64
    };
    CostRow {
        method,
        ratio: spread(times.iter().map(|[stable, naive]| stable / naive), 0.0),
        frame_ns: [of(0), of(1)],
        clock: clock.name(),
        rounds: times.len(),
        differing: [share(0.0), share(1e-3)],
        naive_not_finite: naive.radiance.iter().filter(|value| !value.is_finite()).count(),
    }
}

/// A row for each method.
pub fn for_people(rows: &[CostRow]) -> String {
    let columns = [
        Column::Left("method"),
        Column::Right("stable / naive"),
        Column::Right("least"),
        Column::Right("greatest"),
        Column::Right("frame ms"),
        Column::Right("pixels that differ"),
        Column::Right("by .001"),
        Column::Right("not finite"),
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let [all, visible] = row.differing.map(|share| format!("{:.1} %", 100.0 * share));
            vec![
                row.method.to_owned(),
                format!("{:.3}", row.ratio.value),
                format!("{:.3}", row.ratio.low),
                format!("{:.3}", row.ratio.high),
                format!("{:.1}", row.frame_ns[0] * 1e-6),
                all,
                visible,
                row.naive_not_finite.to_string(),
            ]
        })
        .collect();
    let [width, height] = SIZE;
    let clock = rows.first().map_or("", |row| row.clock);
    let heading = format!(
        "whole frames of {SCENE} at {width}x{height} with stable forms of microfacets, chances and areas over naive ones, {ROUNDS} rounds in turns, {clock} time\n\n"
    );
    heading + &table(&columns, &cells)
}
