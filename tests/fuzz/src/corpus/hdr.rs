//! Radiance pictures.

/// A header for that size, and what follows it.
pub fn file(width: u64, height: u64, texels: &[u8]) -> Vec<u8> {
    let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    [header.as_bytes(), texels].concat()
}

/// In runs of both kinds and plain, and some whose runs or sizes are wrong.
pub fn files() -> Vec<Vec<u8>> {
    // A line of 16 texels: 16 times one byte, for each of four channels.
    let run = [2, 2, 0, 16, 144, 77, 144, 90, 144, 13, 144, 130];
    // The same, of bytes that differ.
    let literal: Vec<u8> = [2u8, 2, 0, 16]
        .into_iter()
        .chain((0..4u8).flat_map(|channel| [16].into_iter().chain((0..16).map(move |k| k * 9 + channel + 60))))
        .collect();
    let plain: Vec<u8> = (0..4 * 2u8).flat_map(|k| [k, 2 * k, 3 * k, 120 + k]).collect();
    // A texel, and three more of it, as Radiance wrote runs first.
    let old = [9, 8, 7, 130, 1, 1, 1, 3].repeat(2);
    vec![
        file(16, 4, &[&run[..], &literal, &run, &literal].concat()),
        file(4, 2, &plain),
        file(4, 2, &old),
        // A run beyond the line, no exponent but the greatest, sizes without texels.
        file(16, 1, &[2, 2, 0, 16, 255, 77, 144, 90, 144, 13, 144, 130]),
        file(1, 1, &[255, 255, 255, 255]),
        file(1_000_000_000, 1, &run),
        file(0, 0, b""),
    ]
}
