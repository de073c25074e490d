//! Every hard case on the device at hand: stable forms within their tolerance, naive ones beyond it.

use mica_gpu::DeviceKind;
use mica_stability::{CASES, Effort, Laboratory};
use mica_tests::Gpu;

/// Measures a case, prints what it found and fails where a form does not do as it should. On a GPU a naive form may
/// hold, if its fault is that of another device.
fn holds(id: &str) {
    let mut gpu = Gpu::new();
    let case = CASES.iter().find(|case| case.id == id).expect("a case");
    let mut laboratory = Laboratory { executor: gpu.executor(), effort: Effort::Quick };
    let checks = (case.measure)(&mut laboratory).expect("it is measured");
    assert!(!checks.is_empty(), "{id} checks nothing");
    let on_processor = laboratory.executor.device().info().kind == DeviceKind::Cpu;
    for check in &checks {
        println!(
            "{id} {}: naive {:.2e}, stable {:.2e}, tolerance {:.2e}",
            check.what, check.naive.worst, check.stable.worst, check.tolerance
        );
        assert!(check.inputs > 0 && check.holds(), "{id}: {check:?}");
        assert!(check.has_teeth() || !on_processor, "{id}, the naive form holds: {check:?}");
    }
}

#[test]
fn h01_grazing() {
    holds("H01");
}

#[test]
fn h02_masking() {
    holds("H02");
}

#[test]
fn h03_opposite() {
    holds("H03");
}

#[test]
fn h04_retroreflection() {
    holds("H04");
}

#[test]
fn h05_cone_membership() {
    holds("H05");
}

#[test]
fn h06_cone_angles() {
    holds("H06");
}

#[test]
fn h07_small_angles() {
    holds("H07");
}

#[test]
fn h08_cone_and_node() {
    holds("H08");
}

#[test]
fn h09_beckmann() {
    holds("H09");
}

#[test]
fn h10_binomial_counts() {
    holds("H10");
}

#[test]
fn h11_many_flakes() {
    holds("H11");
}

#[test]
fn h12_conserving_split() {
    holds("H12");
}

#[test]
fn h13_accumulated_probability() {
    holds("H13");
}

#[test]
fn h14_hashes() {
    holds("H14");
}

#[test]
fn h15_huge_coordinates() {
    holds("H15");
}

#[test]
fn h16_footprint_axes() {
    holds("H16");
}

#[test]
fn h17_odd_footprints() {
    holds("H17");
}

#[test]
fn h18_uv_derivatives() {
    holds("H18");
}

#[test]
fn h19_tangent_frames() {
    holds("H19");
}

#[test]
fn h20_distances() {
    holds("H20");
}

#[test]
fn h21_self_intersection() {
    holds("H21");
}

#[test]
fn h22_watertight() {
    holds("H22");
}

#[test]
fn h23_hierarchy() {
    holds("H23");
}

#[test]
fn h24_lit_probability() {
    holds("H24");
}

#[test]
fn h25_selection_probability() {
    holds("H25");
}

#[test]
fn h26_scale_transitions() {
    holds("H26");
}

#[test]
fn h27_temporal_stability() {
    holds("H27");
}

#[test]
fn h28_energy_across_scale() {
    holds("H28");
}

#[test]
fn h29_blurs() {
    holds("H29");
}

#[test]
fn h30_environment_maps() {
    holds("H30");
}

#[test]
fn h31_wang_bowles() {
    holds("H31");
}

#[test]
fn h32_half_floats() {
    holds("H32");
}

#[test]
fn h33_timestamps() {
    holds("H33");
}

#[test]
fn h34_denormals() {
    holds("H34");
}

#[test]
fn h35_contraction() {
    holds("H35");
}

#[test]
fn h36_negative_zero() {
    holds("H36");
}

#[test]
fn h37_not_a_number() {
    holds("H37");
}

#[test]
fn h38_subgroups() {
    holds("H38");
}

#[test]
fn h39_atomics() {
    holds("H39");
}

#[test]
fn h40_loop_budget() {
    holds("H40");
}

#[test]
fn h41_integer_edges() {
    holds("H41");
}

#[test]
fn h42_area_lights() {
    holds("H42");
}

#[test]
fn h43_density() {
    holds("H43");
}

#[test]
fn h44_descriptor_range() {
    holds("H44");
}
