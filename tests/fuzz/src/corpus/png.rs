//! PNG images, by hand: of every colour type, and what must not be believed.

/// Samples of a texel, by their number in the format.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub enum Color {
    /// Grey.
    Grey = 0,
    /// Red, green, blue.
    Rgb = 2,
    /// Numbers of colours in a palette.
    Palette = 3,
    /// Grey and alpha.
    GreyAlpha = 4,
    /// Red, green, blue and alpha.
    Rgba = 6,
}

/// A chunk with its checksum.
pub fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    [&(data.len() as u32).to_be_bytes()[..], &body, &crc32(&body).to_be_bytes()].concat()
}

/// The header of an image.
pub fn header(width: u32, height: u32, bits: u8, color: Color, interlaced: bool) -> Vec<u8> {
    let start = [&width.to_be_bytes()[..], &height.to_be_bytes()].concat();
    chunk(b"IHDR", &[&start[..], &[bits, color as u8, 0, 0, u8::from(interlaced)]].concat())
}

/// A file of these chunks, and the last.
pub fn file(chunks: &[Vec<u8>]) -> Vec<u8> {
    [b"\x89PNG\r\n\x1a\n", &chunks.concat()[..], &chunk(b"IEND", b"")].concat()
}

/// Bytes in the form of zlib, not compressed.
pub fn stored(bytes: &[u8]) -> Vec<u8> {
    let mut stream = vec![0x78, 0x01];
    let blocks: Vec<&[u8]> = bytes.chunks(0xffff).collect();
    for (k, block) in blocks.iter().enumerate() {
        let length = block.len() as u16;
        stream.push(u8::from(k + 1 == blocks.len()));
        stream.extend(length.to_le_bytes());
        stream.extend((!length).to_le_bytes());
        stream.extend(*block);
    }
    let (a, b) = bytes.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    stream.extend((b << 16 | a).to_be_bytes());
    stream
}

/// Zeros in the form of zlib, 158 of them in a byte: `1 + 258 * runs` of them, a literal and copies of the one before
/// (RFC 1951, section 3.2.6).
pub fn deflated_zeros(runs: usize) -> Vec<u8> {
    let mut bits = Bits::default();
    // The last block, of the fixed codes; the literal 0.
    bits.push(0b011, 3);
    bits.push_code(0b0011_0000, 8);
    for _ in 0..runs {
        // The length of 258, the distance of 1.
        bits.push_code(0b1100_0101, 8);
        bits.push_code(0, 5);
    }
    // The end of the block.
    bits.push_code(0, 7);
    // A sum of 1 + 0 + 0 ... is 1, a sum of those is their number.
    let count = (1 + 258 * runs as u64) % 65521;
    [&[0x78, 0x01][..], &bits.bytes, &((count as u32) << 16 | 1).to_be_bytes()].concat()
}

/// Bits from the least significant of each byte on.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    used: u32,
}

impl Bits {
    fn push(&mut self, value: u32, count: u32) {
        for k in 0..count {
            if self.used == 0 {
                self.bytes.push(0);
            }
            let last = self.bytes.len() - 1;
            self.bytes[last] |= ((value >> k & 1) as u8) << self.used;
            self.used = (self.used + 1) % 8;
        }
    }

    /// Huffman codes begin with their most significant bit.
    fn push_code(&mut self, code: u32, count: u32) {
        self.push(code.reverse_bits() >> (32 - count), count);
    }
}

/// The checksum of chunks.
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// An image of 5 x 3 texels; `row` bytes a line, after the number of its filter.
fn image(bits: u8, color: Color, row: usize) -> Vec<u8> {
    let lines: Vec<u8> =
        (0..3u8).flat_map(|filter| [filter].into_iter().chain((0..row).map(move |k| (k * 7) as u8 & 3))).collect();
    let palette = chunk(b"PLTE", &[0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255]);
    let mut chunks = vec![header(5, 3, bits, color, false)];
    chunks.extend(matches!(color, Color::Palette).then_some(palette));
    chunks.push(chunk(b"IDAT", &stored(&lines)));
    file(&chunks)
}

/// Of every colour type, interlaced, animated, compressed; and some that are wrong.
pub fn files() -> Vec<Vec<u8>> {
    // A single texel has one pass of one line.
    let interlaced = file(&[header(1, 1, 8, Color::Rgb, true), chunk(b"IDAT", &stored(&[0, 1, 2, 3]))]);
    let compressed = file(&[header(1, 259, 8, Color::Grey, false), chunk(b"IDAT", &deflated_zeros(2))]);
    let texel = chunk(b"IDAT", &stored(&[0, 9]));
    let grey = header(1, 1, 8, Color::Grey, false);
    // One frame, shown without end.
    let animation = chunk(b"acTL", &[0, 0, 0, 1, 0, 0, 0, 0]);
    let animated = file(&[grey.clone(), animation, texel.clone()]);
    let text = chunk(b"zTXt", &[b"note\0\0", &deflated_zeros(20)[..]].concat());
    let huge = file(&[header(60_000, 60_000, 8, Color::Rgba, false), texel.clone()]);
    let nothing = file(&[header(0, 0, 8, Color::Rgba, false), texel.clone()]);
    let mut damaged = image(8, Color::Rgba, 20);
    damaged[30] ^= 1;
    vec![
        image(8, Color::Rgba, 20),
        image(8, Color::Rgb, 15),
        image(8, Color::Grey, 5),
        image(1, Color::Grey, 1),
        image(16, Color::Rgba, 40),
        image(16, Color::GreyAlpha, 20),
        image(2, Color::Palette, 2),
        interlaced,
        animated,
        file(&[grey, text, texel]),
        compressed,
        huge,
        nothing,
        damaged,
    ]
}
