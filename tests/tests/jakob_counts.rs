//! Queries of the tree of Jakob et al. 2014, put to the shader itself: how many flakes of a footprint are lit.

use glam::{DVec2, DVec3};
use mica_graph::{Access, Graph, Shader};
use mica_render::JakobTable;
use mica_tests::Gpu;
use mica_tests::shaders::{Change, filled, push_pass, test_shader};

/// The shader's buffers: triangles, queries, answers.
const BUFFERS: [(u32, Access); 3] = [(50, Access::StorageRead), (30, Access::StorageRead), (31, Access::StorageWrite)];
/// Flakes are counted by place and normal, by place alone, by normal alone.
pub const MODES: [u32; 3] = [0, 1, 2];

/// A query, as the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Query {
    pub corner: [f32; 2],
    pub side_x: [f32; 2],
    pub side_y: [f32; 2],
    pub seed: u32,
    pub mode: u32,
    pub i: [f32; 3],
    /// sin(gamma/2).
    pub sin_half: f32,
    pub o: [f32; 3],
    pub cos_half: f32,
    pub flakes_low: u32,
    pub flakes_high: u32,
    pub last_level: u32,
    pub split_ratio: f32,
    pub epsilon: f32,
    pub budget: i32,
    pub reserved: [u32; 2],
}

impl Query {
    /// The exact count of `flakes` flakes, as the renderer asks for it.
    pub fn new(flakes: u64, gamma_radians: f64, i: DVec3, o: DVec3, [corner, side_x, side_y]: [DVec2; 3]) -> Self {
        let sin_half = (0.5 * gamma_radians).sin() as f32;
        // Of the very angle that the f32 sine stands for.
        let sin2 = f64::from(sin_half).powi(2);
        let xy = |v: DVec2| v.as_vec2().to_array();
        Self {
            corner: xy(corner),
            side_x: xy(side_x),
            side_y: xy(side_y),
            seed: 0,
            mode: MODES[0],
            i: i.as_vec3().to_array(),
            sin_half,
            o: o.as_vec3().to_array(),
            cos_half: (1.0 - sin2).sqrt() as f32,
            flakes_low: flakes as u32,
            flakes_high: (flakes >> 32) as u32,
            last_level: (0..19).find(|level| flakes <= 4 << (2 * level)).unwrap_or(19),
            split_ratio: (std::f64::consts::PI * sin2 / 1e-5) as f32,
            epsilon: 0.0,
            budget: 7000,
            reserved: [0; 2],
        }
    }

    pub fn flakes(&self) -> u64 {
        u64::from(self.flakes_high) << 32 | u64::from(self.flakes_low)
    }

    /// The half-angle of the cone that the f32 sine stands for.
    pub fn gamma_radians(&self) -> f64 {
        2.0 * f64::from(self.sin_half).asin()
    }

    /// Corner and sides of the footprint.
    pub fn footprint(&self) -> [DVec2; 3] {
        [self.corner, self.side_x, self.side_y].map(|v| DVec2::from(v.map(f64::from)))
    }

    /// Directions of light and view.
    pub fn directions(&self) -> [DVec3; 2] {
        [self.i, self.o].map(|v| DVec3::from(v.map(f64::from)))
    }
}

/// What the shader says of a query.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Answer {
    counted_low: u32,
    counted_high: u32,
    /// What is expected of nodes that were not looked into.
    pub expected: f32,
    /// Steps taken.
    pub steps: i32,
}

impl Answer {
    /// Flakes counted one by one or by whole nodes.
    pub fn counted(&self) -> u64 {
        u64::from(self.counted_high) << 32 | u64::from(self.counted_low)
    }

    /// All that was found.
    pub fn total(&self) -> f64 {
        self.counted() as f64 + f64::from(self.expected)
    }
}

/// The shader that answers.
pub struct Counter {
    shader: &'static Shader,
}

impl Counter {
    /// With the shaders as they are.
    pub fn new() -> Self {
        Self { shader: test_shader("jakob_counts.comp", None, &BUFFERS, 0) }
    }

    /// With one passage of `shared/FILE.glsl` replaced by another: what a test must notice.
    pub fn with_change(file: &str, from: &str, to: &str) -> Self {
        let change = Change { file: &format!("shared/{file}.glsl"), from, to };
        Self { shader: test_shader("jakob_counts.comp", Some(change), &BUFFERS, 0) }
    }

    /// What the device says of each query.
    pub fn count(&self, gpu: &mut Gpu, table: &JakobTable, queries: &[Query]) -> Vec<Answer> {
        let mut graph = Graph::new();
        let triangles = filled(&mut graph, "triangles", bytemuck::cast_slice(&table.triangles));
        let asked = filled(&mut graph, "queries", bytemuck::cast_slice(queries));
        let answers = graph.buffer("answers", (queries.len() * size_of::<Answer>()) as u64);
        let buffers = [&triangles, &asked, &answers];
        let bound: Vec<_> =
            BUFFERS.iter().zip(buffers).map(|(&(slot, access), buffer)| (slot, buffer, access)).collect();
        push_pass(&mut graph, self.shader, &[], queries.len(), &bound);
        bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&answers])[0])
    }
}
