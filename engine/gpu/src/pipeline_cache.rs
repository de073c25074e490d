//! The pipeline cache on disk: whole and of this very device and driver, or not used.
//!
//! The file is a header and the driver's data. Drivers check their own header, but not whether the rest is whole, and
//! not all of them put their version into it.

use crate::device::Device;
use crate::error::{Call, Error};
use crate::info::CacheIdentity;
use ash::vk;
use std::path::{Path, PathBuf};

const MAGIC: [u8; 8] = *b"MICAPIPE";
const FORMAT: u32 = 1;
const HEADER_BYTES: usize = 8 + 4 + 3 * 16 + 4 + 32;

/// The target of log lines about caches that the file system refuses. They cost time and nothing else, so a host may show
/// the first alone.
pub const NOT_KEPT: &str = "mica::not_kept";

/// A pipeline cache, in memory and, where a path is given, on disk.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    path: Option<PathBuf>,
    /// Whether pipelines were made that the file may not hold yet.
    pub(crate) is_changed: bool,
}

impl PipelineCache {
    /// An empty cache, or what a good file holds.
    pub(crate) fn new(device: &Device, path: Option<PathBuf>) -> Result<Self, Error> {
        let data = path.as_deref().map(|path| load(path, &device.info.cache_identity)).unwrap_or_default();
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the data is empty, or what this driver wrote for this device, as its checksum says.
            unsafe { device.raw.create_pipeline_cache(&info, None) }
        };
        let raw = create(&data).or_else(|_| create(&[])).call("vkCreatePipelineCache")?;
        Ok(Self { raw, path, is_changed: false })
    }

    /// Writes the file, if there is one and anything changed: a reader sees the old file or the new one.
    pub(crate) fn flush(&mut self, device: &Device) -> std::io::Result<()> {
        let Some(path) = self.path.as_deref().filter(|_| self.is_changed) else { return Ok(()) };
        // SAFETY: the cache is alive, and this is the only thread that uses it.
        let data = unsafe { device.raw.get_pipeline_cache_data(self.raw) }.map_err(std::io::Error::other)?;
        store(path, &device.info.cache_identity, &data)?;
        self.is_changed = false;
        Ok(())
    }
}

fn header(identity: &CacheIdentity, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&FORMAT.to_le_bytes());
    bytes.extend_from_slice(&identity.cache_uuid);
    bytes.extend_from_slice(&identity.device_uuid);
    bytes.extend_from_slice(&identity.driver_uuid);
    bytes.extend_from_slice(&identity.driver_version.to_le_bytes());
    bytes.extend_from_slice(blake3::hash(data).as_bytes());
    bytes
}

/// The driver's data in a file, or nothing if the file is absent, damaged or of another device.
fn load(path: &Path, identity: &CacheIdentity) -> Vec<u8> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Vec::new(),
        Err(error) => {
            log::warn!(target: NOT_KEPT, "pipeline cache {}: {error}; the run goes on without it", path.display());
            return Vec::new();
        }
    };
    let data = data_of(&bytes, identity);
    if data.is_none() {
        log::warn!("pipeline cache {} is damaged or of another device; it is rebuilt", path.display());
    }
    data.unwrap_or_default().to_vec()
}

/// The driver's data in a whole file of this device and driver.
fn data_of<'a>(file: &'a [u8], identity: &CacheIdentity) -> Option<&'a [u8]> {
    let (found, data) = file.split_at_checked(HEADER_BYTES)?;
    (found == header(identity, data)).then_some(data)
}

fn store(path: &Path, identity: &CacheIdentity, data: &[u8]) -> std::io::Result<()> {
    std::fs::create_dir_all(mica_files::folder_of(path))?;
    mica_files::replace(path, &[&header(identity, data), data])
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: CacheIdentity =
        CacheIdentity { cache_uuid: [1; 16], device_uuid: [2; 16], driver_uuid: [3; 16], driver_version: 4 };

    fn file_of(data: &[u8]) -> Vec<u8> {
        [header(&IDENTITY, data), data.to_vec()].concat()
    }

    #[test]
    fn a_whole_file_is_read_back_and_replaces_the_old_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("below").join("pipelines");
        assert_eq!(load(&path, &IDENTITY), b"", "there is no file yet");
        for data in [&b"pipelines"[..], b"other pipelines"] {
            store(&path, &IDENTITY, data).expect("the file is written");
            assert_eq!(load(&path, &IDENTITY), data);
        }
        let left = std::fs::read_dir(path.parent().expect("a folder")).expect("the folder").count();
        assert_eq!(left, 1, "a temporary file is left");
    }

    #[test]
    fn a_file_with_any_bit_flipped_is_discarded() {
        let whole = file_of(b"pipelines");
        for bit in 0..whole.len() * 8 {
            let mut damaged = whole.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(data_of(&damaged, &IDENTITY), None, "bit {bit}");
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_discarded() {
        let whole = file_of(b"pipelines");
        for bytes in 0..whole.len() {
            assert_eq!(data_of(&whole[..bytes], &IDENTITY), None, "{bytes} bytes");
        }
    }

    #[test]
    fn a_file_of_another_device_or_driver_is_discarded() {
        for other in [
            CacheIdentity { cache_uuid: [9; 16], ..IDENTITY },
            CacheIdentity { device_uuid: [9; 16], ..IDENTITY },
            CacheIdentity { driver_uuid: [9; 16], ..IDENTITY },
            CacheIdentity { driver_version: 9, ..IDENTITY },
        ] {
            assert_eq!(data_of(&[header(&other, b"data"), b"data".to_vec()].concat(), &IDENTITY), None);
        }
    }
}
