//! Gaussian blurs over a few pixels, one axis after the other.

use super::GlintTiles;
use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::{blur_glints, blur_visibility};

const AXES: [[i32; 2]; 2] = [[1, 0], [0, 1]];

/// Weights of a Gaussian of `2 radius + 1` taps, from the centre outwards: the ends lie at two standard deviations, and
/// all taps add up to 1. At most four on each side.
fn weights(radius: i32) -> [f32; 5] {
    let sigma = f64::from(radius) / 2.0;
    let gaussian: [f64; 5] =
        std::array::from_fn(|tap| if tap as i32 <= radius { (-0.5 * (tap as f64 / sigma).powi(2)).exp() } else { 0.0 });
    let total = gaussian[0] + 2.0 * gaussian[1..].iter().sum::<f64>();
    gaussian.map(|weight| (weight / total) as f32)
}

/// Blurs the glints' radiance on the tiles of a list; elsewhere it is 0.
pub(crate) fn blur_glints(
    g: &mut Graph,
    frame: &Buffer,
    (tiles, list): (&GlintTiles, u32),
    mut source: Image,
    radius: i32,
) -> Image {
    for axis in AXES {
        let mut blurred_image = g.image("glints_blurred", Format::Rgba32Float, source.extent());
        g.clear(&mut blurred_image, 0.0);
        let params = blur_glints::Params { axis, radius, list, weights: weights(radius) };
        let (listed_tiles, tile_lists) = (&tiles.listed, &tiles.lists);
        let bind =
            blur_glints::Bind { frame, source: &source, listed_tiles, tile_lists, blurred_image: &mut blurred_image };
        g.pass_indirect(bind, params, tile_lists, GlintTiles::arguments(list));
        source = blurred_image;
    }
    source
}

/// Blurs the visibility of the mirror direction on the tiles of a list; elsewhere it is 1.
pub(crate) fn blur_visibility(
    g: &mut Graph,
    frame: &Buffer,
    (tiles, list): (&GlintTiles, u32),
    mut source: Image,
    radius: i32,
) -> Image {
    for axis in AXES {
        let mut blurred_image = g.image("visibility_blurred", Format::R32Float, source.extent());
        g.clear(&mut blurred_image, 1.0);
        let params = blur_visibility::Params { axis, radius, list, weights: weights(radius) };
        let (listed_tiles, tile_lists) = (&tiles.listed, &tiles.lists);
        let bind = blur_visibility::Bind {
            frame,
            source: &source,
            listed_tiles,
            tile_lists,
            blurred_image: &mut blurred_image,
        };
        g.pass_indirect(bind, params, tile_lists, GlintTiles::arguments(list));
        source = blurred_image;
    }
    source
}

#[cfg(test)]
mod tests {
    use super::weights;

    #[test]
    fn blurs_neither_add_nor_lose_light() {
        for radius in 1..=4 {
            let weights = weights(radius);
            assert!((weights[0] + 2.0 * weights[1..].iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(weights.windows(2).all(|pair| pair[0] > pair[1] || pair[1] == 0.0));
            assert!(weights[radius as usize] > 0.0);
        }
    }
}
