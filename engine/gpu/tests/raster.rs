//! Raster passes: where triangles land, which of them is nearest, and what each attachment gets.

use crate::common::{Checked, bind_raster, bytes_of, color, depth, floats, raster, words};
use mica_gpu::{Executor, Timing};
use mica_graph::{Access, BindingKind, Draw, Extent, Format, Graph, Shader, Work};
use std::sync::LazyLock;

const SIZE: u32 = 16;

/// Positions are pulled from a buffer; the first attachment gets the instance and the facing, the second the depth.
static TRIANGLES: LazyLock<&Shader> = LazyLock::new(|| {
    let vertex = "
        layout(binding = 0) readonly buffer B0 { vec4 b0[]; };
        layout(location = 0) flat out uint instance;
        void main() {
          gl_Position = b0[3 * gl_InstanceIndex + gl_VertexIndex];
          instance = gl_InstanceIndex;
        }";
    let fragment = "
        layout(push_constant) uniform Params { uint offset; };
        layout(location = 0) flat in uint instance;
        layout(location = 0) out uvec2 ids;
        layout(location = 1) out float nearness;
        void main() {
          ids = uvec2(instance + offset, gl_FrontFacing ? 1 : 2);
          nearness = gl_FragCoord.z;
        }";
    let bindings = [(0, BindingKind::StorageBuffer, Access::StorageRead)];
    raster("triangles", (vertex, fragment), 4, &["ids", "nearness"], &bindings)
});

struct Picture {
    ids: Vec<[u32; 2]>,
    nearness: Vec<f32>,
    depth: Vec<f32>,
}

/// Draws triangles of clip-space corners, each an instance of its own.
fn draw(executor: &mut Executor, triangles: &[[[f32; 4]; 3]]) -> Picture {
    let corners: Vec<u32> = triangles.iter().flatten().flatten().map(|value| value.to_bits()).collect();
    let extent = Extent::new(SIZE, SIZE);
    let mut graph = Graph::new();
    let mut positions = graph.buffer("positions", 4 * corners.len() as u64);
    graph.upload(&mut positions, bytes_of(&corners));
    let ids = graph.image("ids", Format::Rg32Uint, extent);
    let nearness = graph.image("nearness", Format::R32Float, extent);
    let depths = graph.image("depth", Format::Depth32, extent);
    let draws = (0..triangles.len() as u32).map(|instance| Draw { vertices: 3, instance }).collect();
    let uses = vec![
        bind_raster(0, positions.resource(), Access::StorageRead),
        color(0, ids.resource()),
        color(1, nearness.resource()),
        depth(depths.resource()),
    ];
    graph.push("triangles", Work::Raster { shader: *TRIANGLES, params: bytes_of(&[10]), draws, extent }, uses);
    let downloads = [&ids, &nearness, &depths].map(|image| graph.download_image(image));
    let mut run = executor.run(graph, Timing::Isolated).expect("the frame runs");
    let [ids, nearness, depth] = downloads.map(|download| run.take(download));
    let ids = words(&ids).chunks(2).map(|pair| [pair[0], pair[1]]).collect();
    Picture { ids, nearness: floats(&nearness), depth: floats(&depth) }
}

/// A triangle over the corners (-1, -1), (1, -1) and (-1, 1): the half of the picture below its falling diagonal.
fn lower_left(depth: f32) -> [[f32; 4]; 3] {
    [[-1.0, -1.0, depth, 1.0], [1.0, -1.0, depth, 1.0], [-1.0, 1.0, depth, 1.0]]
}

#[test]
fn a_triangle_covers_the_pixels_whose_centres_it_holds_with_y_up() {
    let checked = Checked::new();
    let picture = draw(&mut checked.executor(), &[lower_left(0.5)]);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let index = (y * SIZE + x) as usize;
            // Row 0 is the top: centres strictly below the diagonal from top left to bottom right are inside. Those on
            // it fall to either side by the rule for edges, so they are not looked at.
            let inside = x < y;
            if x != y {
                let expected = if inside { ([10, 1], 0.5) } else { ([0, 0], 0.0) };
                assert_eq!((picture.ids[index], picture.nearness[index]), expected, "pixel {x}, {y}");
                assert_eq!(picture.depth[index], expected.1, "depth at {x}, {y}");
            }
        }
    }
}

#[test]
fn a_triangle_seen_from_behind_is_drawn_and_known_as_such() {
    let checked = Checked::new();
    let [a, b, c] = lower_left(0.5);
    let picture = draw(&mut checked.executor(), &[[a, c, b]]);
    assert_eq!(picture.ids[(SIZE * (SIZE - 1)) as usize], [10, 2]);
}

#[test]
fn the_nearest_triangle_wins_in_any_order_and_near_is_1() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let corner = (SIZE * (SIZE - 1)) as usize;
    for depths in [[0.2, 0.9, 0.5], [0.9, 0.5, 0.2], [0.5, 0.2, 0.9]] {
        let picture = draw(&mut executor, &depths.map(lower_left));
        let nearest = depths.iter().position(|depth| *depth == 0.9).expect("0.9 is among them");
        assert_eq!(picture.ids[corner], [10 + nearest as u32, 1], "{depths:?}");
        assert_eq!(picture.depth[corner], 0.9);
    }
}
