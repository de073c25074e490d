//! Buffers and images whose content the host knows: uploaded when it changes, and not again.

use mica_graph::{Buffer, Graph, Image, ImageDesc, Lifetime};
use std::sync::Arc;

/// A buffer that is filled by the host.
pub(crate) struct Filled {
    /// What passes read.
    pub buffer: Buffer,
    pending: Option<Arc<[u8]>>,
}

impl Filled {
    /// A list as bytes; an empty one is held as 16 zero bytes, as no buffer may be empty.
    pub fn new<T: bytemuck::NoUninit>(name: &str, list: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(list);
        let bytes: Arc<[u8]> = if bytes.is_empty() { Arc::from([0u8; 16]) } else { Arc::from(bytes) };
        Self { buffer: Buffer::new(name, bytes.len() as u64, Lifetime::Scene), pending: Some(bytes) }
    }

    /// Another content for the next upload: a list as long as the one before, and not empty.
    pub fn replace<T: bytemuck::NoUninit>(&mut self, list: &[T]) {
        self.pending = Some(Arc::from(bytemuck::cast_slice::<_, u8>(list)));
    }

    /// Whether there is something to upload.
    pub fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Declares its upload, if there is something new.
    pub fn upload(&mut self, g: &mut Graph) {
        if let Some(bytes) = self.pending.take() {
            g.upload(&mut self.buffer, bytes);
        }
    }
}

/// An image that is filled by the host, once.
pub(crate) struct FilledImage {
    /// What passes read.
    pub image: Image,
    pending: Option<Arc<[u8]>>,
}

impl FilledImage {
    /// With the texels that [`ImageDesc::bytes`] describes.
    pub fn new(name: &str, desc: ImageDesc, bytes: Arc<[u8]>) -> Self {
        Self { image: Image::new(name, desc, Lifetime::Scene), pending: Some(bytes) }
    }

    /// Declares its upload, the first time.
    pub fn upload(&mut self, g: &mut Graph) {
        if let Some(bytes) = self.pending.take() {
            g.upload_image(&mut self.image, bytes);
        }
    }
}
