//! Mip chains, the atlas, and environment maps.

mod scene_support;

use glam::DVec3;
use mica_render::scene::{Atlas, AtlasLimits, Encoding, EquirectMap, SceneErrorCode as Code, Texture, Wrap, mip_count};
use scene_support::assert_refused;
use std::f64::consts::PI;
use std::io::Cursor;

fn texture(width: u32, height: u32, encoding: Encoding, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y)).collect();
    Texture {
        name: format!("{width}x{height}"),
        width,
        height,
        pixels,
        encoding,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
    }
}

#[test]
fn mip_chains_of_a_constant_are_constant() {
    for (width, height) in [(1, 1), (8, 8), (7, 5), (1, 9), (13, 2), (100, 3)] {
        for code in [0, 1, 37, 128, 200, 255] {
            for encoding in [Encoding::Srgb, Encoding::Linear] {
                let texel = [code, 255 - code, code / 2, code];
                let chain = texture(width, height, encoding, |_, _| texel).mip_chain();
                assert_eq!(chain.len() as u32, mip_count(width, height));
                for level in &chain {
                    // Where nothing is opaque no colour counts, and any may stay.
                    assert!(
                        level.pixels.chunks_exact(4).all(|t| t == texel),
                        "{width}x{height} {encoding:?} {texel:?}"
                    );
                }
                let last = chain.last().expect("at least itself");
                assert_eq!((last.width, last.height), (1, 1));
            }
        }
    }
}

#[test]
fn colours_are_averaged_in_linear_light_and_data_as_it_is() {
    let checker = |encoding| {
        let chain =
            texture(2, 2, encoding, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] }).mip_chain();
        chain[1].pixels.clone()
    };
    // Half the light of white is code value 188.
    assert_eq!(checker(Encoding::Srgb), [188, 188, 188, 255]);
    assert_eq!(checker(Encoding::Linear), [128, 128, 128, 255]);
}

#[test]
fn transparent_texels_lend_no_colour() {
    let half = |x: u32, _| if x == 0 { [200, 100, 50, 255] } else { [0, 255, 0, 0] };
    assert_eq!(texture(2, 1, Encoding::Srgb, half).mip_chain()[1].pixels, [200, 100, 50, 128]);
}

#[test]
fn odd_sizes_weigh_every_texel_alike() {
    // Of 3 texels under 1, each is a third; of 5 under 2, the middle one is shared.
    let bright = |at: u32| move |x: u32, _| if x == at { [255; 4] } else { [0, 0, 0, 255] };
    for at in 0..3 {
        assert_eq!(texture(3, 1, Encoding::Linear, bright(at)).mip_chain()[1].pixels[0], 85, "texel {at}");
    }
    let halves: Vec<[u8; 2]> = (0..5)
        .map(|at| texture(5, 1, Encoding::Linear, bright(at)).mip_chain()[1].pixels.clone())
        .map(|pixels| [pixels[0], pixels[4]])
        .collect();
    assert_eq!(halves, [[102, 0], [102, 0], [51, 51], [0, 102], [0, 102]]);
}

#[test]
fn normal_maps_stay_unit() {
    let bumps = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [218, 128, 218, 255] } else { [128, 218, 218, 255] };
    for level in &texture(16, 16, Encoding::Normal, bumps).mip_chain()[1..] {
        for texel in level.pixels.chunks_exact(4) {
            let length = texel[..3].iter().map(|&c| (f64::from(c) / 127.5 - 1.0).powi(2)).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 0.01, "{length}");
        }
    }
    // Opposed normals cancel; what is left is the unbent one.
    let opposed = |x: u32, _| if x == 0 { [255, 128, 128, 255] } else { [0, 127, 127, 255] };
    assert_eq!(texture(2, 1, Encoding::Normal, opposed).mip_chain()[1].pixels[2], 255);
}

/// Textures of many shapes, of both kinds, whose texels tell which they are.
fn assorted() -> Vec<Texture> {
    let sizes =
        [(64, 64), (1, 1), (33, 7), (7, 33), (1, 100), (100, 1), (128, 32), (50, 50), (64, 64), (3, 3), (90, 91)];
    sizes
        .iter()
        .enumerate()
        .map(|(k, &(width, height))| {
            let encoding = [Encoding::Srgb, Encoding::Linear, Encoding::Linear][k % 3];
            texture(width, height, encoding, |x, y| [k as u8 + 1, x as u8, y as u8, 255])
        })
        .collect()
}

#[test]
fn every_level_is_in_the_atlas_and_none_overlap() {
    for limits in [
        AtlasLimits::default(),
        AtlasLimits { side: 256, ..AtlasLimits::default() },
        AtlasLimits { side: 64, ..AtlasLimits::default() },
        AtlasLimits { side: 128, layers: 1, ..AtlasLimits::default() },
        AtlasLimits { bytes: 1 << 16, ..AtlasLimits::default() },
        AtlasLimits { side: 1, layers: 1, ..AtlasLimits::default() },
    ] {
        let textures = assorted();
        let atlas = Atlas::pack(&textures, limits);
        assert_eq!(atlas.records.len(), textures.len());
        for (srgb, image) in [(true, &atlas.srgb), (false, &atlas.linear)] {
            assert_eq!(image.bytes.len(), image.side as usize * image.side as usize * 4 * image.layers as usize);
            let mut taken = vec![0u8; image.bytes.len() / 4];
            for (k, (record, texture)) in atlas.records.iter().zip(&textures).enumerate() {
                assert_eq!(record.srgb, texture.encoding == Encoding::Srgb);
                if record.srgb != srgb {
                    continue;
                }
                let chain = texture.mip_chain();
                let skipped = chain.len() - record.mips as usize;
                for level in 0..record.mips {
                    let ([x, y], [width, height]) = (record.mip_origin(level), record.mip_extent(level));
                    let expected = &chain[skipped + level as usize];
                    assert_eq!([width, height], [expected.width, expected.height]);
                    for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
                        let at = ((record.layer * image.side + y + row) * image.side + x + column) as usize;
                        assert!(x + column < image.side && y + row < image.side && record.layer < image.layers);
                        assert_eq!(taken[at], 0, "texture {k}, level {level} lies over texture {}", taken[at]);
                        taken[at] = k as u8 + 1;
                        let from = ((row * width + column) * 4) as usize;
                        assert_eq!(image.bytes[at * 4..at * 4 + 4], expected.pixels[from..from + 4]);
                    }
                }
            }
        }
        let shrunk = atlas.records.iter().zip(&textures).filter(|(r, t)| r.width < t.width || r.height < t.height);
        assert_eq!(atlas.warnings.len(), shrunk.count(), "each that was made smaller is named: {:?}", atlas.warnings);
    }
}

#[test]
fn an_atlas_of_nothing_can_be_bound() {
    let atlas = Atlas::pack(&[], AtlasLimits::default());
    assert_eq!((atlas.srgb.side, atlas.srgb.layers, &atlas.srgb.bytes[..]), (1, 1, &[255u8; 4][..]));
    assert_eq!(atlas.srgb, atlas.linear);
    assert!(Atlas::pack(&assorted(), AtlasLimits::default()).warnings.is_empty());
}

/// A map whose texels are all different.
fn gradient(width: u32, height: u32) -> EquirectMap {
    let texels = (0..width * height).map(|k| [k as f32, 1.0 + (k % 7) as f32, (k * k % 13) as f32]).collect();
    EquirectMap { width, height, texels }
}

#[test]
fn directions_lie_where_the_convention_says() {
    for (direction, uv) in [
        (DVec3::NEG_Z, [0.5, 0.5]),
        (DVec3::X, [0.75, 0.5]),
        (DVec3::NEG_X, [0.25, 0.5]),
        (DVec3::Y, [0.5, 0.0]),
        (DVec3::NEG_Y, [0.5, 1.0]),
        (DVec3::new(0.0, 1.0, -1.0), [0.5, 0.25]),
    ] {
        let found = EquirectMap::uv_from_direction(direction);
        assert!((found[0] - uv[0]).abs() < 1e-15 && (found[1] - uv[1]).abs() < 1e-15, "{direction}: {found:?}");
        assert!(EquirectMap::direction_from_uv(uv).abs_diff_eq(direction.normalize(), 1e-15));
    }
    // A texel's centre has its value; between two, their mean; across the seam too.
    let map = gradient(8, 4);
    let at = |x: f64, y: f64| map.radiance(EquirectMap::direction_from_uv([x / 8.0, y / 4.0]))[0];
    assert!((at(2.5, 1.5) - 10.0).abs() < 1e-5);
    assert!((at(3.0, 1.5) - 10.5).abs() < 1e-5);
    assert!((at(2.5, 2.0) - 14.0).abs() < 1e-5);
    assert!((at(0.0, 1.5) - 11.5).abs() < 1e-5, "between texels 15 and 8: {}", at(0.0, 1.5));
    assert_eq!(EquirectMap::constant([1.0, 2.0, 3.0]).radiance(DVec3::new(0.3, -7.0, 0.1)), [1.0, 2.0, 3.0]);
}

#[test]
fn the_integral_of_one_is_the_sphere_and_halving_keeps_it() {
    for (width, height) in [(1, 1), (2, 1), (64, 32), (7, 5), (13, 16)] {
        let ones = EquirectMap { width, height, texels: vec![[1.0; 3]; (width * height) as usize] };
        assert!((ones.integral()[0] - 4.0 * PI).abs() < 1e-12);
        let mut map = gradient(width, height);
        let whole = map.integral();
        while map.width > 1 || map.height > 1 {
            map = map.half();
            for (now, before) in map.integral().iter().zip(whole) {
                assert!((now / before - 1.0).abs() < 1e-6, "{width}x{height} at {}", map.width);
            }
        }
    }
    let constant = EquirectMap { width: 9, height: 6, texels: vec![[0.3, 7.0, 1e5]; 54] };
    assert!(constant.half().texels.iter().all(|texel| *texel == [0.3, 7.0, 1e5]));
}

fn exr_bytes(width: usize, height: usize, texel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
    use exr::prelude::{SpecificChannels, WritableImage};
    let mut bytes = Cursor::new(Vec::new());
    let channels = SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| texel(at.x(), at.y()));
    exr::prelude::Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).expect("memory");
    bytes.into_inner()
}

#[test]
fn openexr_maps_are_read_bit_for_bit() {
    let bytes = exr_bytes(8, 4, |x, y| (x as f32 + 0.1, y as f32 * 1e5, 1e-30));
    let (map, report) = EquirectMap::from_file_bytes("sky.exr", &bytes).expect("read");
    assert_eq!((map.width, map.height), (8, 4));
    assert_eq!(map.texels[2 * 8 + 3], [3.1, 2e5, 1e-30]);
    assert_eq!(report, Default::default());
}

#[test]
fn texels_that_are_no_light_are_repaired_and_counted() {
    let bad = [(f32::NAN, 1.0, -1.0), (f32::INFINITY, 0.0, 2.0), (-0.0, -5.0, f32::NEG_INFINITY), (1.0, 2.0, 3.0)];
    let (map, report) = EquirectMap::from_file_bytes("sky.exr", &exr_bytes(4, 1, |x, _| bad[x])).expect("read");
    assert_eq!(map.texels, [[0.0, 1.0, 0.0], [65504.0, 0.0, 2.0], [0.0; 3], [1.0, 2.0, 3.0]]);
    assert_eq!((report.nan_texels, report.negative_texels, report.infinite_texels), (1, 2, 1));
    assert_eq!(report.warnings.len(), 4, "three repairs and a shape that is not 2:1: {:?}", report.warnings);
    let one_bad = |x: usize, y: usize| (if [x, y] == [3, 2] { f32::NAN } else { -0.0 }, 1.0, 1.0);
    let (_, report) = EquirectMap::from_file_bytes("sky.exr", &exr_bytes(6, 3, one_bad)).expect("read");
    assert_eq!((report.first_changed, report.warnings.len()), (Some([3, 2]), 1));
    assert!(report.warnings[0].ends_with("in column 3 of row 2"), "{:?}", report.warnings);
}

#[test]
fn other_layouts_of_openexr_are_read_or_refused_by_name() {
    use exr::prelude::*;
    let write = |image: &dyn Fn(&mut Cursor<Vec<u8>>)| {
        let mut bytes = Cursor::new(Vec::new());
        image(&mut bytes);
        EquirectMap::from_file_bytes("sky.exr", &bytes.into_inner())
    };
    // Half floats, with an opacity, in compressed tiles.
    let half = write(&|out| {
        let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
            (f16::from_f32(at.x() as f32), f16::from_f32(0.5), f16::from_f32(at.y() as f32), f16::ONE)
        });
        let encoding = Encoding {
            compression: Compression::PIZ,
            blocks: Blocks::Tiles(Vec2(16, 16)),
            line_order: LineOrder::Increasing,
        };
        let layer = Layer::new((40, 20), LayerAttributes::named("sky"), encoding, channels);
        Image::from_layer(layer).write().to_buffered(out).expect("memory");
    });
    assert_eq!(half.expect("read").0.texels[19 * 40 + 39], [39.0, 0.5, 19.0]);
    // Luminance alone is not what is asked for.
    let grey = write(&|out| {
        let channel = AnyChannel::new("Y", FlatSamples::F32(vec![1.0; 8]));
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![channel]));
        Image::from_channels((4, 2), channels).write().to_buffered(out).expect("memory");
    });
    assert_refused(grey, Code::InvalidImage, "");
}

#[test]
fn radiance_maps_are_read() {
    // Two texels, not run-length encoded: (mantissa, exponent) of 1, 0.5, 0.25 and of 2^127 * 255/256 in red.
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
    let file = [header, vec![128, 64, 32, 129, 255, 0, 0, 255]].concat();
    let (map, report) = EquirectMap::from_file_bytes("sky.hdr", &file).expect("read");
    assert_eq!(map.texels[0], [1.0, 0.5, 0.25]);
    // Sums of the second would leave the range of a float.
    assert_eq!(map.texels[1], [EquirectMap::GREATEST, 0.0, 0.0]);
    assert_eq!((report.huge_texels, report.infinite_texels, report.warnings.len()), (1, 0, 1));
    assert_refused(EquirectMap::from_file_bytes("sky.hdr", &file[..file.len() - 1]), Code::InvalidImage, "");
}

#[test]
fn sizes_of_maps_are_bounded_by_their_headers() {
    let header = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    for (size, code) in [
        ("-Y 16384 +X 1000000000", Code::ImageTooLarge),
        ("-Y 16384 +X 16384", Code::ImageTooLarge),
        ("-Y 0 +X 0", Code::InvalidImage),
        ("-Y 5", Code::InvalidImage),
    ] {
        assert_refused(EquirectMap::from_file_bytes("sky.hdr", &header(size)), code, "");
    }
    // The data window of an OpenEXR file, widened in place.
    let good = exr_bytes(32, 16, |_, _| (1.0, 1.0, 1.0));
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = good.windows(name.len()).position(|window| window == name).expect("a data window") + name.len();
    for largest in [1i32 << 24, 20_000, 16_383] {
        let mut bad = good.clone();
        bad[at + 8..at + 12].copy_from_slice(&largest.to_le_bytes());
        bad[at + 12..at + 16].copy_from_slice(&largest.to_le_bytes());
        assert_refused(EquirectMap::from_file_bytes("sky.exr", &bad), Code::ImageTooLarge, "");
    }
    assert_refused(EquirectMap::from_file_bytes("sky.exr", &good[..good.len() / 2]), Code::InvalidImage, "");
    assert_refused(EquirectMap::from_file_bytes("sky.png", b"\x89PNG\r\n\x1a\n"), Code::UnknownFormat, "");
    assert_refused(EquirectMap::load(std::path::Path::new("/dev/zero")), Code::FileNotRegular, "");
}
