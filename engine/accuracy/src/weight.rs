//! What stands for a figure where figures are weighed against each other, so that nothing wins by noise.

use crate::Estimate;

/// What stands for a figure that cannot be below 0, in fronts, charts and choices alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight {
    /// What is compared.
    pub value: f64,
    /// Whether all that is known is that the figure lies no higher.
    pub is_at_most: bool,
}

impl Weight {
    /// Of a time: itself if it is greater than its spread, from the least to the greatest. What is not may be noise, and the upper
    /// end stands for it.
    pub fn of_time(time: Estimate) -> Self {
        Self::of(time, time.value <= time.high - time.low)
    }

    /// Of an error: itself, or the upper end where its interval reaches down to 0.
    pub fn of_error(error: Estimate) -> Self {
        Self::of(error, error.low <= 0.0)
    }

    /// Ends that are not known (not numbers) make no noise of a figure, and what is no number stays none.
    fn of(Estimate { value, high, .. }: Estimate, may_be_noise: bool) -> Self {
        if value.is_nan() {
            return Self { value, is_at_most: false };
        }
        let end = if may_be_noise { value.max(high) } else { value };
        Self { value: end.max(0.0), is_at_most: may_be_noise && end > 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate([low, value, high]: [f64; 3]) -> Estimate {
        Estimate { value, low, high }
    }

    #[test]
    fn a_time_no_greater_than_its_spread_is_at_most_its_upper_end() {
        let of = |ends| {
            let Weight { value, is_at_most } = Weight::of_time(estimate(ends));
            (value, is_at_most)
        };
        assert_eq!(of([3.0, 5.0, 7.0]), (5.0, false));
        assert_eq!(of([3.0, 5.0, 8.0]), (8.0, true), "as great as its spread");
        // Whether the spread of a little time just reaches 0 or just does not is noise itself: neither wins by it.
        assert_eq!([of([-0.1, 8.0, 16.0]), of([0.3, 8.5, 16.7])], [(16.0, true), (16.7, true)]);
        assert_eq!(of([-3.0, -2.0, 4.0]), (4.0, true));
        assert_eq!(of([-3.0, -2.0, -1.0]), (0.0, false), "less than nothing is nothing");
        assert_eq!([of([5.0; 3]), of([0.0; 3])], [(5.0, false), (0.0, false)]);
    }

    #[test]
    fn an_error_whose_interval_reaches_0_is_at_most_its_upper_end() {
        let of = |ends| {
            let Weight { value, is_at_most } = Weight::of_error(estimate(ends));
            (value, is_at_most)
        };
        assert_eq!(of([0.01, 0.02, 0.09]), (0.02, false));
        assert_eq!(of([0.0, 0.02, 0.09]), (0.09, true));
        assert_eq!(of([0.0; 3]), (0.0, false), "exact");
    }

    #[test]
    fn unknown_ends_change_nothing_and_an_unknown_figure_stays_unknown() {
        let nan = f64::NAN;
        for weight in [Weight::of_time, Weight::of_error] {
            assert_eq!(weight(estimate([nan, 2.0, nan])), Weight { value: 2.0, is_at_most: false });
            assert!(weight(estimate([-1.0, nan, 1.0])).value.is_nan());
        }
    }
}
