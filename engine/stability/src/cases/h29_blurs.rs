//! H29. Blurs keep energy at the border, and what is not a number does not spread.

use crate::{Check, Form, Laboratory, StabilityError};
use mica_gpu::Timing;
use mica_graph::{Extent, Format, Graph, Image};
use mica_shaders::{blur_at_edge, blur_glints, constants as c, types};

/// Sides of the picture.
const SIZE: [u32; 2] = [24, 16];
/// Taps on each side of the centre.
const RADIUS: i32 = 4;

/// What is beyond the border.
#[derive(Clone, Copy, Debug)]
enum Beyond {
    /// The picture, mirrored: the renderer's own pass.
    Mirrored,
    /// One of `EDGE_*`.
    Other(u32),
}

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let [width, height] = SIZE;
    let at = |x: u32, y: u32| (y * width + x) as usize;
    // At the corner, at every place along an edge and one pixel further in, and in the middle.
    let mut places = vec![at(width / 2, height / 2)];
    places.extend((0..width).flat_map(|x| [at(x, 0), at(x, 1), at(x, height - 1)]));
    places.extend((0..height).flat_map(|y| [at(0, y), at(1, y), at(width - 1, y)]));
    let mut worst = |beyond: Beyond| {
        let mut worst: f64 = 0.0;
        for place in &places {
            let mut picture = vec![0.0; (width * height) as usize];
            picture[*place] = 1.0;
            worst = worst.max((blurred(laboratory, &picture, beyond)?.iter().sum::<f64>() - 1.0).abs());
        }
        Ok::<f64, StabilityError>(worst)
    };
    let stable = worst(Beyond::Mirrored)?;
    // The best of those that are in use elsewhere.
    let mut naive = f64::INFINITY;
    for edge in [c::EDGE_BLACK, c::EDGE_REPEATED, c::EDGE_LEFT_OUT] {
        naive = naive.min(worst(Beyond::Other(edge))?);
    }

    // One pixel that is no number among ones. The counter of pixels that are not finite is another pass's.
    let bad = at(width / 2, height / 2);
    let mut spread = |beyond: Beyond| {
        let mut off: f64 = 0.0;
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut picture = vec![1.0; (width * height) as usize];
            picture[bad] = value;
            let mut black = picture.clone();
            black[bad] = 0.0;
            let expected = blurred(laboratory, &black, Beyond::Mirrored)?;
            let shown = blurred(laboratory, &picture, beyond)?;
            // Not by the greater of two, which would drop what is no number.
            let wrong = shown.iter().zip(&expected).filter(|(shown, expected)| shown != expected).count();
            off = off.max(wrong as f64);
        }
        Ok::<f64, StabilityError>(off)
    };
    Ok(vec![
        Check {
            what: "a single bright pixel, at the border and inside, blurred along both axes".to_owned(),
            error_of: "|sum of the picture after / before - 1|".to_owned(),
            inputs: places.len() as u64,
            naive: Form::new("beyond the border: black, the edge, or left out, whichever is best", naive),
            stable: Form::new("beyond the border: the picture mirrored, its edge included", stable),
            tolerance: 1e-6,
        },
        Check {
            what: "a pixel that is infinite or not a number".to_owned(),
            error_of: "pixels that are not as if it were black".to_owned(),
            inputs: 3,
            naive: Form::new("weighted as it is", spread(Beyond::Other(c::EDGE_REPEATED))?),
            stable: Form::new("left out by its bits", spread(Beyond::Mirrored)?),
            tolerance: 0.0,
        },
    ])
}

/// The picture after a blur along x and one along y; its Gaussian ends at two standard deviations.
fn blurred(laboratory: &mut Laboratory, picture: &[f32], beyond: Beyond) -> Result<Vec<f64>, StabilityError> {
    let [width, height] = SIZE;
    let extent = Extent::new(width, height);
    let gaussian: [f64; 5] = std::array::from_fn(|tap| (-0.5 * (tap as f64 / 2.0).powi(2)).exp());
    let total = gaussian[0] + 2.0 * gaussian[1..].iter().sum::<f64>();
    let weights = gaussian.map(|weight| (weight / total) as f32);

    let mut g = Graph::new();
    let mut frame = g.buffer("frame", size_of::<types::Frame>() as u64);
    let constants = types::Frame { width, height, ..Default::default() };
    g.upload(&mut frame, bytemuck::bytes_of(&constants));
    let mut source = g.image("glints", Format::Rgba32Float, extent);
    let texels: Vec<[f32; 4]> = picture.iter().map(|value| [*value; 4]).collect();
    g.upload_image(&mut source, bytemuck::cast_slice::<_, u8>(&texels));
    // All tiles of the frame, as a list.
    let tiles: Vec<u32> = (0..width.div_ceil(c::TILE_SIDE) * height.div_ceil(c::TILE_SIDE)).collect();
    let count = tiles.len() as u32;
    let lists = [types::TileList { groups: [count, 1, 1], tiles: count }];
    let mut listed_tiles = g.buffer("listed_tiles", 4 * u64::from(count));
    g.upload(&mut listed_tiles, bytemuck::cast_slice::<_, u8>(&tiles));
    let mut tile_lists = g.buffer("tile_lists", size_of_val(&lists) as u64);
    g.upload(&mut tile_lists, bytemuck::cast_slice::<_, u8>(&lists));
    for axis in [[1, 0], [0, 1]] {
        let mut blurred_image: Image = g.image("glints_blurred", Format::Rgba32Float, extent);
        match beyond {
            Beyond::Mirrored => {
                let params = blur_glints::Params { axis, radius: RADIUS, list: 0, weights };
                let (listed_tiles, tile_lists) = (&listed_tiles, &tile_lists);
                let (frame, source, blurred_image) = (&frame, &source, &mut blurred_image);
                let bind = blur_glints::Bind { frame, source, listed_tiles, tile_lists, blurred_image };
                g.pass_indirect(bind, params, tile_lists, 0);
            }
            Beyond::Other(beyond) => {
                let params = blur_at_edge::Params { axis, radius: RADIUS, beyond, weights };
                let bind = blur_at_edge::Bind { source: &source, blurred_image: &mut blurred_image };
                g.pass(bind, params, extent);
            }
        }
        source = blurred_image;
    }
    let download = g.download_image(&source);
    let bytes = laboratory.executor.run(g, Timing::Overlapped)?.take(download);
    let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    Ok(pixels.into_iter().map(|pixel| f64::from(pixel[0])).collect())
}
