//! The .exr of a reference: its pixels as channels of 32-bit floats, named so that viewers show the whole picture.

use super::pixels::Rgb;
use super::reference::ReferencePixels;
use crate::error::Failure;
use crate::picture::{ascii, with_sorted_attributes};
use exr::prelude::*;
use std::collections::BTreeMap;
use std::io::Cursor;

/// What a file says of whom it is: place, machine and effort.
const OF: &str = "reference";

type Channels = BTreeMap<String, Vec<f32>>;

/// The file. The same pixels give the same bytes.
pub fn write(pixels: &ReferencePixels, of: &str) -> std::result::Result<Vec<u8>, Failure> {
    let mut channels = Channels::new();
    for (name, pixels) in [("", &pixels.whole), ("glints.", &pixels.glints), ("variance.", &pixels.variance)] {
        for (k, channel) in ["R", "G", "B"].into_iter().enumerate() {
            channels.insert(format!("{name}{channel}"), pixels.iter().map(|pixel| pixel[k]).collect());
        }
    }
    let flags = |flags: &[bool]| flags.iter().map(|flag| f32::from(u8::from(*flag))).collect();
    channels.insert("glinting".to_owned(), flags(&pixels.glinting));
    channels.insert("flakes".to_owned(), pixels.flakes.clone());
    if !pixels.path.is_empty() {
        channels.insert("path.glinting".to_owned(), flags(&pixels.path_glinting));
    }
    for (frame, luminance) in pixels.path.iter().enumerate() {
        channels.insert(frame_name(frame), luminance.clone());
    }
    let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(ascii(&name), FlatSamples::F32(samples)));
    let mut own = LayerAttributes::named("reference");
    own.other.insert(ascii(OF), AttributeValue::Text(ascii(of)));
    let encoding =
        Encoding { compression: Compression::ZIP16, line_order: LineOrder::Increasing, ..Encoding::default() };
    let size = pixels.size.map(|side| side as usize);
    let layer = Layer::new((size[0], size[1]), own, encoding, AnyChannels::sort(list.collect()));
    let mut bytes = Vec::new();
    Image::from_layer(layer)
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| Failure::bad_input(format!("the reference cannot be written as OpenEXR: {error}")))?;
    Ok(with_sorted_attributes(bytes))
}

/// The pixels of a file that is of the same place, machine and effort; none of any other, or of one that is damaged.
pub fn read(bytes: &[u8], of: &str) -> Option<ReferencePixels> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .ok()?;
    let layer = image.layer_data;
    if layer.attributes.other.get(&ascii(OF)) != Some(&AttributeValue::Text(ascii(of))) {
        return None;
    }
    let size = [u32::try_from(layer.size.width()).ok()?, u32::try_from(layer.size.height()).ok()?];
    let mut channels = Channels::new();
    for channel in layer.channel_data.list {
        let FlatSamples::F32(samples) = channel.sample_data else { return None };
        channels.insert(channel.name.to_string(), samples);
    }
    let mut rgb = |name: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|channel| channels.remove(&format!("{name}{channel}")));
        let (r, g, b) = (r?, g?, b?);
        Some(r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect::<Vec<Rgb>>())
    };
    let (whole, glints, variance) = (rgb("")?, rgb("glints.")?, rgb("variance.")?);
    let flags = |samples: Vec<f32>| samples.into_iter().map(|flag| flag != 0.0).collect::<Vec<bool>>();
    let glinting = flags(channels.remove("glinting")?);
    let path: Vec<Vec<f32>> = (0..).map_while(|frame| channels.remove(&frame_name(frame))).collect();
    let path_glinting = channels.remove("path.glinting").map_or_else(|| glinting.clone(), flags);
    let flakes = channels.remove("flakes")?;
    Some(ReferencePixels { size, glinting, flakes, glints, variance, whole, path, path_glinting })
}

fn frame_name(frame: usize) -> String {
    format!("path.{frame:03}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(frames: usize) -> ReferencePixels {
        let rgb = |seed: usize| (0..35).map(|k| [k as f32 * 0.37, seed as f32, 1e-30 * k as f32]).collect::<Vec<Rgb>>();
        let glinting: Vec<bool> = (0..35).map(|k| k % 3 > 0).collect();
        ReferencePixels {
            size: [7, 5],
            flakes: (0..35).map(|k| k as f32 * 1e7).collect(),
            glints: rgb(1),
            variance: rgb(2),
            whole: rgb(3),
            path: (0..frames).map(|frame| (0..35).map(|k| (k * frame) as f32 / 3.0).collect()).collect(),
            path_glinting: if frames > 0 { (0..35).map(|k| k % 4 > 0).collect() } else { glinting.clone() },
            glinting,
        }
    }

    #[test]
    fn every_bit_comes_back() {
        for frames in [0, 12] {
            let bytes = write(&pixels(frames), "plane").expect("a file");
            assert_eq!(read(&bytes, "plane"), Some(pixels(frames)));
            assert_eq!(write(&pixels(frames), "plane").expect("a file"), bytes);
        }
    }

    #[test]
    fn what_is_of_something_else_or_damaged_is_none() {
        let bytes = write(&pixels(2), "plane").expect("a file");
        assert_eq!(read(&bytes, "shoe"), None);
        assert_eq!(read(&bytes[..bytes.len() / 2], "plane"), None);
        assert_eq!(read(b"", "plane"), None);
        let other = crate::picture::Picture { size: [7, 5], radiance: vec![0.0; 140], display: Vec::new() };
        assert_eq!(read(&other.exr(&[("reference", "plane".to_owned())]).expect("a file"), "plane"), None);
    }
}
