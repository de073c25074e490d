//! Mutations: a few bits, bytes, numbers, words or stretches of a good or bad file changed, and then, mostly, its lengths
//! and checksums made right again, so that the change is seen behind them.

use crate::Format;
use crate::corpus::png;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// Values of lengths and indices at which arithmetic breaks.
const NUMBERS: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 34,
    0x7fff_ffff_ffff_ffff,
    1 << 63,
    u64::MAX,
];

/// The same in JSON, and what is a number nowhere else.
const TEXT_NUMBERS: [&str; 12] = [
    "-1",
    "0",
    "1e999",
    "-0.0",
    "0.5",
    "65536",
    "4294967295",
    "4294967296",
    "16777217",
    "1e308",
    "18446744073709551615",
    "1e-320",
];

/// Words of the formats.
fn words(format: Format) -> &'static [&'static [u8]] {
    match format {
        Format::Gltf | Format::Glb => &[
            b"{}",
            b"[]",
            b"null",
            b"true",
            b"\"\"",
            b"\"\\u0000\"",
            b"\"\\ud800\"",
            b"[[[[[[[[",
            b"\"sparse\":{}",
            b"\"children\":[0]",
            b"\"mode\":5",
            b"\"mode\":6",
            b"\"byteStride\":4",
            b"\"normalized\":true",
            b"MAT4",
            b"SCALAR",
            b"5121",
            b"5125",
            b"data:;base64,",
            b"../",
            b"file:///",
            b"JSON",
            b"BIN\0",
            b"glTF",
            b"\"extensionsRequired\":[\"x\"]",
            b"\"extras\":1",
            b"\"uri\":\"x\"",
            b"\"KHR_draco_mesh_compression\":{}",
        ],
        Format::Exr => &[
            b"chlist\0",
            b"compression\0",
            b"tiledesc\0",
            b"box2i\0",
            b"dataWindow\0",
            b"displayWindow\0",
            b"tiles\0",
            b"type\0string\0\x09\0\0\0deepimage",
            b"scanlineimage",
            b"tiledimage",
            b"deepscanline",
            b"name\0",
            b"chunkCount\0int\0",
            b"R\0\x01\0\0\0",
            b"G\0\x02\0\0\0",
            b"\x76\x2f\x31\x01",
            b"preview\0preview\0",
        ],
        Format::Hdr => &[
            b"#?RADIANCE\n",
            b"#?RGBE\n",
            b"EXPOSURE=1e40\n",
            b"FORMAT=32-bit_rle_xyze\n",
            b"\n\n",
            b"-Y 1 +X 8\n",
            b"+X 8 -Y 1\n",
            b"-Y 0 +X 0\n",
            b"-Y 4294967295 +X 2\n",
            b"\x02\x02\x00\x10",
            b"\x02\x02\x7f\xff",
            b"\x01\x01\x01\xff",
            b"PIXASPECT=0\n",
            b"COLORCORR=1 1 1\n",
        ],
        Format::Png => &[
            b"IHDR",
            b"IDAT",
            b"IEND",
            b"PLTE",
            b"tRNS",
            b"acTL",
            b"fcTL",
            b"fdAT",
            b"iCCP",
            b"zTXt",
            b"iTXt",
            b"gAMA",
            b"cHRM",
            b"sRGB",
            b"eXIf",
            b"\x78\x9c",
            b"\x78\x01",
        ],
        Format::Jpeg => &[
            b"\xff\xd8",
            b"\xff\xd9",
            b"\xff\xc0\0\x11\x08",
            b"\xff\xc2\0\x11\x08",
            b"\xff\xc4\0\x1f",
            b"\xff\xda\0\x0c\x03",
            b"\xff\xdb\0\x43",
            b"\xff\xdd\0\x04\0\x01",
            b"\xff\xd0",
            b"\xff\xee\0\x0eAdobe",
            b"\xff\xe1\0\x08Exif\0\0",
            b"\xff\0",
        ],
        Format::Cache => &[b"MICA\x01\r\n\x1a", b"MICA", b"\0\0\0\0\0\0\0\0"],
    }
}

/// Input `index` of a seed, from the format's corpus: the same bytes on every machine.
pub fn input(format: Format, corpus: &[Vec<u8>], seed: u64, index: u64) -> Vec<u8> {
    let state = u128::from(seed) << 64 | u128::from(index);
    let mut random = Random(Pcg64Mcg::new(state.wrapping_mul(0x2545_f491_4f6c_dd1d_9e37_79b9_7f4a_7c15) ^ state));
    // The first numbers of neighbouring states resemble each other.
    for _ in 0..4 {
        random.below(1);
    }
    // Those in front more often: they are good, and most of the readers is seen by what is nearly good.
    let mut bytes = corpus[random.below(corpus.len()).min(random.below(corpus.len()))].clone();
    for _ in 0..=random.below(3) {
        random.change(format, corpus, &mut bytes);
    }
    if random.below(8) > 0 {
        match format {
            Format::Glb => mend_glb(&mut bytes),
            Format::Png => mend_png(&mut bytes),
            _ => {}
        }
    }
    bytes
}

struct Random(Pcg64Mcg);

impl Random {
    /// A number below a limit, or 0.
    fn below(&mut self, limit: usize) -> usize {
        self.0.next_u32() as usize % limit.max(1)
    }

    fn one_of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }

    fn change(&mut self, format: Format, corpus: &[Vec<u8>], bytes: &mut Vec<u8>) {
        let at = self.below(bytes.len());
        let end = (at + 1 + self.below(24)).min(bytes.len());
        let is_text = matches!(format, Format::Gltf | Format::Glb | Format::Hdr);
        match self.below(if is_text { 24 } else { 9 }) {
            _ if bytes.is_empty() => bytes.push(self.below(256) as u8),
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = self.below(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let doubled = bytes[at..end].to_vec();
                bytes.splice(at..at, doubled);
            }
            4 => bytes.truncate(at),
            5 => {
                // A stretch of another file of the corpus, in place of one of this.
                let other = self.one_of(corpus);
                let from = self.below(other.len());
                let to = (from + 1 + self.below(64)).min(other.len());
                bytes.splice(at..end, other[from.min(to)..to].iter().copied());
            }
            6 => {
                let word = *self.one_of(words(format));
                let end = if self.below(2) == 0 { at } else { (at + word.len()).min(bytes.len()) };
                bytes.splice(at..end, word.iter().copied());
            }
            7 | 8 => {
                // A number of 1, 2, 4 or 8 bytes in either order, or one beside that which is there.
                let width = 1 << self.below(4);
                let Some(place) = bytes.get_mut(at..at + width) else { return };
                let little = self.below(4) > 0;
                let mut number = [0; 8];
                number[..width].copy_from_slice(place);
                let there = u64::from_le_bytes(number);
                let number = match self.below(3) {
                    0 if little => there.wrapping_add(1),
                    1 if little => there.wrapping_sub(1),
                    _ => *self.one_of(&NUMBERS),
                };
                place.copy_from_slice(&number.to_le_bytes()[..width]);
                if !little {
                    place.reverse();
                }
            }
            kind => {
                // Another number in text that stays text.
                let Some(ahead) = bytes[at..].iter().position(u8::is_ascii_digit) else { return };
                let start = at + ahead;
                let end = start + bytes[start..].iter().take_while(|byte| byte.is_ascii_digit()).count();
                if kind < 13 {
                    let number = *self.one_of(&TEXT_NUMBERS);
                    bytes.splice(start..end, number.bytes());
                } else {
                    bytes[start] = b'0' + self.below(10) as u8;
                }
            }
        }
    }
}

/// Makes the length of a binary glTF and of its first chunk right again: the second follows where it did.
fn mend_glb(bytes: &mut [u8]) {
    let total = bytes.len() as u32;
    let binary = bytes.windows(4).rposition(|word| word == b"BIN\0").filter(|&at| at >= 24);
    let Some(header) = bytes.get_mut(..20) else { return };
    header[..4].copy_from_slice(b"glTF");
    header[4..8].copy_from_slice(&2u32.to_le_bytes());
    header[8..12].copy_from_slice(&total.to_le_bytes());
    header[12..16].copy_from_slice(&(binary.map_or(total - 20, |at| at as u32 - 24)).to_le_bytes());
    header[16..20].copy_from_slice(b"JSON");
    if let Some(at) = binary {
        bytes[at - 4..at].copy_from_slice(&(total - at as u32 - 4).to_le_bytes());
    }
}

/// Makes the checksums of chunks right again, as far as their lengths lead.
fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let end = at + 8 + length;
        let Some(body) = bytes.get(at + 4..end) else { return };
        let crc = png::crc32(body).to_be_bytes();
        let Some(sum) = bytes.get_mut(end..end + 4) else { return };
        sum.copy_from_slice(&crc);
        at = end + 4;
    }
}
