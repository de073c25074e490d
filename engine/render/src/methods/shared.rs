//! Tables that materials share: one for each set of values that it depends on, however many materials use it, and no longer than
//! any does.

use super::GlintMaterial;
use mica_graph::Graph;
use std::collections::BTreeMap;

/// Tables of one kind, each by its key: all that it depends on.
pub(super) struct Shared<K, T> {
    tables: Vec<(K, T)>,
    /// What each material uses, by its index.
    used: BTreeMap<usize, K>,
}

impl<K, T> Default for Shared<K, T> {
    fn default() -> Self {
        Self { tables: Vec::new(), used: BTreeMap::new() }
    }
}

/// A table that is to be made.
pub(super) struct Wanted<'a, K, T> {
    /// A material that uses it.
    pub material: &'a GlintMaterial,
    /// What it depends on.
    pub key: K,
    /// What the material used before, if that was another.
    pub before: Option<K>,
    /// A table that nobody uses any more: its memory may be filled anew.
    pub spare: Option<T>,
}

impl<K, T> Wanted<'_, K, T> {
    /// Why it is made: what changed for the material.
    pub fn because(&self, g: &mut Graph, change: impl std::fmt::Display) {
        g.because(format!("material {}: {change}", self.material.name));
    }
}

impl<K: Copy + PartialEq, T> Shared<K, T> {
    /// The table that a material uses, as of the last update.
    pub fn of(&self, material: &GlintMaterial) -> Option<&T> {
        self.used.get(&material.index).and_then(|key| self.get(*key))
    }

    /// The table of a key, if it is there.
    pub fn get(&self, key: K) -> Option<&T> {
        self.tables.iter().find(|(of, _)| *of == key).map(|(_, table)| table)
    }

    /// What there are tables for.
    pub fn keys(&self) -> Vec<K> {
        self.tables.iter().map(|(key, _)| *key).collect()
    }

    /// Takes a table that was made in advance. The next update keeps it if it is used.
    pub fn insert(&mut self, key: K, table: T) {
        self.tables.retain(|(of, _)| *of != key);
        self.tables.push((key, table));
    }

    /// Notes what these materials use, and has `make` make what is not there, if it can. Other tables are given back.
    pub fn update(
        &mut self,
        materials: &[GlintMaterial],
        key: impl Fn(&GlintMaterial) -> Option<K>,
        mut make: impl FnMut(Wanted<K, T>) -> Option<T>,
    ) {
        let used = materials.iter().filter_map(|material| Some((material.index, key(material)?))).collect();
        let before = std::mem::replace(&mut self.used, used);
        let is_used = |(key, _): &mut (K, T)| !self.used.values().any(|used| used == key);
        let mut spare: Vec<T> = self.tables.extract_if(.., is_used).map(|(_, table)| table).collect();
        for material in materials {
            let Some(&key) = self.used.get(&material.index) else { continue };
            if self.get(key).is_none() {
                let before = before.get(&material.index).copied().filter(|before| *before != key);
                let table = make(Wanted { material, key, before, spare: spare.pop() });
                self.tables.extend(table.map(|table| (key, table)));
            }
        }
    }
}
