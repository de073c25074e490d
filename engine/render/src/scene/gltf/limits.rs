//! How much a file may ask for, checked before anything is allocated.

use crate::scene::{SceneError, SceneErrorCode};
use std::sync::atomic::{AtomicU64, Ordering};

/// What loading may consume at most; a file of a few bytes can declare any size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// One file, bytes.
    pub file_bytes: u64,
    /// One data URI, characters.
    pub data_uri_chars: u64,
    /// One side of an image, texels.
    pub image_side: u32,
    /// One image, decoded, bytes.
    pub image_bytes: u64,
    /// Buffers, vertices, indices and images together, bytes.
    pub total_bytes: u64,
    /// Placements of meshes.
    pub instances: usize,
    /// Ancestors of a node.
    pub node_depth: usize,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            file_bytes: 1 << 30,
            data_uri_chars: 1 << 28,
            image_side: 16384,
            image_bytes: 1 << 30,
            total_bytes: 8 << 30,
            instances: 1 << 22,
            node_depth: 1024,
        }
    }
}

/// What is left of [`LoadLimits::total_bytes`]; shared by the threads that load.
pub struct Budget {
    limit: u64,
    spent: AtomicU64,
}

impl Budget {
    pub fn new(limit: u64) -> Self {
        Self { limit, spent: AtomicU64::new(0) }
    }

    /// Claims memory that is about to be allocated on behalf of `location`.
    pub fn claim(&self, bytes: u64, location: &str) -> Result<(), SceneError> {
        let spent = self.spent.fetch_add(bytes.min(self.limit + 1), Ordering::Relaxed);
        if bytes > self.limit || spent > self.limit - bytes {
            return Err(SceneError::new(
                SceneErrorCode::SceneTooLarge,
                location,
                format!("needs {bytes} bytes where {} of {} are left", self.limit.saturating_sub(spent), self.limit),
                "split the scene, or share its accessors and images",
            ));
        }
        Ok(())
    }
}
