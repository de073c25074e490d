//! Points of error against time weighed against each other: the front of those that nothing beats in both, and what a
//! budget or a wanted error chooses.

/// The points that no other beats: of pairs of time and error, those for which no other is as fast and more accurate, or
/// as accurate and faster. By time, the fastest first, so that errors fall strictly; of equal points only the first stands
/// for them. A pair with a time or an error that is not finite beats nothing and is not in the front. Times may be below 0:
/// a difference of two noisy frames can be.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let finite = |index: &usize| points[*index].0.is_finite() && points[*index].1.is_finite();
    let mut by_time: Vec<usize> = (0..points.len()).filter(finite).collect();
    // Adding 0 makes -0 and 0 one number: `total_cmp` tells them apart. The sort is stable: the first of equals stays first.
    by_time.sort_by(|&a, &b| {
        let key = |index: usize| (points[index].0 + 0.0, points[index].1 + 0.0);
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut least = f64::INFINITY;
    by_time.retain(|&index| {
        let better = points[index].1 < least;
        least = least.min(points[index].1);
        better
    });
    by_time
}

#[cfg(test)]
mod tests {
    use super::front;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    #[test]
    fn of_points_of_one_time_the_most_accurate_and_of_one_error_the_fastest_is_in_the_front() {
        assert_eq!(front(&[(1.0, 0.5), (1.0, 0.4), (2.0, 0.4), (2.0, 0.1)]), [1, 3]);
    }

    #[test]
    fn equal_points_are_represented_by_the_first_whatever_the_sign_of_their_zeros() {
        assert_eq!(front(&[(3.0, 0.2), (1.0, 0.2), (1.0, 0.2)]), [1]);
        assert_eq!(front(&[(0.0, 0.0), (-0.0, -0.0)]), [0]);
        assert_eq!(front(&[(0.0, 0.2), (-0.0, 0.1)]), [1]);
    }

    #[test]
    fn points_that_are_not_finite_beat_nothing() {
        let nan = f64::NAN;
        let points = [(nan, 0.0), (0.0, nan), (f64::NEG_INFINITY, 0.0), (0.0, f64::NEG_INFINITY), (f64::INFINITY, 0.0)];
        assert_eq!(front(&points), [0_usize; 0]);
        assert_eq!(front(&[points.as_slice(), &[(7.0, 0.7)]].concat()), [5]);
        assert_eq!(front(&[]), [0_usize; 0]);
    }

    /// Few values, so that ties are common.
    fn coordinate(random: &mut Pcg64) -> f64 {
        match random.next_u32() % 10 {
            0 => f64::NAN,
            1 => f64::INFINITY,
            number => f64::from(number) - 4.0,
        }
    }

    #[test]
    fn the_front_is_what_its_definition_says() {
        let mut random = Pcg64::new(1, 1);
        for _ in 0..2000 {
            let count = random.next_u32() % 12;
            let points: Vec<_> = (0..count).map(|_| (coordinate(&mut random), coordinate(&mut random))).collect();
            let is_finite = |index: usize| points[index].0.is_finite() && points[index].1.is_finite();
            let beats = |a: usize, b: usize| {
                let ((time_a, error_a), (time_b, error_b)) = (points[a], points[b]);
                let worse_in_none = is_finite(a) && time_a <= time_b && error_a <= error_b;
                worse_in_none && (time_a < time_b || error_a < error_b || a < b)
            };
            let unbeaten = |&index: &usize| is_finite(index) && !(0..points.len()).any(|other| beats(other, index));
            let mut expected: Vec<usize> = (0..points.len()).filter(unbeaten).collect();
            expected.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0));
            let chosen = front(&points);
            assert_eq!(chosen, expected, "{points:?}");
            assert!(chosen.windows(2).all(|w| points[w[0]].0 < points[w[1]].0 && points[w[0]].1 > points[w[1]].1));
        }
    }
}
