//! A count of what was run and what was skipped, and why: a skip is a result.

/// What came of the cases of a test whose cases may be missing on this machine.
#[derive(Debug, Default)]
pub struct Tally {
    ran: Vec<String>,
    skipped: Vec<(String, String)>,
}

impl Tally {
    /// A case that was run.
    pub fn ran(&mut self, case: impl Into<String>) {
        self.ran.push(case.into());
    }

    /// A case that was not run, and why.
    pub fn skipped(&mut self, case: impl Into<String>, why: impl Into<String>) {
        self.skipped.push((case.into(), why.into()));
    }

    /// Prints the count, with each skip's reason, and fails if fewer than `least` cases were run.
    pub fn finish(self, what: &str, least: usize) {
        println!("{what}: {} ran, {} skipped", self.ran.len(), self.skipped.len());
        for (case, why) in &self.skipped {
            println!("  skipped {case}: {why}");
        }
        assert!(self.ran.len() >= least, "{what}: only {} of at least {least} cases ran", self.ran.len());
    }
}

#[cfg(test)]
mod tests {
    use super::Tally;

    #[test]
    #[should_panic(expected = "only 1 of at least 2")]
    fn too_many_skips_fail_the_test() {
        let mut tally = Tally::default();
        tally.ran("one");
        tally.skipped("two", "it is not there");
        tally.finish("cases", 2);
    }
}
