//! Tables kept between runs: never needed for correctness, checked before use, written whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

const MAGIC: &[u8; 8] = b"MICA\x01\r\n\x1a";
const HEADER_BYTES: usize = 8 + 8 + 8 + 32;
const ENDIANNESS_AND_VERSION: u64 = 0x0102_0304_0506_0001;
/// A file whose writer died is removed after this time.
const STALE: Duration = Duration::from_secs(24 * 60 * 60);

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
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CacheError::Io { path, source }),
        };
        match payload(&bytes) {
            Some(payload) => Ok(Some(payload.to_vec())),
            None => Err(CacheError::Damaged { path }),
        }
    }

    /// Stores bytes under `key`: into a file of another name first, which then takes the entry's place.
    pub fn store(&self, key: &str, payload: &[u8]) -> Result<(), CacheError> {
        let path = self.path(key);
        let failed = |source| CacheError::Io { path: path.clone(), source };
        fs::create_dir_all(&self.folder).map_err(failed)?;
        self.remove_stale();
        let unique = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |time| time.as_nanos());
        let temporary = self.folder.join(format!("{key}.{}.{unique}.tmp", std::process::id()));
        let write = || -> io::Result<()> {
            let mut file = fs::File::create_new(&temporary)?;
            file.write_all(&header(payload))?;
            file.write_all(payload)?;
            file.sync_all()?;
            fs::rename(&temporary, &path)?;
            // The folder too: a crash must not bring the old entry back half renamed.
            fs::File::open(&self.folder)?.sync_all()
        };
        write().map_err(|source| {
            let _ = fs::remove_file(&temporary);
            failed(source)
        })
    }

    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.bin"))
    }

    fn remove_stale(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten() {
            let stale = entry.path().extension().is_some_and(|extension| extension == "tmp")
                && entry
                    .metadata()
                    .and_then(|metadata| metadata.modified())
                    .is_ok_and(|modified| modified.elapsed().is_ok_and(|age| age > STALE));
            if stale {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

fn header(payload: &[u8]) -> Vec<u8> {
    let mut header = Vec::with_capacity(HEADER_BYTES);
    header.extend(MAGIC);
    header.extend(ENDIANNESS_AND_VERSION.to_ne_bytes());
    header.extend((payload.len() as u64).to_ne_bytes());
    header.extend(blake3::hash(payload).as_bytes());
    header
}

fn payload(bytes: &[u8]) -> Option<&[u8]> {
    let payload = bytes.get(HEADER_BYTES..)?;
    (bytes[..HEADER_BYTES] == header(payload)).then_some(payload)
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
