//! A point of a study: one method with one rung of its ladder at one place, its error and its time; and the figures by which
//! points are compared.
//!
//! Points are lines of JSON, so that a study can be appended to, resumed and drawn anew. What decides a figure is in the
//! line: a point is worth keeping only while scene, light, size, method, settings, device, build and effort are the same.

use serde::{Deserialize, Deserializer, Serialize};

/// What lines of points say of themselves.
pub const POINT_SCHEMA: &str = "mica-point-1";
/// What lines of references say of themselves.
pub const REFERENCE_SCHEMA: &str = "mica-reference-1";

/// A figure and how sure it is: an error with its interval of 95 %, or the median of times with their spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The figure; not a number, and `null` in JSON, where it is not defined, as a ratio to nothing.
    #[serde(deserialize_with = "number_or_null")]
    pub value: f64,
    /// Lower end; not a number where nothing is known of how sure the figure is.
    #[serde(deserialize_with = "number_or_null")]
    pub low: f64,
    /// Upper end, likewise.
    #[serde(deserialize_with = "number_or_null")]
    pub high: f64,
}

/// JSON has no word for what is not a number: it is written as `null`, and read back here.
fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Where points can be compared with each other: what is seen, and at what size.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Place {
    /// An embedded scene or the path of a file.
    pub scene: String,
    /// Which of the scene's lights shine: `own` (all), `lights` (no environment) or `environment` (no lights).
    pub lighting: String,
    /// Pixels along x and y.
    pub size: [u32; 2],
}

/// Who measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The device, as its driver calls it.
    pub device: String,
    /// The driver and its version.
    pub driver: String,
    /// Who answered questions about occlusion: `none`, `bvh` or `ray-query`.
    pub occlusion: String,
    /// The program's version and commit.
    pub build: String,
}

/// Bytes on the device under one name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bytes {
    /// The image, buffer or structure.
    pub name: String,
    /// Its bytes.
    pub bytes: u64,
    /// `frame`, `settings` or `scene`: what has to change for it to be made anew.
    pub lifetime: String,
}

/// What a point costs. Times are in nanoseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// `gpu` (timestamps) or `cpu` (processor time of the process, where the device is the processor).
    pub clock: String,
    /// What the figures are made of: the sittings, which lie apart in time, each with its rounds, each round the nanoseconds
    /// of a frame with glints and of one without.
    pub sittings: Vec<Vec<[f64; 2]>>,
    /// Overlapped frame with glints less overlapped frame without, paired in each round. May be below 0 within its spread.
    pub glints: Estimate,
    /// The overlapped frame with glints.
    pub frame: Estimate,
    /// With glints over without, paired in each round.
    pub ratio: Estimate,
    /// Each pass of a frame in isolation.
    pub passes: Vec<(String, Estimate)>,
    /// Tables made when a setting or the environment changes.
    #[serde(deserialize_with = "number_or_null")]
    pub tables: f64,
    /// What was made once, before the first frame.
    #[serde(deserialize_with = "number_or_null")]
    pub precomputation: f64,
    /// Bytes on the device that a frame without glints does not need.
    pub glint_bytes: u64,
    /// All of them.
    pub memory: Vec<Bytes>,
}

/// Errors among pixels whose footprint holds so many flakes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BandErrors {
    /// Flakes expected in a footprint, lit or not: at least the first and below the second, which is absent in the last band.
    pub flakes: (f64, Option<f64>),
    /// Pixels.
    pub pixels: usize,
    /// Mean over the reference's.
    pub mean_ratio: Estimate,
    /// Variance within tiles over the reference's.
    pub variance_ratio: Estimate,
    /// Wasserstein-1 distance over the reference's mean.
    pub w1: Estimate,
}

/// Errors along a path of the camera in steps of a fraction of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathErrors {
    /// Energy of the differences between frames, over the reference's.
    pub energy_ratio: Estimate,
    /// The same, each energy first taken over the variance of its own pixels: above 1, sparkle changes faster than it should.
    pub flicker: Estimate,
}

/// How far a picture is from its reference; `errors.rs` defines each figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Pixels that see glinting material and nothing else, in which both pictures are finite: those of all figures but FLIP.
    pub pixels: usize,
    /// Pixels left out as a channel is not finite.
    pub left_out: usize,
    /// Mean luminance of the glints over the reference's.
    pub mean_ratio: Estimate,
    /// Variance of the glints' luminance within tiles, about their means, over the reference's.
    pub variance_ratio: Estimate,
    /// Wasserstein-1 distance of the glints' luminance over the reference's mean: that of the bands, by their pixels; no number
    /// where there is no band.
    pub w1: Estimate,
    /// Relative mean square error of the glints' pixels.
    pub rel_mse: Estimate,
    /// Mean FLIP of the tone-mapped pictures, all of them.
    pub flip: Estimate,
    /// Mean HDR-FLIP of the pictures, all of them.
    pub hdr_flip: Estimate,
    /// Mean luminance of the pixels that glint over that of the reference's; a pixel glints that is twice as bright as its tile.
    pub energy_per_glint: Estimate,
    /// By scale.
    pub bands: Vec<BandErrors>,
    /// Over time, where a path was rendered.
    pub path: Option<PathErrors>,
}

/// A line of `points.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// [`POINT_SCHEMA`].
    pub schema: String,
    /// What is seen.
    pub place: Place,
    /// The method.
    pub method: String,
    /// The rung of its ladder.
    pub rung: String,
    /// What the rung sets, as keys and values.
    pub set: Vec<(String, String)>,
    /// What the method claims: `pixels`, `distribution`, `mean` or `look`.
    pub claim: String,
    /// Who measured.
    pub machine: Machine,
    /// How much work was spent on measuring.
    pub effort: String,
    /// Letters that change with anything that is seen of the scene and its environment; empty where nobody asked.
    #[serde(default)]
    pub content: String,
    /// The command line that renders this point.
    pub command: String,
    /// Its error; none where only time was measured.
    pub errors: Option<Errors>,
    /// Its cost.
    pub cost: Cost,
    /// The tone-mapped picture, and the map of its FLIP, as paths from the folder of the study.
    pub pictures: Option<[String; 2]>,
}

/// A line of `references.jsonl`: what the points of a place are compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLine {
    /// [`REFERENCE_SCHEMA`].
    pub schema: String,
    /// What is seen.
    pub place: Place,
    /// Who rendered it.
    pub machine: Machine,
    /// How much work was spent on it.
    pub effort: String,
    /// As in [`Point`].
    #[serde(default)]
    pub content: String,
    /// Samples of each pixel.
    pub samples: u32,
    /// Standard deviation of a pixel's glints about what they converge to, over their mean.
    #[serde(deserialize_with = "number_or_null")]
    pub noise: f64,
    /// What a method has that is right but has flakes of its own: the reference's method with another seed.
    pub floor: Errors,
    /// The tone-mapped picture, and the .exr of radiance and variance, as paths from the folder of the study.
    pub pictures: [String; 2],
}

/// A figure of which less is better, 0 at best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Metric {
    /// Wasserstein-1 distance: the distribution of pixels.
    W1,
    /// Mean: |ratio - 1|.
    Mean,
    /// Variance: |ratio - 1|.
    Variance,
    /// Relative mean square error: the very pixels.
    RelMse,
    /// FLIP: the picture as seen.
    Flip,
    /// HDR-FLIP: the picture as seen at any exposure.
    HdrFlip,
    /// Flicker over time: |ratio - 1|.
    Flicker,
}

impl Metric {
    /// All of them, the one that compares methods of every claim first.
    pub const ALL: [Self; 7] =
        [Self::W1, Self::Mean, Self::Variance, Self::RelMse, Self::Flip, Self::HdrFlip, Self::Flicker];

    /// Its name on command lines and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::W1 => "w1",
            Self::Mean => "mean",
            Self::Variance => "variance",
            Self::RelMse => "relmse",
            Self::Flip => "flip",
            Self::HdrFlip => "hdr-flip",
            Self::Flicker => "flicker",
        }
    }

    /// What an axis says.
    pub const fn label(self) -> &'static str {
        match self {
            Self::W1 => "Wasserstein-1 distance of pixel luminance / mean",
            Self::Mean => "|mean / reference's - 1|",
            Self::Variance => "|variance / reference's - 1|",
            Self::RelMse => "relMSE of pixels",
            Self::Flip => "mean FLIP",
            Self::HdrFlip => "mean HDR-FLIP",
            Self::Flicker => "|flicker / reference's - 1|",
        }
    }

    /// The error of a picture by this measure; none where it was not measured.
    pub fn of(self, errors: &Errors) -> Option<Estimate> {
        Some(match self {
            Self::W1 => errors.w1,
            Self::Mean => errors.mean_ratio.away_from_one(),
            Self::Variance => errors.variance_ratio.away_from_one(),
            Self::RelMse => errors.rel_mse,
            Self::Flip => errors.flip,
            Self::HdrFlip => errors.hdr_flip,
            Self::Flicker => errors.path?.flicker.away_from_one(),
        })
    }
}

impl Estimate {
    /// A figure that is not defined.
    pub const UNKNOWN: Self = Self { value: f64::NAN, low: f64::NAN, high: f64::NAN };

    /// A figure that is exact.
    pub const fn exact(value: f64) -> Self {
        Self { value, low: value, high: value }
    }

    /// The same in another unit.
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: self.value * factor, low: self.low * factor, high: self.high * factor }
    }

    /// The same of what cannot be below 0.
    pub(crate) fn at_least_zero(self) -> Self {
        let cut = |value: f64| if value < 0.0 { 0.0 } else { value };
        Self { value: cut(self.value), low: cut(self.low), high: cut(self.high) }
    }

    /// |value - 1|, with what that says of the interval.
    fn away_from_one(self) -> Self {
        let Self { value, low, high } = self;
        let ends = [(low - 1.0).abs(), (high - 1.0).abs()];
        let least = if (low..=high).contains(&1.0) { 0.0 } else { ends[0].min(ends[1]) };
        Self { value: (value - 1.0).abs(), low: least, high: ends[0].max(ends[1]) }
    }
}

impl Point {
    /// Whether another line measures the same thing in the same way, so that this one need not be measured again.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let key = |point: &'_ Self| {
            let Self { schema, place, method, set, machine, effort, content, .. } = point.clone();
            (schema, place, method, set, machine, effort, content)
        };
        key(self) == key(other)
    }

    /// Words for people: the method, and its rung where it has several.
    pub fn name(&self) -> String {
        if self.method == self.rung { self.method.clone() } else { format!("{}, {}", self.method, self.rung) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_ratios_are_distances_from_one() {
        let around = Estimate { value: 0.98, low: 0.9, high: 1.05 }.away_from_one();
        assert!((around.value - 0.02).abs() < 1e-12 && around.low == 0.0 && (around.high - 0.1).abs() < 1e-12);
        let above = Estimate { value: 1.3, low: 1.2, high: 1.5 }.away_from_one();
        assert!((above.low - 0.2).abs() < 1e-12 && (above.high - 0.5).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_a_number_survives_a_line_of_json() {
        let estimate = Estimate { value: f64::INFINITY, low: f64::NAN, high: 0.1 + 0.2 };
        let line = serde_json::to_string(&estimate).expect("a line");
        assert_eq!(line, r#"{"value":null,"low":null,"high":0.30000000000000004}"#);
        let read: Estimate = serde_json::from_str(&line).expect("an estimate");
        assert!(read.value.is_nan() && read.low.is_nan() && read.high == estimate.high, "{read:?}");
        assert!(serde_json::from_str::<Estimate>(r#"{"value":1.0,"low":1.0}"#).is_err(), "a missing figure is no null");
    }
}
