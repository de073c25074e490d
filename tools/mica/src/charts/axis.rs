//! Axes, most of them logarithmic: how far they reach, and where their ticks are.

use super::three_digits;

/// An axis from one value to another, over a stretch of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    range: [f64; 2],
    pixels: [f64; 2],
    /// Where 0 is, which has no logarithm; none if no value is 0.
    zero: Option<f64>,
    /// Whether equal lengths are equal differences.
    linear: bool,
}

/// A line across the chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where.
    pub at: f64,
    /// What stands beside it; none for lines in between.
    pub label: Option<String>,
}

/// An axis has ticks for this much at least, so that one point alone has an axis too.
const LEAST_RATIO: f64 = 3.0;
/// Space beyond the outermost values: a factor, and a share of the axis, of which the larger counts.
const MARGIN: f64 = 1.3;
const MARGIN_SHARE: f64 = 0.06;
/// Values below are 0.
const LEAST: f64 = 1e-30;
/// Pixels from the lower end to 0, and to where the logarithms begin.
const ZERO: [f64; 2] = [10.0, 24.0];

impl Axis {
    /// An axis on which all values that are finite lie, those that are not positive at 0.
    pub fn around(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Option<Self> {
        let (mut least, mut greatest, mut has_zero) = (f64::INFINITY, 0.0_f64, false);
        for value in values.filter(|value| value.is_finite() && *value < 1e30) {
            if value > LEAST {
                (least, greatest) = (least.min(value), greatest.max(value));
            } else {
                has_zero = true;
            }
        }
        if greatest == 0.0 {
            if !has_zero {
                return None;
            }
            (least, greatest) = (1.0, 1.0);
        }
        let margin = MARGIN.max((greatest / least).powf(MARGIN_SHARE));
        let (mut low, mut high) = (least / margin, greatest * margin);
        if high / low < LEAST_RATIO {
            let wider = (LEAST_RATIO / (high / low)).sqrt();
            (low, high) = (low / wider, high * wider);
        }
        let range = [low, high];
        let [zero, start] = ZERO.map(|away| pixels[0] + away * (pixels[1] - pixels[0]).signum());
        Some(if has_zero {
            Self { range, pixels: [start, pixels[1]], zero: Some(zero), linear: false }
        } else {
            Self { range, pixels, zero: None, linear: false }
        })
    }

    /// The same of equal differences, which reaches somewhat beyond the values.
    pub fn linear_around(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Option<Self> {
        let (least, greatest) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let margin = (MARGIN_SHARE * (greatest - least)).max(0.01 * greatest.abs()).max(LEAST);
        (least <= greatest).then_some(Self {
            range: [least - margin, greatest + margin],
            pixels,
            zero: None,
            linear: true,
        })
    }

    /// Where 0 is, if a value is.
    pub const fn zero(&self) -> Option<f64> {
        self.zero
    }

    /// Where a value lies, also beyond the ends; what is not positive lies at 0, or at the lower end.
    pub fn at(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if self.linear {
            return self.pixels[0] + (value - low) / (high - low) * (self.pixels[1] - self.pixels[0]);
        }
        if value <= LEAST {
            return self.zero.unwrap_or(self.pixels[0]);
        }
        let share = (value / low).ln() / (high / low).ln();
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    /// The same, at the nearer end if it is beyond.
    pub fn within(&self, value: f64) -> f64 {
        let low = if self.zero.is_some() && value <= LEAST { value } else { self.range[0] };
        self.at(value.clamp(low, self.range[1]))
    }

    /// Whether a value lies between the ends.
    pub fn holds(&self, value: f64) -> bool {
        (self.range[0]..=self.range[1]).contains(&value)
    }

    /// A line for every whole multiple of a power of ten, and labels on so many of them as can be read.
    pub fn ticks(&self) -> Vec<Tick> {
        let [low, high] = self.range;
        if self.linear {
            // Five or so, a round number apart.
            let rough = (high - low) / 5.0;
            let power = 10_f64.powf(rough.log10().floor());
            let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power).into_iter().find(|step| *step >= rough);
            let step = step.unwrap_or(rough);
            let numbers = (low / step).ceil() as i64..=(high / step).floor() as i64;
            let value = |number: i64| number as f64 * step;
            let tick = |number| Tick { at: self.at(value(number)), label: Some(three_digits(value(number))) };
            return numbers.map(tick).collect();
        }
        let decades = low.log10().floor() as i32..=high.log10().floor() as i32;
        // Over many decades, the decades alone.
        let multiples: &[u32] = if (high / low).log10() > 7.0 { &[1] } else { &[1, 2, 3, 4, 5, 6, 7, 8, 9] };
        let all: Vec<(u32, f64)> = decades
            .flat_map(|decade| multiples.iter().map(move |multiple| (*multiple, decimal(*multiple, decade))))
            .filter(|(_, value)| self.holds(*value))
            .collect();
        let labelled: &[u32] = [&[1][..], &[1, 3], &[1, 2, 5], &[1, 2, 3, 5, 7], multiples]
            .into_iter()
            .find(|labelled| all.iter().filter(|(multiple, _)| labelled.contains(multiple)).count() >= 3)
            .unwrap_or(multiples);
        let stride = all.iter().filter(|(multiple, _)| *multiple == 1).count().div_ceil(8).max(1);
        let mut decade = 0;
        all.iter()
            .map(|(multiple, value)| {
                decade += usize::from(*multiple == 1);
                let shown = labelled.contains(multiple) && (labelled.len() > 1 || decade % stride == 0 || stride == 1);
                Tick { at: self.at(*value), label: shown.then(|| label(*value)) }
            })
            .collect()
    }
}

/// A multiple of a power of ten, as the decimal says it: products of powers would be an ulp off.
fn decimal(multiple: u32, exponent: i32) -> f64 {
    format!("{multiple}e{exponent}").parse().unwrap_or(f64::NAN)
}

fn label(value: f64) -> String {
    if (1e-3..1e6).contains(&value) {
        return three_digits(value);
    }
    let exponent = (value.log10() + 1e-9).floor() as i32;
    let multiple = (value / 10_f64.powi(exponent)).round();
    let power: String = exponent.to_string().chars().map(superscript).collect();
    if multiple == 1.0 { format!("10{power}") } else { format!("{multiple}·10{power}") }
}

const fn superscript(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_axes_have_round_ticks() {
        let axis = Axis::linear_around([0.98, 1.13].into_iter(), [0.0, 100.0]).expect("an axis");
        let labels: Vec<String> = axis.ticks().into_iter().filter_map(|tick| tick.label).collect();
        assert_eq!(labels, ["1", "1.05", "1.1"]);
        assert!((axis.at(1.055) - 50.0).abs() < 1e-9 && axis.holds(0.98) && !axis.holds(0.9));
        assert_eq!(Axis::linear_around(std::iter::empty(), [0.0, 1.0]), None);
    }

    fn labels(values: &[f64]) -> Vec<String> {
        let axis = Axis::around(values.iter().copied(), [0.0, 100.0]).expect("an axis");
        axis.ticks().into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn labels_are_round_numbers_within_the_axis_and_enough_of_them() {
        assert_eq!(labels(&[3.0, 9000.0]), ["10", "100", "1000", "10,000"]);
        assert_eq!(labels(&[0.02, 0.4]), ["0.03", "0.1", "0.3"]);
        assert_eq!(labels(&[5.0]), ["3", "5", "7"]);
        assert_eq!(labels(&[2e-9, 3e-7]), ["3·10⁻⁹", "10⁻⁸", "3·10⁻⁸", "10⁻⁷", "3·10⁻⁷"]);
        for (low, high) in [(1e-12, 1e12), (1.0, 1.0001), (0.9, 1.1), (7.7, 8.8), (1e-29, 1e29)] {
            let found = labels(&[low, high]);
            assert!((3..=10).contains(&found.len()), "{low} to {high}: {found:?}");
        }
    }

    #[test]
    fn values_lie_where_their_logarithm_says() {
        let axis = Axis::around([1.0, 100.0].into_iter(), [10.0, 210.0]).expect("an axis");
        assert!((axis.at(10.0) - 110.0).abs() < 1e-9);
        assert_eq!((axis.within(1e9), axis.within(-1.0), axis.within(0.0)), (210.0, 10.0, 10.0));
        let tick = axis.ticks().into_iter().find(|tick| tick.label.as_deref() == Some("10")).expect("a tick");
        assert!((tick.at - 110.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_drawn_makes_no_axis() {
        assert_eq!(Axis::around([f64::NAN, f64::INFINITY, 1e300].into_iter(), [0.0, 1.0]), None);
    }

    #[test]
    fn zero_lies_apart_from_logarithms_and_inside_the_chart() {
        for pixels in [[10.0, 210.0], [210.0, 10.0]] {
            let axis = Axis::around([0.0, -2.0, 1.0, 100.0].into_iter(), pixels).expect("an axis");
            let zero = axis.zero().expect("a place for 0");
            assert_eq!((axis.at(0.0), axis.within(-2.0)), (zero, zero));
            let [first, least] = [zero, axis.at(1.0)].map(|at| (at - pixels[0]).abs());
            assert!(first > 5.0 && least > first + 10.0, "{first} {least}");
        }
        assert!(Axis::around([0.0].into_iter(), [0.0, 100.0]).is_some_and(|axis| !axis.ticks().is_empty()));
        assert_eq!(Axis::around([1.0].into_iter(), [0.0, 100.0]).and_then(|axis| axis.zero()), None);
    }
}
