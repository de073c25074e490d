//! What a command could not measure: said as soon as it is known, and counted at the end.

use crate::error::Failure;

/// Places and points that others go on without.
#[derive(Debug, Default)]
pub struct LeftOut {
    number: usize,
    /// The greatest of their exit codes.
    code: u8,
}

impl LeftOut {
    /// Says why something is left out.
    pub fn add(&mut self, what: &str, failure: &Failure) {
        log::warn!("{what} is left out: {failure}");
        self.number += 1;
        self.code = self.code.max(failure.code);
    }

    /// How the command ends after all else went well.
    ///
    /// # Errors
    /// If anything was left out, without the reasons once more.
    pub fn end(&self) -> Result<(), Failure> {
        if self.number == 0 {
            return Ok(());
        }
        let message = format!("{} left out, for the reasons above; all else was measured", self.number);
        Err(Failure::with_code(self.code, message))
    }
}

#[cfg(test)]
mod tests {
    use super::LeftOut;
    use crate::error::Failure;

    #[test]
    fn the_end_has_the_worst_code_and_counts_all() {
        let mut left_out = LeftOut::default();
        assert_eq!(left_out.end(), Ok(()));
        for code in [2, 4, 3] {
            left_out.add("plane", &Failure::with_code(code, "why"));
        }
        let end = left_out.end().expect_err("something was left out");
        assert_eq!((end.code, end.to_string().split(' ').next()), (4, Some("3")));
    }
}
