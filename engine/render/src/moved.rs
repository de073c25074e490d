//! Instances that are not where something knows them to be.

use glam::DAffine3;
use std::collections::BTreeMap;

/// The instances that moved, each with the place it had before: one that is moved back has not moved.
#[derive(Default)]
pub(crate) struct Moved(BTreeMap<usize, DAffine3>);

impl Moved {
    /// Takes note of a move.
    pub fn note(&mut self, instance: usize, from: DAffine3, to: DAffine3) {
        if *self.0.entry(instance).or_insert(from) == to {
            self.0.remove(&instance);
        }
    }

    /// Which they are, in order.
    pub fn instances(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.keys().copied()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Why something is made again after instances moved; nothing where none did.
    pub fn why(&self) -> Option<String> {
        match self.count() {
            0 => None,
            1 => self.instances().next().map(|index| format!("instance {index} moved")),
            count => Some(format!("{count} instances moved")),
        }
    }

    /// Takes note that all are known to be where they are.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}
