//! A plan as text: what runs when, what waits for what and why, and where every byte lies.

use crate::declare::Pass;
use crate::plan::{Barrier, Plan, Step, Usage};
use crate::resource::{Extent, ResourceId};
use crate::shader::{Access, Stages};
use std::collections::BTreeSet;
use std::fmt;

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let barriers = self.steps.iter().filter(|step| matches!(step, Step::Synchronize { .. })).count();
        writeln!(
            f,
            "{}, {} culled, {}, {}",
            count(self.passes.len(), "pass", "passes"),
            self.culled.len(),
            count(barriers, "barrier", "barriers"),
            count(self.resources.len(), "resource", "resources"),
        )?;
        self.write_steps(f)?;
        self.write_resources(f)?;
        writeln!(f, "shared {} bytes, side by side {} bytes", self.shared_bytes, self.unshared_bytes)
    }
}

impl Plan {
    fn write_steps(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.passes.iter().map(|pass| pass.name.chars().count()).max().unwrap_or(0);
        writeln!(f, "\nsteps")?;
        for step in &self.steps {
            match step {
                Step::Synchronize { barrier, discard } => self.write_barrier(f, barrier, discard)?,
                Step::Run(index) => write_pass(f, *index, &self.passes[*index], width)?,
            }
        }
        if !self.culled.is_empty() {
            writeln!(f, "\nculled: {}", self.culled.join(", "))?;
        }
        Ok(())
    }

    fn write_barrier(&self, f: &mut fmt::Formatter<'_>, barrier: &Barrier, discard: &[ResourceId]) -> fmt::Result {
        write!(f, "     barrier")?;
        if !barrier.from_stages.is_empty() {
            write!(f, " after {}", scope(barrier.from_stages, &barrier.from_access))?;
        }
        writeln!(f, " before {}", scope(barrier.to_stages, &barrier.to_access))?;
        for why in &barrier.why {
            writeln!(f, "       {why}")?;
        }
        if !discard.is_empty() {
            let name = |id: &ResourceId| self.resources.iter().find(|usage| usage.resource.id == *id);
            let names: Vec<&str> = discard.iter().filter_map(name).map(|usage| usage.resource.name.as_str()).collect();
            writeln!(f, "       begins {}", names.join(", "))?;
        }
        Ok(())
    }

    fn write_resources(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = vec![["resource", "bytes", "lifetime", "passes", "placed", ""].map(str::to_owned)];
        for usage in &self.resources {
            let (bytes, placed) = match usage.placement {
                Some(place) => (place.bytes, format!("{}..{}", place.offset, place.offset + place.bytes)),
                None => (usage.bytes, "own memory".to_owned()),
            };
            let exported = if self.exports.contains(&usage.resource.id) { "exported" } else { "" };
            table.push([
                usage.resource.name.clone(),
                bytes.to_string(),
                usage.resource.lifetime.name().to_owned(),
                passes(usage),
                placed,
                exported.to_owned(),
            ]);
        }
        let width = |column: usize| table.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let [name, bytes, lifetime, passes, placed] = [0, 1, 2, 3, 4].map(width);
        writeln!(f)?;
        for row in &table {
            let line = format!(
                "{:name$}  {:>bytes$}  {:lifetime$}  {:passes$}  {:placed$}  {}",
                row[0], row[1], row[2], row[3], row[4], row[5]
            );
            writeln!(f, "{}", line.trim_end())?;
        }
        writeln!(f)
    }
}

fn write_pass(f: &mut fmt::Formatter<'_>, index: usize, pass: &Pass, width: usize) -> fmt::Result {
    let names = |wanted: fn(Access) -> bool| {
        let mut names: Vec<&str> = Vec::new();
        for used in pass.uses.iter().filter(|used| wanted(used.access)) {
            if !names.contains(&used.resource.name.as_str()) {
                names.push(&used.resource.name);
            }
        }
        names.join(", ")
    };
    let (reads, writes) = (names(Access::reads), names(Access::writes));
    let mut line = format!("{index:3}  {:width$}", pass.name);
    if !reads.is_empty() {
        line += &format!("  reads {reads}");
    }
    if !writes.is_empty() {
        line += &format!("  writes {writes}");
    }
    if !pass.why.is_empty() {
        line += &format!("  ({})", pass.why);
    }
    writeln!(f, "{}", line.trim_end())
}

/// `compute, transfer (StorageWrite, TransferRead)`; no accesses where the order alone matters.
fn scope(stages: Stages, accesses: &BTreeSet<Access>) -> String {
    if accesses.is_empty() {
        return stages.to_string();
    }
    let accesses: Vec<String> = accesses.iter().map(|access| format!("{access:?}")).collect();
    format!("{stages} ({})", accesses.join(", "))
}

fn passes(usage: &Usage) -> String {
    match usage.passes {
        (first, last) if first == last => first.to_string(),
        (first, last) => format!("{first}-{last}"),
    }
}

impl fmt::Display for Stages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |stage| match stage {
            Self::COMPUTE => "compute",
            Self::VERTEX => "vertex",
            Self::FRAGMENT => "fragment",
            Self::COLOR_OUTPUT => "color output",
            Self::DEPTH_TEST => "depth test",
            Self::TRANSFER => "transfer",
            Self::BUILD => "build",
            Self::INDIRECT => "indirect",
            _ => "unknown",
        };
        let names: Vec<&str> = self.iter().map(name).collect();
        f.write_str(if names.is_empty() { "nothing" } else { "" })?;
        f.write_str(&names.join(", "))
    }
}

impl fmt::Display for Extent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)?;
        if self.depth != 1 {
            write!(f, "x{}", self.depth)?;
        }
        Ok(())
    }
}
