//! The hard cases, a file each.

mod h01_grazing;
mod h02_masking;
mod h03_opposite;
mod h04_retroreflection;
mod h05_cone_membership;
mod h06_cone_angles;
mod h07_small_angles;
mod h08_cone_and_node;
mod h09_beckmann;
mod h10_binomial_counts;
mod h11_many_flakes;
mod h12_conserving_split;
mod h13_accumulated_probability;
mod h14_hashes;
mod h15_huge_coordinates;
mod h16_footprint_axes;
mod h17_odd_footprints;
mod h18_uv_derivatives;
mod h19_tangent_frames;
mod h20_distances;
mod h21_self_intersection;
mod h22_watertight;
mod h23_hierarchy;
mod h24_lit_probability;
mod h25_selection_probability;
mod h26_scale_transitions;
mod h27_temporal_stability;
mod h28_energy_across_scale;
mod h29_blurs;
mod h30_environment_maps;
mod h31_wang_bowles;
mod h32_half_floats;
mod h33_timestamps;
mod h34_denormals;
mod h35_contraction;
mod h36_negative_zero;
mod h37_not_a_number;
mod h38_subgroups;
mod h39_atomics;
mod h40_loop_budget;
mod h41_integer_edges;
mod h42_area_lights;
mod h43_density;
mod h44_descriptor_range;
mod lit_flake;
mod quarters;

/// What the sweep over distance shows more of.
pub(crate) use h28_energy_across_scale::{EVERY_FLAKE, GATED, Shown, distances, limit, radiance_seen, seen_from};

use crate::Case;

/// All of them, by number.
pub const CASES: [Case; 44] = [
    Case {
        id: "H01",
        title: "Grazing light and view: G1 / cos at the horizon",
        stable: &["beckmann_d", "beckmann_g1_over_cosine", "half_vector"],
        measure: h01_grazing::measure,
    },
    Case {
        id: "H02",
        title: "Masking of Smith for Beckmann: the rational fit and the exact form",
        stable: &["beckmann_g1_over_cosine"],
        measure: h02_masking::measure,
    },
    Case {
        id: "H03",
        title: "Light and view nearly opposite: the half vector",
        stable: &["half_vector", "half_vector_cosine"],
        measure: h03_opposite::measure,
    },
    Case {
        id: "H04",
        title: "Light from where the viewer is: axes of the reflecting set",
        stable: &["flake_is_lit", "lit_probability", "reflects_into_cone"],
        measure: h04_retroreflection::measure,
    },
    Case {
        id: "H05",
        title: "Whether a flake is lit, for narrow cones",
        stable: &["conic_across", "flake_is_lit", "reflects_into_cone"],
        measure: h05_cone_membership::measure,
    },
    Case {
        id: "H06",
        title: "Cones from nothing to everything: solid angle, P and its limit",
        stable: &["lit_probability"],
        measure: h06_cone_angles::measure,
    },
    Case {
        id: "H07",
        title: "Small angles between directions",
        stable: &["angle_between", "sine_between"],
        measure: h07_small_angles::measure,
    },
    Case {
        id: "H08",
        title: "A cone against a node of the angular hierarchy",
        stable: &["jakob_side_of_cone"],
        measure: h08_cone_and_node::measure,
    },
    Case {
        id: "H09",
        title: "Beckmann's D at small roughness, and underflow",
        stable: &["beckmann_d"],
        measure: h09_beckmann::measure,
    },
    Case {
        id: "H10",
        title: "Binomial counts: rare events, moments, no switch between branches",
        stable: &["binomial", "chance_of_any"],
        measure: h10_binomial_counts::measure,
    },
    Case {
        id: "H11",
        title: "From no flake to 1e12: halving without loss",
        stable: &["children_of"],
        measure: h11_many_flakes::measure,
    },
    Case {
        id: "H12",
        title: "Multinomial splits that lose no flake",
        stable: &["children_of"],
        measure: h12_conserving_split::measure,
    },
    Case {
        id: "H13",
        title: "Chances accumulated over many lights",
        stable: &["log_of_rest", "one_minus_exp"],
        measure: h13_accumulated_probability::measure,
    },
    Case {
        id: "H14",
        title: "Hashes: duplicates, correlation, dispersion, their twin on the host",
        stable: &["hash"],
        measure: h14_hashes::measure,
    },
    Case {
        id: "H15",
        title: "Huge, negative and tiled texture coordinates",
        stable: &["cell_of", "texture_place", "within_cell"],
        measure: h15_huge_coordinates::measure,
    },
    Case {
        id: "H16",
        title: "Area and axes of long footprints",
        stable: &["footprint_area", "footprint_axes"],
        measure: h16_footprint_axes::measure,
    },
    Case {
        id: "H17",
        title: "Footprints of no area, below a texel, beyond the texture, infinite",
        stable: &["derivatives by triangles"],
        measure: h17_odd_footprints::measure,
    },
    Case {
        id: "H18",
        title: "Derivatives of texture coordinates far from the origin, mirrored, across seams",
        stable: &["derivatives by triangles"],
        measure: h18_uv_derivatives::measure,
    },
    Case {
        id: "H19",
        title: "Tangent frames where they are singular; triangles without area",
        stable: &["frame_about", "frame_along", "triangles without area"],
        measure: h19_tangent_frames::measure,
    },
    Case {
        id: "H20",
        title: "Cameras from 1e-4 to 1e6 away",
        stable: &["placing about the centre"],
        measure: h20_distances::measure,
    },
    Case {
        id: "H21",
        title: "Rays that leave a triangle meet what covers it, and not itself",
        stable: &["offset_origin"],
        measure: h21_self_intersection::measure,
    },
    Case {
        id: "H22",
        title: "Rays at shared edges and corners meet the surface",
        stable: &["rays against triangles"],
        measure: h22_watertight::measure,
    },
    Case {
        id: "H23",
        title: "Hierarchies of degenerate triangles: build and walk",
        stable: &["hierarchies of triangles"],
        measure: h23_hierarchy::measure,
    },
    Case {
        id: "H24",
        title: "P near the edge of the cone",
        stable: &["lit_probability"],
        measure: h24_lit_probability::measure,
    },
    Case {
        id: "H25",
        title: "Division by the probability of selection",
        stable: &["rare_unit_from", "selection_probability"],
        measure: h25_selection_probability::measure,
    },
    Case {
        id: "H26",
        title: "Mean and variance across scales, without a step",
        stable: &["binomial"],
        measure: h26_scale_transitions::measure,
    },
    Case {
        id: "H27",
        title: "The same frame twice; small motions",
        stable: &["binomial", "frames of flakes"],
        measure: h27_temporal_stability::measure,
    },
    Case {
        id: "H28",
        title: "Energy from near to far and from few flakes to many",
        stable: &["frames of flakes"],
        measure: h28_energy_across_scale::measure,
    },
    Case {
        id: "H29",
        title: "Blurs keep energy at the border, and what is not a number does not spread",
        stable: &["blurred"],
        measure: h29_blurs::measure,
    },
    Case {
        id: "H30",
        title: "Environments: a sun in one texel, bad texels, poles, the seam",
        stable: &["equirect_from", "environments"],
        measure: h30_environment_maps::measure,
    },
    Case {
        id: "H31",
        title: "Sparkle of Wang and Bowles: levels, normalisation, normal incidence",
        stable: &["sparkle_distance", "sparkle_shift", "sparkle_stretch"],
        measure: h31_wang_bowles::measure,
    },
    Case {
        id: "H32",
        title: "Storage in half floats",
        stable: &["packed_halves", "running_mean"],
        measure: h32_half_floats::measure,
    },
    Case {
        id: "H33",
        title: "Timestamps that wrap, and none at all",
        stable: &["differences of timestamps"],
        measure: h33_timestamps::measure,
    },
    Case {
        id: "H34",
        title: "Nothing depends on denormals",
        stable: &["beckmann_g1_over_cosine", "frames of flakes"],
        measure: h34_denormals::measure,
    },
    Case {
        id: "H35",
        title: "Operations are rounded one by one where they must be",
        stable: &["exact_product", "exact_sum"],
        measure: h35_contraction::measure,
    },
    Case { id: "H36", title: "Minus zero", stable: &["frame_about", "words_of"], measure: h36_negative_zero::measure },
    Case {
        id: "H37",
        title: "What is not a number, and finite or not",
        stable: &["is_finite"],
        measure: h37_not_a_number::measure,
    },
    Case {
        id: "H38",
        title: "No algorithm assumes a size of subgroups or groups",
        stable: &["count_rays"],
        measure: h38_subgroups::measure,
    },
    Case {
        id: "H39",
        title: "Sums that do not depend on the order of invocations",
        stable: &["ADD_FIXED_POINT"],
        measure: h39_atomics::measure,
    },
    Case {
        id: "H40",
        title: "Loops within the device's budget",
        stable: &["budgets of steps"],
        measure: h40_loop_budget::measure,
    },
    Case {
        id: "H41",
        title: "Shifts, divisions and conversions at their edges",
        stable: &["integer_from", "quotient", "shifted_left", "shifted_right", "whole_from"],
        measure: h41_integer_edges::measure,
    },
    Case {
        id: "H42",
        title: "Area lights: interpolation on the sphere, black subdivisions",
        stable: &["chance_of_first", "slerp"],
        measure: h42_area_lights::measure,
    },
    Case {
        id: "H43",
        title: "Logarithms of densities, up to e^50",
        stable: &["flakes_in_cell"],
        measure: h43_density::measure,
    },
    Case {
        id: "H44",
        title: "Buffers larger than a descriptor can bind",
        stable: &["sizes of buffers"],
        measure: h44_descriptor_range::measure,
    },
];
