//! Tables that frames make and that are kept between runs: taken from a cache where it has them, and otherwise brought back by
//! the frame that makes them.

use crate::Cache;
use mica_gpu::{DeviceInfo, Run};
use mica_graph::{Buffer, Download, Graph, Image, Pass, Resource, Shader, Work};
use std::fmt::Arguments;
use std::sync::Arc;

/// What a table is made from, beside what the passes that make it say.
#[derive(Default)]
pub(crate) struct Inputs(blake3::Hasher);

impl Inputs {
    /// And from what these words tell apart.
    pub fn and(mut self, words: Arguments) -> Self {
        self.part(words.to_string().as_bytes());
        self
    }

    /// Something of it was made by a shader.
    pub fn by(mut self, shader: &Shader) -> Self {
        for stage in shader.stages {
            self.part(bytemuck::cast_slice(stage.spirv));
        }
        self
    }

    fn part(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// The name, in a cache, of what these passes make of it; none if they are not all compute passes.
    fn key(mut self, table: &str, passes: &[Pass]) -> Option<String> {
        for pass in passes {
            let Work::Compute { shader, params, groups } = &pass.work else { return None };
            self = self.by(shader).and(format_args!("{groups:?} {}", pass.effects.bits()));
            self.part(params);
        }
        Some(format!("{table}-{}", &self.0.finalize().to_hex()[..16]))
    }
}

/// A table that a frame made and brings back, to be kept for later runs.
#[derive(Debug)]
pub struct MadeTable {
    cache: Cache,
    key: String,
    download: Download,
}

impl MadeTable {
    /// Stores it, from the run of the frame that it was declared in. Where that fails, the log says so.
    pub fn store(self, run: &mut Run) {
        if let Err(error) = self.cache.store(&self.key, &run.take(self.download)) {
            error.warn();
        }
    }
}

/// A buffer or an image.
pub(crate) trait Table {
    fn resource(&self) -> &Arc<Resource>;
    fn download(&self, g: &mut Graph) -> Download;
}

impl Table for Buffer {
    fn resource(&self) -> &Arc<Resource> {
        self.resource()
    }

    fn download(&self, g: &mut Graph) -> Download {
        g.download(self)
    }
}

impl Table for Image {
    fn resource(&self) -> &Arc<Resource> {
        self.resource()
    }

    fn download(&self, g: &mut Graph) -> Download {
        g.download_image(self)
    }
}

/// Where the tables of a device are kept.
struct Place {
    cache: Cache,
    device: String,
}

impl Place {
    /// The name of an entry: two devices may differ in the last digits.
    fn key(&self, inputs: Inputs, table: &impl Table, passes: &[Pass]) -> Option<String> {
        inputs.and(format_args!("{}", self.device)).key(&table.resource().name, passes)
    }

    fn load(&self, key: &str, table: &impl Table) -> Option<Arc<[u8]>> {
        let kept = self.cache.load(key).unwrap_or_else(|error| {
            error.warn();
            None
        });
        kept.filter(|kept| kept.len() as u64 == table.resource().bytes()).map(Arc::from)
    }
}

/// What is kept, and where: nothing, unless somebody asks for it.
#[derive(Default)]
pub(crate) struct Kept {
    place: Option<Place>,
    made: Vec<MadeTable>,
}

impl Kept {
    /// Tables of a device, in a cache.
    pub fn new(cache: Cache, device: &DeviceInfo) -> Self {
        let DeviceInfo { name, driver, driver_version, .. } = device;
        let device = format!("{name} {driver} {driver_version}");
        Self { place: Some(Place { cache, device }), made: Vec::new() }
    }

    /// Declares the upload of a table that is there already, or else what makes it: compute passes.
    pub fn table<T: Table>(
        &mut self,
        g: &mut Graph,
        inputs: Option<Inputs>,
        mut table: T,
        make: impl FnOnce(&mut Graph, &mut T),
    ) -> T {
        let first = g.passes().len();
        make(g, &mut table);
        let (Some(place), Some(inputs)) = (&self.place, inputs) else { return table };
        let Some(key) = place.key(inputs, &table, &g.passes()[first..]) else { return table };
        if let Some(bytes) = place.load(&key, &table) {
            g.upload_instead(first, table.resource(), bytes, "read from the cache");
        } else {
            self.made.push(MadeTable { cache: place.cache.clone(), key, download: table.download(g) });
        }
        table
    }

    /// The bytes of a table that the host makes, stored as soon as it has. The inputs name the code that does.
    pub fn bytes(&self, inputs: Option<Inputs>, table: &impl Table, make: impl FnOnce() -> Arc<[u8]>) -> Arc<[u8]> {
        let (Some(place), Some(inputs)) = (&self.place, inputs) else { return make() };
        let Some(key) = place.key(inputs, table, &[]) else { return make() };
        place.load(&key, table).unwrap_or_else(|| {
            let made = make();
            if let Err(error) = place.cache.store(&key, &made) {
                error.warn();
            }
            made
        })
    }

    /// What was made since this was last asked.
    pub fn take_made(&mut self) -> Vec<MadeTable> {
        std::mem::take(&mut self.made)
    }
}
