//! Queries of the tree of Jakob et al. 2014, put to the shader itself: how many flakes of a footprint are lit.

use glam::{DVec2, DVec3};
use mica_graph::{Access, Binding, BindingKind, Buffer, Graph, Shader, Slot, Stage, StageCode, Stages, Use, Work};
use mica_render::JakobTable;
use mica_tests::Gpu;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

const GROUP: u32 = 64;
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
        Self::with_change("jakob_tree", "", "")
    }

    /// With one passage of `shared/FILE.glsl` replaced by another: what a test must notice.
    pub fn with_change(file: &str, from: &str, to: &str) -> Self {
        Self { shader: shader(file, from, to) }
    }

    /// What the device says of each query.
    pub fn count(&self, gpu: &mut Gpu, table: &JakobTable, queries: &[Query]) -> Vec<Answer> {
        let mut graph = Graph::new();
        let mut filled = |name: &str, bytes: &[u8]| {
            let mut buffer = graph.buffer(name, bytes.len() as u64);
            graph.upload(&mut buffer, bytes);
            buffer
        };
        let triangles = filled("triangles", bytemuck::cast_slice(&table.triangles));
        let asked = filled("queries", bytemuck::cast_slice(queries));
        let answers = graph.buffer("answers", (queries.len() * size_of::<Answer>()) as u64);
        let bind = |slot, buffer: &Buffer, access| Use {
            resource: buffer.resource().clone(),
            slot: Slot::Binding(slot),
            access,
            stages: Stages::COMPUTE,
        };
        let uses = vec![
            bind(50, &triangles, Access::StorageRead),
            bind(30, &asked, Access::StorageRead),
            bind(31, &answers, Access::StorageWrite),
        ];
        let groups = [(queries.len() as u32).div_ceil(GROUP), 1, 1];
        graph.push("jakob_counts", Work::Compute { shader: self.shader, params: Vec::new(), groups }, uses);
        bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&answers])[0])
    }
}

/// Compiles `jakob_counts.comp` around the shaders, changed or not. Shaders are statics in the program; a test's live as
/// long as its process.
fn shader(file: &str, from: &str, to: &str) -> &'static Shader {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shaders = package.join("../shaders_glsl");
    // A folder for each, as tests run at once.
    static MADE: AtomicU32 = AtomicU32::new(0);
    let name = format!("jakob_counts_{}_{}", std::process::id(), MADE.fetch_add(1, Ordering::Relaxed));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(folder.join("shared")).expect("a folder");
    let name = format!("shared/{file}.glsl");
    let source = std::fs::read_to_string(shaders.join(&name)).expect("the shader's source");
    assert!(source.contains(from), "{name} no longer says {from:?}: change this test with it");
    std::fs::write(folder.join(&name), source.replacen(from, to, 1)).expect("its copy");
    let output = folder.join("jakob_counts.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let include = |path: &Path| format!("-I{}", path.display());
    let done = Command::new(tool)
        .args(["--target-env", "vulkan1.3", &include(&folder), &include(&shaders), "-o"])
        .args([output.as_path(), &package.join("tests/jakob_counts.comp")])
        .output()
        .expect("glslangValidator runs (Debian: glslang-tools)");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    let spirv: Vec<u32> = bytemuck::pod_collect_to_vec(&std::fs::read(output).expect("its output"));
    let _ = std::fs::remove_dir_all(&folder);

    let accesses = [(50, "triangles"), (30, "queries"), (31, "answers")];
    let bindings = accesses.map(|(slot, name)| Binding {
        name,
        slot,
        kind: BindingKind::StorageBuffer,
        access: if name == "answers" { Access::StorageWrite } else { Access::StorageRead },
        stages: Stages::COMPUTE,
    });
    Box::leak(Box::new(Shader {
        name: "jakob_counts",
        variant: "",
        stages: vec![StageCode { stage: Stage::Compute, spirv: spirv.leak() }].leak(),
        group: [GROUP, 1, 1],
        bindings: bindings.to_vec().leak(),
        params_bytes: 0,
        outputs: &[],
    }))
}
