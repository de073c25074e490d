//! Canaries sing what a device is known to do.

use mica_stability::{Canary, Effort, Laboratory, canaries};
use mica_tests::Gpu;

/// Where lavapipe 22.3 and 25.0 differ: ends of loops, and conversions out of range.
const LOOPS: [(&str, &str); 2] = [("22.3", "65535 and 1"), ("25.0", "200000 and 1000")];
const CONVERSIONS: [(&str, &str); 2] = [
    (
        "22.3",
        "int(3000000000) = -2147483648, int(NaN) = -2147483648, int(-inf) = -2147483648, \
         uint(-1.5) = 4294967295, uint(5000000000) = 4294967295",
    ),
    (
        "25.0",
        "int(3000000000) = 2147483647, int(NaN) = 0, int(-inf) = -2147483648, uint(-1.5) = 0, \
         uint(5000000000) = 4294967295",
    ),
];
/// What both are known to do.
const COMMON: [(&str, &str); 11] = [
    ("subgroup_size", "8"),
    ("storage_range", "128 MiB"),
    ("reassociation", "no, it is rewritten, yes"),
    ("contraction", "yes"),
    ("fma", "no, it is not fused"),
    ("denormals", "kept, kept, kept, kept"),
    ("nan_selection", "min(NaN, 1) = 1, min(1, NaN) = 1, max(NaN, 1) = 1, max(1, NaN) = 1, clamp(NaN, 0, 1) = 0"),
    ("nan_tests", "isnan(NaN) = 1, inf - inf = 0, 0 inf = NaN, NaN == NaN = 0, isinf(inf) = 1"),
    ("fract_below_zero", "fract(-1e-9) = 1"),
    ("integer_edges", "1 << 32 = 1, 7 / 0 = 4294967295"),
    ("half_floats", "to nearest, ties to even; 65519 = 65504, 65520 = inf; 2^-20 is kept, 2.9e-8 = 0"),
];

/// On any device each question has an answer, no promise of Vulkan's is broken and `precise` is obeyed; on lavapipe
/// answers are those that were measured once and that the renderer was built on.
#[test]
fn canaries_sing_what_lavapipe_is_known_to_do() {
    let mut gpu = Gpu::new();
    let mut laboratory = Laboratory { executor: gpu.executor(), effort: Effort::Quick };
    let found = canaries(&mut laboratory).expect("the device answers");
    let info = laboratory.executor.device().info().clone();
    let answer = |name: &str| -> &Canary { found.iter().find(|canary| canary.name == name).expect("a canary") };
    for canary in &found {
        println!("{}: {}; {}", canary.name, canary.found, canary.means);
        assert!(![&canary.found, &canary.means].iter().any(|text| text.is_empty()), "{canary:?}");
        assert!(!canary.means.contains("NOT KEPT") && !canary.means.contains("not obeyed"), "{canary:?}");
    }
    if info.driver == "llvmpipe" {
        let of_version = |known: &[(&str, &'static str)]| {
            known.iter().find(|(version, _)| info.driver_version.contains(version)).map(|(_, answer)| *answer)
        };
        let known = [("loop_limit", of_version(&LOOPS)), ("float_to_integer", of_version(&CONVERSIONS))];
        let common = COMMON.map(|(name, answer)| (name, Some(answer)));
        for (name, known) in known.into_iter().chain(common) {
            let known = known.unwrap_or_else(|| panic!("lavapipe {} is new: add what it does", info.driver_version));
            assert_eq!(answer(name).found, known, "{name}");
        }
    }
}
