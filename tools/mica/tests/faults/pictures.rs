//! Environment maps and textures that are damaged, or that ask for more than there is: F14 to F18.

use super::*;
use mica_fuzz::corpus::exr::{COMPRESSIONS, Written, encoded};
use mica_fuzz::corpus::gltf::with_image;
use mica_fuzz::corpus::{hdr, png};

/// An environment map of these bytes must be refused, with these words.
#[track_caller]
fn map_refused(name: &str, bytes: &[u8], words: &[&str]) {
    let place = Place::new();
    let map = place.file(name, bytes);
    place.refused(&["sphere", "--env", &map], &[&[name, "; "], words].concat());
}

/// What is warned of when a sphere is lit by an environment map of these bytes.
#[track_caller]
fn map_warnings(name: &str, bytes: &[u8]) -> String {
    let place = Place::new();
    let map = place.file(name, bytes);
    place.rendered(&["sphere", "--env", &map])
}

#[test]
fn f14_a_map_that_declares_more_than_its_file_can_hold_is_refused() {
    let too_large = &["IMAGE_TOO_LARGE", "; save the map again"][..];
    let sizes = |last, compression| Written { last, compression, ..Written::default() }.bytes();
    for compression in [0, 1, 2, 3, 4, 5, 6, 7, 8, 9] {
        // 2^30 is the most that the format itself allows; more is another error, and as good a one.
        map_refused("sky.exr", &sizes([(1 << 30) - 3; 2], compression), too_large);
        map_refused("sky.exr", &sizes([i32::MAX - 1; 2], compression), &["IMAGE_DATA_INVALID"]);
        map_refused("sky.exr", &sizes([16384, 0], compression), too_large);
        map_refused("sky.exr", &sizes([16383, 8191], compression), &["IMAGE_DATA_INVALID", "cannot hold"]);
    }
    let tiles = Written { tile: Some([1 << 20; 2]), flags: 0x200, ..Written::default() };
    map_refused("sky.exr", &tiles.bytes(), too_large);
    // Sixteen lines of a gigabyte in a block.
    let channels = (0..20_000).map(|k| format!("c{k:05}")).collect();
    let wide = Written { channels, last: [16383, 15], compression: 3, ..Written::default() };
    map_refused("sky.exr", &wide.bytes(), too_large);
    // The sizes that a block of DWAA begins with: 17 GB of values, and more bytes than there are.
    for count in [1 << 33, 1 << 34, 1 << 40, u64::MAX] {
        map_refused("sky.exr", &Written::dwa_that_claims(count).bytes(), &["IMAGE_DATA_INVALID"]);
    }
}

#[test]
fn f15_a_map_that_is_cut_deep_or_without_colours_is_refused_and_nan_is_repaired() {
    for compression in COMPRESSIONS {
        let whole = encoded(9, 5, compression, None);
        map_refused("sky.exr", &whole[..whole.len() / 2], &["IMAGE_DATA_INVALID"]);
        map_refused("sky.exr", &whole[..whole.len() - 1], &["IMAGE_DATA_INVALID"]);
    }
    let rgb = Written::default();
    let deep = Written { flags: 0x800, kind: Some("deepscanline"), ..rgb.clone() };
    map_refused("sky.exr", &deep.bytes(), &["IMAGE_DATA_INVALID"]);
    map_refused("sky.exr", &Written { flags: 0x1000, ..rgb.clone() }.bytes(), &["IMAGE_DATA_INVALID"]);
    let grey = Written { channels: vec!["Y".to_owned()], ..rgb.clone() };
    map_refused("sky.exr", &grey.bytes(), &["IMAGE_DATA_INVALID", "R, G and B"]);
    let nan = rgb.with_block(&[f32::NAN, 1.0, f32::INFINITY, 2.0, -1.0, 3.0].map(f32::to_le_bytes).concat());
    let said = map_warnings("sky.exr", &nan.bytes());
    for words in ["1 texels have channels that are not a number", "1 texels have channels that are infinite"] {
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn f16_radiance_pictures_are_held_to_their_size_and_their_runs() {
    map_refused("sky.hdr", &hdr::file(1_000_000_000, 1, &[0; 64]), &["IMAGE_TOO_LARGE"]);
    let most = u64::from(u32::MAX);
    map_refused("sky.hdr", &hdr::file(most, most, &[0; 64]), &["IMAGE_DATA_INVALID", "too large"]);
    map_refused("sky.hdr", &hdr::file(1 << 40, 1, &[0; 64]), &["IMAGE_DATA_INVALID"]);
    map_refused("sky.hdr", &hdr::file(16384, 8192, &[0; 64]), &["IMAGE_DATA_INVALID", "cannot hold"]);
    // A run of 127 texels in a line of 16.
    let run = [2, 2, 0, 16, 255, 77, 144, 90, 144, 13, 144, 130];
    map_refused("sky.hdr", &hdr::file(16, 1, &run), &["IMAGE_DATA_INVALID"]);
    map_refused("sky.hdr", b"#?RADIANCE\n", &["IMAGE_DATA_INVALID"]);
    let said = map_warnings("sky.hdr", &hdr::file(2, 1, &[255; 8]));
    assert!(said.contains("2 texels have channels that are above 1e12"), "{said}");
}

/// A scene that shows an image of these bytes.
fn shows(place: &Place, image: &[u8]) -> String {
    place.file("scene.glb", with_image(image))
}

#[test]
fn f17_images_are_bounded_before_they_are_decoded() {
    let place = Place::new();
    let texel = png::chunk(b"IDAT", &png::stored(&[0, 9]));
    let of = |header: Vec<u8>, data: &[u8]| png::file(&[header, data.to_vec()]);
    for side in [16385, 60_000, i32::MAX as u32] {
        let bomb = of(png::header(side, side, 8, png::Color::Rgba, false), &texel);
        place.refused(&[&shows(&place, &bomb)], &["images[0]", "IMAGE_TOO_LARGE", "; save the image again, smaller"]);
    }
    let thin = of(png::header(16384, 16384, 8, png::Color::Rgba, false), &texel);
    place.refused(&[&shows(&place, &thin)], &["images[0]", "IMAGE_DATA_INVALID", "cannot hold"]);
    // A true bomb, 32 MiB in 212 kB that are a gigabyte as RGBA: more than this process may have.
    let zeros = png::chunk(b"IDAT", &png::deflated_zeros((2049 * 16384usize).div_ceil(258)));
    let bomb = of(png::header(16384, 16384, 1, png::Color::Grey, false), &zeros);
    assert!(bomb.len() < 220_000);
    place.fails(4, 1 << 20, &[&shows(&place, &bomb)], &["images[0]", "OUT_OF_MEMORY", "; make it smaller"]);

    let good = of(png::header(1, 1, 8, png::Color::Grey, false), &texel);
    for at in [29, 40, 45] {
        let mut damaged = good.clone();
        damaged[at] ^= 1;
        place.refused(&[&shows(&place, &damaged)], &["images[0]", "IMAGE_DATA_INVALID"]);
    }
    // Of an animation, the image that stands for it.
    let animation = png::chunk(b"acTL", &[0, 0, 0, 1, 0, 0, 0, 0]);
    let animated = png::file(&[png::header(1, 1, 8, png::Color::Grey, false), animation, texel]);
    place.rendered(&[&shows(&place, &animated)]);
}

#[test]
fn f18_maps_of_odd_shapes_and_values_are_usable_or_refused() {
    let constant = |width: i32, height: i32, value: f32| {
        let texels = value.to_le_bytes().repeat((width * 3) as usize);
        let lines: Vec<Vec<u8>> = (0..height)
            .map(|y| [&y.to_le_bytes()[..], &(texels.len() as i32).to_le_bytes(), &texels].concat())
            .collect();
        let mut map = Written { last: [width - 1, height - 1], body: Vec::new(), ..Written::default() };
        let start = map.bytes().len() + 8 * lines.len();
        let offsets = (0..lines.len()).flat_map(|y| ((start + y * (texels.len() + 8)) as u64).to_le_bytes());
        map.body = offsets.chain(lines.concat()).collect();
        map.bytes()
    };
    let whole = "where an equirectangular map is twice as wide as high; it is stretched";
    for (width, height, value, words) in [
        (2, 1, 1.0, vec![]),
        (1, 1, 1.0, vec!["1 x 1 texels", whole]),
        (3, 1, 1.0, vec!["3 x 1 texels", whole]),
        (4, 2, 0.0, vec![]),
        (4, 2, f32::NAN, vec!["8 texels have channels that are not a number"]),
        (4, 2, f32::INFINITY, vec!["8 texels have channels that are infinite"]),
        (4, 2, f32::NEG_INFINITY, vec!["8 texels have channels that are negative"]),
    ] {
        let said = map_warnings("sky.exr", &constant(width, height, value));
        assert!(words.iter().all(|word| said.contains(word)), "{width} x {height} of {value}: {said}");
        assert_eq!(
            said.lines().filter(|line| line.contains("sky.exr")).count(),
            usize::from(!words.is_empty()),
            "{said}"
        );
    }
    // A last column before the first is no picture, and neither is one of no lines.
    map_refused("sky.exr", &Written { last: [-1, -1], ..Written::default() }.bytes(), &["IMAGE_DATA_INVALID"]);
    map_refused("sky.hdr", &hdr::file(0, 0, b""), &["IMAGE_DATA_INVALID"]);
}
