//! Seeded numbers.

/// The generator xorshift64* of Vigna, "An experimental exploration of Marsaglia's xorshift generators, scrambled".
pub struct Random(u64);

impl Random {
    /// Any seed will do; near ones give unrelated sequences.
    pub fn new(seed: u64) -> Self {
        Self(mix(&[seed]).max(1))
    }

    /// A number in `0..end`.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32;
        ((bits * end as u64) >> 32) as usize
    }

    /// True so often in a hundred.
    pub fn percent(&mut self, chance: usize) -> bool {
        self.below(100) < chance
    }

    /// One of the items; none if there are none.
    pub fn choose<T: Copy>(&mut self, items: &[T]) -> Option<T> {
        (!items.is_empty()).then(|| items[self.below(items.len())])
    }
}

/// A hash of a list of words.
pub fn mix(words: &[u64]) -> u64 {
    words.iter().fold(0x9e37_79b9_7f4a_7c15, |hash: u64, &word| {
        let hash = (hash ^ word).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (hash ^ (hash >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb) ^ (hash >> 32)
    })
}

/// A hash of a name.
pub fn mix_name(name: &str) -> u64 {
    mix(&name.bytes().map(u64::from).collect::<Vec<_>>())
}
