//! OpenEXR pictures: good ones by the `exr` crate in every compression that it writes, bad ones by hand.

use exr::image::Encoding;
use exr::prelude::{
    Blocks, Compression, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, WritableImage, f16,
};
use std::io::Cursor;

/// Those of the good files.
pub const COMPRESSIONS: [Compression; 10] = [
    Compression::ZIP16,
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::PIZ,
    Compression::PXR24,
    Compression::B44,
    Compression::B44A,
    Compression::DWAA(None),
    Compression::DWAB(None),
];

/// A picture with a gradient; in tiles where a side is given for them.
pub fn encoded(width: usize, height: usize, compression: Compression, tile: Option<usize>) -> Vec<u8> {
    let blocks = tile.map_or(Blocks::ScanLines, |side| Blocks::Tiles(Vec2(side, side)));
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        (f16::from_f32(at.x() as f32 * 0.25), f16::from_f32(at.y() as f32), f16::from_f32(0.5))
    });
    let layer = Layer::new((width, height), LayerAttributes::named("sky"), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).expect("memory has room");
    bytes.into_inner()
}

/// A header that says what no writer would, byte by byte, and what follows it.
#[derive(Clone, Debug)]
pub struct Written {
    /// Bits beside the version: 0x200 tiles, 0x800 deep data, 0x1000 several parts.
    pub flags: u32,
    /// What a part is made of, such as `deepscanline`, where that is said.
    pub kind: Option<&'static str>,
    /// Names of channels of 32-bit floats.
    pub channels: Vec<String>,
    /// The compression's number: 0 is none, 3 ZIP of 16 lines, 8 DWAA.
    pub compression: u8,
    /// The last column and line of the picture; the first are 0.
    pub last: [i32; 2],
    /// Width and height of tiles.
    pub tile: Option<[u32; 2]>,
    /// The table of offsets, and blocks.
    pub body: Vec<u8>,
}

impl Default for Written {
    /// Two texels by one, uncompressed.
    fn default() -> Self {
        let texels: Vec<u8> = [0.5f32, 1.0, 1.5, 2.0, 2.5, 3.0].iter().flat_map(|c| c.to_le_bytes()).collect();
        let written = Self {
            flags: 0,
            kind: None,
            channels: ["B", "G", "R"].map(str::to_owned).to_vec(),
            compression: 0,
            last: [1, 0],
            tile: None,
            body: Vec::new(),
        };
        written.with_block(&texels)
    }
}

impl Written {
    /// The same with a body of one block of scan lines.
    pub fn with_block(mut self, block: &[u8]) -> Self {
        self.body.clear();
        let offset = self.bytes().len() as u64 + 8;
        let size = block.len() as i32;
        self.body = [&offset.to_le_bytes()[..], &0i32.to_le_bytes(), &size.to_le_bytes(), block].concat();
        self
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let attribute = |name: &str, kind: &str, value: &[u8]| {
            [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &(value.len() as i32).to_le_bytes(), value].concat()
        };
        let mut channels = Vec::new();
        for name in &self.channels {
            channels.extend([name.as_bytes(), b"\0"].concat());
            // Floats, not perceptually linear, one sample for each texel.
            channels.extend([2, 0, 1, 1].iter().flat_map(|word: &u32| word.to_le_bytes()));
        }
        channels.push(0);
        let window: Vec<u8> = [0, 0, self.last[0], self.last[1]].iter().flat_map(|edge| edge.to_le_bytes()).collect();
        let one = 1f32.to_le_bytes();
        let mut file = [&20_000_630u32.to_le_bytes()[..], &(2 | self.flags).to_le_bytes()].concat();
        file.extend(attribute("channels", "chlist", &channels));
        file.extend(attribute("compression", "compression", &[self.compression]));
        file.extend(attribute("dataWindow", "box2i", &window));
        file.extend(attribute("displayWindow", "box2i", &window));
        file.extend(attribute("lineOrder", "lineOrder", &[0]));
        file.extend(attribute("pixelAspectRatio", "float", &one));
        file.extend(attribute("screenWindowCenter", "v2f", &[0; 8]));
        file.extend(attribute("screenWindowWidth", "float", &one));
        if let Some(kind) = self.kind {
            file.extend(attribute("type", "string", kind.as_bytes()));
        }
        if let Some([width, height]) = self.tile {
            let tiles = [&width.to_le_bytes()[..], &height.to_le_bytes(), &[0]].concat();
            file.extend(attribute("tiles", "tiledesc", &tiles));
        }
        file.push(0);
        file.extend(&self.body);
        file
    }

    /// A block of DWAA whose parts claim this many bytes and values.
    pub fn dwa_that_claims(count: u64) -> Self {
        let mut block: Vec<u8> = [2, count, 8, 8, 8, 8, count, count, count, count, 0]
            .iter()
            .flat_map(|counter: &u64| counter.to_le_bytes())
            .collect();
        // No rules for channels, then the parts.
        block.extend(2u16.to_le_bytes());
        block.extend([0x78, 0x9c, 3, 0, 0, 0, 0, 1].repeat(4));
        Self { compression: 8, last: [15, 7], ..Self::default() }.with_block(&block)
    }
}

/// Good ones, and some that ask for much or for what is not read.
pub fn files() -> Vec<Vec<u8>> {
    let rgb = Written::default();
    let good = COMPRESSIONS.iter().map(|&compression| encoded(9, 5, compression, None));
    let tiled = [encoded(9, 5, Compression::ZIP16, Some(4)), encoded(9, 5, Compression::Uncompressed, Some(16))];
    let nan = rgb.clone().with_block(&f32::NAN.to_le_bytes().repeat(6));
    let bad = [
        Written { last: [i32::MAX / 2 - 2; 2], ..rgb.clone() },
        Written { last: [16383, 8191], compression: 3, ..rgb.clone() },
        Written { tile: Some([1 << 20; 2]), flags: 0x200, ..rgb.clone() },
        Written { channels: vec!["Y".to_owned()], ..rgb.clone() },
        Written { channels: (0..60).map(|k| format!("c{k}")).collect(), ..rgb.clone() },
        Written { flags: 0x800, kind: Some("deepscanline"), ..rgb.clone() },
        Written { flags: 0x1000, ..rgb.clone() },
        Written::dwa_that_claims(1 << 34),
        Written::dwa_that_claims(u64::MAX),
    ];
    good.chain(tiled).chain([rgb, nan].map(|file| file.bytes())).chain(bad.map(|file| file.bytes())).collect()
}
