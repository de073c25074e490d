//! `mica accuracy --sheet`: every method on every embedded scene, in one picture.

use super::AccuracyArgs;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::picture;
use crate::progress::Progress;
use crate::session::Session;
use font8x8::legacy::BASIC_LEGACY;
use mica_gpu::Timing;
use mica_render::{EMBEDDED_SCENES, EmbeddedScene, MethodInfo};
use std::path::Path;

/// Pixels between tiles, and around the sheet.
const GAP: u32 = 8;
/// Pixels of a character, which is an 8 x 8 glyph drawn twice as large.
const CHARACTER: u32 = 16;
const PAPER: [u8; 3] = [24, 24, 26];
const INK: [u8; 3] = [225, 225, 220];
/// Size of a tile where none is named, and the largest: larger tiles make a sheet that no program opens.
const TILE: [u32; 2] = [320, 180];
const LARGEST_TILE: u32 = 1024;
/// What stands for a tile that could not be rendered.
const MISSING: [u8; 3] = [70, 30, 30];

/// The scenes of a sheet, from left to right: a tile has no use for a million triangles.
fn scenes() -> Vec<&'static EmbeddedScene> {
    EMBEDDED_SCENES.iter().filter(|scene| !scene.is_large()).collect()
}

/// A sheet to be written.
pub struct Sheet {
    destination: Destination,
    tile: [u32; 2],
}

impl Sheet {
    /// Checks, before any work is done, that the file can be written.
    pub fn check(path: &Path, sizes: &[[u32; 2]]) -> Result<Self, Failure> {
        if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
            return Err(Failure::bad_input(format!("--sheet {}: a sheet is a .png file", path.display())));
        }
        let tile = match sizes {
            [] => TILE,
            [tile] if tile.iter().all(|side| *side <= LARGEST_TILE) => *tile,
            _ => {
                let wanted = format!("tiles of a sheet have one --size, each side at most {LARGEST_TILE}");
                return Err(Failure::bad_input(wanted));
            }
        };
        Ok(Self { destination: Destination::check(path)?, tile })
    }

    /// Renders all tiles and writes the sheet; after Ctrl-C, with those that were finished.
    pub fn draw(
        &self,
        args: &AccuracyArgs,
        methods: &[&'static MethodInfo],
        interrupt: &Interrupt,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let mut canvas = Canvas::new(self.tile, methods);
        let total = (scenes().len() * methods.len()) as u64;
        let mut done = 0;
        let mut failed = None;
        interrupt.defer();
        'scenes: for (column, scene) in scenes().into_iter().enumerate() {
            let mut session = Session::new(&self.scene_args(args, scene.name), progress)?;
            for (row, method) in methods.iter().enumerate() {
                if interrupt.requested() {
                    break 'scenes;
                }
                progress.update(&format!("{} by {}", scene.name, method.name), done, total);
                match tile(&mut session, method, args.samples) {
                    Ok(display) => canvas.place(column, row, &display),
                    Err(failure) => {
                        log::warn!("{} by {}: {failure}", scene.name, method.name);
                        failed = Some(failure);
                    }
                }
                done += 1;
            }
        }
        progress.clear();
        let [width, height] = canvas.size;
        self.destination.write(&picture::png_of(&canvas.pixels, [width, height])?)?;
        if !args.quiet {
            output::print(&format!("{} ({width}x{height}, {done} tiles)\n", self.destination.path.display()))?;
        }
        if interrupt.requested() {
            return Err(Failure::with_code(
                INTERRUPTED,
                format!("interrupted after {done} of {total} tiles, which were kept"),
            ));
        }
        failed.map_or(Ok(()), Err)
    }

    fn scene_args(&self, args: &AccuracyArgs, scene: &str) -> SceneArgs {
        SceneArgs { size: self.tile, device: args.device.clone(), ..SceneArgs::of(scene) }
    }
}

/// The tone-mapped picture of a scene by a method.
fn tile(session: &mut Session, method: &MethodInfo, samples: u32) -> Result<Vec<u8>, Failure> {
    session.renderer.set_method(None, method.name)?;
    session.precompute(&mut Progress::new(true))?;
    for sample in 0..samples {
        let shot = session.frame(Some(sample), Timing::Overlapped, sample + 1 == samples)?;
        if let Some(picture) = shot.picture {
            let nonfinite = picture.summary().nonfinite;
            if nonfinite > 0 {
                log::warn!("{} by {}: {nonfinite} pixels are not finite", session.scene, method.name);
            }
            return Ok(picture.display);
        }
    }
    Err(Failure::bad_input("the frame gave no picture"))
}

/// The sheet as it grows: scenes from left to right, methods from top to bottom.
struct Canvas {
    size: [u32; 2],
    tile: [u32; 2],
    /// Width of the column with the methods' names.
    margin: u32,
    /// Red, green and blue, row by row from the top.
    pixels: Vec<u8>,
}

impl Canvas {
    fn new(tile: [u32; 2], methods: &[&MethodInfo]) -> Self {
        let longest = methods.iter().map(|method| method.name.len() as u32).max().unwrap_or(0);
        let margin = longest * CHARACTER + 2 * GAP;
        let heading = CHARACTER + 2 * GAP;
        let size = [margin + scenes().len() as u32 * (tile[0] + GAP), heading + methods.len() as u32 * (tile[1] + GAP)];
        let pixels = PAPER.repeat((size[0] * size[1]) as usize);
        let mut canvas = Self { size, tile, margin, pixels };
        for (column, scene) in scenes().into_iter().enumerate() {
            canvas.write(scene.name, [canvas.left(column), GAP]);
        }
        for (row, method) in methods.iter().enumerate() {
            canvas.write(method.name, [GAP, canvas.top(row) + GAP]);
            for column in 0..scenes().len() {
                for y in 0..tile[1] {
                    for x in 0..tile[0] {
                        canvas.set([canvas.left(column) + x, canvas.top(row) + y], MISSING);
                    }
                }
            }
        }
        canvas
    }

    fn left(&self, column: usize) -> u32 {
        self.margin + column as u32 * (self.tile[0] + GAP)
    }

    fn top(&self, row: usize) -> u32 {
        CHARACTER + 2 * GAP + row as u32 * (self.tile[1] + GAP)
    }

    fn set(&mut self, [x, y]: [u32; 2], color: [u8; 3]) {
        if x < self.size[0] && y < self.size[1] {
            let at = 3 * (y as usize * self.size[0] as usize + x as usize);
            self.pixels[at..at + 3].copy_from_slice(&color);
        }
    }

    /// Copies a tile of red, green, blue and alpha.
    fn place(&mut self, column: usize, row: usize, display: &[u8]) {
        let (left, top, width) = (self.left(column), self.top(row), self.tile[0]);
        for (index, pixel) in (0..).zip(display.chunks_exact(4)) {
            self.set([left + index % width, top + index / width], [pixel[0], pixel[1], pixel[2]]);
        }
    }

    fn write(&mut self, text: &str, [left, top]: [u32; 2]) {
        for (index, character) in (0..).zip(text.bytes()) {
            let glyph = BASIC_LEGACY[usize::from(character & 0x7f)];
            for (y, bits) in (0..).zip(glyph) {
                for x in (0..8).filter(|x| bits >> x & 1 == 1) {
                    for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                        self.set([left + index * CHARACTER + 2 * x + dx, top + 2 * y + dy], INK);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_render::METHODS;

    #[test]
    fn a_tile_lands_in_its_own_place() {
        let methods: Vec<&MethodInfo> = METHODS.iter().collect();
        let mut canvas = Canvas::new([5, 4], &methods);
        canvas.place(2, 1, &[200, 100, 50, 255].repeat(20));
        let at = |x: u32, y: u32| {
            let index = 3 * (y * canvas.size[0] + x) as usize;
            canvas.pixels[index..index + 3].to_vec()
        };
        let (left, top) = (canvas.left(2), canvas.top(1));
        assert_eq!(at(left, top), [200, 100, 50]);
        assert_eq!(at(left + 4, top + 3), [200, 100, 50]);
        assert_eq!(at(left + 5, top + 3), PAPER);
        assert_eq!(at(canvas.left(0), top), MISSING);
        assert!(canvas.pixels.chunks_exact(3).any(|pixel| pixel == INK), "there is a heading");
    }
}
