//! The figures of a point: their names, what they mean, and how they are written.

use crate::charts::three_digits;
use crate::table::bytes;
use mica_accuracy::{Errors, Estimate, Metric, Point, Weight};

/// A figure that pages show of every point.
pub struct Figure {
    pub name: &'static str,
    pub meaning: &'static str,
    of: fn(&Point) -> Option<Shown>,
}

/// A figure as pages show it.
#[derive(Clone, Copy)]
pub struct Shown {
    pub estimate: Estimate,
    /// Whether noise may be all of it, so that its upper end is all that is known.
    pub is_at_most: bool,
}

const MS: f64 = 1e-6;

/// All figures with an interval, in the order in which they are shown.
pub const FIGURES: [Figure; 13] = [
    Figure {
        name: "glint time, ms",
        meaning: "Frames with glints less frames without, alternating in one run: the median of the rounds, and how far rounds \
                  and sittings spread. A median that is no greater than its spread may be noise: all that is known is the upper end.",
        of: |point| Some(of_glints(point, scaled(point.cost.glints, MS))),
    },
    Figure {
        name: "frame, ms",
        meaning: "The whole frame with glints, its passes free to overlap.",
        of: |point| Some(certain(scaled(point.cost.frame, MS))),
    },
    Figure {
        name: "time factor",
        meaning: "The frame with glints over the frame without, in each round.",
        of: |point| Some(factor(point)),
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
        of: |point| Some(certain(Estimate::exact(point.cost.tables * MS))),
    },
];

impl Figure {
    /// The figure of a point; none where it was not measured.
    pub fn of(&self, point: &Point) -> Option<Shown> {
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

impl Shown {
    /// The number that is shown, and by which rows are sorted.
    pub fn number(&self) -> f64 {
        if self.is_at_most { self.estimate.high } else { self.estimate.value }
    }

    /// It in words, without its interval.
    pub fn words(&self) -> String {
        let number = three_digits(self.number());
        if self.is_at_most { format!("at most {number}") } else { number }
    }

    /// The same with its interval.
    pub fn with_interval(&self) -> String {
        let Estimate { value, low, high } = self.estimate;
        if !self.is_at_most {
            return with_interval(self.estimate);
        }
        format!("{} [{}, {}; median {}]", self.words(), three_digits(low), three_digits(high), three_digits(value))
    }
}

/// A frame with glints over one without.
pub fn factor(point: &Point) -> Shown {
    of_glints(point, point.cost.ratio)
}

/// What frames with glints say of these.
fn of_glints(point: &Point, estimate: Estimate) -> Shown {
    Shown { estimate, is_at_most: Weight::of_time(point.cost.glints).is_at_most }
}

fn certain(estimate: Estimate) -> Shown {
    Shown { estimate, is_at_most: false }
}

fn error(point: &Point, of: impl Fn(&Errors) -> Option<Estimate>) -> Option<Shown> {
    of(point.errors.as_ref()?).map(certain)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_noise_is_shown_as_its_upper_end() {
        let estimate = Estimate { value: 5.9, low: -2.0, high: 13.9 };
        let noise = Shown { estimate, is_at_most: true };
        assert_eq!((noise.number(), noise.words()), (13.9, "at most 13.9".to_owned()));
        assert_eq!(noise.with_interval(), "at most 13.9 [-2, 13.9; median 5.9]");
        assert_eq!(
            (certain(estimate).words(), certain(estimate).with_interval()),
            ("5.9".into(), "5.9 [-2, 13.9]".into())
        );
    }
}
