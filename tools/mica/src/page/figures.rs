//! The figures of a point: their names, what they mean, and how they are written.

use crate::charts::three_digits;
use crate::table::bytes;
use mica_accuracy::{Errors, Estimate, Metric, Point};

/// A figure that pages show of every point.
pub struct Figure {
    pub name: &'static str,
    pub meaning: &'static str,
    of: fn(&Point) -> Option<Estimate>,
}

const MS: f64 = 1e-6;

/// All figures with an interval, in the order in which they are shown.
pub const FIGURES: [Figure; 13] = [
    Figure {
        name: "glint time, ms",
        meaning: "Frames with glints less frames without, alternating in one run: the median of the rounds, and the least \
                  and greatest. May be below 0 within its spread.",
        of: |point| Some(scaled(point.cost.glints, MS)),
    },
    Figure {
        name: "frame, ms",
        meaning: "The whole frame with glints, its passes free to overlap.",
        of: |point| Some(scaled(point.cost.frame, MS)),
    },
    Figure {
        name: "time factor",
        meaning: "The frame with glints over the frame without, in each round.",
        of: |point| Some(point.cost.ratio),
    },
    Figure {
        name: "W1",
        meaning: "Wasserstein-1 distance between the distributions of the luminance of glint pixels, over the reference's \
                  mean; the mean over bands of scale, by their pixels. Compares methods of every claim.",
        of: |point| error(point, |errors| Some(errors.w1)),
    },
    Figure {
        name: "mean ratio",
        meaning: "Mean luminance of the glints over the reference's: 1 if no energy is lost or made.",
        of: |point| error(point, |errors| Some(errors.mean_ratio)),
    },
    Figure {
        name: "variance ratio",
        meaning: "Variance of the glints' luminance within tiles of 16 x 16 pixels, over the reference's: below 1 there is too \
                  little sparkle.",
        of: |point| error(point, |errors| Some(errors.variance_ratio)),
    },
    Figure {
        name: "relMSE",
        meaning: "Relative mean square error of glint pixels: for methods that claim the very flakes.",
        of: |point| error(point, |errors| Some(errors.rel_mse)),
    },
    Figure {
        name: "FLIP",
        meaning: "Mean FLIP of the tone-mapped pictures: the difference that is seen when they are flipped.",
        of: |point| error(point, |errors| Some(errors.flip)),
    },
    Figure {
        name: "HDR-FLIP",
        meaning: "The same over the exposures at which the pictures can be looked at.",
        of: |point| error(point, |errors| Some(errors.hdr_flip)),
    },
    Figure {
        name: "energy ratio over time",
        meaning: "Energy of the differences between frames along a camera path of sub-pixel steps, over the reference's.",
        of: |point| error(point, |errors| Some(errors.path?.energy_ratio)),
    },
    Figure {
        name: "flicker ratio",
        meaning: "The same, each energy first taken over the variance of its own pixels: above 1, sparkle changes faster \
                  than it should.",
        of: |point| error(point, |errors| Some(errors.path?.flicker)),
    },
    Figure {
        name: "energy per glint",
        meaning: "Mean luminance of the pixels that glint over that of the reference's, as Table 1 of Wang, Deng and \
                  Holzschuch (2020) has it.",
        of: |point| error(point, |errors| Some(errors.energy_per_glint)),
    },
    Figure {
        name: "tables, ms",
        meaning: "Making the tables anew when a setting or the environment changes; not part of a frame.",
        of: |point| Some(Estimate::exact(point.cost.tables * MS)),
    },
];

impl Figure {
    /// The figure of a point; none where it was not measured.
    pub fn of(&self, point: &Point) -> Option<Estimate> {
        (self.of)(point)
    }
}

/// Figures without an interval: name, meaning and words of a point.
pub fn further(point: &Point) -> [(&'static str, String); 4] {
    [
        ("precomputation, ms", three_digits(point.cost.precomputation * MS)),
        ("memory of glints", bytes(point.cost.glint_bytes)),
        ("rounds", point.cost.sittings.iter().map(Vec::len).sum::<usize>().to_string()),
        ("clock", point.cost.clock.clone()),
    ]
}

/// What they mean.
pub const FURTHER: [(&str, &str); 4] = [
    ("precomputation, ms", "What was made once, before the first frame."),
    ("memory of glints", "Bytes on the device that a frame without glints does not need."),
    ("rounds", "Pairs of frames that were timed."),
    ("clock", "Timestamps of the GPU, or processor time of the process where the device is the processor."),
];

fn error(point: &Point, of: impl Fn(&Errors) -> Option<Estimate>) -> Option<Estimate> {
    of(point.errors.as_ref()?)
}

pub fn scaled(estimate: Estimate, by: f64) -> Estimate {
    Estimate { value: estimate.value * by, low: estimate.low * by, high: estimate.high * by }
}

/// A figure with its interval.
pub fn with_interval(estimate: Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    let shown = three_digits(value);
    if low == high { shown } else { format!("{shown} [{}, {}]", three_digits(low), three_digits(high)) }
}

/// A few words for a tab.
pub const fn tab(metric: Metric) -> &'static str {
    match metric {
        Metric::W1 => "Distribution (W1)",
        Metric::Mean => "Mean",
        Metric::Variance => "Variance",
        Metric::RelMse => "Pixels (relMSE)",
        Metric::Flip => "FLIP",
        Metric::HdrFlip => "HDR-FLIP",
        Metric::Flicker => "Flicker",
    }
}
