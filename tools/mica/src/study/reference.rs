//! What the pictures of a place are compared with: every flake of every part of a pixel, twice.

use super::effort::Effort;
use super::path;
use super::pixels::{Rgb, difference, luminances};
use super::place::OpenPlace;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use mica_accuracy::{Errors, MeanOfTwo, PathErrors, Pixels, REFERENCE_SCHEMA, Radiance, ReferenceLine};
use mica_render::{View, method};

/// The method of references, and what keeps it from falling back to what is expected of many flakes.
const METHOD: &str = "flakes";
const EVERY_FLAKE: [(&str, &str); 1] = [("most", "1e6")];

/// A reference, and all that a comparison with it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Its line in the study.
    pub line: ReferenceLine,
    /// What was rendered.
    pub pixels: ReferencePixels,
    /// The views of the camera's path.
    pub path: Vec<PathView>,
    /// The place without glints, one sample a pixel as pictures have.
    pub base: Vec<Rgb>,
}

/// The pixels of a reference, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferencePixels {
    /// Along x and y.
    pub size: [u32; 2],
    /// Whether a pixel sees glinting material and nothing else.
    pub glinting: Vec<bool>,
    /// Flakes expected in its footprint.
    pub flakes: Vec<f32>,
    /// What glints add.
    pub glints: Vec<Rgb>,
    /// Variance of that about what it converges to.
    pub variance: Vec<Rgb>,
    /// Everything, glints included.
    pub whole: Vec<Rgb>,
    /// Luminance of the glints in each frame of the camera's path.
    pub path: Vec<Vec<f32>>,
    /// Whether a pixel sees glinting material and nothing else in all of these frames.
    pub path_glinting: Vec<bool>,
}

/// A view of the camera's path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathView {
    /// The view.
    pub view: View,
    /// What is seen without glints, one sample a pixel.
    pub base: Vec<Rgb>,
}

/// The sum over the parts of a pixel.
struct Parts {
    glints: Vec<[f64; 3]>,
    whole: Vec<[f64; 3]>,
    number: u32,
}

impl Reference {
    /// Renders the reference of a place. `pictures` are the names that its line gives to its picture and its .exr.
    pub fn render(
        open: &mut OpenPlace,
        effort: &Effort,
        pictures: [String; 2],
        interrupt: &Interrupt,
        progress: &mut Progress,
    ) -> Result<Self, Failure> {
        open.set(method(METHOD)?, &EVERY_FLAKE)?;
        open.session.precompute_anew()?;
        let view = open.session.view.clone();
        let (base, surface) = open.radiance_and_surface(&View { glints: false, ..view.clone() })?;
        let mut glinting = open.glinting(&surface);
        let flakes = open.flakes(&surface);
        let views = path::views(open, &surface, effort.path_frames);

        let [a, b] = effort.parts;
        let total = u64::from(a * a + b * b + effort.path_parts * effort.path_parts * views.len() as u32);
        let what = format!("reference of {}", open.place.scene);
        let mut done = 0;
        let mut shown = || {
            progress.update(&what, done, total);
            done += 1;
            if interrupt.requested() { Err(Failure::with_code(INTERRUPTED, "interrupted")) } else { Ok(()) }
        };
        let halves =
            [parts(open, &view, a, &mut glinting, &mut shown)?, parts(open, &view, b, &mut glinting, &mut shown)?];
        let mut path_glinting = glinting.clone();
        let mut path = Vec::new();
        for view in &views {
            path.push(luminances(&parts(open, view, effort.path_parts, &mut path_glinting, &mut shown)?.glints()));
        }
        let joined = MeanOfTwo::new(view.size[0] as usize, &glinting, &halves[0].glints(), &halves[1].glints());
        let [whole_a, whole_b] = [halves[0].whole(), halves[1].whole()];
        let whole = whole_a.iter().zip(&whole_b).map(|(a, b)| std::array::from_fn(|k| 0.5 * (a[k] + b[k]))).collect();
        let pixels = ReferencePixels {
            size: view.size,
            glinting,
            flakes,
            glints: joined.mean,
            variance: joined.variance,
            whole,
            path,
            path_glinting,
        };

        // What a method could be that is right but has flakes of its own.
        open.other_flakes()?;
        let own = open.radiance(&view)?;
        let views = bases(open, views)?;
        let mut floor = pixels.errors(&own, &base, view.exposure)?;
        floor.path = pixels.path_errors(&path_frames(open, &views)?)?;
        let line = ReferenceLine {
            schema: REFERENCE_SCHEMA.to_owned(),
            place: open.place.clone(),
            machine: open.machine.clone(),
            effort: effort.of_reference(),
            samples: a * a + b * b,
            noise: joined.noise,
            floor,
            pictures,
        };
        Ok(Self { line, pixels, path: views, base })
    }

    /// A reference of which the pixels are there already: renders what is quickly rendered again.
    ///
    /// # Errors
    /// If the pixels are not of this place.
    pub fn of_stored(
        open: &mut OpenPlace,
        effort: &Effort,
        line: ReferenceLine,
        pixels: ReferencePixels,
    ) -> Result<Self, Failure> {
        let view = open.session.view.clone();
        let (base, surface) = open.radiance_and_surface(&View { glints: false, ..view })?;
        let views = path::views(open, &surface, effort.path_frames);
        if pixels.size != open.place.size || pixels.path.len() != views.len() {
            return Err(Failure::bad_input(format!("{}: a reference of another picture", line.pictures[1])));
        }
        let path = bases(open, views)?;
        Ok(Self { line, pixels, path, base })
    }
}

impl ReferencePixels {
    /// The errors of a picture; `base` is the same without glints.
    pub fn errors(&self, picture: &[Rgb], base: &[Rgb], exposure: f32) -> Result<Errors, Failure> {
        let glints = difference(picture, base);
        let pixels = Pixels { size: self.size, glinting: &self.glinting, flakes: &self.flakes, exposure };
        let reference = mica_accuracy::Reference {
            radiance: Radiance { glints: &self.glints, whole: &self.whole },
            variance: &self.variance,
        };
        Ok(Errors::between(&pixels, &Radiance { glints: &glints, whole: picture }, &reference)?)
    }

    /// The errors of the frames of a path, if there is one.
    pub fn path_errors(&self, frames: &[Vec<f32>]) -> Result<Option<PathErrors>, Failure> {
        if self.path.is_empty() {
            return Ok(None);
        }
        Ok(Some(PathErrors::between(self.size, &self.path_glinting, frames, &self.path)?))
    }
}

/// The frames of a path as the place stands: luminance of the glints.
pub fn path_frames(open: &mut OpenPlace, path: &[PathView]) -> Result<Vec<Vec<f32>>, Failure> {
    path.iter().map(|PathView { view, base }| Ok(luminances(&difference(&open.radiance(view)?, base)))).collect()
}

/// The views with what each shows without glints.
fn bases(open: &mut OpenPlace, views: Vec<View>) -> Result<Vec<PathView>, Failure> {
    let of_view = |view: View| {
        let base = open.radiance(&View { glints: false, ..view.clone() })?;
        Ok(PathView { view, base })
    };
    views.into_iter().map(of_view).collect()
}

/// Every part of each pixel of a view; takes pixels in which a part sees anything else out of `glinting`.
fn parts(
    open: &mut OpenPlace,
    view: &View,
    parts: u32,
    glinting: &mut [bool],
    shown: &mut impl FnMut() -> Result<(), Failure>,
) -> Result<Parts, Failure> {
    let mut sum = Parts { glints: vec![[0.0; 3]; glinting.len()], whole: vec![[0.0; 3]; glinting.len()], number: 0 };
    for (row, column) in (0..parts).flat_map(|row| (0..parts).map(move |column| (row, column))) {
        shown()?;
        let part = view.part(parts, column, row);
        let (with, surface) = open.radiance_and_surface(&part)?;
        let without = open.radiance(&View { glints: false, ..part })?;
        for (glinting, of_part) in glinting.iter_mut().zip(open.glinting(&surface)) {
            *glinting &= of_part;
        }
        sum.add(&with, &without);
    }
    Ok(sum)
}

impl Parts {
    fn add(&mut self, with: &[Rgb], without: &[Rgb]) {
        self.number += 1;
        for (pixel, (with, without)) in with.iter().zip(without).enumerate() {
            for channel in 0..3 {
                let [with, without] = [with, without].map(|radiance| f64::from(radiance[channel]));
                self.glints[pixel][channel] += with - without;
                self.whole[pixel][channel] += with;
            }
        }
    }

    fn glints(&self) -> Vec<Rgb> {
        self.mean(&self.glints)
    }

    fn whole(&self) -> Vec<Rgb> {
        self.mean(&self.whole)
    }

    fn mean(&self, sums: &[[f64; 3]]) -> Vec<Rgb> {
        sums.iter().map(|sum| sum.map(|sum| (sum / f64::from(self.number)) as f32)).collect()
    }
}
