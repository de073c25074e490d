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

/// The method of references.
const METHOD: &str = "flakes";
/// Most flakes of a footprint that it looks at one by one: more show what is expected of them.
const MOST: f64 = 1e6;

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
        open.set(method(METHOD)?, &[])?;
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
        look_at_all(open, &pixels.flakes, &pixels.glinting)?;
        let own = open.radiance(&view)?;
        let views = bases(open, views)?;
        let mut floor = pixels.errors(&own, &base, view.exposure)?;
        floor.path = pixels.path_errors(&path_frames(open, &own, &views, interrupt)?)?;
        let line = ReferenceLine {
            schema: REFERENCE_SCHEMA.to_owned(),
            place: open.place.clone(),
            machine: open.machine.clone(),
            effort: effort.of_reference(),
            content: open.content.clone(),
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
    /// The errors of a picture; `base` is the same without glints. Without an exposure there is no FLIP.
    pub fn errors(&self, picture: &[Rgb], base: &[Rgb], exposure: impl Into<Option<f32>>) -> Result<Errors, Failure> {
        let glints = difference(picture, base);
        let exposure = exposure.into();
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

/// The frames of a path as the place stands: luminance of the glints. `first` is the place's own picture, as is the first
/// of the path.
pub fn path_frames(
    open: &mut OpenPlace,
    first: &[Rgb],
    path: &[PathView],
    interrupt: &Interrupt,
) -> Result<Vec<Vec<f32>>, Failure> {
    let mut frames = Vec::new();
    for (index, PathView { view, base }) in path.iter().enumerate() {
        if interrupt.requested() {
            return Err(Failure::with_code(INTERRUPTED, "interrupted"));
        }
        let glints = if index == 0 { difference(first, base) } else { difference(&open.radiance(view)?, base) };
        frames.push(luminances(&glints));
    }
    Ok(frames)
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
        let (without, surface) = open.radiance_and_surface(&View { glints: false, ..part.clone() })?;
        for (glinting, of_part) in glinting.iter_mut().zip(open.glinting(&surface)) {
            *glinting &= of_part;
        }
        let flakes = open.flakes(&surface);
        look_at_all(open, &flakes, glinting)?;
        let with = open.radiance(&part)?;
        sum.add(&with, &without);
    }
    Ok(sum)
}

/// Lets the method look at every flake of the pixels that count. It takes a pass over the picture for each 2,000 flakes that
/// a footprint may hold, and reckons with square footprints: long ones of as many flakes take more steps.
fn look_at_all(open: &mut OpenPlace, flakes: &[f32], glinting: &[bool]) -> Result<(), Failure> {
    let counted = flakes.iter().zip(glinting).filter(|(_, glinting)| **glinting);
    let greatest = counted.map(|(flakes, _)| f64::from(*flakes)).fold(0.0, f64::max);
    let most = (8.0 * greatest + 2000.0).min(MOST).ceil();
    Ok(open.session.renderer.set(None, "most", &most.to_string())?)
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
