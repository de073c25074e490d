//! Uploads, downloads, copies and fills.

use crate::common::{Checked, bytes_of, floats, words};
use mica_gpu::{Error, Timing};
use mica_graph::{Access, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Slot, Stages, Use, Work};

const FORMATS: [Format; 9] = [
    Format::Rgba8,
    Format::Rgba8Srgb,
    Format::R32Uint,
    Format::Rg32Uint,
    Format::R32Float,
    Format::Rg32Float,
    Format::Rgba16Float,
    Format::Rgba32Float,
    Format::Depth32,
];

/// Bytes that are finite in every float format and depths of 0 to 1, each word of its own.
fn texels(desc: &ImageDesc) -> Vec<u8> {
    let count = desc.bytes() / 4;
    bytes_of(&(0..count).map(|i| (i as f32 / count as f32).to_bits()).collect::<Vec<u32>>())
}

#[test]
fn an_update_changes_its_part_of_a_buffer_and_nothing_else() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut kept = Buffer::new("kept", 32, Lifetime::Scene);
    let mut graph = Graph::new();
    graph.upload(&mut kept, bytes_of(&[1, 2, 3, 4, 5, 6, 7, 8]));
    executor.run(graph, Timing::Overlapped).expect("the frame runs");
    let mut graph = Graph::new();
    graph.update(&mut kept, 8, bytes_of(&[30, 40]));
    graph.update(&mut kept, 28, bytes_of(&[80]));
    let download = graph.download(&kept);
    let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
    assert_eq!(words(&run.take(download)), [1, 2, 30, 40, 5, 6, 7, 80]);

    // What is declared by hand is checked once more.
    for (data, offset) in [(vec![0; 8], 28), (vec![0; 4], u64::MAX), (Vec::new(), 0)] {
        let mut graph = Graph::new();
        let (slot, access, stages) = (Slot::None, Access::TransferUpdate, Stages::TRANSFER);
        let uses = vec![Use { resource: kept.resource().clone(), slot, access, stages }];
        graph.push("update", Work::Update { data: data.into(), offset }, uses);
        let error = executor.run(graph, Timing::Overlapped).expect_err("there is no such part");
        assert!(matches!(&error, Error::BadUse { resource, .. } if resource == "kept"), "{error}");
    }
}

#[test]
fn images_with_levels_and_layers_come_back_as_they_went() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut tried = 0;
    for format in FORMATS {
        for (extent, mips, layers) in [
            (Extent::new(1, 1), 1, 0),
            (Extent::new(13, 7), 4, 0),
            (Extent::new(16, 5), 1, 3),
            (Extent::new(9, 16), 5, 2),
            (Extent::volume(6, 5, 4), 3, 0),
        ] {
            if format == Format::Depth32 && extent.depth > 1 {
                continue;
            }
            for lifetime in [Lifetime::Frame, Lifetime::Scene] {
                let desc = ImageDesc { format, extent, mips, layers };
                let (mut image, mut copy) = (Image::new("image", desc, lifetime), Image::new("copy", desc, lifetime));
                let data = texels(&desc);
                let mut graph = Graph::new();
                graph.upload_image(&mut image, data.clone());
                graph.copy_image(&image, &mut copy);
                let downloads = [graph.download_image(&image), graph.download_image(&copy)];
                let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
                for download in downloads {
                    assert_eq!(run.take(download), data, "{desc:?} {lifetime:?}");
                }
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 2 * (9 * 5 - 1));
}

#[test]
fn buffers_of_odd_sizes_come_back_as_they_went() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut graph = Graph::new();
    let mut expected = Vec::new();
    for bytes in [1, 3, 4, 15, 17, 1000, 65_537] {
        let data: Vec<u8> = (0..bytes).map(|i| (i * 7 % 251) as u8).collect();
        let mut buffer = graph.buffer(format!("of {bytes}"), bytes);
        graph.upload(&mut buffer, data.clone());
        let copy = graph.buffer(format!("copy of {bytes}"), bytes);
        let transfer = |buffer: &Buffer, access| Use {
            resource: buffer.resource().clone(),
            slot: Slot::None,
            access,
            stages: Stages::TRANSFER,
        };
        let uses = vec![transfer(&buffer, Access::TransferRead), transfer(&copy, Access::TransferWrite)];
        graph.push("copy", Work::Copy, uses);
        expected.push((graph.download(&copy), data));
    }
    let mut run = executor.run(graph, Timing::Isolated).expect("the frame runs");
    for (download, data) in expected {
        assert_eq!(run.take(download), data);
    }
}

#[test]
fn fills_set_every_word_and_every_channel() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut graph = Graph::new();
    let mut buffer = graph.buffer("buffer", 400);
    graph.fill(&mut buffer, 0xdead_beef);
    let buffer = graph.download(&buffer);
    let mut image = |format| {
        let desc = ImageDesc { mips: 2, layers: 2, ..ImageDesc::new(format, Extent::new(4, 4)) };
        let mut image = Image::new("image", desc, Lifetime::Frame);
        graph.clear(&mut image, 0.25);
        graph.download_image(&image)
    };
    let (color, depth, integer) = (image(Format::Rgba32Float), image(Format::Depth32), image(Format::Rg32Uint));
    let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
    assert_eq!(words(&run.take(buffer)), [0xdead_beef; 100]);
    assert_eq!(floats(&run.take(color)), [0.25; 2 * (16 + 4) * 4]);
    assert_eq!(floats(&run.take(depth)), [0.25; 2 * (16 + 4)]);
    assert_eq!(words(&run.take(integer)), [0.25_f32.to_bits(); 2 * (16 + 4) * 2]);
}

#[test]
fn an_image_that_the_device_cannot_hold_is_refused_by_name() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let side = checked.device().info().limits.max_image_side_2d;
    let flat = ImageDesc::new(Format::Rgba8, Extent::new(8, 8));
    for (name, desc) in [
        ("wide", ImageDesc::new(Format::Rgba8, Extent::new(side + 1, 1))),
        ("deep", ImageDesc { layers: 2, ..ImageDesc::new(Format::Rgba8, Extent::volume(4, 4, 4)) }),
        ("with levels", ImageDesc { mips: 5, ..flat }),
        ("without levels", ImageDesc { mips: 0, ..flat }),
        ("layered", ImageDesc { layers: u32::MAX, ..flat }),
    ] {
        for lifetime in [Lifetime::Frame, Lifetime::Scene] {
            let mut image = Image::new(name, desc, lifetime);
            let mut graph = Graph::new();
            graph.clear(&mut image, 0.0);
            graph.download_image(&image);
            let error = executor.run(graph, Timing::Overlapped).expect_err("the image cannot be");
            let named = match &error {
                Error::BadResource { resource, .. } => resource == name,
                Error::Plan(error) => error.to_string().contains(name),
                _ => false,
            };
            assert!(named, "{error:?}");
        }
    }
}
