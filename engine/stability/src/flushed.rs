//! Shaders as a device without small numbers would run them: every float that is read or computed and lies below a
//! threshold becomes 0.
//!
//! Vulkan lets a device flush denormals wherever it likes, and not every device can be told to. So the flush is written
//! into the SPIR-V, after each load, each read of an image, each conversion and each arithmetic instruction that gives floats,
//! vectors or matrices of them. What only moves bits (bitcasts, selections, swizzles) gives what it was given.

use crate::spirv::{HEADER_WORDS, instructions, push};
use mica_graph::{Graph, Shader, StageCode, Work};
use std::collections::HashMap;

/// The least float that devices keep.
pub const LEAST_NORMAL: f32 = f32::MIN_POSITIVE;

/// The graph with all its shaders flushed. What it exports is not kept: ask for downloads.
pub fn flushed(graph: &Graph, below: f32) -> Graph {
    let mut shaders: HashMap<*const Shader, &'static Shader> = HashMap::new();
    let mut changed = Graph::new();
    for pass in graph.passes() {
        let mut work = pass.work.clone();
        if let Work::Compute { shader, .. } | Work::ComputeIndirect { shader, .. } | Work::Raster { shader, .. } =
            &mut work
        {
            *shader = shaders.entry(*shader).or_insert_with(|| flushed_shader(shader, below));
        }
        changed.push_with(pass, work);
    }
    changed
}

/// Lives as long as the process: graphs hold shaders that are part of the program.
fn flushed_shader(shader: &Shader, below: f32) -> &'static Shader {
    let stages = shader
        .stages
        .iter()
        .map(|stage| StageCode { stage: stage.stage, spirv: Vec::leak(Module::new(stage.spirv, below).rewritten()) });
    Box::leak(Box::new(Shader { stages: Vec::leak(stages.collect()), ..*shader }))
}

const OP_EXT_INST: u32 = 12;
const OP_TYPE_BOOL: u32 = 20;
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_FLOAT: u32 = 22;
const OP_TYPE_VECTOR: u32 = 23;
const OP_TYPE_MATRIX: u32 = 24;
const OP_CONSTANT: u32 = 43;
const OP_CONSTANT_COMPOSITE: u32 = 44;
const OP_CONSTANT_NULL: u32 = 46;
const OP_FUNCTION: u32 = 54;
const OP_LOAD: u32 = 61;
const OP_DECORATE: u32 = 71;
const OP_COMPOSITE_CONSTRUCT: u32 = 80;
const OP_COMPOSITE_EXTRACT: u32 = 81;
const OP_BITCAST: u32 = 124;
const OP_SELECT: u32 = 169;
const OP_U_LESS_THAN: u32 = 176;
const OP_BITWISE_AND: u32 = 199;
const NO_CONTRACTION: u32 = 42;
/// Sums, differences, products, quotients and remainders of floats, of vectors and matrices, outer and dot products.
const ARITHMETIC: [u32; 13] = [129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148];
/// Samples, fetches, gathers and reads of images.
const IMAGE_READS: [u32; 12] = [87, 88, 89, 90, 91, 92, 93, 94, 95, 96, 97, 98];
/// From integers, from floats of other widths, and to half floats and back.
const CONVERSIONS: [u32; 4] = [111, 112, 115, 116];

/// What flushing numbers of one width takes: floats, or vectors of two to four.
#[derive(Clone, Copy)]
struct Width {
    bits_type: u32,
    flags_type: u32,
    magnitude: u32,
    threshold: u32,
    zero: u32,
}

/// The instructions of a module, and what is added to them.
struct Module<'a> {
    words: &'a [u32],
    bound: u32,
    /// Declarations that functions need and the module lacks.
    declared: Vec<u32>,
    /// By the type of floats.
    widths: HashMap<u32, Width>,
    /// The columns of matrices by their type: what they are, and how many.
    columns: HashMap<u32, (u32, u32)>,
    /// Results that are flushed, and the names that their instructions get.
    raw: HashMap<u32, u32>,
}

impl<'a> Module<'a> {
    fn new(words: &'a [u32], below: f32) -> Self {
        let mut module = Self {
            words,
            bound: words[3],
            declared: Vec::new(),
            widths: HashMap::new(),
            columns: HashMap::new(),
            raw: HashMap::new(),
        };
        module.declare(below);
        let matrices = instructions(words).filter(|(operation, _)| *operation == OP_TYPE_MATRIX);
        let matrices = matrices.filter(|(_, whole)| module.widths.contains_key(&whole[2]));
        module.columns = matrices.map(|(_, whole)| (whole[1], (whole[2], whole[3]))).collect();
        let results: Vec<u32> = instructions(words).filter_map(|(_, whole)| module.flushed_result(whole)).collect();
        for result in results {
            let raw = module.name();
            module.raw.insert(result, raw);
        }
        module
    }

    fn name(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    /// Finds or declares the types and constants of each width.
    fn declare(&mut self, below: f32) {
        let find = |operation: u32, operands: &[u32]| {
            let matches = |whole: &[u32]| whole[0] & 0xffff == operation && whole[2..] == *operands;
            instructions(self.words).find(|(_, whole)| matches(whole)).map(|(_, whole)| whole[1])
        };
        let Some(float) = find(OP_TYPE_FLOAT, &[32]) else { return };
        let vectors: Vec<(u32, u32)> = (2..=4).filter_map(|n| Some((n, find(OP_TYPE_VECTOR, &[float, n])?))).collect();
        let (uint, bool_type) = (find(OP_TYPE_INT, &[32, 0]), find(OP_TYPE_BOOL, &[]));
        let known: Vec<(u32, Option<u32>, Option<u32>)> = vectors
            .iter()
            .map(|(n, _)| {
                let of = |scalar: Option<u32>| scalar.and_then(|scalar| find(OP_TYPE_VECTOR, &[scalar, *n]));
                (*n, of(uint), of(bool_type))
            })
            .collect();

        let uint = uint.unwrap_or_else(|| self.add(OP_TYPE_INT, None, &[32, 0]));
        let bool_type = bool_type.unwrap_or_else(|| self.add(OP_TYPE_BOOL, None, &[]));
        let magnitude = self.add(OP_CONSTANT, Some(uint), &[0x7fff_ffff]);
        let threshold = self.add(OP_CONSTANT, Some(uint), &[below.to_bits()]);
        let zero = self.add(OP_CONSTANT_NULL, Some(float), &[]);
        self.widths.insert(float, Width { bits_type: uint, flags_type: bool_type, magnitude, threshold, zero });
        for ((n, vector), (_, bits_type, flags_type)) in vectors.into_iter().zip(known) {
            let bits_type = bits_type.unwrap_or_else(|| self.add(OP_TYPE_VECTOR, None, &[uint, n]));
            let flags_type = flags_type.unwrap_or_else(|| self.add(OP_TYPE_VECTOR, None, &[bool_type, n]));
            let magnitude = self.add(OP_CONSTANT_COMPOSITE, Some(bits_type), &vec![magnitude; n as usize]);
            let threshold = self.add(OP_CONSTANT_COMPOSITE, Some(bits_type), &vec![threshold; n as usize]);
            let zero = self.add(OP_CONSTANT_NULL, Some(vector), &[]);
            self.widths.insert(vector, Width { bits_type, flags_type, magnitude, threshold, zero });
        }
    }

    /// Appends a declaration and returns its name.
    fn add(&mut self, operation: u32, of_type: Option<u32>, operands: &[u32]) -> u32 {
        let name = self.name();
        push(&mut self.declared, operation, of_type.into_iter().chain([name]).chain(operands.iter().copied()));
        name
    }

    /// The result of an instruction that gives floats that a device might flush.
    fn flushed_result(&self, whole: &[u32]) -> Option<u32> {
        let operation = whole[0] & 0xffff;
        let gives_floats = [&ARITHMETIC[..], &IMAGE_READS, &CONVERSIONS, &[OP_LOAD, OP_EXT_INST]];
        let gives_floats = gives_floats.iter().any(|operations| operations.contains(&operation));
        let of_floats = || self.widths.contains_key(&whole[1]) || self.columns.contains_key(&whole[1]);
        (gives_floats && of_floats()).then(|| whole[2])
    }

    fn rewritten(mut self) -> Vec<u32> {
        let mut code = self.words[..HEADER_WORDS].to_vec();
        let mut in_functions = false;
        for (operation, whole) in instructions(self.words) {
            if operation == OP_FUNCTION && !in_functions {
                in_functions = true;
                code.append(&mut self.declared);
            }
            let at = code.len();
            code.extend_from_slice(whole);
            if operation == OP_DECORATE && whole[2] == NO_CONTRACTION {
                code[at + 1] = *self.raw.get(&whole[1]).unwrap_or(&whole[1]);
            }
            if let Some(result) = self.flushed_result(whole) {
                let raw = self.raw[&result];
                code[at + 2] = raw;
                self.flush(&mut code, whole[1], raw, result);
            }
        }
        code[3] = self.bound;
        code
    }

    /// `result` is `raw`, or 0 where that is small.
    fn flush(&mut self, code: &mut Vec<u32>, of_type: u32, raw: u32, result: u32) {
        if let Some((column_type, count)) = self.columns.get(&of_type).copied() {
            let columns = (0..count).map(|index| {
                let [column, flushed] = [(); 2].map(|()| self.name());
                push(code, OP_COMPOSITE_EXTRACT, [column_type, column, raw, index]);
                self.flush(code, column_type, column, flushed);
                flushed
            });
            let columns: Vec<u32> = columns.collect();
            push(code, OP_COMPOSITE_CONSTRUCT, [of_type, result].into_iter().chain(columns));
            return;
        }
        let width = self.widths[&of_type];
        let [bits, magnitude, small] = [(); 3].map(|()| self.name());
        push(code, OP_BITCAST, [width.bits_type, bits, raw]);
        push(code, OP_BITWISE_AND, [width.bits_type, magnitude, bits, width.magnitude]);
        push(code, OP_U_LESS_THAN, [width.flags_type, small, magnitude, width.threshold]);
        push(code, OP_SELECT, [of_type, result, small, width.zero, raw]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In all shaders that there are: what gives floats gives them under another name, and what had their name chooses between
    /// them and 0, matrices column by column.
    #[test]
    fn every_instruction_that_gives_floats_is_flushed() {
        let mut kinds: HashMap<u32, usize> = HashMap::new();
        for stage in mica_shaders::ALL.iter().flat_map(|shader| shader.stages) {
            let given = Module::new(stage.spirv, LEAST_NORMAL);
            let rewritten = Module::new(stage.spirv, LEAST_NORMAL).rewritten();
            let chosen: HashMap<u32, u32> = instructions(&rewritten)
                .filter(|(operation, _)| [OP_SELECT, OP_COMPOSITE_CONSTRUCT].contains(operation))
                .map(|(operation, whole)| (whole[2], operation))
                .collect();
            let renamed: HashMap<u32, u32> = instructions(&rewritten)
                .filter(|(_, whole)| given.flushed_result(whole).is_some())
                .map(|(operation, whole)| (whole[2], operation))
                .collect();
            for (operation, whole) in instructions(stage.spirv) {
                let Some(result) = given.flushed_result(whole) else { continue };
                let is_matrix = given.columns.contains_key(&whole[1]);
                let wanted = if is_matrix { OP_COMPOSITE_CONSTRUCT } else { OP_SELECT };
                assert_eq!(renamed.get(&given.raw[&result]), Some(&operation));
                assert_eq!(chosen.get(&result), Some(&wanted));
                *kinds.entry(if is_matrix { OP_TYPE_MATRIX } else { operation }).or_default() += 1;
            }
        }
        // Sums, products of a matrix and a vector, fetches and reads of images, f64 to f32, from integers, matrices.
        for kind in [129, 145, 95, 98, 115, 111, 112, OP_TYPE_MATRIX] {
            assert!(kinds.contains_key(&kind), "{kind} of {kinds:?}");
        }
    }
}
