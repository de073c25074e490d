//! Floats of the flake set are rounded one by one: compiled shaders say so, and the device does so.

use mica_graph::{Access, Graph, Shader};
use mica_tests::Gpu;
use mica_tests::shaders::{Change, filled, push_pass, test_shader};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::collections::{HashMap, HashSet};

/// Functions of `shared/flake_set.glsl` that work on floats, with the operations that each has at least.
const EXACT: [(&str, usize); 5] =
    [("minus_log", 20), ("inverse_root", 4), ("normal_pair", 18), ("half_of", 9), ("flake_normal", 1)];

/// By function of a shader, how many sums and products of floats it has, and how many of them may be contracted.
fn sums_and_products(shader: &Shader) -> HashMap<String, (usize, usize)> {
    const HEADER_WORDS: usize = 5;
    const OP_NAME: u32 = 5;
    const OP_FUNCTION: u32 = 54;
    const OP_DECORATE: u32 = 71;
    const NO_CONTRACTION: u32 = 42;
    // OpFAdd, OpFSub, OpFMul, OpVectorTimesScalar.
    const OPERATIONS: [u32; 4] = [129, 131, 133, 142];
    let (mut names, mut exact, mut found) = (HashMap::new(), HashSet::new(), HashMap::new());
    let mut function = String::new();
    for stage in shader.stages {
        let mut rest = &stage.spirv[HEADER_WORDS..];
        while let Some(first) = rest.first() {
            let (instruction, after) = rest.split_at((first >> 16) as usize);
            rest = after;
            match (first & 0xffff, &instruction[1..]) {
                (OP_NAME, [id, name @ ..]) => {
                    let bytes = name.iter().flat_map(|word| word.to_le_bytes());
                    // Up to the types of the parameters, which glslang appends.
                    let name: Vec<u8> = bytes.take_while(|byte| *byte != 0 && *byte != b'(').collect();
                    names.insert(*id, String::from_utf8_lossy(&name).into_owned());
                }
                (OP_DECORATE, [id, NO_CONTRACTION]) => {
                    exact.insert(*id);
                }
                (OP_FUNCTION, [_, id, ..]) => function = names.get(id).cloned().unwrap_or_default(),
                (operation, [_, result, ..]) if OPERATIONS.contains(&operation) => {
                    let (all, loose) = found.entry(function.clone()).or_insert((0, 0));
                    *all += 1;
                    *loose += usize::from(!exact.contains(result));
                }
                _ => {}
            }
        }
    }
    found
}

/// The functions of the flake set that a shader has with all their operations, and those with an operation that may be
/// contracted.
fn functions(shader: &Shader) -> (Vec<&'static str>, Vec<&'static str>) {
    let found = sums_and_products(shader);
    let (mut sound, mut loose) = (Vec::new(), Vec::new());
    for (name, least) in EXACT {
        if let Some((all, contracted)) = found.get(name) {
            let list = if *all >= least && *contracted == 0 { &mut sound } else { &mut loose };
            list.push(name);
        }
    }
    (sound, loose)
}

/// Each sum and product in them has the decoration `NoContraction`, in every shader that has them: the one that shows
/// flakes has all five. One `precise` less shows.
#[test]
fn compiled_shaders_forbid_contraction_in_the_flake_set() {
    let (mut holders, mut required) = (0, 0);
    for shader in mica_shaders::ALL {
        let (sound, loose) = functions(shader);
        assert!(loose.is_empty(), "{} {}: {loose:?}", shader.name, shader.variant);
        holders += usize::from(!sound.is_empty());
        let expected = match (shader.name, shader.variant) {
            ("glints", "method=flakes") => EXACT.len(),
            // They count, and take no flake's normal.
            ("glints", "method=jakob") | ("flake_counts", _) => EXACT.len() - 1,
            _ => continue,
        };
        required += 1;
        println!("{} {}: {sound:?}", shader.name, shader.variant);
        assert_eq!(sound.len(), expected, "{} {}: {sound:?}", shader.name, shader.variant);
    }
    println!("{holders} shaders have such functions");
    assert_eq!(required, 3, "the shaders that count and show flakes are among them");

    let access = [(30, Access::StorageRead), (31, Access::StorageWrite)];
    let as_it_is = test_shader("flake_words.comp", None, &access, 0);
    assert_eq!(functions(as_it_is).0.len(), EXACT.len());
    for (from, to, function) in [
        ("precise float result =", "float result =", "minus_log"),
        ("precise vec2 slopes =", "vec2 slopes =", "flake_normal"),
    ] {
        let change = Change { file: "shared/flake_set.glsl", from, to };
        let changed = test_shader("flake_words.comp", Some(change), &access, 0);
        assert_eq!(functions(changed).1, [function], "{from:?} must be missed");
    }
}

/// The device rounds each operation by itself: what a sum rounds off is found exactly, for 1e8 + 1 and for 100,000
/// random pairs up to 2^28 apart, and a product is rounded before something is added to it. Sums reassociated would
/// have no error, and a fused product would differ in a tenth of the cases or more: both are seen to differ here on the
/// host.
#[test]
fn precise_operations_are_rounded_one_by_one() {
    let mut gpu = Gpu::new();
    let mut random = Pcg64::seed_from_u64(8);
    let mut terms = vec![[1e8f32, 1.0, -1e8], [1.0, 1e8, 1.0], [1e8, -1.0, 1e8]];
    terms.extend((0..100_000).map(|_| {
        [(); 3].map(|()| {
            let size = 2f32.powi((random.next_u32() % 28) as i32);
            let sign = if random.next_u32() % 2 == 0 { 1.0 } else { -1.0 };
            sign * size * (1.0 + (random.next_u32() >> 9) as f32 / 8_388_608.0)
        })
    }));
    let access = [(30, Access::StorageRead), (31, Access::StorageWrite)];
    let shader = test_shader("sums.comp", None, &access, 0);
    let mut graph = Graph::new();
    let asked = filled(&mut graph, "asked", bytemuck::cast_slice(&terms));
    let found = graph.buffer("found", (terms.len() * size_of::<[f32; 3]>()) as u64);
    push_pass(&mut graph, shader, &[], terms.len(), &[(30, &asked, access[0].1), (31, &found, access[1].1)]);
    let found: Vec<[f32; 3]> = bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&found])[0]);
    let (mut inexact, mut fused) = (0, 0);
    for ([a, b, c], [sum, error, of_product]) in terms.iter().zip(&found) {
        assert_eq!(sum.to_bits(), (a + b).to_bits(), "{a} + {b}");
        // Sums of such numbers, and of a sum with its error, are exact in f64.
        let exact = f64::from(*a) + f64::from(*b);
        assert_eq!(f64::from(*sum) + f64::from(*error), exact, "{a} + {b} is {sum} and {error}");
        assert_eq!(*of_product, a * b + c, "{a} {b} + {c}");
        inexact += usize::from(*error != 0.0);
        fused += usize::from(a.mul_add(*b, *c) != a * b + c);
    }
    println!("{inexact} sums are inexact, {fused} products would differ fused, of {}", terms.len());
    assert!(inexact > terms.len() / 10 && fused > terms.len() / 10, "{inexact} {fused}");
}
