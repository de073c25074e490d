//! Tables kept between runs: never needed for correctness, checked before use, written whole or not at all.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"MICA\x01\r\n\x1a";
const HEADER_BYTES: usize = 8 + 8 + 8 + 32;
const ENDIANNESS_AND_VERSION: u64 = 0x0102_0304_0506_0002;

/// Why an entry was not used.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// The file system refused.
    #[error("cache {}: {source}: the run goes on without it", path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// The bytes are not those that were written.
    #[error("cache {} is damaged or of another version: it is made again", path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
    },
}

impl CacheError {
    /// Says so in the log.
    pub fn warn(&self) {
        match self {
            Self::Io { .. } => log::warn!(target: mica_gpu::NOT_KEPT, "{self}"),
            Self::Damaged { .. } => log::warn!("{self}"),
        }
    }
}

/// A folder of entries by name. Any number of processes may share it.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// A cache in that folder, which is made when something is stored.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The cache in the user's cache folder; none where the environment names no home.
    pub fn of_user() -> Option<Self> {
        let base = std::env::var_os("XDG_CACHE_HOME")
            .filter(|path| Path::new(path).is_absolute())
            .map(PathBuf::from)
            .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")))?;
        Some(Self::new(base.join("mica")))
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The bytes stored under `key`; `None` if there are none.
    pub fn load(&self, key: &str) -> Result<Option<Vec<u8>>, CacheError> {
        let path = self.path(key);
        match open(&path).and_then(|(file, bytes)| read(key, file, bytes)) {
            Ok(Some(payload)) => Ok(Some(payload)),
            Ok(None) => Err(CacheError::Damaged { path }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(CacheError::Io { path, source }),
        }
    }

    /// Stores bytes under `key`: a reader sees the old entry or the new one.
    pub fn store(&self, key: &str, payload: &[u8]) -> Result<(), CacheError> {
        let path = self.path(key);
        fs::create_dir_all(&self.folder)
            .and_then(|()| mica_files::replace(&path, &[&header(key, payload), payload]))
            .map_err(|source| CacheError::Io { path, source })
    }

    /// The file of an entry, as bytes.
    pub fn entry(key: &str, payload: &[u8]) -> Vec<u8> {
        [&header(key, payload)[..], payload].concat()
    }

    /// What the bytes of an entry's file hold; none when they are not those that were written under `key`.
    pub fn payload(key: &str, entry: &[u8]) -> Option<Vec<u8>> {
        read(key, entry, entry.len() as u64).ok().flatten()
    }

    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.bin"))
    }
}

/// All of a header but the checksum.
fn start_of_header(payload_bytes: u64) -> [u8; 24] {
    let mut start = [0; 24];
    start[..8].copy_from_slice(MAGIC);
    start[8..16].copy_from_slice(&ENDIANNESS_AND_VERSION.to_ne_bytes());
    start[16..].copy_from_slice(&payload_bytes.to_ne_bytes());
    start
}

/// The checksum is of the key too: a file that was renamed is none of that name.
fn header(key: &str, payload: &[u8]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(key.len() as u64).to_le_bytes()).update(key.as_bytes()).update(payload);
    [&start_of_header(payload.len() as u64)[..], hasher.finalize().as_bytes()].concat()
}

/// A regular file and its length.
fn open(path: &Path) -> io::Result<(fs::File, u64)> {
    // Before opening: opening a pipe would wait for its other end.
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    Ok((fs::File::open(path)?, metadata.len()))
}

/// The payload of an entry's file of that length; none when it is damaged. A file that is none of ours is told by its
/// header, so that its length, which may be anything, costs nothing.
fn read(key: &str, mut file: impl Read, file_bytes: u64) -> io::Result<Option<Vec<u8>>> {
    let mut header = Vec::with_capacity(HEADER_BYTES);
    file.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut header)?;
    let payload_bytes = file_bytes.saturating_sub(HEADER_BYTES as u64);
    if header.len() < HEADER_BYTES || header[..24] != start_of_header(payload_bytes) {
        return Ok(None);
    }
    let mut payload = Vec::new();
    payload.try_reserve_exact(payload_bytes as usize)?;
    file.take(payload_bytes).read_to_end(&mut payload)?;
    Ok((header == self::header(key, &payload)).then_some(payload))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_stored_is_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().join("made/on/demand"));
        assert!(cache.load("table").unwrap().is_none());
        cache.store("table", b"some bytes").unwrap();
        assert_eq!(cache.load("table").unwrap().as_deref(), Some(&b"some bytes"[..]));
        cache.store("table", b"").unwrap();
        assert_eq!(cache.load("table").unwrap().as_deref(), Some(&b""[..]));
        assert_eq!(fs::read_dir(cache.folder()).unwrap().count(), 1, "temporary files are left");
    }

    #[test]
    fn every_damaged_byte_and_every_truncation_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        cache.store("table", &[7; 100]).unwrap();
        let path = cache.path("table");
        let whole = fs::read(&path).unwrap();
        let entry = Cache::entry("table", &[7; 100]);
        assert_eq!((&entry, Cache::payload("table", &whole)), (&whole, Some(vec![7; 100])));
        fs::write(cache.path("another"), &whole).unwrap();
        assert!(matches!(cache.load("another"), Err(CacheError::Damaged { .. })), "renamed");
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x10;
            fs::write(&path, damaged).unwrap();
            assert!(matches!(cache.load("table"), Err(CacheError::Damaged { .. })), "byte {at}");
            fs::write(&path, &whole[..at]).unwrap();
            assert!(matches!(cache.load("table"), Err(CacheError::Damaged { .. })), "cut at {at}");
        }
    }

    #[test]
    fn files_that_are_none_of_ours_are_neither_read_whole_nor_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        cache.store("table", &[7; 100]).unwrap();
        // A terabyte, of which the file system stores the header alone.
        fs::File::options().write(true).open(cache.path("table")).and_then(|file| file.set_len(1 << 40)).unwrap();
        assert!(matches!(cache.load("table"), Err(CacheError::Damaged { .. })));
        // The same with that length in the header: no machine has so much.
        let mut forged = start_of_header((1 << 62) - HEADER_BYTES as u64).to_vec();
        forged.resize(HEADER_BYTES, 0);
        fs::write(cache.path("forged"), forged).unwrap();
        assert!(matches!(cache.load("forged"), Err(CacheError::Damaged { .. })));
        fs::create_dir(cache.path("folder")).unwrap();
        assert!(matches!(cache.load("folder"), Err(CacheError::Io { .. })));
        let made = std::process::Command::new("mkfifo").arg(cache.path("pipe")).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo is part of every Debian");
        assert!(matches!(cache.load("pipe"), Err(CacheError::Io { .. })));
    }

    #[test]
    fn readers_beside_writers_see_whole_entries() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        std::thread::scope(|scope| {
            for writer in 0..4u8 {
                let cache = cache.clone();
                scope.spawn(move || {
                    for _ in 0..20 {
                        cache.store("table", &[writer; 5000]).unwrap();
                    }
                });
            }
            for _ in 0..4 {
                let cache = cache.clone();
                scope.spawn(move || {
                    for _ in 0..100 {
                        if let Some(bytes) = cache.load("table").unwrap() {
                            assert!(bytes.len() == 5000 && bytes.iter().all(|byte| *byte == bytes[0]));
                        }
                    }
                });
            }
        });
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "in the way").unwrap();
        assert!(matches!(Cache::new(file.join("cache")).store("table", b"x"), Err(CacheError::Io { .. })));
    }
}
