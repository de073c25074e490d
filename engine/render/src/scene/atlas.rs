//! All textures in two array images, one for sRGB and one for linear bytes: where drivers have no bindless textures, a
//! shader finds each by a record and fetches its texels by hand.

use super::texture::{Encoding, MipLevel, Texture, Wrap, mip_count, mip_extent};
use rayon::prelude::*;

/// How large the array images may be; what a device allows at least is 4096 texels and 256 layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasLimits {
    /// One side of a layer, texels.
    pub side: u32,
    /// Layers of one array.
    pub layers: u32,
    /// One array, bytes.
    pub bytes: u64,
}

impl Default for AtlasLimits {
    fn default() -> Self {
        Self { side: 4096, layers: 256, bytes: 2 << 30 }
    }
}

/// Every texture of a scene with its mip chain, packed.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Textures whose colours follow the sRGB curve.
    pub srgb: AtlasImage,
    /// The others.
    pub linear: AtlasImage,
    /// One per texture, in their order.
    pub records: Vec<AtlasRecord>,
    /// Which textures had to be made smaller.
    pub warnings: Vec<String>,
}

/// An array of square layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AtlasImage {
    /// Texels on a side; a power of two.
    pub side: u32,
    /// At least 1: where there are no textures, one white texel stands in, so that there is something to bind.
    pub layers: u32,
    /// RGBA8, layer by layer, row by row from the top.
    pub bytes: Vec<u8>,
}

/// Where a texture lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasRecord {
    /// Layer of the array.
    pub layer: u32,
    /// Left edge of level 0, texels.
    pub x: u32,
    /// Top edge of level 0, texels.
    pub y: u32,
    /// Texels of level 0 across.
    pub width: u32,
    /// Texels of level 0 down.
    pub height: u32,
    /// Levels, down to a single texel.
    pub mips: u32,
    /// What happens outside of the unit square, along u and v.
    pub wrap: [Wrap; 2],
    /// Whether it lies in [`Atlas::srgb`].
    pub srgb: bool,
    /// Whether it is magnified without interpolation.
    pub nearest: bool,
}

impl AtlasRecord {
    /// The size of one level, texels.
    pub fn mip_extent(&self, level: u32) -> [u32; 2] {
        mip_extent(self.width, self.height, level)
    }

    /// The left and top edge of one level: those after the first stand below each other, at the right of it.
    pub fn mip_origin(&self, level: u32) -> [u32; 2] {
        match level {
            0 => [self.x, self.y],
            _ => [self.x + self.width, self.y + (1..level).map(|above| self.mip_extent(above)[1]).sum::<u32>()],
        }
    }
}

impl Atlas {
    /// Packs the textures. Those too large for a layer are halved until they fit, and when they are too many for the
    /// array, the largest are.
    pub fn pack(textures: &[Texture], limits: AtlasLimits) -> Atlas {
        let mut warnings = Vec::new();
        let mut records = vec![None; textures.len()];
        let mut pack = |srgb: bool| {
            let members: Vec<usize> =
                (0..textures.len()).filter(|&k| (textures[k].encoding == Encoding::Srgb) == srgb).collect();
            pack_array(textures, &members, limits, &mut records, &mut warnings)
        };
        let (srgb, linear) = (pack(true), pack(false));
        Atlas { srgb, linear, records: records.into_iter().flatten().collect(), warnings }
    }
}

/// A texture and the rectangle that its mip chain takes.
struct Item {
    texture: usize,
    /// How often it was halved.
    skipped: u32,
    extent: [u32; 2],
}

impl Item {
    fn new(textures: &[Texture], texture: usize, skipped: u32) -> Self {
        let extent = mip_extent(textures[texture].width, textures[texture].height, skipped);
        Self { texture, skipped, extent }
    }

    fn footprint(&self) -> [u32; 2] {
        let [width, height] = self.extent;
        let levels = mip_count(width, height);
        if levels == 1 {
            return self.extent;
        }
        let column: u32 = (1..levels).map(|level| mip_extent(width, height, level)[1]).sum();
        [width + mip_extent(width, height, 1)[0], height.max(column)]
    }
}

fn pack_array(
    textures: &[Texture],
    members: &[usize],
    limits: AtlasLimits,
    records: &mut [Option<AtlasRecord>],
    warnings: &mut Vec<String>,
) -> AtlasImage {
    if members.is_empty() {
        return AtlasImage { side: 1, layers: 1, bytes: vec![255; 4] };
    }
    let limit = 1 << limits.side.max(2).ilog2();
    let fitting = |texture: usize| {
        let mut item = Item::new(textures, texture, 0);
        while item.footprint().iter().any(|&side| side > limit) {
            item = Item::new(textures, texture, item.skipped + 1);
        }
        item
    };
    let mut items: Vec<Item> = members.iter().map(|&texture| fitting(texture)).collect();
    let (side, places) = loop {
        let side = layer_side(&items, limit);
        let places = shelves(&items, side);
        let layers = places.iter().map(|place| place[0]).max().unwrap_or(0) + 1;
        let largest = items.iter().map(|item| item.extent[0].max(item.extent[1])).max().unwrap_or(1);
        let fits = layers <= limits.layers && u64::from(layers) * u64::from(side).pow(2) * 4 <= limits.bytes;
        if fits || largest == 1 {
            break (side, places);
        }
        for item in items.iter_mut().filter(|item| item.extent[0].max(item.extent[1]) == largest) {
            *item = Item::new(textures, item.texture, item.skipped + 1);
        }
    };

    let layers = places.iter().map(|place| place[0]).max().unwrap_or(0) + 1;
    let row_bytes = side as usize * 4;
    let mut bytes = vec![0; row_bytes * side as usize * layers as usize];
    // A few chains at a time, as each holds a third more than its texture.
    for (items, places) in items.chunks(8).zip(places.chunks(8)) {
        let chains: Vec<Vec<MipLevel>> =
            items.par_iter().map(|item| textures[item.texture].mip_chain().split_off(item.skipped as usize)).collect();
        for ((item, chain), &[layer, x, y]) in items.iter().zip(chains).zip(places) {
            let texture = &textures[item.texture];
            let [width, height] = item.extent;
            if item.skipped > 0 {
                warnings.push(format!(
                    "texture {} is used at {width} x {height} instead of {} x {}, to fit the device",
                    texture.name, texture.width, texture.height
                ));
            }
            let record = AtlasRecord {
                layer,
                x,
                y,
                width,
                height,
                mips: chain.len() as u32,
                wrap: texture.wrap,
                srgb: texture.encoding == Encoding::Srgb,
                nearest: texture.nearest,
            };
            for (level, mip) in chain.iter().enumerate() {
                let [x, y] = record.mip_origin(level as u32);
                for (row, texels) in mip.pixels.chunks_exact(mip.width as usize * 4).enumerate() {
                    let row = (layer as usize * side as usize) + y as usize + row;
                    let start = row * row_bytes + x as usize * 4;
                    bytes[start..start + texels.len()].copy_from_slice(texels);
                }
            }
            records[item.texture] = Some(record);
        }
    }
    AtlasImage { side, layers, bytes }
}

/// The smallest power of two that holds the largest item and, if the limit allows, all of them in one layer.
fn layer_side(items: &[Item], limit: u32) -> u32 {
    let footprints = || items.iter().map(Item::footprint);
    let longest = footprints().flatten().max().unwrap_or(1).next_power_of_two();
    (longest.ilog2()..=limit.ilog2())
        .map(|log2| 1 << log2)
        .find(|&side| shelves(items, side).iter().all(|place| place[0] == 0))
        // Whether several layers are small or large makes little difference to their sum; large ones need fewer.
        .unwrap_or(limit)
}

/// Layer, left and top edge of each item: tallest first, side by side on shelves, shelves below each other.
fn shelves(items: &[Item], side: u32) -> Vec<[u32; 3]> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(items[k].footprint()[1]));
    let mut places = vec![[0; 3]; items.len()];
    let [mut layer, mut x, mut y, mut shelf] = [0; 4];
    for k in order {
        let [width, height] = items[k].footprint();
        if x + width > side {
            (x, y, shelf) = (0, y + shelf, 0);
        }
        if y + height > side {
            (layer, x, y, shelf) = (layer + 1, 0, 0, 0);
        }
        places[k] = [layer, x, y];
        x += width;
        shelf = shelf.max(height);
    }
    places
}
