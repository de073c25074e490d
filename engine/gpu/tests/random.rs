//! Random frames of integer passes against the same arithmetic on the processor.

use crate::common::{Checked, bind, bytes_of, compute, words};
use mica_gpu::Timing;
use mica_graph::{
    Access, BindingKind, Buffer, Download, Extent, Format, Graph, Image, ImageDesc, Lifetime, Resource, Shader, Slot,
    Stages, Use, Work,
};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;
use std::sync::Arc;

const SIDE: u32 = 8;
const COUNT: usize = (SIDE * SIDE) as usize;
const FRAMES: u64 = 120;

/// One value per texel or word, on the device and here.
struct Cell {
    kind: Kind,
    resource: Arc<Resource>,
    /// `None` until something is written.
    value: Option<Vec<u32>>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Buffer,
    Image,
}

impl Cell {
    fn new(kind: Kind, name: String, lifetime: Lifetime) -> Self {
        let resource = match kind {
            Kind::Buffer => Buffer::new(name, 4 * COUNT as u64, lifetime).resource().clone(),
            Kind::Image => {
                let desc = ImageDesc::new(Format::R32Uint, Extent::new(SIDE, SIDE));
                Image::new(name, desc, lifetime).resource().clone()
            }
        };
        Self { kind, resource, value: None }
    }
}

/// `b2 = k * b0 + b1` for every choice of buffers and images, and `b0 = k * b0 + i` in place.
struct Shaders {
    /// By the kinds of `b0`, `b1` and `b2`.
    combine: [&'static Shader; 8],
    /// By the kind of `b0`.
    update: [&'static Shader; 2],
}

fn declaration(slot: u32, kind: Kind, qualifier: &str) -> String {
    match kind {
        Kind::Buffer => format!("layout(binding = {slot}) {qualifier} buffer B{slot} {{ uint b{slot}[]; }};"),
        Kind::Image => format!("layout(binding = {slot}, r32ui) uniform {qualifier} uimage2D b{slot};"),
    }
}

fn load(slot: u32, kind: Kind) -> String {
    match kind {
        Kind::Buffer => format!("b{slot}[i]"),
        Kind::Image => format!("imageLoad(b{slot}, at).x"),
    }
}

fn store(slot: u32, kind: Kind, value: &str) -> String {
    match kind {
        Kind::Buffer => format!("b{slot}[i] = {value};"),
        Kind::Image => format!("imageStore(b{slot}, at, uvec4({value}));"),
    }
}

fn glsl(declarations: &[String], statement: &str) -> String {
    format!(
        "layout(local_size_x = 8, local_size_y = 8) in;
         layout(push_constant) uniform Params {{ uint k; }};
         {}
         void main() {{
           ivec2 at = ivec2(gl_GlobalInvocationID.xy);
           uint i = at.y * {SIDE} + at.x;
           {statement}
         }}",
        declarations.join("\n")
    )
}

fn binding_kind(kind: Kind) -> BindingKind {
    match kind {
        Kind::Buffer => BindingKind::StorageBuffer,
        Kind::Image => BindingKind::StorageImage,
    }
}

impl Shaders {
    fn new() -> Self {
        let kind = |bit: bool| if bit { Kind::Image } else { Kind::Buffer };
        let combine = std::array::from_fn(|index| {
            let kinds = [kind(index & 1 != 0), kind(index & 2 != 0), kind(index & 4 != 0)];
            let declarations: Vec<String> = (0..3)
                .zip(kinds)
                .map(|(slot, kind)| declaration(slot, kind, if slot == 2 { "writeonly" } else { "readonly" }))
                .collect();
            let value = format!("k * {} + {}", load(0, kinds[0]), load(1, kinds[1]));
            let glsl = glsl(&declarations, &store(2, kinds[2], &value));
            let accesses = [Access::StorageRead, Access::StorageRead, Access::StorageWrite];
            let bindings: Vec<_> =
                (0..3).map(|slot| (slot as u32, binding_kind(kinds[slot]), accesses[slot])).collect();
            compute("combine", &glsl, [8, 8, 1], 4, &bindings)
        });
        let update = [Kind::Buffer, Kind::Image].map(|kind| {
            let value = format!("k * {} + i", load(0, kind));
            let glsl = glsl(&[declaration(0, kind, "")], &store(0, kind, &value));
            compute("update", &glsl, [8, 8, 1], 4, &[(0, binding_kind(kind), Access::StorageReadWrite)])
        });
        Self { combine, update }
    }
}

struct Dice(Pcg32);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0.next_u32() as usize % count
    }

    /// A cell that has a value, or one of any kind.
    fn pick(&mut self, cells: &[Cell], written: bool) -> Option<usize> {
        let fitting: Vec<usize> = (0..cells.len()).filter(|&index| !written || cells[index].value.is_some()).collect();
        if fitting.is_empty() { None } else { Some(fitting[self.below(fitting.len())]) }
    }
}

fn transfer(cell: &Cell, access: Access) -> Use {
    Use { resource: cell.resource.clone(), slot: Slot::None, access, stages: Stages::TRANSFER }
}

/// Adds one random pass, and does the same to the values here.
fn add_pass(graph: &mut Graph, cells: &mut [Cell], shaders: &Shaders, dice: &mut Dice) -> Option<()> {
    let k = dice.0.next_u32();
    let dispatch = |shader| Work::Compute { shader, params: bytes_of(&[k]), groups: [1; 3] };
    match dice.below(8) {
        0 => {
            let to = dice.pick(cells, false)?;
            let value: Vec<u32> = (0..COUNT).map(|_| dice.0.next_u32()).collect();
            let work = Work::Upload { data: bytes_of(&value).into() };
            graph.push("upload", work, vec![transfer(&cells[to], Access::TransferWrite)]);
            cells[to].value = Some(value);
        }
        1 => {
            let to = dice.pick(cells, false)?;
            graph.push("fill", Work::Fill { word: k }, vec![transfer(&cells[to], Access::TransferWrite)]);
            cells[to].value = Some(vec![k; COUNT]);
        }
        2 => {
            let (from, to) = (dice.pick(cells, true)?, dice.pick(cells, false)?);
            if from == to || cells[from].kind != cells[to].kind {
                return None;
            }
            let uses = vec![transfer(&cells[from], Access::TransferRead), transfer(&cells[to], Access::TransferWrite)];
            graph.push("copy", Work::Copy, uses);
            cells[to].value = cells[from].value.clone();
        }
        3 | 4 => {
            let at = dice.pick(cells, true)?;
            let shader = shaders.update[usize::from(cells[at].kind == Kind::Image)];
            graph.push("update", dispatch(shader), vec![bind(0, &cells[at].resource, Access::StorageReadWrite)]);
            let value = cells[at].value.as_mut()?;
            for (i, word) in (0..).zip(value) {
                *word = k.wrapping_mul(*word).wrapping_add(i);
            }
        }
        _ => {
            let (a, b, to) = (dice.pick(cells, true)?, dice.pick(cells, true)?, dice.pick(cells, false)?);
            if a == to || b == to {
                return None;
            }
            let bit = |cell: usize, bit| if cells[cell].kind == Kind::Image { bit } else { 0 };
            let shader = shaders.combine[bit(a, 1) | bit(b, 2) | bit(to, 4)];
            let uses = vec![
                bind(0, &cells[a].resource, Access::StorageRead),
                bind(1, &cells[b].resource, Access::StorageRead),
                bind(2, &cells[to].resource, Access::StorageWrite),
            ];
            graph.push("combine", dispatch(shader), uses);
            let combined = cells[a].value.iter().flatten().zip(cells[b].value.iter().flatten());
            let combined = combined.map(|(x, y)| k.wrapping_mul(*x).wrapping_add(*y)).collect();
            cells[to].value = Some(combined);
        }
    }
    Some(())
}

#[test]
fn random_frames_agree_with_the_processor_to_the_bit() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let shaders = Shaders::new();
    let mut dice = Dice(Pcg32::new(7, 11));
    let kind = |index: usize| if index.is_multiple_of(2) { Kind::Buffer } else { Kind::Image };
    // These keep their content from frame to frame.
    let mut kept: Vec<Cell> =
        (0..4).map(|index| Cell::new(kind(index), format!("kept {index}"), Lifetime::Scene)).collect();
    let (mut passes, mut shared) = (0, 0);
    for frame in 0..FRAMES {
        let mut graph = Graph::new();
        let count = 4 + dice.below(12);
        let mut cells: Vec<Cell> =
            (0..count).map(|index| Cell::new(kind(index), format!("own {index}"), Lifetime::Frame)).collect();
        let own = cells.len();
        cells.append(&mut kept);
        for _ in 0..2 + dice.below(40) {
            let _ = add_pass(&mut graph, &mut cells, &shaders, &mut dice);
        }
        let mut expected: Vec<(Download, Vec<u32>)> = Vec::new();
        for cell in &cells {
            if let (Some(value), true) = (&cell.value, dice.below(4) == 0) {
                let download = Download(expected.len() as u32);
                graph.push("download", Work::Download { download }, vec![transfer(cell, Access::TransferRead)]);
                expected.push((download, value.clone()));
            }
        }
        let timing = if frame % 3 == 0 { Timing::Isolated } else { Timing::Overlapped };
        let mut run = executor.run(graph, timing).unwrap_or_else(|error| panic!("frame {frame}: {error}"));
        for (download, value) in expected {
            assert_eq!(words(&run.take(download)), value, "frame {frame}\n{}", run.plan);
        }
        passes += run.plan.passes.len();
        shared += usize::from(run.plan.shared_bytes < run.plan.unshared_bytes);
        kept = cells.split_off(own);
    }
    assert!(passes > 1000 && shared > 30, "the frames have something to get wrong: {passes} passes, {shared} share");
}
