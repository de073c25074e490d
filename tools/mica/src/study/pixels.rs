//! What pixels see: their glints, whether they count, and how many flakes lie in each.

use super::place::OpenPlace;
use crate::error::Failure;
use crate::session::{Surface, Wanted};
use mica_gpu::Timing;
use mica_render::View;

/// Red, green and blue.
pub type Rgb = [f32; 3];

impl OpenPlace {
    /// The radiance of a view.
    pub fn radiance(&mut self, view: &View) -> Result<Vec<Rgb>, Failure> {
        Ok(self.seen(view, false)?.0)
    }

    /// The radiance of a view, and what each of its pixels sees.
    pub fn radiance_and_surface(&mut self, view: &View) -> Result<(Vec<Rgb>, Surface), Failure> {
        let (radiance, surface) = self.seen(view, true)?;
        surface.map(|surface| (radiance, surface)).ok_or_else(nothing)
    }

    fn seen(&mut self, view: &View, surface: bool) -> Result<(Vec<Rgb>, Option<Surface>), Failure> {
        let shot = self.session.look(view, Timing::Overlapped, Wanted { picture: true, surface })?;
        let radiance = shot.picture.ok_or_else(nothing)?.radiance;
        Ok((radiance.as_chunks::<4>().0.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect(), shot.surface))
    }

    /// Whether each pixel sees a material that glints.
    pub fn glinting(&self, surface: &Surface) -> Vec<bool> {
        surface.ids.iter().map(|ids| self.count(*ids).is_some_and(|count| count > 0.0)).collect()
    }

    /// Flakes expected in the footprint of each pixel, lit or not.
    pub fn flakes(&self, surface: &Surface) -> Vec<f32> {
        let of_pixel = |(ids, [du_dx, dv_dx, du_dy, dv_dy]): (&[u32; 2], &[f32; 4])| {
            let area = (f64::from(*du_dx) * f64::from(*dv_dy) - f64::from(*dv_dx) * f64::from(*du_dy)).abs();
            (self.count(*ids).unwrap_or(0.0) * area) as f32
        };
        surface.ids.iter().zip(&surface.footprint).map(of_pixel).collect()
    }

    /// Flakes in a square of texture space of what is seen, if it glints.
    fn count(&self, [instance, _]: [u32; 2]) -> Option<f64> {
        let renderer = &self.session.renderer;
        let scene = renderer.scene();
        let instance = scene.instances.get((instance as usize).checked_sub(1)?)?;
        let material = scene.meshes.get(instance.mesh)?.material;
        renderer.materials().iter().find(|glint| glint.index == material).map(|glint| glint.values.number("count"))
    }
}

fn nothing() -> Failure {
    Failure::bad_input("the frame gave no picture")
}

/// What glints add to each pixel.
pub fn difference(with: &[Rgb], without: &[Rgb]) -> Vec<Rgb> {
    with.iter().zip(without).map(|(with, without)| std::array::from_fn(|k| with[k] - without[k])).collect()
}

/// Luminance of each pixel.
pub fn luminances(pixels: &[Rgb]) -> Vec<f32> {
    pixels.iter().map(|pixel| mica_accuracy::luminance(*pixel) as f32).collect()
}
