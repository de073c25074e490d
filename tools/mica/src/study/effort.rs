//! How much work is spent on a point: samples of references, frames of paths, rounds of times.

/// How much work is spent on measuring. What decides a figure of error is fixed: only the number of rounds follows the
/// clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Parts along each side of a pixel, in the two halves of a reference.
    pub parts: [u32; 2],
    /// Frames of the camera's path; 0 or 1 leaves it out.
    pub path_frames: u32,
    /// Parts along each side of a pixel in the reference's own path.
    pub path_parts: u32,
    /// How often a point is timed, with all others of its place in between: times of one sitting are more alike than those
    /// of two.
    pub sittings: usize,
    /// Seconds that the rounds of a sitting may take together, as far as the fewest rounds fit into them.
    pub seconds: f64,
    /// Fewest and most rounds of a sitting, each a frame with glints and one without.
    pub rounds: [u32; 2],
    /// Frames whose passes are timed in isolation.
    pub isolated: u32,
}

impl Effort {
    /// For minutes.
    pub fn quick() -> Self {
        Self { parts: [4, 5], path_frames: 3, path_parts: 2, sittings: 3, seconds: 0.4, rounds: [1, 3], isolated: 1 }
    }

    /// For hours.
    pub fn full() -> Self {
        Self { parts: [8, 9], path_frames: 16, path_parts: 4, sittings: 3, seconds: 7.0, rounds: [2, 5], isolated: 3 }
    }

    /// Words that go into every line: figures of another effort are others.
    pub fn describe(&self) -> String {
        format!("{}; {}", self.of_reference(), self.of_times())
    }

    /// The part of it that decides how times are taken.
    pub fn of_times(&self) -> String {
        let Self { sittings, seconds, rounds: [fewest, most], isolated, .. } = self;
        format!("{sittings} sittings of {fewest} to {most} rounds within {seconds} s, {isolated} isolated")
    }

    /// The part of it that decides what a reference is.
    pub fn of_reference(&self) -> String {
        let Self { parts: [a, b], path_frames, path_parts, .. } = self;
        format!("reference of {a}x{a} and {b}x{b} parts, path of {path_frames} frames of {path_parts}x{path_parts}")
    }
}

#[cfg(test)]
mod tests {
    use super::Effort;

    #[test]
    fn no_two_efforts_are_described_alike() {
        let quick = Effort::quick();
        let of_reference = [
            Effort { parts: [4, 6], ..quick.clone() },
            Effort { path_frames: 5, ..quick.clone() },
            Effort { path_parts: 3, ..quick.clone() },
        ];
        let of_times = [
            Effort { seconds: 1.0, ..quick.clone() },
            Effort { rounds: [2, 7], ..quick.clone() },
            Effort { sittings: 1, ..quick.clone() },
            Effort { isolated: 2, ..quick.clone() },
        ];
        assert!(of_reference.iter().chain(&of_times).all(|other| other.describe() != quick.describe()));
        assert!(of_reference.iter().all(|other| other.of_reference() != quick.of_reference()));
        // Times are measured anew against the reference that is there.
        assert!(of_times.iter().all(|other| other.of_reference() == quick.of_reference()));
    }
}
