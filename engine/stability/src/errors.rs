//! How far what a device says is from the truth.

/// The worst of |value / truth - 1|. A value that is not finite is infinitely wrong unless the truth is the same, and so is
/// any value but 0 where the truth is 0.
pub fn worst_ratio(values: &[f32], truth: &[f64]) -> f64 {
    worst(values, truth, |value, truth| if value == truth { 0.0 } else { (value / truth - 1.0).abs() })
}

/// The worst of |value - truth|, likewise.
pub fn worst_difference(values: &[f32], truth: &[f64]) -> f64 {
    worst(values, truth, |value, truth| if value == truth { 0.0 } else { (value - truth).abs() })
}

fn worst(values: &[f32], truth: &[f64], error: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(values.len(), truth.len(), "a value for each truth");
    let errors = values.iter().zip(truth).map(|(value, truth)| error(f64::from(*value), *truth));
    errors.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

/// The share of answers that are not the truth.
pub fn share_wrong<T: PartialEq>(answers: &[T], truth: &[T]) -> f64 {
    assert_eq!(answers.len(), truth.len(), "an answer for each truth");
    let wrong = answers.iter().zip(truth).filter(|(answer, truth)| answer != truth).count();
    wrong as f64 / truth.len().max(1) as f64
}
