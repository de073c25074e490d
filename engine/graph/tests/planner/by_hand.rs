//! Small frames whose plans are known.

use crate::frames::requirements;
use crate::shaders::{COMPUTE, Compute, Raster};
use mica_graph::{
    Access, Barrier, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, MeshRange, Plan, Requirements, Slot,
    Stages, Step, Structure, TrianglesDesc, Use, Work,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const SIZE: Extent = Extent::new(4, 4);

fn plan(graph: Graph) -> Plan {
    Plan::new(graph, &requirements).expect("the frame is well formed")
}

fn kept(name: &str, lifetime: Lifetime) -> Image {
    Image::new(name, ImageDesc::new(Format::Rgba16Float, SIZE), lifetime)
}

fn pass(g: &mut Graph, name: &str, reads: Vec<&Image>, writes: Vec<&mut Image>) {
    g.pass_named(name, Compute { reads, writes }, (), SIZE);
}

/// The barriers, each with the pass it comes before.
fn barriers(plan: &Plan) -> Vec<(&str, &Barrier)> {
    let pairs = plan.steps.windows(2).filter_map(|pair| match pair {
        [Step::Synchronize { barrier, .. }, Step::Run(pass)] => Some((plan.passes[*pass].name.as_str(), barrier)),
        _ => None,
    });
    pairs.collect()
}

fn names(plan: &Plan) -> Vec<&str> {
    plan.passes.iter().map(|pass| pass.name.as_str()).collect()
}

#[test]
fn passes_that_share_nothing_have_no_barrier() {
    let mut g = Graph::new();
    let mut images: Vec<Image> = (0..5).map(|it| kept(&format!("table{it}"), Lifetime::Settings)).collect();
    for (number, image) in images.iter_mut().enumerate() {
        pass(&mut g, &format!("build{number}"), vec![], vec![image]);
    }
    assert_eq!(barriers(&plan(g)), []);
}

#[test]
fn images_that_begin_wait_for_nothing_that_they_share_no_byte_with() {
    let mut g = Graph::new();
    for name in ["left", "right"] {
        let mut image = g.image(name, Format::Rgba8, SIZE);
        pass(&mut g, name, vec![], vec![&mut image]);
        g.export(&image);
    }
    let plan = plan(g);
    assert_eq!(barriers(&plan).len(), 2);
    assert!(barriers(&plan).iter().all(|(_, barrier)| barrier.from_stages.is_empty() && barrier.why.is_empty()));
}

#[test]
fn readers_do_not_wait_for_each_other() {
    let mut g = Graph::new();
    let environment = kept("environment", Lifetime::Scene);
    for name in ["a", "b", "c"] {
        let mut out = kept(name, Lifetime::Settings);
        pass(&mut g, name, vec![&environment], vec![&mut out]);
    }
    assert_eq!(barriers(&plan(g)), []);
}

#[test]
fn three_readers_of_one_write_take_one_barrier() {
    let mut g = Graph::new();
    let mut table = kept("table", Lifetime::Settings);
    pass(&mut g, "build", vec![], vec![&mut table]);
    for name in ["a", "b", "c"] {
        let mut out = kept(name, Lifetime::Settings);
        pass(&mut g, name, vec![&table], vec![&mut out]);
    }
    let barrier = Barrier {
        from_stages: Stages::COMPUTE,
        from_access: BTreeSet::from([Access::StorageWrite]),
        to_stages: Stages::COMPUTE,
        to_access: BTreeSet::from([Access::Sampled]),
        why: vec!["table: build writes, a reads".into()],
    };
    assert_eq!(barriers(&plan(g)), [("a", &barrier)]);
}

#[test]
fn a_pass_that_reads_twice_waits_for_both_reads_and_says_so_once() {
    let mut g = Graph::new();
    let mut table = kept("table", Lifetime::Settings);
    let mut out = kept("out", Lifetime::Settings);
    g.clear(&mut table, 0.0);
    g.pass_named("blur", Compute { reads: vec![&table, &table], writes: vec![&mut out] }, (), SIZE);
    let plan = plan(g);
    assert_eq!(barriers(&plan)[0].1.why, ["table: clear table writes, blur reads"]);
}

#[test]
fn a_write_settles_for_later_readers_what_came_before_it() {
    let mut g = Graph::new();
    let mut counter = Buffer::new("counter", 4, Lifetime::Settings);
    g.fill(&mut counter, 0);
    let count = Use {
        resource: counter.resource().clone(),
        slot: Slot::Binding(0),
        access: Access::StorageReadWrite,
        stages: Stages::COMPUTE,
    };
    g.push("count", Work::Compute { shader: &COMPUTE, params: vec![], groups: [1; 3] }, vec![count]);
    g.download(&counter);
    let plan = plan(g);
    let (before, barrier) = barriers(&plan)[1];
    assert_eq!((before, barrier.from_stages), ("download counter", Stages::COMPUTE));
    assert_eq!(barrier.why, ["counter: count updates, download counter reads"]);
}

#[test]
fn a_write_after_reads_waits_but_makes_nothing_visible() {
    let mut g = Graph::new();
    let mut history = kept("history", Lifetime::Scene);
    let mut current = kept("current", Lifetime::Scene);
    pass(&mut g, "reproject", vec![&history], vec![&mut current]);
    g.clear(&mut history, 0.0);
    let barrier = Barrier {
        from_stages: Stages::COMPUTE,
        to_stages: Stages::TRANSFER,
        why: vec!["history: reproject reads, clear history writes".into()],
        ..Barrier::default()
    };
    assert_eq!(barriers(&plan(g)), [("clear history", &barrier)]);
}

#[test]
fn an_image_waits_for_those_whose_bytes_it_takes() {
    let mut g = Graph::new();
    let mut images: Vec<Image> = ["a", "b", "c"].map(|name| g.image(name, Format::Rgba8, SIZE)).into();
    let [a, b, c] = &mut images[..] else { unreachable!("three were made") };
    pass(&mut g, "one", vec![], vec![a]);
    pass(&mut g, "two", vec![a], vec![b]);
    pass(&mut g, "three", vec![b], vec![c]);
    g.export(c);
    let plan = plan(g);
    let offset = |it: usize| plan.resources[it].placement.map(|place| place.offset);
    assert_eq!(offset(0), offset(2));
    let (before, barrier) = barriers(&plan)[2];
    assert_eq!(before, "three");
    assert_eq!(barrier.from_access, BTreeSet::from([Access::StorageWrite]));
    assert_eq!(barrier.to_access, BTreeSet::from([Access::StorageWrite, Access::Sampled]));
    assert_eq!(barrier.why, ["b: two writes, three reads", "c in the bytes of a: one writes, two reads, three writes"]);
}

#[test]
fn a_chain_of_images_takes_the_bytes_of_two() {
    let mut g = Graph::new();
    let mut last = g.image("image0", Format::Rgba8, SIZE);
    g.clear(&mut last, 0.0);
    for number in 1..10 {
        let mut next = g.image(format!("image{number}"), Format::Rgba8, SIZE);
        pass(&mut g, &format!("blur{number}"), vec![&last], vec![&mut next]);
        last = next;
    }
    g.download_image(&last);
    let plan = Plan::new(g, &|_, _| Requirements { bytes: 300, alignment: 256 }).expect("the frame is well formed");
    assert_eq!((plan.shared_bytes, plan.unshared_bytes), (512 + 300, 9 * 512 + 300));
}

#[test]
fn what_is_exported_keeps_its_bytes_to_the_end() {
    let mut g = Graph::new();
    let mut display = g.image("display", Format::Rgba8, SIZE);
    g.clear(&mut display, 0.0);
    g.export(&display);
    let mut other = g.image("other", Format::Rgba8, SIZE);
    g.clear(&mut other, 0.0);
    g.download_image(&other);
    let plan = plan(g);
    assert!(plan.exports.contains(&display.resource().id));
    let [a, b] = [0, 1].map(|it| plan.resources[it].placement.expect("both live for the frame"));
    assert!(a.offset + a.bytes <= b.offset || b.offset + b.bytes <= a.offset);
}

#[test]
fn an_image_of_the_host_keeps_its_content() {
    let mut g = Graph::new();
    let mut target = kept("target", Lifetime::Host);
    pass(&mut g, "draw", vec![], vec![&mut target]);
    pass(&mut g, "overlay", vec![], vec![&mut target]);
    let plan = plan(g);
    assert_eq!(names(&plan), ["draw", "overlay"]);
    assert_eq!(plan.resources[0].placement, None);
    assert!(plan.steps.iter().all(|step| !matches!(step, Step::Synchronize { discard, .. } if !discard.is_empty())));
    assert_eq!(barriers(&plan)[0].1.why, ["target: draw writes, overlay writes"]);
}

#[test]
fn nothing_is_left_of_what_is_overwritten_and_all_of_what_may_be_kept() {
    let mut g = Graph::new();
    let mut table = g.buffer("table", 16);
    g.upload(&mut table, vec![0; 16]);
    g.fill(&mut table, 7);
    let write = Use {
        resource: table.resource().clone(),
        slot: Slot::Binding(0),
        access: Access::StorageWrite,
        stages: Stages::COMPUTE,
    };
    g.push("scatter", Work::Compute { shader: &COMPUTE, params: vec![], groups: [1; 3] }, vec![write]);
    g.download(&table);
    let plan = plan(g);
    assert_eq!(plan.culled, ["upload table"]);
    assert_eq!(names(&plan), ["fill table", "scatter", "download table"]);
    assert_eq!(plan.downloads, 1);
}

#[test]
fn drawing_into_the_first_level_leaves_the_others() {
    for (mips, culled) in [(1, vec!["clear color"]), (2, vec![])] {
        let mut g = Graph::new();
        let mesh = Buffer::new("mesh", 12, Lifetime::Scene);
        let desc = ImageDesc { mips, ..ImageDesc::new(Format::Rgba8, SIZE) };
        let mut color = Image::new("color", desc, Lifetime::Frame);
        let mut depth = g.image("depth", Format::Depth32, SIZE);
        g.clear(&mut color, 0.0);
        g.raster(Raster { mesh: &mesh, color: &mut color, depth: &mut depth }, (), Arc::from([]), SIZE);
        g.export(&color);
        assert_eq!(plan(g).culled, culled);
    }
}

#[test]
fn what_only_a_culled_pass_needs_is_culled_too() {
    let mut g = Graph::new();
    let mut depth = g.image("depth", Format::Rgba8, SIZE);
    let mut heat = g.image("heat", Format::Rgba8, SIZE);
    pass(&mut g, "depth", vec![], vec![&mut depth]);
    pass(&mut g, "heat", vec![&depth], vec![&mut heat]);
    let plan = plan(g);
    assert_eq!(plan.culled, ["depth", "heat"]);
    assert!(plan.steps.is_empty() && plan.resources.is_empty());
    assert_eq!(plan.shared_bytes, 0);
}

#[test]
fn indirect_arguments_are_waited_for_where_they_are_fetched() {
    let mut g = Graph::new();
    let mut counts = Buffer::new("counts", 12, Lifetime::Settings);
    g.fill(&mut counts, 1);
    let mut out = kept("out", Lifetime::Settings);
    g.pass_indirect(Compute { reads: vec![], writes: vec![&mut out] }, (), &counts, 0);
    let plan = plan(g);
    let (_, barrier) = barriers(&plan)[0];
    assert_eq!((barrier.from_stages, barrier.to_stages), (Stages::TRANSFER, Stages::INDIRECT));
    assert_eq!(barrier.to_access, BTreeSet::from([Access::IndirectRead]));
}

#[test]
fn a_build_waits_for_its_inputs_and_what_is_built_on_it_for_the_build() {
    let mut g = Graph::new();
    let mut positions = Buffer::new("positions", 36, Lifetime::Scene);
    let mut indices = Buffer::new("indices", 12, Lifetime::Scene);
    let triangle = TrianglesDesc { triangles: 1, vertices: 3, opaque: true };
    let mut mesh = Structure::over_triangles("mesh", triangle, Lifetime::Scene);
    let mut small = Structure::compacted(&mesh).expect("a bottom level");
    let mut world = Structure::over_instances("world", 2, Lifetime::Scene);
    g.upload(&mut positions, vec![0; 36]);
    g.upload(&mut indices, vec![0; 12]);
    let range = MeshRange { first_index: 0, first_vertex: 0 };
    g.build_meshes("build meshes", &indices, &positions, [(&mut mesh, range)]);
    g.compact(&mesh, &mut small);
    g.build_instances("build instances", [(&small, [[0.0; 4]; 3], 0), (&small, [[0.0; 4]; 3], 1)], &mut world);
    let plan = plan(g);
    let why: Vec<(&str, Vec<&str>)> =
        barriers(&plan).iter().map(|(pass, it)| (*pass, it.why.iter().map(String::as_str).collect())).collect();
    let expected = [
        (
            "build meshes",
            vec![
                "indices: upload indices writes, build meshes reads",
                "positions: upload positions writes, build meshes reads",
            ],
        ),
        ("compact mesh", vec!["mesh: build meshes writes, compact mesh reads"]),
        (
            "build instances",
            vec![
                "mesh: compact mesh writes, build instances reads",
                "scratch of world in the bytes of scratch of mesh: build meshes writes, build instances writes",
            ],
        ),
    ];
    assert_eq!(why, expected);
}

#[test]
fn two_builds_in_a_frame_share_their_scratch_one_after_the_other() {
    let mut g = Graph::new();
    let buffer = |name: &str| Buffer::new(name, 36, Lifetime::Scene);
    let (positions, indices) = (buffer("positions"), buffer("indices"));
    let triangle = TrianglesDesc { triangles: 1, vertices: 3, opaque: true };
    let mut meshes = ["first", "second"].map(|name| Structure::over_triangles(name, triangle, Lifetime::Scene));
    for mesh in &mut meshes {
        let range = MeshRange { first_index: 0, first_vertex: 0 };
        g.build_meshes("build", &indices, &positions, [(mesh, range)]);
    }
    let plan = plan(g);
    assert!(plan.shared_bytes < plan.unshared_bytes, "{plan}");
    let (_, barrier) = barriers(&plan)[0];
    assert_eq!(barrier.why, ["scratch of second in the bytes of scratch of first: build writes"]);
}

#[test]
fn the_device_is_asked_once_for_each_resource_of_the_frame_with_all_its_accesses() {
    let mut g = Graph::new();
    let mut depth = g.image("depth", Format::Rgba8, SIZE);
    let mut unused = g.image("unused", Format::Rgba8, SIZE);
    let mut out = kept("out", Lifetime::Scene);
    g.clear(&mut depth, 0.0);
    pass(&mut g, "shade", vec![&depth], vec![&mut out]);
    pass(&mut g, "heat", vec![&depth], vec![&mut unused]);
    g.download_image(&depth);
    let asked = RefCell::new(BTreeMap::new());
    Plan::new(g, &|resource, accesses| {
        let before = asked.borrow_mut().insert(resource.name.clone(), accesses.clone());
        assert_eq!(before, None);
        requirements(resource, accesses)
    })
    .expect("the frame is well formed");
    let accesses = BTreeSet::from([Access::TransferWrite, Access::Sampled, Access::TransferRead]);
    assert_eq!(asked.into_inner(), BTreeMap::from([("depth".to_owned(), accesses)]));
}

#[test]
fn the_same_declarations_give_the_same_plan() {
    for seed in 0..50 {
        let text = || crate::frames::Frame::random(seed).plan().to_string();
        assert_eq!(text(), text());
    }
}

#[test]
fn an_empty_frame_is_an_empty_plan() {
    let plan = plan(Graph::new());
    assert!(plan.steps.is_empty());
    assert_eq!((plan.shared_bytes, plan.unshared_bytes), (0, 0));
}

#[test]
fn bytes_that_are_known_take_the_place_of_the_passes_that_make_them() {
    let mut g = Graph::new();
    let mut table = Buffer::new("table", 64, Lifetime::Settings);
    let mut shown = kept("shown", Lifetime::Settings);
    g.because("first frame");
    pass(&mut g, "before", vec![], vec![&mut shown]);
    let first = g.passes().len();
    g.fill(&mut table, 0);
    g.upload(&mut table, vec![1; 64]);
    g.upload_instead(first, table.resource(), vec![2; 64].into(), "read from the cache");
    pass(&mut g, "after", vec![&shown], vec![]);
    let said: Vec<_> = g.passes().iter().map(|pass| (pass.name.as_str(), pass.why.as_str())).collect();
    let expected = [("before", "first frame"), ("upload table", "read from the cache"), ("after", "first frame")];
    assert_eq!(said, expected);
    assert!(matches!(&g.passes()[first].work, Work::Upload { data } if **data == [2; 64]));
    // In the place of nothing it bears its own name.
    let mut g = Graph::new();
    g.upload_instead(0, table.resource(), vec![3; 64].into(), "known");
    assert_eq!((g.passes()[0].name.as_str(), g.passes()[0].why.as_str()), ("upload table", "known"));
}
