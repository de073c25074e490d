//! Entries of the cache.

use crate::targets::CACHE_KEY;
use mica_render::Cache;

/// Good ones, and some with a header that is wrong in one way.
pub fn files() -> Vec<Vec<u8>> {
    let good = Cache::entry(CACHE_KEY, &(0..64).collect::<Vec<u8>>());
    let changed = |at: usize, byte: u8| {
        let mut entry = good.clone();
        entry[at] = byte;
        entry
    };
    // Magic, byte order and version, the highest byte of the length, the checksum.
    let bad = [changed(0, b'm'), changed(8, 0xff), changed(23, 0x80), changed(24, 0)];
    [good.clone(), Cache::entry(CACHE_KEY, b"")].into_iter().chain(bad).collect()
}
