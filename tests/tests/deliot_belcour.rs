//! `deliot_belcour` against an f64 twin, its smooth limit, and the continuity that its blends are for.

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use mica_accuracy::{Condition, Stage};
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_oracle::flake_set::{hash2, hash3, mixed};
use mica_oracle::lit_probability::{cone_solid_angle, lit_probability};
use mica_shaders::constants::DELIOT_BELCOUR_NOISE_SIZE as SIZE;
use mica_shaders::deliot_belcour_noise;
use mica_tests::Gpu;
use mica_tests::twin::{Seen, ellipse, stage_pixels, unit_from, words_of};
use mica_tests::unusual::{greatest_jump, panned, ratios_over_unusual_footprints};
use mica_tests::values::facets;
use std::f64::consts::PI;

/// The number that these bits are as a half float.
fn half(bits: u32) -> f64 {
    let (exponent, mantissa) = (bits >> 10 & 31, f64::from(bits & 1023));
    let magnitude = if exponent == 0 {
        mantissa * 2f64.powi(-24)
    } else {
        (1.0 + mantissa / 1024.0) * 2f64.powi(exponent as i32 - 15)
    };
    if bits >> 15 & 1 == 1 { -magnitude } else { magnitude }
}

/// The noise map: four words a cell.
fn noise_map(gpu: &mut Gpu) -> Vec<u32> {
    let mut graph = Graph::new();
    let mut noise = Buffer::new("noise", 16 * u64::from(SIZE * SIZE), Lifetime::Frame);
    graph.pass(deliot_belcour_noise::Bind { noise: &mut noise }, (), Extent::new(SIZE, SIZE));
    bytemuck::pod_collect_to_vec(&gpu.run(graph, &[&noise])[0])
}

/// Moments of 262,144 uniform and as many normal numbers within 4 standard errors, no neighbours alike, and each cell's
/// three neighbours in its own entry. Catches a deviation 1 % off.
#[test]
fn the_noise_map_holds_uniform_and_normal_numbers_and_their_neighbours() {
    let mut gpu = Gpu::new();
    let noise = noise_map(&mut gpu);
    assert!(noise == noise_map(&mut gpu), "it is the same whenever it is made");
    let at = |x: u32, y: u32, word: u32| noise[(4 * ((y % SIZE) * SIZE + x % SIZE) + word) as usize];
    for y in 0..SIZE {
        for x in 0..SIZE {
            let own: Vec<u32> = (0..4).map(|word| at(x, y, word)).collect();
            assert_eq!(own[1..], [at(x + 1, y, 0), at(x, y + 1, 0), at(x + 1, y + 1, 0)]);
        }
    }
    let firsts: Vec<u32> = noise.iter().step_by(4).copied().collect();
    let n = firsts.len() as f64;
    let uniform: Vec<f64> = firsts.iter().map(|bits| half(bits >> 16)).collect();
    let normal: Vec<f64> = firsts.iter().map(|bits| half(bits & 0xffff)).collect();
    assert!(uniform.iter().all(|u| *u >= 0.0 && *u < 1.0));
    let moment = |values: &[f64], power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / n;
    let near = |value: f64, expected: f64, variance: f64| (value - expected).abs() < 4.0 * (variance / n).sqrt();
    assert!(near(moment(&uniform, 1), 0.5, 1.0 / 12.0) && near(moment(&uniform, 2), 1.0 / 3.0, 4.0 / 45.0));
    let right = |scale: f64| {
        let normal: Vec<f64> = normal.iter().map(|v| scale * v).collect();
        near(moment(&normal, 1), 0.0, 1.0) && near(moment(&normal, 2), 1.0, 2.0) && near(moment(&normal, 4), 3.0, 96.0)
    };
    assert!(right(1.0), "{} {} {}", moment(&normal, 1), moment(&normal, 2), moment(&normal, 4));
    assert!(!right(1.01), "a deviation 1 % off must show");
    let together = |a: &[f64], b: &[f64], mean: f64| a.iter().zip(b).map(|(a, b)| (a - mean) * b).sum::<f64>() / n;
    let line = SIZE as usize;
    for shift in [1, line] {
        assert!(near(together(&normal, &normal[shift..], 0.0), 0.0, 1.0), "neighbours at {shift} are alike");
    }
    assert!(near(together(&uniform, &normal, 0.5), 0.0, 1.0 / 12.0), "the two numbers of a cell are alike");
}

/// The corners of every tetrahedron of a prism: (part of the angle's bin, ratio, level).
fn tetrahedra(round_end: bool) -> Vec<[DVec3; 4]> {
    let corner = |name: char| {
        let (below, up) = if round_end { ("bac", "edf") } else { ("abcde", "fghij") };
        let places: &[(f64, f64)] = if round_end {
            &[(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
        } else {
            &[(0.0, 1.0), (0.0, 0.0), (0.5, 1.0), (1.0, 0.0), (1.0, 1.0)]
        };
        let (index, level) = below.find(name).map_or_else(|| (up.find(name), 1.0), |index| (Some(index), 0.0));
        let (x, y) = places[index.expect("a corner of the prism")];
        DVec3::new(x, y, level)
    };
    let names: &[&str] = if round_end {
        &["bace", "feca", "aedf"]
    } else {
        &["bacg", "cahg", "afhg", "cghi", "bgic", "dbci", "deci", "cjhi", "eicj"]
    };
    names
        .iter()
        .map(|name| {
            let corners: Vec<DVec3> = name.chars().map(corner).collect();
            [corners[0], corners[1], corners[2], corners[3]]
        })
        .collect()
}

/// Weights of the corners, by solving for them: they sum to 1 and their mean is the point.
fn weights(corners: &[DVec3; 4], point: DVec3) -> [f64; 4] {
    let columns = DMat4::from_cols(
        corners[0].extend(1.0),
        corners[1].extend(1.0),
        corners[2].extend(1.0),
        corners[3].extend(1.0),
    );
    (columns.inverse() * point.extend(1.0)).to_array()
}

#[test]
fn the_tetrahedra_fill_their_prism_without_overlap() {
    for round_end in [false, true] {
        let all = tetrahedra(round_end);
        let volume: f64 =
            all.iter().map(|[a, b, c, d]| DMat3::from_cols(*b - *a, *c - *a, *d - *a).determinant().abs() / 6.0).sum();
        assert!((volume - if round_end { 0.5 } else { 1.0 }).abs() < 1e-12, "{volume}");
        for k in 0..20_000u32 {
            let random = |index: u32| unit_from(mixed(mixed(k) + index));
            let y = random(1);
            let point = DVec3::new(random(0) * if round_end { y } else { 1.0 }, y, random(2));
            let holding: Vec<[f64; 4]> =
                all.iter().map(|corners| weights(corners, point)).filter(|w| w.iter().all(|w| *w > 0.0)).collect();
            assert_eq!(holding.len(), 1, "{point} lies in one tetrahedron");
            assert!((holding[0].iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}

/// The quantile of the normal distribution, by bisection of its integral from 0.
fn probit(u: f64) -> f64 {
    let mass = |z: f64| {
        let width = z / 64.0;
        let at = |k: u32| (-0.5 * (f64::from(k) * width).powi(2)).exp();
        (at(0) + (1..64).map(|k| at(k) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum::<f64>() + at(64)) * width
            / 3.0
            / (2.0 * PI).sqrt()
    };
    let (mut low, mut high) = (-6.0, 6.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if 0.5 + mass(middle) < u { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The density of normals that a pixel shows, from the paper.
fn density(noise: &[u32], condition: &Condition, seen: &Seen, seed: u32, repaired: bool) -> f64 {
    let lobe = facets(condition.alpha);
    let h = (seen.i + seen.o).normalize();
    let local = DVec3::new(h.x, -h.z, h.y);
    let half_solid_angle = cone_solid_angle(condition.gamma_deg.to_radians()) / (4.0 * seen.i.dot(h));
    // The integral of D, by slopes.
    let normals = 1.0
        + (1..4000)
            .map(|k| {
                let x = (f64::from(k) - 0.5) * 0.01;
                0.01 * (-x).exp() * ((1.0 + condition.alpha.powi(2) * x).sqrt() - 1.0)
            })
            .sum::<f64>();
    let spread = (normals / half_solid_angle).max(lobe.d(DVec3::Z));
    let p = lobe.d(local) / spread;
    let slope = DVec2::new(local.x.abs(), local.y.abs()) / half_solid_angle.sqrt();
    let (major, minor, direction) = ellipse(seen.sides);
    let level = (0.75 * minor).log2();
    let low_level = if repaired { level.floor() } else { level.trunc() } as i32;
    let low_stretch = (major / minor).log2().floor() as i32;
    let low_ratio = 2f64.powi(low_stretch);
    let bin_degrees = 45.0 / f64::from(1 << low_stretch.max(1));
    let degrees = direction.x.atan2(direction.y).to_degrees().rem_euclid(180.0);
    let first = (degrees / bin_degrees).floor();
    let mut point = DVec3::new(degrees / bin_degrees - first, major / minor / low_ratio - 1.0, level - level.floor());
    if low_stretch == 0 {
        point.x *= point.y;
    }
    let least = |corners: &[DVec3; 4]| weights(corners, point).into_iter().fold(1.0, f64::min);
    let corners = tetrahedra(low_stretch == 0).into_iter().max_by(|a, b| least(a).total_cmp(&least(b))).expect("some");
    let log_density = condition.count().round().ln() - 2.0;
    let mut sum = 0.0;
    for (corner, weight) in corners.iter().zip(weights(&corners, point)) {
        let (level, stretch) = (low_level + corner.z as i32, low_stretch + corner.y as i32);
        let degrees = if stretch == 0 { 0.0 } else { ((first + corner.x) * bin_degrees).rem_euclid(180.0) };
        let turn = (degrees / 45.0 * f64::from(1 << stretch.max(1))).round() as u32;
        let turned = DVec2::from_angle(degrees.to_radians()).rotate(seen.uv)
            / 2f64.powi(level)
            / DVec2::new(1.0, 2f64.powi(stretch));
        let area = 2f64.powi(2 * level + stretch);
        let skewed = DVec2::new(turned.x - turned.y / 3f64.sqrt(), 2.0 * turned.y / 3f64.sqrt());
        let base = skewed.floor();
        let part = skewed - base;
        let vertices = if part.x + part.y > 1.0 {
            [(DVec2::ONE, part.x + part.y - 1.0), (DVec2::X, 1.0 - part.y), (DVec2::Y, 1.0 - part.x)]
        } else {
            [(DVec2::ZERO, 1.0 - part.x - part.y), (DVec2::X, part.x), (DVec2::Y, part.y)]
        };
        let grid = hash3(level as u32, stretch as u32, hash2(turn, seed));
        for (step, share) in vertices {
            let ([xh, xl], [yh, yl]) = (words_of((base + step).x), words_of((base + step).y));
            let key = hash3(xh, xl, hash3(yh, yl, grid));
            let random = |index: u32| unit_from(mixed(key.wrapping_add(index)));
            let n = area * (log_density + 2.0 * probit(random(1))).clamp(if repaired { -1e9 } else { 0.0 }, 50.0).exp();
            let at = slope + f64::from(SIZE) * DVec2::new(random(2), random(3));
            let cell = at.floor();
            let inside = at - cell;
            let texel = ((cell.y as u32 % SIZE) * SIZE + cell.x as u32 % SIZE) as usize;
            let lit = |word: usize| {
                let bits = noise[4 * texel + word];
                let (normal, uniform) = (half(bits & 0xffff), half(bits >> 16));
                let n = n * weight;
                let any = if repaired && n < 1.0 { n * p } else { -(n * (-p).ln_1p()).exp_m1() };
                let softness = 0.1 * (10.0 * any).min(1.0) * (10.0 * (1.0 - any)).min(1.0);
                let gate = ((any + softness - uniform) / (2.0 * softness)).clamp(0.0, 1.0);
                let deviation = ((n - 1.0) * p * (1.0 - p)).max(0.0).sqrt();
                let more = (normal * deviation + (n - 1.0) * p).floor();
                gate * (1.0 + more.clamp(0.0, if repaired { (n - 1.0).max(0.0) } else { n }))
            };
            let quarter = DVec4::new(
                (1.0 - inside.x) * (1.0 - inside.y),
                inside.x * (1.0 - inside.y),
                (1.0 - inside.x) * inside.y,
                inside.x * inside.y,
            );
            sum += share * quarter.dot(DVec4::new(lit(0), lit(1), lit(2), lit(3))) / n;
        }
    }
    sum * spread
}

/// The shader and the paper's formulas in f64, with the tetrahedron found by trying all, weights by inverse matrices
/// and the quantile by bisection, agree in nearly all pixels; where a count is about to change, f32 may fall on the
/// other side. Measured on lavapipe: within .5 % in half of the pixels and 2.2 % in nine of ten. Smallest bias caught:
/// 5 % up or down, in every setting but at 87 degrees, where most pixels are dark: 12 %.
#[test]
fn every_pixel_is_the_papers_formula_in_f64() {
    let mut gpu = Gpu::new();
    let noise = noise_map(&mut gpu);
    for (alpha, gamma_deg, flakes, theta_o_deg, repaired) in [
        (0.1, 6.0, 3.0, 12.0, false),
        (0.1, 6.0, 3.0, 12.0, true),
        (0.3, 2.0, 300.0, 60.0, true),
        (0.02, 6.0, 40.0, 12.0, false),
        (0.06, 6.0, 12.0, 12.0, true),
        (0.5, 2.0, 1e4, 80.0, true),
        (0.3, 6.0, 100.0, 87.0, true),
    ] {
        let condition =
            Condition { alpha, gamma_deg, flakes, theta_i_deg: theta_o_deg - 5.0, theta_o_deg, phi_deg: 10.0 };
        let mut stage = Stage::new("deliot_belcour", &condition).expect("a stage");
        stage.set("repaired", if repaired { "true" } else { "false" }).expect("a setting");
        stage.set("density_randomization", "2").expect("a setting");
        let samples = stage.samples(gpu.executor(), &condition, 16, 7).expect("samples");
        let lobe = facets(alpha);
        // What each pixel should be, and what an error is measured against.
        let expected: Vec<[f64; 2]> = stage_pixels(&condition, 16)
            .iter()
            .map(|seen| {
                let [i, o] = [seen.i, seen.o].map(|v| DVec3::new(v.x, -v.z, v.y));
                let scale = lobe.g1_over_cos(i) * lobe.g1_over_cos(o) / 4.0;
                let expected = scale * density(&noise, &condition, seen, 7, repaired);
                [expected, expected + 0.01 * scale * lobe.d((i + o).normalize())]
            })
            .collect();
        let errors = |bias: f64| {
            let pairs = samples.iter().zip(&expected);
            let mut errors: Vec<f64> = pairs.map(|(f, [expected, unit])| (bias * f - expected).abs() / unit).collect();
            errors.sort_by(f64::total_cmp);
            [errors[128], errors[230], errors[255]]
        };
        let right = |[median, most, _]: [f64; 3]| most < 0.05 && median < 0.02;
        println!("{condition:?}: median, 90 % and worst {:.4?}", errors(1.0));
        assert!(right(errors(1.0)), "{condition:?}: {:?}", errors(1.0));
        let bias = if theta_o_deg > 85.0 { 0.12 } else { 0.05 };
        let biased = [errors(1.0 + bias), errors(1.0 - bias)];
        assert!(!biased.into_iter().any(right), "{condition:?}: a bias of {bias} must show: {biased:?}");
    }
}

/// Mean over the smooth lobe's, variance over a Poisson count's, share of dark pixels, and the mean's standard error.
fn measured(gpu: &mut Gpu, stage: &mut Stage, condition: &Condition) -> [f64; 4] {
    let mut samples = Vec::new();
    for seed in 0..4 {
        samples.extend(stage.samples(gpu.executor(), condition, 128, seed).expect("samples"));
    }
    let n = samples.len() as f64;
    let lobe = facets(condition.alpha);
    let expected = lobe.brdf(condition.i(), condition.o());
    let lit = condition.flakes * lit_probability(&lobe, condition.i(), condition.o(), condition.gamma_deg.to_radians());
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n / (mean * mean);
    let dark = samples.iter().filter(|f| **f < 0.01 * expected).count() as f64 / n;
    // Pixels of one cell show its flakes together.
    [mean / expected, variance * lit, dark, (variance * 4.0 / n).sqrt()]
}

/// One setting of the mean's test.
struct Case {
    flakes: f64,
    lit: f64,
    mean: f64,
    variance: f64,
    dark: f64,
    error: f64,
}

fn cases(gpu: &mut Gpu, theta_i_deg: f64, theta_o_deg: f64, settings: &[(&str, &str)]) -> Vec<Case> {
    let base = Condition { alpha: 0.1, gamma_deg: 1.0, flakes: 1.0, theta_i_deg, theta_o_deg, phi_deg: 0.0 };
    let mut stage = Stage::new("deliot_belcour", &base).expect("a stage");
    for (key, value) in settings {
        stage.set(key, value).expect("a setting");
    }
    let mut cases = Vec::new();
    for (alpha, gamma_deg) in [(0.1, 6.0), (0.5, 2.0)] {
        for flakes in [0.1, 1.0, 10.0, 100.0, 1e3, 1e5] {
            let condition = Condition { alpha, gamma_deg, flakes, ..base };
            let (i, o) = (condition.i(), condition.o());
            let lit = flakes * lit_probability(&facets(alpha), i, o, gamma_deg.to_radians());
            let [mean, variance, dark, error] = measured(gpu, &mut stage, &condition);
            println!(
                "{settings:?} {condition:?}: lit {lit:.3}, mean {mean:.3} +- {error:.3}, variance {variance:.3} of a \
                 count's, dark {dark:.3} of {:.3}",
                (-lit).exp()
            );
            cases.push(Case { flakes, lit, mean, variance, dark, error });
        }
    }
    cases
}

/// From .1 to 10^5 flakes in a pixel, where noise lets the mean be told within 5 %: repaired it is .88 to 1.12 of the
/// smooth lobe's and .97 to 1.04 on the whole. As printed it is so from one flake in the pixel upward, within .93 to
/// 1.15; below, a flake is lit more often than it is there, 1.48 times at grazing light. Measured on lavapipe: .898 to
/// 1.07 repaired, .954 to 1.09 printed. Smallest bias caught: 7 %.
///
/// The variance is .05 to .6 of a Poisson count's repaired, less than half of that as printed, where cells are twice as
/// wide; hardly a pixel is dark where a third or more should be.
#[test]
fn its_mean_is_that_of_the_smooth_lobe() {
    let mut gpu = Gpu::new();
    for (theta_i_deg, theta_o_deg) in [(10.0, 12.0), (72.0, 80.0)] {
        let [printed, repaired] =
            ["false", "true"].map(|repaired| cases(&mut gpu, theta_i_deg, theta_o_deg, &[("repaired", repaired)]));
        let sure = |cases: &[Case], least: f64| -> Vec<f64> {
            cases.iter().filter(|case| case.error < 0.05 && case.flakes >= least).map(|case| case.mean).collect()
        };
        for (means, bounds) in [(sure(&repaired, 0.1), 0.88..1.12), (sure(&printed, 1.0), 0.93..1.15)] {
            let right = |bias: f64| {
                let whole = bias * means.iter().sum::<f64>() / means.len() as f64;
                means.iter().all(|mean| bounds.contains(&(bias * mean))) && (0.97..1.04).contains(&whole)
            };
            assert!(means.len() >= 8, "{means:?}");
            assert!(right(1.0), "{means:?}");
            assert!(!right(1.07) && !right(0.93), "a bias of 7 % must show");
        }
        for (printed, repaired) in printed.iter().zip(&repaired).filter(|(case, _)| case.lit > 0.01) {
            assert!((0.05..0.6).contains(&repaired.variance), "{} at {}", repaired.variance, repaired.lit);
            assert!(
                (0.01..0.5 * repaired.variance).contains(&printed.variance),
                "{} at {}",
                printed.variance,
                printed.lit
            );
            if (0.1..1.0).contains(&repaired.lit) {
                assert!(repaired.dark < 0.5 * (-repaired.lit).exp(), "dark {} at {}", repaired.dark, repaired.lit);
            }
        }
        let few = &printed[0];
        if theta_o_deg > 60.0 {
            assert!((few.mean - 1.48).abs() < 0.1, "as printed .1 flakes are lit too often: {}", few.mean);
        }
    }
}

/// The published shader's parameters: a random density varies more and has the same mean; R takes the place of the
/// cone. Measured with a thousand flakes in a pixel: 1.00 to 1.02. Smallest bias caught: 8 %.
#[test]
fn the_published_parameters_keep_the_mean() {
    let mut gpu = Gpu::new();
    let condition =
        Condition { alpha: 0.3, gamma_deg: 6.0, flakes: 1e3, theta_i_deg: 10.0, theta_o_deg: 12.0, phi_deg: 0.0 };
    let mut stage = Stage::new("deliot_belcour", &condition).expect("a stage");
    let [_, even, ..] = measured(&mut gpu, &mut stage, &condition);
    stage.set("density_randomization", "2").expect("a setting");
    let [mean, uneven, ..] = measured(&mut gpu, &mut stage, &condition);
    assert!((mean - 1.0).abs() < 0.04 && uneven > 5.0 * even, "mean {mean}, variance {even} and {uneven}");
    let mut variances = Vec::new();
    for roughness in ["0.02", "0.2"] {
        stage.set("density_randomization", "0").expect("a setting");
        stage.set("microfacet_roughness", roughness).expect("a setting");
        let [mean, variance, ..] = measured(&mut gpu, &mut stage, &condition);
        println!("R {roughness}: mean {mean:.4}, variance {variance:.3}");
        assert!((mean - 1.0).abs() < 0.04, "R {roughness}: {mean}");
        variances.push(variance);
    }
    assert!(variances[0] > 5.0 * variances[1], "a wider R lights more flakes: {variances:?}");
}

/// Footprints with thousands of lit flakes show the smooth lobe within 2 % wherever they lie and however they are
/// stretched. Measured: within 1.0 %.
#[test]
fn no_footprint_makes_it_fail() {
    let mut gpu = Gpu::new();
    for repaired in ["false", "true"] {
        for ratio in ratios_over_unusual_footprints(&mut gpu, "deliot_belcour", &[("repaired", repaired)]) {
            assert!((ratio - 1.0).abs() < 0.02, "repaired {repaired}: {ratio}");
        }
    }
}

/// Vertices are blended so that the surface moves under a pixel without jumps: four times smaller steps change pixels
/// by a quarter or so. Measured: 29 times the mean at most for a quarter of a pixel, 7.9 for a sixteenth. A picture
/// whose counts jumped would change as much for both, as `kemppinen` nearly does (6.5 and 5.5): its points drop out of
/// the visited cells.
#[test]
fn the_picture_moves_without_jumps() {
    let mut gpu = Gpu::new();
    let mut ratio = |method: &str| {
        let [coarse, fine] = [(0.25, 5), (0.0625, 17)]
            .map(|(step, pictures)| greatest_jump(&panned(&mut gpu, method, &[("repaired", "true")], step, pictures)));
        println!("{method}: {coarse:.2} for a quarter of a pixel, {fine:.2} for a sixteenth");
        coarse / fine
    };
    assert!(ratio("deliot_belcour") > 2.5);
    assert!(ratio("kemppinen") < 2.5, "jumps must show");
}
