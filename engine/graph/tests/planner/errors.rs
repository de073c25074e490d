//! Frames that cannot be planned, and what is said of them.

use crate::frames::requirements;
use crate::shaders::{COMPUTE, Compute, Raster};
use mica_graph::{
    Access, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Plan, PlanError, Requirements, Slot, Stages,
    Use, Work,
};
use std::sync::Arc;

const SIZE: Extent = Extent::new(4, 4);

fn error(graph: Graph) -> PlanError {
    let error = Plan::new(graph, &requirements).expect_err("the frame is not well formed");
    assert_eq!(error.to_string().lines().count(), 1);
    error
}

fn used(resource: &Image, slot: Slot, access: Access) -> Use {
    Use { resource: resource.resource().clone(), slot, access, stages: Stages::COMPUTE }
}

fn compute() -> Work {
    Work::Compute { shader: &COMPUTE, params: Vec::new(), groups: [1, 1, 1] }
}

#[test]
fn reading_what_nothing_wrote_is_an_error() {
    let mut g = Graph::new();
    let radiance = g.image("radiance", Format::Rgba16Float, SIZE);
    let mut display = g.image("display", Format::Rgba8, SIZE);
    g.pass_named("tonemap", Compute { reads: vec![&radiance], writes: vec![&mut display] }, (), SIZE);
    let error = error(g);
    assert_eq!(error, PlanError::ReadBeforeWrite { pass: "tonemap".into(), resource: "radiance".into() });
    assert_eq!(
        error.to_string(),
        "pass tonemap reads radiance, which no pass before it writes: write it first in this frame"
    );
}

#[test]
fn updating_what_nothing_wrote_is_an_error() {
    let mut g = Graph::new();
    let counter = g.image("counter", Format::R32Uint, SIZE);
    g.push("count", compute(), vec![used(&counter, Slot::Binding(0), Access::StorageReadWrite)]);
    assert_eq!(error(g), PlanError::ReadBeforeWrite { pass: "count".into(), resource: "counter".into() });
}

#[test]
fn a_write_that_comes_later_does_not_define_a_read() {
    let mut g = Graph::new();
    let mut mask = g.image("mask", Format::Rgba8, SIZE);
    g.download_image(&mask);
    g.clear(&mut mask, 1.0);
    assert_eq!(error(g), PlanError::ReadBeforeWrite { pass: "download mask".into(), resource: "mask".into() });
}

#[test]
fn a_mistake_in_a_pass_that_would_be_culled_is_still_one() {
    let mut g = Graph::new();
    let depth = g.image("depth", Format::R32Float, SIZE);
    g.push("inspect", compute(), vec![used(&depth, Slot::Binding(0), Access::Sampled)]);
    assert_eq!(error(g), PlanError::ReadBeforeWrite { pass: "inspect".into(), resource: "depth".into() });
}

#[test]
fn what_outlives_the_frame_may_be_read_before_it_is_written() {
    let mut g = Graph::new();
    let history = Image::new("history", ImageDesc::new(Format::Rgba8, SIZE), Lifetime::Scene);
    g.download_image(&history);
    assert!(Plan::new(g, &requirements).is_ok());
}

#[test]
fn exporting_what_nothing_wrote_is_an_error() {
    let mut g = Graph::new();
    let display = g.image("display", Format::Rgba8, SIZE);
    g.export(&display);
    let error = error(g);
    assert_eq!(error, PlanError::ExportNeverWritten { resource: "display".into() });
    assert!(error.to_string().contains("display"));
}

#[test]
fn a_pass_may_not_write_what_it_uses_twice() {
    let image = Image::new("radiance", ImageDesc::new(Format::Rgba8, SIZE), Lifetime::Scene);
    let pairs = [
        (Access::Sampled, Access::StorageWrite),
        (Access::StorageWrite, Access::Sampled),
        (Access::StorageWrite, Access::StorageWrite),
        (Access::StorageReadWrite, Access::StorageRead),
    ];
    for (first, second) in pairs {
        let mut g = Graph::new();
        g.push("blur", compute(), vec![used(&image, Slot::Binding(0), first), used(&image, Slot::Binding(1), second)]);
        assert_eq!(error(g), PlanError::UsedTwice { pass: "blur".into(), resource: "radiance".into() });
    }
}

#[test]
fn a_pass_may_read_a_resource_twice() {
    let mut g = Graph::new();
    let image = Image::new("radiance", ImageDesc::new(Format::Rgba8, SIZE), Lifetime::Scene);
    let reads = [Access::Sampled, Access::StorageRead].map(|access| used(&image, Slot::None, access));
    g.push("compare", compute(), reads.to_vec());
    assert!(Plan::new(g, &requirements).is_ok());
}

#[test]
fn an_attachment_has_the_size_of_its_pass() {
    let mut g = Graph::new();
    let mesh = Buffer::new("mesh", 12, Lifetime::Scene);
    let mut color = g.image("color", Format::Rgba8, SIZE);
    let mut depth = g.image("depth", Format::Depth32, Extent::new(4, 3));
    g.raster(Raster { mesh: &mesh, color: &mut color, depth: &mut depth }, (), Arc::from([]), SIZE);
    let error = error(g);
    assert!(
        matches!(&error, PlanError::AttachmentExtent { pass, resource, .. } if pass == "raster" && resource == "depth")
    );
    assert_eq!(error.to_string(), "pass raster draws 4x4 into depth, which is 4x3: make them equal");
}

#[test]
fn only_images_in_raster_passes_are_attachments() {
    let mut g = Graph::new();
    let color = g.image("color", Format::Rgba8, SIZE);
    g.push("shade", compute(), vec![used(&color, Slot::Color(0), Access::ColorWrite)]);
    assert_eq!(error(g), PlanError::NotAnAttachment { pass: "shade".into(), resource: "color".into() });
}

#[test]
fn a_resource_has_at_least_one_byte() {
    let mut g = Graph::new();
    let mut table = g.buffer("table", 0);
    g.fill(&mut table, 0);
    let error_of_buffer = error(g);
    assert_eq!(error_of_buffer, PlanError::ZeroSize { pass: "fill table".into(), resource: "table".into() });

    for desc in
        [ImageDesc::new(Format::Rgba8, Extent::new(0, 4)), ImageDesc { mips: 0, ..ImageDesc::new(Format::Rgba8, SIZE) }]
    {
        let mut g = Graph::new();
        let mut image = Image::new("empty", desc, Lifetime::Scene);
        g.clear(&mut image, 0.0);
        assert_eq!(error(g), PlanError::ZeroSize { pass: "clear empty".into(), resource: "empty".into() });
    }
}

#[test]
fn sizes_beyond_64_bits_are_an_error_and_not_an_overflow() {
    let huge = |_: &_, _: &_| Requirements { bytes: u64::MAX - 10, alignment: 256 };
    let mut g = Graph::new();
    for name in ["first", "second"] {
        let mut image = g.image(name, Format::Rgba8, SIZE);
        g.clear(&mut image, 0.0);
        g.export(&image);
    }
    let error = Plan::new(g, &huge).expect_err("two of them cannot fit");
    assert_eq!(error, PlanError::TooLarge { resource: "second".into() });

    let extent = Extent::volume(u32::MAX, u32::MAX, u32::MAX);
    assert_eq!(ImageDesc::new(Format::Rgba32Float, extent).bytes(), u64::MAX);
}
