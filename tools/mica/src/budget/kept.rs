//! What was measured of one view on one device, kept between runs: the points, and the reference that they were held against.

use crate::study::{Reference, ReferencePixels, reference_file};
use mica_accuracy::{Point, ReferenceLine};
use mica_render::{Cache, MethodInfo, Rung};

/// Points of one view on one device.
pub struct Kept {
    cache: Option<Cache>,
    /// Stands for everything that decides the figures.
    key: String,
    points: Vec<Point>,
}

impl Kept {
    /// What is in the cache for all that `decisive` names; nothing there, or something damaged, is no points yet.
    pub fn open(cache: Option<Cache>, decisive: &str) -> Self {
        let key = format!("budget-{}", &blake3::hash(decisive.as_bytes()).to_hex()[..32]);
        let mut kept = Self { cache, key, points: Vec::new() };
        kept.points = kept.stored();
        kept
    }

    /// Whether anything outlasts this run.
    pub fn lasts(&self) -> bool {
        self.cache.is_some()
    }

    /// All points.
    pub fn all(&self) -> &[Point] {
        &self.points
    }

    /// The point of a rung.
    pub fn point(&self, method: &MethodInfo, rung: &Rung) -> Option<&Point> {
        let is_set =
            |set: &[(String, String)]| set.iter().map(|(k, v)| (k.as_str(), v.as_str())).eq(rung.set.iter().copied());
        self.points.iter().find(|point| point.method == method.name && is_set(&point.set))
    }

    /// Keeps a point in place of an earlier one of its rung, on the disk before this returns.
    pub fn add(&mut self, point: Point) {
        // Another process may have added some meanwhile.
        for other in self.stored() {
            if !self.points.iter().any(|own| is_of_one_rung(own, &other)) {
                self.points.push(other);
            }
        }
        self.points.retain(|own| !is_of_one_rung(own, &point));
        self.points.push(point);
        let lines: Result<Vec<String>, _> = self.points.iter().map(serde_json::to_string).collect();
        match lines {
            Ok(lines) => self.store(&self.key, lines.join("\n").as_bytes()),
            Err(error) => log::warn!("measurements cannot be kept: {error}"),
        }
    }

    /// The reference of the view, if it was rendered.
    pub fn reference(&self) -> Option<(ReferenceLine, ReferencePixels)> {
        let bytes = self.load(&self.reference_key())?;
        let end = bytes.iter().position(|byte| *byte == b'\n')?;
        let line = serde_json::from_slice(&bytes[..end]).ok()?;
        Some((line, reference_file::read(&bytes[end + 1..], &self.key)?))
    }

    /// Keeps the reference, so that a run that goes on need not render it again.
    pub fn keep_reference(&self, reference: &Reference) {
        let line = serde_json::to_string(&reference.line).map_err(|error| error.to_string());
        let pixels = reference_file::write(&reference.pixels, &self.key).map_err(|failure| failure.to_string());
        match line.and_then(|line| Ok([line.as_bytes(), b"\n", &pixels?].concat())) {
            Ok(bytes) => self.store(&self.reference_key(), &bytes),
            Err(error) => log::warn!("the reference cannot be kept: {error}"),
        }
    }

    fn reference_key(&self) -> String {
        format!("{}-reference", self.key)
    }

    fn stored(&self) -> Vec<Point> {
        let Some(bytes) = self.load(&self.key) else { return Vec::new() };
        let lines = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        // Whole but of another form: as good as nothing.
        lines.map(serde_json::from_slice).collect::<Result<_, _>>().unwrap_or_default()
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        self.cache.as_ref()?.load(key).unwrap_or_else(|error| {
            error.warn();
            None
        })
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        if let Some(Err(error)) = self.cache.as_ref().map(|cache| cache.store(key, bytes)) {
            error.warn();
        }
    }
}

fn is_of_one_rung(a: &Point, b: &Point) -> bool {
    a.method == b.method && a.set == b.set
}
