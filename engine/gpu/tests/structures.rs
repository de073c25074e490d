//! Acceleration structures: built, compacted and asked by ray queries, where the device has them; refused by name where
//! it has not.

use crate::common::host::Host;
use crate::common::{Checked, bind, bytes_of, compute, words};
use mica_gpu::{Error, Executor, Feature, Timing};
use mica_graph::{
    Access, BindingKind, Buffer, Graph, Lifetime, MeshRange, Shader, Structure, TrianglesDesc, Use, Work,
};
use std::sync::LazyLock;

/// What a ray met: whether, which instance, which triangle, and t times 1000.
type Answer = [u32; 4];
const NOTHING: Answer = [0, 0, 0, 0];

/// Asks about rays along -z from so many points of a 4x4 grid in 0..4; rejects candidates of odd triangles.
static ASK: LazyLock<&Shader> = LazyLock::new(|| {
    let glsl = "
        #extension GL_EXT_ray_query : require
        layout(local_size_x = 16) in;
        layout(binding = 0) uniform accelerationStructureEXT b0;
        layout(std430, binding = 1) writeonly buffer Answers { uvec4 b1[]; };
        void main() {
          uint index = gl_LocalInvocationIndex;
          vec3 origin = vec3(float(index % 4) + 0.25, float(index / 4) + 0.25, 10);
          rayQueryEXT query;
          rayQueryInitializeEXT(query, b0, 0, 0xff, origin, 0, vec3(0, 0, -1), 100);
          while (rayQueryProceedEXT(query)) {
            if (rayQueryGetIntersectionPrimitiveIndexEXT(query, false) % 2 == 0) {
              rayQueryConfirmIntersectionEXT(query);
            }
          }
          bool met = rayQueryGetIntersectionTypeEXT(query, true) != 0;
          b1[index] = met ? uvec4(1, rayQueryGetIntersectionInstanceCustomIndexEXT(query, true),
                                  rayQueryGetIntersectionPrimitiveIndexEXT(query, true),
                                  uint(rayQueryGetIntersectionTEXT(query, true) * 1000 + 0.5)) : uvec4(0);
        }";
    let bindings = [
        (0, BindingKind::AccelerationStructure, Access::Traverse),
        (1, BindingKind::StorageBuffer, Access::StorageWrite),
    ];
    compute("ask", glsl, [16, 1, 1], 0, &bindings)
});

/// Two squares of two triangles each, one after the other in the same buffers, the second at z = 1.
struct Squares {
    indices: Buffer,
    positions: Buffer,
    meshes: [Structure; 2],
}

const INDICES: [u32; 9] = [7, 7, 7, 0, 1, 2, 2, 1, 3];
const MOVE_UP: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 2.0]];

fn corners(z: f32) -> [f32; 12] {
    [0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z, 1.0, 1.0, z]
}

fn placed_at(x: f32, y: f32) -> [[f32; 4]; 3] {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, 0.0]]
}

impl Squares {
    /// Declares uploads and builds. The first mesh has one vertex and three indices before it.
    fn build(g: &mut Graph, opaque: bool) -> Self {
        let positions: Vec<f32> = [[9.0; 3].as_slice(), &corners(0.0), &corners(1.0)].concat();
        let bits: Vec<u32> = positions.iter().map(|value| value.to_bits()).collect();
        let desc = TrianglesDesc { triangles: 2, vertices: 4, opaque };
        let mut squares = Self {
            indices: Buffer::new("indices", 36, Lifetime::Scene),
            positions: Buffer::new("positions", 4 * bits.len() as u64, Lifetime::Scene),
            meshes: ["low", "high"].map(|name| Structure::over_triangles(name, desc, Lifetime::Scene)),
        };
        g.upload(&mut squares.indices, bytes_of(&INDICES));
        g.upload(&mut squares.positions, bytes_of(&bits));
        let ranges = [1, 5].map(|first_vertex| MeshRange { first_index: 3, first_vertex });
        g.build_meshes("build", &squares.indices, &squares.positions, squares.meshes.iter_mut().zip(ranges));
        squares
    }
}

/// The low square under two pixels, the high one above another, mirrored and lifted.
fn build_world<'a>(g: &mut Graph, low: &'a Structure, high: &'a Structure) -> Structure {
    let mut world = Structure::over_instances("world", 3, Lifetime::Scene);
    let mirrored = [[-1.0, 0.0, 0.0, 3.5], [0.0, 1.0, 0.0, 2.0], MOVE_UP[2]];
    let instances = [(low, placed_at(0.0, 0.0), 5), (low, placed_at(1.0, 0.0), (1 << 24) - 1), (high, mirrored, 7)];
    g.build_instances("build world", instances, &mut world);
    world
}

fn ask(g: &mut Graph, world: &Structure) -> Buffer {
    let answers = g.buffer("answers", 256);
    let uses = vec![bind(0, world.resource(), Access::Traverse), bind(1, answers.resource(), Access::StorageWrite)];
    g.push("ask", Work::Compute { shader: *ASK, params: Vec::new(), groups: [1; 3] }, uses);
    answers
}

fn answers(executor: &mut Executor, mut g: Graph, buffer: &Buffer) -> Vec<Answer> {
    let download = g.download(buffer);
    let bytes = executor.run(g, Timing::Isolated).expect("the frame runs").take(download);
    words(&bytes).as_chunks().0.to_vec()
}

/// What is hit in the world above: pixels 0 and 1 at z = 0, pixel 11 at z = 3.
fn expected() -> Vec<Answer> {
    let mut expected = vec![NOTHING; 16];
    expected[0] = [1, 5, 0, 10_000];
    expected[1] = [1, (1 << 24) - 1, 0, 10_000];
    // x = 3.25 is 0.25 in the mirrored square.
    expected[11] = [1, 7, 0, 7_000];
    expected
}

/// Runs the test where there are ray queries; elsewhere the build must be refused, with the reason.
fn tracing(test: impl Fn(&mut Executor)) {
    let checked = Checked::new();
    let device = checked.with_ray_query();
    let mut executor = checked.executor();
    if device.is_some() {
        return test(&mut executor);
    }
    let mut g = Graph::new();
    let squares = Squares::build(&mut g, true);
    let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
    ask(&mut g, &world);
    let error = executor.run(g, Timing::Overlapped).expect_err("this device has no ray queries");
    let text = error.to_string();
    assert!(text.contains("VK_KHR_ray_query") && text.contains("Mica's own trees"), "{text}");
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn rays_meet_what_was_built() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), expected());

        // A later frame asks the same structures, and builds the top level anew with one instance moved.
        let mut g = Graph::new();
        let mut moved = Structure::over_instances("moved", 1, Lifetime::Scene);
        g.build_instances("build moved", [(&squares.meshes[1], placed_at(0.0, 3.0), 1)], &mut moved);
        let buffer = ask(&mut g, &moved);
        let mut expected = vec![NOTHING; 16];
        expected[12] = [1, 1, 0, 9_000];
        assert_eq!(answers(executor, g, &buffer), expected);
    });
}

#[test]
fn a_compacted_structure_answers_alike_and_the_original_is_given_back() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        executor.run(g, Timing::Overlapped).expect("the frame runs");
        let bytes = |executor: &Executor, name: &str| -> Vec<u64> {
            executor.memory().iter().filter(|row| row.name == name).map(|row| row.bytes).collect()
        };
        let original = bytes(executor, "low");

        let mut g = Graph::new();
        let Squares { meshes, .. } = squares;
        let compacted = meshes.each_ref().map(|mesh| {
            let mut small = Structure::compacted(mesh).expect("a bottom level");
            g.compact(mesh, &mut small);
            assert!(Structure::compacted(&small).is_none(), "once is enough");
            small
        });
        let world = build_world(&mut g, &compacted[0], &compacted[1]);
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), expected());
        assert_eq!(bytes(executor, "low").len(), 2, "both are there");
        drop(meshes);
        executor.collect();
        let left = bytes(executor, "low");
        assert!(left.len() == 1 && left[0] <= original[0], "{original:?} bytes became {left:?}");

        let mut g = Graph::new();
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), expected(), "without the original");
    });
}

/// Frees whatever nobody holds, and says what is left of the structures.
fn structures_left(executor: &mut Executor) -> Vec<String> {
    executor.collect();
    let rows = executor.memory().into_iter().map(|row| row.name);
    rows.filter(|name| ["low", "high", "world"].contains(&name.as_str())).collect()
}

#[test]
fn a_top_level_holds_on_to_what_it_places_until_it_goes_itself() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
        executor.run(g, Timing::Overlapped).expect("the frame runs");
        drop(squares);
        assert_eq!(structures_left(executor), ["high", "low", "world"]);
        let mut g = Graph::new();
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), expected());
        drop(world);
        assert!(structures_left(executor).is_empty());
    });
}

#[test]
fn a_frame_under_way_keeps_what_its_top_level_places() {
    let offered = Checked::new().with_ray_query().is_some();
    let features = [Feature::BufferDeviceAddress, Feature::AccelerationStructure, Feature::RayQuery];
    if !offered {
        // What is refused there, `tracing` asserts in the tests above.
        return;
    }
    let host = Host::enabling(&features);
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let run = |executor: &mut Executor, g: Graph| {
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        let recorded = unsafe { executor.record(g, commands, Timing::Overlapped) }.expect("the frame is recorded");
        host.end_and_submit(commands);
        recorded
    };
    let mut g = Graph::new();
    let squares = Squares::build(&mut g, true);
    let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
    let recorded = run(&mut executor, g);
    // SAFETY: the host waited for the frame.
    unsafe { executor.finish(recorded) }.expect("the frame is finished");

    let mut g = Graph::new();
    let buffer = ask(&mut g, &world);
    g.download(&buffer);
    // As far as the executor knows, this one is under way until it is finished.
    let asking = run(&mut executor, g);
    let Squares { meshes: [low, high], .. } = squares;
    drop(low);
    // The next frame builds the top level over less.
    let mut g = Graph::new();
    let places = [5, 6, 7].map(|index| (&high, placed_at(0.0, 0.0), index));
    let mut world = world;
    g.build_instances("build world", places, &mut world);
    let building = run(&mut executor, g);
    assert_eq!(structures_left(&mut executor), ["high", "low", "world"]);
    // SAFETY: the host waited for the frame.
    unsafe { executor.finish(asking) }.expect("the frame is finished");
    // The frame that builds it anew began with all that it held.
    drop((high, world));
    assert_eq!(structures_left(&mut executor), ["high", "low", "world"]);
    // SAFETY: the host waited for the frame.
    unsafe { executor.finish(building) }.expect("the frame is finished");
    assert!(structures_left(&mut executor).is_empty());
}

/// Before the size is known, a compacted structure is as large as the original, and no less right.
#[test]
fn structures_are_built_compacted_and_asked_in_one_frame() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        let compacted = squares.meshes.each_ref().map(|mesh| {
            let mut small = Structure::compacted(mesh).expect("a bottom level");
            g.compact(mesh, &mut small);
            small
        });
        let world = build_world(&mut g, &compacted[0], &compacted[1]);
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), expected());
    });
}

#[test]
fn shaders_are_asked_about_triangles_that_are_not_opaque() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, false);
        // Turned by half: the rays meet triangle 1, which the shader rejects, or triangle 0 again.
        let turned = |x: f32| [[-1.0, 0.0, 0.0, x], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]];
        let mut world = Structure::over_instances("world", 2, Lifetime::Scene);
        let instances = [(&squares.meshes[0], turned(1.0), 0), (&squares.meshes[0], placed_at(1.0, 0.0), 1)];
        g.build_instances("build world", instances, &mut world);
        let buffer = ask(&mut g, &world);
        let mut expected = vec![NOTHING; 16];
        expected[1] = [1, 1, 0, 10_000];
        assert_eq!(answers(executor, g, &buffer), expected);
    });
}

#[test]
fn a_world_of_nothing_is_empty() {
    tracing(|executor| {
        let mut g = Graph::new();
        let mut world = Structure::over_instances("world", 0, Lifetime::Scene);
        g.build_instances("build world", [], &mut world);
        let buffer = ask(&mut g, &world);
        assert_eq!(answers(executor, g, &buffer), vec![NOTHING; 16]);
    });
}

#[test]
fn builds_have_times_of_their_own() {
    tracing(|executor| {
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
        ask(&mut g, &world);
        let run = executor.run(g, Timing::Isolated).expect("the frame runs");
        let times: Vec<&str> =
            run.passes.iter().filter(|pass| pass.ns > Some(0)).map(|pass| pass.name.as_str()).collect();
        assert!(["build", "build world"].iter().all(|name| times.contains(name)), "{:?}", run.passes);
    });
}

#[test]
fn what_cannot_be_built_is_refused_and_nothing_is_recorded() {
    tracing(|executor| {
        let refused = |executor: &mut Executor, why: &str, declare: &dyn Fn(&mut Graph)| {
            let mut g = Graph::new();
            declare(&mut g);
            let error = executor.run(g, Timing::Overlapped).expect_err(why).to_string();
            assert!(error.contains(why), "{error}");
        };
        let mesh = |triangles, vertices, lifetime| {
            Structure::over_triangles("mesh", TrianglesDesc { triangles, vertices, opaque: true }, lifetime)
        };
        let build = |g: &mut Graph, mut mesh: Structure, range: MeshRange| {
            let buffer = |name| Buffer::new(name, 48, Lifetime::Scene);
            let (mut indices, mut positions) = (buffer("indices"), buffer("positions"));
            g.fill(&mut indices, 0);
            g.fill(&mut positions, 0);
            g.build_meshes("build", &indices, &positions, [(&mut mesh, range)]);
            mesh
        };
        let range = |first_index, first_vertex| MeshRange { first_index, first_vertex };
        for (mesh_of, range, why) in [
            ((4, 4, Lifetime::Scene), range(1, 0), "does not lie within"),
            ((1, 4, Lifetime::Scene), range(0, 1), "does not lie within"),
            ((1, u32::MAX, Lifetime::Scene), range(0, 0), "does not lie within"),
            ((0, 4, Lifetime::Scene), range(0, 0), "no triangles"),
            ((1, 4, Lifetime::Frame), range(0, 0), "outlives the frame"),
        ] {
            let (triangles, vertices, lifetime) = mesh_of;
            refused(executor, why, &|g| {
                // Something that outlives the frame, so that the build is not culled with it.
                let mesh = build(g, mesh(triangles, vertices, lifetime), range);
                let mut world = Structure::over_instances("world", 1, Lifetime::Scene);
                g.build_instances("build world", [(&mesh, MOVE_UP, 0)], &mut world);
            });
        }
        refused(executor, "more than 24 bits", &|g| {
            let mesh = build(g, mesh(1, 4, Lifetime::Scene), range(0, 0));
            let mut world = Structure::over_instances("world", 1, Lifetime::Scene);
            g.build_instances("build world", [(&mesh, MOVE_UP, 1 << 24)], &mut world);
        });
        for singular in [[[0.0; 4]; 3], [[f32::NAN; 4]; 3], [MOVE_UP[0], MOVE_UP[0], MOVE_UP[2]]] {
            refused(executor, "without an inverse", &|g| {
                let mesh = build(g, mesh(1, 4, Lifetime::Scene), range(0, 0));
                let mut world = Structure::over_instances("world", 1, Lifetime::Scene);
                g.build_instances("build world", [(&mesh, singular, 0)], &mut world);
            });
        }
        refused(executor, "nothing has built it", &|g| {
            let unbuilt = mesh(1, 4, Lifetime::Scene);
            let mut small = Structure::compacted(&unbuilt).expect("a bottom level");
            g.compact(&unbuilt, &mut small);
        });
        refused(executor, "nothing has built it", &|g| {
            let mut world = Structure::over_instances("world", 1, Lifetime::Scene);
            g.build_instances("build world", [(&mesh(1, 4, Lifetime::Scene), MOVE_UP, 0)], &mut world);
        });
        refused(executor, "it is a bottom level", &|g| {
            let mesh = build(g, mesh(1, 4, Lifetime::Scene), range(0, 0));
            let answers = ask(g, &mesh);
            g.download(&answers);
        });
        refused(executor, "does not suit", &|g| {
            let mut buffer = Buffer::new("no structure", 64, Lifetime::Scene);
            g.fill(&mut buffer, 0);
            let mut answers = Buffer::new("answers", 256, Lifetime::Scene);
            g.fill(&mut answers, 0);
            let uses: Vec<Use> = vec![
                bind(0, buffer.resource(), Access::StorageRead),
                bind(1, answers.resource(), Access::StorageWrite),
            ];
            g.push("ask", Work::Compute { shader: *ASK, params: Vec::new(), groups: [1; 3] }, uses);
        });
    });
}

#[test]
fn a_host_that_enables_ray_queries_lends_them_and_one_that_does_not_is_told_so() {
    let offered = Checked::new().with_ray_query().is_some();
    let enabled: &[Feature] =
        if offered { &[Feature::BufferDeviceAddress, Feature::AccelerationStructure, Feature::RayQuery] } else { &[] };
    for (enabled, works) in [(enabled, offered), (&[][..], false)] {
        let host = Host::enabling(enabled);
        let mut executor = Executor::new(host.lend()).expect("an executor");
        let mut g = Graph::new();
        let squares = Squares::build(&mut g, true);
        let world = build_world(&mut g, &squares.meshes[0], &squares.meshes[1]);
        let buffer = ask(&mut g, &world);
        let download = g.download(&buffer);
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        let recorded = unsafe { executor.record(g, commands, Timing::Overlapped) };
        host.end_and_submit(commands);
        match recorded {
            Ok(recorded) => {
                assert!(works);
                // SAFETY: the host waited for the frame.
                let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
                assert_eq!(words(&run.take(download)).as_chunks().0, expected());
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!works && matches!(error, Error::BadResource { .. }) && text.contains("ray"), "{text}");
            }
        }
    }
}
