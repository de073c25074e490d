//! Shaders that say how often their loops go round, where they say something else otherwise: for what a walk takes in truth, and
//! not by its own account.
//!
//! A counter is written into the SPIR-V, and images get it in the place of what would be stored in them. Everything else stays
//! as it is, buffers too. Loops whose length is a small constant, which drivers unroll, are not counted.

use crate::spirv::{HEADER_WORDS, instructions, push};
use crate::{Laboratory, StabilityError};
use mica_gpu::Timing;
use mica_graph::{
    Access, Description, Download, Graph, ImageDesc, Resource, Shader, Slot, StageCode, Stages, Use, Work,
};
use std::collections::{HashMap, HashSet};

/// How often the loops of passes went round in invocations that run as one vector.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rounds {
    /// In one pass, at most.
    pub longest: f64,
    /// In all passes together, at most.
    pub together: f64,
    /// Invocations.
    pub invocations: u64,
}

/// Invocations that lavapipe runs as one vector: neighbours along a row.
pub const LANES: usize = 8;

impl Laboratory<'_> {
    /// The rounds of all passes of this name.
    ///
    /// # Errors
    /// Those of the device, and where the frame has no such pass.
    pub fn rounds(&mut self, graph: &Graph, name: &str) -> Result<Rounds, StabilityError> {
        let (counting, downloads) = counting(graph, name);
        if downloads.is_empty() {
            return Err(StabilityError::Missing(format!("no pass `{name}` stores into an image")));
        }
        let mut run = self.executor.run(counting, Timing::Overlapped)?;
        let mut rounds = Rounds::default();
        let mut together: Vec<f64> = Vec::new();
        for (download, channels) in downloads {
            let counts: Vec<f32> = bytemuck::pod_collect_to_vec(&run.take(download));
            let of_vector = |vector: &[f32]| vector.iter().step_by(channels).copied().map(f64::from).sum::<f64>();
            let vectors: Vec<f64> = counts.chunks(LANES * channels).map(of_vector).collect();
            rounds.longest = vectors.iter().copied().fold(rounds.longest, f64::max);
            rounds.invocations += (counts.len() / channels) as u64;
            together.resize(vectors.len(), 0.0);
            together.iter_mut().zip(vectors).for_each(|(sum, vector)| *sum += vector);
        }
        rounds.together = together.into_iter().fold(0.0, f64::max);
        Ok(rounds)
    }
}

/// The graph with a count in the image of each pass of this name, what it is asked for by, and the image's channels.
fn counting(graph: &Graph, name: &str) -> (Graph, Vec<(Download, usize)>) {
    let mut shaders: HashMap<*const Shader, &'static Shader> = HashMap::new();
    let (mut changed, mut downloads) = (Graph::new(), Vec::new());
    // What the frame itself asks for is not wanted.
    for pass in graph.passes().iter().filter(|pass| !matches!(pass.work, Work::Download { .. })) {
        let mut work = pass.work.clone();
        let mut stored = None;
        if let Work::Compute { shader, .. } | Work::ComputeIndirect { shader, .. } = &mut work
            && shader.name == name
        {
            stored = pass.uses.iter().find(|of| of.slot == Slot::Binding(IMAGE));
            *shader = shaders.entry(*shader).or_insert_with(|| counting_shader(shader));
        }
        changed.push_with(pass, work);
        if let Some((of, desc)) = stored.and_then(|of| Some((of, image(&of.resource)?))) {
            let download = Download(downloads.len() as u32);
            downloads.push((download, desc.bytes() as usize / size_of::<f32>() / desc.extent.texels() as usize));
            let read = Use {
                resource: of.resource.clone(),
                slot: Slot::None,
                access: Access::TransferRead,
                stages: Stages::TRANSFER,
            };
            changed.push(format!("download {}", of.resource.name), Work::Download { download }, vec![read]);
        }
    }
    (changed, downloads)
}

fn image(resource: &Resource) -> Option<ImageDesc> {
    if let Description::Image(desc) = &resource.description { Some(*desc) } else { None }
}

/// The slot of the image that passes store into.
const IMAGE: u32 = 40;

/// Lives as long as the process: graphs hold shaders that are part of the program.
fn counting_shader(shader: &Shader) -> &'static Shader {
    let stages =
        shader.stages.iter().map(|stage| StageCode { stage: stage.stage, spirv: Vec::leak(with_counter(stage.spirv)) });
    Box::leak(Box::new(Shader { stages: Vec::leak(stages.collect()), ..*shader }))
}

const OP_ENTRY_POINT: u32 = 15;
const OP_CAPABILITY: u32 = 17;
const OP_TYPE_BOOL: u32 = 20;
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_FLOAT: u32 = 22;
const OP_TYPE_VECTOR: u32 = 23;
const OP_TYPE_IMAGE: u32 = 25;
const OP_TYPE_POINTER: u32 = 32;
const OP_CONSTANT: u32 = 43;
const OP_FUNCTION: u32 = 54;
const OP_VARIABLE: u32 = 59;
const OP_LOAD: u32 = 61;
const OP_STORE: u32 = 62;
const OP_COMPOSITE_CONSTRUCT: u32 = 80;
const OP_IMAGE_WRITE: u32 = 99;
const OP_CONVERT_U_TO_F: u32 = 112;
const OP_BITCAST: u32 = 124;
const OP_I_ADD: u32 = 128;
const OP_U_LESS_THAN: u32 = 176;
const OP_S_LESS_THAN: u32 = 177;
const OP_PHI: u32 = 245;
const OP_LOOP_MERGE: u32 = 246;
const OP_LABEL: u32 = 248;
const OP_BRANCH_CONDITIONAL: u32 = 250;
const OP_SELECT: u32 = 169;
const OP_ELECT: u32 = 333;
const GROUP_NON_UNIFORM: u32 = 61;
const SUBGROUP: u32 = 3;
const PRIVATE: u32 = 6;
/// From here on entry points list all the variables that they use.
const SPIRV_1_4: u32 = 0x0001_0400;

/// Rounds that drivers unroll at most.
const UNROLLED: u32 = 32;

/// The blocks where a round begins of a loop that is no small constant number of rounds long, by their labels.
fn heads_of_loops(words: &[u32]) -> HashSet<u32> {
    let small: HashSet<u32> = instructions(words)
        .filter(|(operation, whole)| *operation == OP_CONSTANT && whole.len() == 4 && whole[3] <= UNROLLED)
        .map(|(_, whole)| whole[2])
        .collect();
    let mut heads = HashSet::new();
    let mut label = 0;
    // The loop that has just begun, until its first condition.
    let mut begun = None;
    for (operation, whole) in instructions(words) {
        match operation {
            OP_LABEL => label = whole[1],
            OP_LOOP_MERGE => {
                heads.insert(label);
                begun = Some(label);
            }
            OP_BRANCH_CONDITIONAL => begun = None,
            OP_S_LESS_THAN | OP_U_LESS_THAN if small.contains(&whole[4]) => {
                if let Some(head) = begun.take() {
                    heads.remove(&head);
                }
            }
            _ => {}
        }
    }
    heads
}

/// The module with a counter, which its images get as a float: of the rounds in which this was the first invocation of its vector.
fn with_counter(words: &[u32]) -> Vec<u32> {
    let mut bound = words[3];
    let mut name = || {
        bound += 1;
        bound - 1
    };
    let mut declared = Vec::new();
    let mut declare = |operation: u32, of_type: Option<u32>, operands: &[u32]| {
        let same = |whole: &[u32]| match of_type {
            Some(of_type) => whole[1] == of_type && whole[3..] == *operands,
            None => whole[2..] == *operands,
        };
        // Types of numbers may not be declared twice.
        let known = instructions(words).find(|(known, whole)| *known == operation && same(whole));
        if let Some((_, whole)) = known.filter(|_| operation != OP_VARIABLE) {
            return whole[if of_type.is_some() { 2 } else { 1 }];
        }
        let result = name();
        push(&mut declared, operation, of_type.into_iter().chain([result]).chain(operands.iter().copied()));
        result
    };
    let truth = declare(OP_TYPE_BOOL, None, &[]);
    let uint = declare(OP_TYPE_INT, None, &[32, 0]);
    let float = declare(OP_TYPE_FLOAT, None, &[32]);
    let words_of_texel = declare(OP_TYPE_VECTOR, None, &[uint, 4]);
    let texel = declare(OP_TYPE_VECTOR, None, &[float, 4]);
    let [zero, one, scope] = [0, 1, SUBGROUP].map(|value| declare(OP_CONSTANT, Some(uint), &[value]));
    let pointer = declare(OP_TYPE_POINTER, None, &[PRIVATE, uint]);
    let counter = declare(OP_VARIABLE, Some(pointer), &[PRIVATE, zero]);

    let heads = heads_of_loops(words);
    let of_words: HashSet<u32> = instructions(words)
        .filter(|(operation, whole)| *operation == OP_TYPE_IMAGE && whole[2] == uint)
        .map(|(_, whole)| whole[1])
        .collect();
    let loaded: HashMap<u32, u32> = instructions(words)
        .filter(|(operation, _)| *operation == OP_LOAD)
        .map(|(_, whole)| (whole[2], whole[1]))
        .collect();

    let mut code = words[..HEADER_WORDS].to_vec();
    push(&mut code, OP_CAPABILITY, [GROUP_NON_UNIFORM]);
    let mut in_functions = false;
    let mut begins = false;
    for (operation, whole) in instructions(words) {
        if operation == OP_FUNCTION && !in_functions {
            in_functions = true;
            code.append(&mut declared);
        }
        if begins && operation != OP_PHI {
            begins = false;
            let [elected, added, before, after] = [(); 4].map(|()| name());
            push(&mut code, OP_ELECT, [truth, elected, scope]);
            push(&mut code, OP_SELECT, [uint, added, elected, one, zero]);
            push(&mut code, OP_LOAD, [uint, before, counter]);
            push(&mut code, OP_I_ADD, [uint, after, before, added]);
            push(&mut code, OP_STORE, [counter, after]);
        }
        begins |= operation == OP_LABEL && heads.contains(&whole[1]);
        let mut at = code.len();
        code.extend_from_slice(whole);
        if operation == OP_IMAGE_WRITE {
            code.truncate(at);
            let [rounds, count, mut stored] = [(); 3].map(|()| name());
            push(&mut code, OP_LOAD, [uint, rounds, counter]);
            push(&mut code, OP_CONVERT_U_TO_F, [float, count, rounds]);
            push(&mut code, OP_COMPOSITE_CONSTRUCT, [texel, stored, count, count, count, count]);
            if loaded.get(&whole[1]).is_some_and(|image| of_words.contains(image)) {
                let floats = std::mem::replace(&mut stored, name());
                push(&mut code, OP_BITCAST, [words_of_texel, stored, floats]);
            }
            at = code.len();
            code.extend_from_slice(whole);
            code[at + 3] = stored;
        } else if operation == OP_ENTRY_POINT && words[1] >= SPIRV_1_4 {
            code.push(counter);
            code[at] += 1 << 16;
        }
    }
    code[3] = bound;
    code
}
