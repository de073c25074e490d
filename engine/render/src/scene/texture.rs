//! Images on surfaces, and their mip chains.

use rayon::prelude::*;

/// An image as one kind of use needs it: a file that serves as colour and as data becomes two of these.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// From the file, or made from the image's place in it.
    pub name: String,
    /// Texels across; at least 1.
    pub width: u32,
    /// Texels down; at least 1.
    pub height: u32,
    /// RGBA8, row by row from the top.
    pub pixels: Vec<u8>,
    /// What the bytes mean.
    pub encoding: Encoding,
    /// What happens outside of the unit square, along u and v.
    pub wrap: [Wrap; 2],
    /// Whether texels shall stay visible when magnified.
    pub nearest: bool,
}

/// What the bytes of a texture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Colour by the sRGB transfer curve, opacity linear.
    Srgb,
    /// Four numbers from 0 to 1.
    Linear,
    /// Linear; red, green and blue hold a unit vector's components, mapped from -1..1.
    Normal,
}

/// What happens to texture coordinates outside of the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image again, every other time mirrored.
    Mirror,
    /// The image's border.
    Clamp,
}

/// One image of a mip chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MipLevel {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// RGBA8 in the texture's encoding.
    pub pixels: Vec<u8>,
}

/// How many levels a full mip chain has: each halves both sides, rounding down, until both are 1.
pub fn mip_count(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// The size of one level of a mip chain.
pub fn mip_extent(width: u32, height: u32, level: u32) -> [u32; 2] {
    [width, height].map(|side| side.checked_shr(level).unwrap_or(0).max(1))
}

impl Texture {
    /// The texture itself and every smaller level down to one texel.
    ///
    /// Each texel is the average over exactly its own share of the level above, so that sizes which are no powers of
    /// two neither lose nor shift anything. Colours are averaged in linear light and weighted by opacity (the colour
    /// of a transparent texel is arbitrary); normals are averaged and made unit again.
    pub fn mip_chain(&self) -> Vec<MipLevel> {
        let mut levels = vec![MipLevel { width: self.width, height: self.height, pixels: self.pixels.clone() }];
        let mut source: Option<Plane> = None;
        for level in 1..mip_count(self.width, self.height) {
            let [width, height] = mip_extent(self.width, self.height, level);
            let plane = match &source {
                // The first reduction reads bytes, so that level 0 never exists in floating point.
                None => self.reduce(|x, y| self.decoded(x, y), [self.width, self.height], [width, height]),
                Some(above) => self.reduce(|x, y| above.at(x, y), above.extent, [width, height]),
            };
            levels.push(MipLevel { width, height, pixels: self.encode(&plane) });
            source = Some(plane);
        }
        levels
    }

    /// The texture at the given level of its mip chain, alone.
    pub fn reduced(&self, level: u32) -> Texture {
        let mut chain = self.mip_chain();
        let level = chain.swap_remove((level as usize).min(chain.len() - 1));
        Texture {
            name: self.name.clone(),
            width: level.width,
            height: level.height,
            pixels: level.pixels,
            encoding: self.encoding,
            wrap: self.wrap,
            nearest: self.nearest,
        }
    }

    fn decoded(&self, x: u32, y: u32) -> [f32; 4] {
        let start = (y as usize * self.width as usize + x as usize) * 4;
        let [r, g, b, a] = [0, 1, 2, 3].map(|c| self.pixels[start + c]);
        let a = f32::from(a) / 255.0;
        match self.encoding {
            Encoding::Srgb => [linear_from_srgb8(r), linear_from_srgb8(g), linear_from_srgb8(b), a],
            Encoding::Linear | Encoding::Normal => {
                [f32::from(r) / 255.0, f32::from(g) / 255.0, f32::from(b) / 255.0, a]
            }
        }
    }

    fn reduce(
        &self,
        texel: impl Fn(u32, u32) -> [f32; 4] + Sync,
        [from_width, from_height]: [u32; 2],
        [width, height]: [u32; 2],
    ) -> Plane {
        let columns: Vec<Vec<Share>> = (0..width).map(|x| shares(x, from_width, width)).collect();
        let mut texels = vec![[0.0; 4]; width as usize * height as usize];
        texels.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
            let rows = shares(y as u32, from_height, height);
            for (out, columns) in row.iter_mut().zip(&columns) {
                *out = self.average(rows.iter().flat_map(|down| {
                    let texel = &texel;
                    columns.iter().map(move |across| (texel(across.index, down.index), across.weight * down.weight))
                }));
            }
        });
        Plane { extent: [width, height], texels }
    }

    /// The average of texels by weights that sum to 1.
    fn average(&self, texels: impl Iterator<Item = ([f32; 4], f32)>) -> [f32; 4] {
        let (mut plain, mut by_alpha) = ([0.0f32; 3], [0.0f32; 3]);
        let mut alpha = 0.0;
        for (texel, weight) in texels {
            for c in 0..3 {
                plain[c] += texel[c] * weight;
                by_alpha[c] += texel[c] * weight * texel[3];
            }
            alpha += texel[3] * weight;
        }
        let rgb = match self.encoding {
            Encoding::Srgb if alpha > 0.0 => by_alpha.map(|sum| sum / alpha),
            Encoding::Srgb | Encoding::Linear => plain,
            Encoding::Normal => renormalised(plain),
        };
        [rgb[0], rgb[1], rgb[2], alpha]
    }

    fn encode(&self, plane: &Plane) -> Vec<u8> {
        plane
            .texels
            .par_iter()
            .flat_map_iter(|&[r, g, b, a]| {
                let rgb = match self.encoding {
                    Encoding::Srgb => [r, g, b].map(srgb8_from_linear),
                    Encoding::Linear | Encoding::Normal => [r, g, b].map(unorm8),
                };
                [rgb[0], rgb[1], rgb[2], unorm8(a)]
            })
            .collect()
    }
}

/// A level in linear light.
struct Plane {
    extent: [u32; 2],
    texels: Vec<[f32; 4]>,
}

impl Plane {
    fn at(&self, x: u32, y: u32) -> [f32; 4] {
        self.texels[y as usize * self.extent[0] as usize + x as usize]
    }
}

/// How much of a destination texel one source texel covers.
struct Share {
    index: u32,
    weight: f32,
}

/// The source texels under destination texel `to` when `from_count` are reduced to `to_count`, with weights of sum 1.
fn shares(to: u32, from_count: u32, to_count: u32) -> Vec<Share> {
    // In units of 1 / to_count source texels everything is an integer, so no sliver of rounding appears at the ends.
    let (from, to, units) = (u64::from(from_count), u64::from(to), u64::from(to_count));
    let (start, end) = (to * from, (to + 1) * from);
    (start / units..end.div_ceil(units))
        .map(|index| {
            let covered = end.min((index + 1) * units) - start.max(index * units);
            Share { index: index as u32, weight: covered as f32 / from as f32 }
        })
        .collect()
}

/// A mapped vector made unit; where the vectors cancel, the unbent normal.
fn renormalised(mapped: [f32; 3]) -> [f32; 3] {
    let vector = mapped.map(|c| 2.0 * c - 1.0);
    let length = vector.iter().map(|c| c * c).sum::<f32>().sqrt();
    if length < 1e-3 { [0.5, 0.5, 1.0] } else { vector.map(|c| 0.5 * c / length + 0.5) }
}

fn unorm8(value: f32) -> u8 {
    (value * 255.0).round() as u8
}

/// IEC 61966-2-1, from code value to linear light.
fn linear_from_srgb8(code: u8) -> f32 {
    static TABLE: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
        std::array::from_fn(|code| {
            let encoded = code as f64 / 255.0;
            (if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }) as f32
        })
    });
    TABLE[usize::from(code)]
}

/// IEC 61966-2-1, from linear light to code value.
fn srgb8_from_linear(linear: f32) -> u8 {
    unorm8(if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 })
}
