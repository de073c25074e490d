//! `zirr_kaplanyan` on the stage: its mean where the counts are sound, what its known faults make of it, and its
//! repair.

use glam::{DVec2, DVec3};
use mica_accuracy::{Condition, Stage};
use mica_oracle::microfacet::half_vector;
use mica_render::scene::{Glint, Light};
use mica_render::{OcclusionBackend, Renderer};
use mica_tests::Gpu;
use mica_tests::shapes::{Eye, conductor, plane};
use mica_tests::values::{correlation, facets, mean, variance};
use std::f64::consts::PI;

fn condition(alpha: f64, gamma_deg: f64, flakes: f64, (theta_i_deg, theta_o_deg): (f64, f64)) -> Condition {
    Condition { alpha, gamma_deg, flakes, theta_i_deg, theta_o_deg, phi_deg: 0.0 }
}

/// Probability that a flake shines, as the method has it: D(h) sigma / (4 i.h).
fn probability(condition: &Condition) -> f64 {
    let h = half_vector(condition.i(), condition.o()).expect("directions above the surface");
    let sin2_half = (0.5 * condition.gamma_deg.to_radians()).sin().powi(2);
    PI * sin2_half / condition.i().dot(h) * facets(condition.alpha).d(h)
}

/// The stage with these settings.
fn stage(condition: &Condition, settings: &[(&str, &str)]) -> Stage {
    let mut stage = Stage::new("zirr_kaplanyan", condition).expect("a stage");
    for (key, value) in settings {
        stage.set(key, value).expect("a setting");
    }
    stage
}

/// The BRDF of so many sets of flakes over the smooth one, pixel by pixel.
fn ratios(gpu: &mut Gpu, stage: &mut Stage, condition: &Condition, seeds: u32) -> Vec<f64> {
    let smooth = facets(condition.alpha).brdf(condition.i(), condition.o());
    let samples = (0..seeds).flat_map(|seed| stage.samples(gpu.executor(), condition, 128, seed).expect("samples"));
    samples.map(|f| f / smooth).collect()
}

fn correlation_of(pairs: &[(f64, f64)]) -> f64 {
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    correlation(&a, &b)
}

/// The mean of many pixels is the smooth lobe where at least three flakes lie in each, at any angle. Measured on
/// lavapipe: within 3.3 %, 0.5 % and 0.2 %, most of it noise, where .3, 3 and 100 flakes are expected to shine.
/// Smallest bias caught: 10, 3 and 1.3 % up or down; the light's cone of .02 radians, which adds 8 % at alpha .5 and
/// gamma 2 degrees, is.
#[test]
fn the_mean_is_the_smooth_lobe_where_enough_flakes_shine() {
    let mut gpu = Gpu::new();
    for angles in [(10.0, 12.0), (65.0, 82.0), (80.0, 87.0)] {
        for (alpha, gamma_deg) in [(0.1, 6.0), (0.3, 1.0), (0.5, 2.0)] {
            let mut condition = condition(alpha, gamma_deg, 1.0, angles);
            let p = probability(&condition);
            let mut stage = stage(&condition, &[]);
            for (lit, seeds, tolerance, caught) in [(0.3, 6, 0.06, 0.1), (3.0, 3, 0.02, 0.03), (100.0, 1, 0.01, 0.013)]
            {
                condition.flakes = lit / p;
                let ratio = mean(&ratios(&mut gpu, &mut stage, &condition, seeds));
                println!("{condition:?}: {lit} lit, mean {ratio:.4} of the smooth lobe");
                // Where few flakes shine often, the fault that the next test records shows.
                if condition.flakes >= 3.0 {
                    let right = |bias: f64| ((1.0 + bias) * ratio - 1.0).abs() < tolerance;
                    assert!(right(0.0), "{condition:?}: {ratio}");
                    assert!(!right(caught) && !right(-caught), "{condition:?}: a bias of {caught} must show: {ratio}");
                }
            }
        }
    }
    let condition = condition(0.5, 2.0, 1e5, (10.0, 12.0));
    let mut stage = stage(&condition, &[("cone", "0.02")]);
    let with_cone = mean(&ratios(&mut gpu, &mut stage, &condition, 1));
    println!("with the light's cone: {with_cone:.4}");
    assert!((with_cone - 1.0).abs() > 0.04, "the light's cone must show: {with_cone}");
}

/// With far fewer than one flake in a footprint the mean is too bright, by -ln(1 - p) / p at most. Measured on lavapipe
/// at p = .27 and .1 flakes: 1.18, with noise of 2 %; the bound is 1.166.
#[test]
fn a_fraction_of_a_flake_shines_too_often() {
    let mut gpu = Gpu::new();
    let condition = condition(0.1, 6.0, 0.1, (10.0, 12.0));
    let p = probability(&condition);
    let bound = -(1.0 - p).ln() / p;
    let ratio = mean(&ratios(&mut gpu, &mut stage(&condition, &[]), &condition, 12));
    println!("p {p:.3}: mean {ratio:.4}, bound {bound:.4}");
    assert!(ratio > 1.06, "{ratio}");
    assert!(ratio < bound + 0.06, "{ratio}");
}

/// At the published example's variation of 100, energy is not conserved; without variation it is. Measured on lavapipe,
/// one flake in a footprint: 6.7 times the smooth lobe. A dynamic range of 2 bounds every pixel.
#[test]
fn variation_adds_energy_and_the_dynamic_range_bounds_it() {
    let mut gpu = Gpu::new();
    let condition = condition(0.5, 6.0, 1.0, (10.0, 12.0));
    let mut stage = stage(&condition, &[("variation", "100")]);
    let varied = ratios(&mut gpu, &mut stage, &condition, 4);
    println!("variation 100: mean {:.3}", mean(&varied));
    assert!(mean(&varied) > 1.5, "{}", mean(&varied));
    stage.set("dynamic_range", "2").expect("a setting");
    let bounded = ratios(&mut gpu, &mut stage, &condition, 1);
    let most = bounded.iter().copied().fold(0.0, f64::max);
    println!("dynamic range 2: at most {most:.4} of the smooth lobe");
    assert!(most < 2.02 && most > 1.9, "{most}");
}

/// The factor that the Gaussian branch lacks doubles the variance. Measured on lavapipe: .24 and .47 of the variance of
/// the flakes that shine in a footprint; that it is not all is the fault of the two grids.
#[test]
fn the_missing_root_of_two_halves_the_variance() {
    let mut gpu = Gpu::new();
    let condition = condition(0.5, 6.0, 1e4, (10.0, 12.0));
    let p = probability(&condition);
    let truth = (1.0 - p) / (p * condition.flakes);
    let mut of = |root_two: &str| {
        let mut stage = stage(&condition, &[("root_two", root_two)]);
        variance(&ratios(&mut gpu, &mut stage, &condition, 3)) / truth
    };
    let (printed, repaired) = (of("off"), of("on"));
    println!("variance: {printed:.3} and, repaired, {repaired:.3} of the binomial one");
    assert!((repaired / printed - 2.0).abs() < 0.1, "{printed} {repaired}");
    assert!((0.40..0.56).contains(&repaired), "{repaired}");
}

/// Another seed shows other flakes, the same seed the same ones; many flakes show the smooth lobe in every pixel.
#[test]
fn flakes_follow_from_the_seed_and_many_make_a_smooth_surface() {
    let mut gpu = Gpu::new();
    let few = condition(0.3, 6.0, 30.0, (10.0, 12.0));
    let mut stage = stage(&few, &[]);
    let shows =
        |gpu: &mut Gpu, stage: &mut Stage, seed| stage.samples(gpu.executor(), &few, 64, seed).expect("samples");
    let first = shows(&mut gpu, &mut stage, 1);
    assert_eq!(first, shows(&mut gpu, &mut stage, 1));
    assert_ne!(first, shows(&mut gpu, &mut stage, 2));
    let many = Condition { flakes: 1e7, ..few };
    let ratios = ratios(&mut gpu, &mut stage, &many, 1);
    let worst = ratios.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
    println!("1e7 flakes: {worst:.1e} off at most");
    assert!(worst < 1.5e-2, "{worst}");
}

/// A cell and the one of twice its index, on the same grid, are the same cell, as the index is shorn of its factors of
/// 2: by design one cell in four is its parent on the coarser grid, and by the same token the grid repeats itself.
/// Measured on lavapipe: a correlation of .80; unrelated cells have -.02.
#[test]
fn cells_of_twice_the_index_have_the_same_flakes() {
    let mut gpu = Gpu::new();
    let condition = condition(0.5, 6.0, 100.0, (20.0, 0.0));
    let samples = ratios(&mut gpu, &mut stage(&condition, &[]), &condition, 1);
    // The picture is of 128 x 128 pixels of 1/256, the width of a cell, about (.4031, .3527).
    let first = |middle: f64| (middle * 256.0 + 0.5 - 64.0).floor() as i64;
    let corner = (first(0.4031), first(0.3527));
    let at = |x: i64, y: i64| {
        let (column, row) = (x - corner.0, y - corner.1);
        let inside = (0..128).contains(&column) && (0..128).contains(&row);
        inside.then(|| samples[(row * 128 + column) as usize] - 1.0)
    };
    let correlation_at = |shift: i64| {
        let cells = (1..128).flat_map(|y| (1..128).map(move |x| (x, y)));
        let pairs: Vec<(f64, f64)> =
            cells.filter_map(|(x, y)| at(x, y).zip(at(2 * x + shift, 2 * y + shift))).collect();
        assert!(pairs.len() > 1_000, "{}", pairs.len());
        correlation_of(&pairs)
    };
    println!(
        "correlation with the cell of twice the index {:.3}, beside it {:.3}",
        correlation_at(0),
        correlation_at(7)
    );
    assert!(correlation_at(0) > 0.3, "{}", correlation_at(0));
    assert!(correlation_at(7).abs() < 0.1, "{}", correlation_at(7));
}

/// A footprint askew to the axes of texture counts the cells that it lies over. From above, every pixel is one cell and
/// tells how many shine there; seen from the side, along the diagonal of the texture, a pixel is predicted by the cells
/// under it. Light comes from where the plane mirrors the viewer, so that the half vector is the same. Measured on
/// lavapipe: a correlation of .87; with the cells under the same pixel turned by a right angle .49.
#[test]
fn a_skewed_footprint_counts_the_cells_that_it_lies_over() {
    const SIDE: usize = 128;
    const ASIDE: usize = 64;
    let mut gpu = Gpu::new();
    let cell = 1.0 / 256.0;
    // A corner of four cells.
    let target = DVec3::new(103.0 * cell, 0.0, 90.0 * cell);
    let mut picture = |o: DVec3, pixel: f64, side: usize| -> Vec<f64> {
        let glint = Glint { count: 3e6, alpha: 0.5, gamma_deg: 6.0, color: Some([1.0; 3]), ..Glint::default() };
        let light = Light::Directional { direction: DVec3::new(o.x, -o.y, o.z), irradiance: [1.0; 3] };
        let scene = plane(conductor("zirr_kaplanyan", glint), 8.0);
        let mut renderer = Renderer::new(scene, &[light], None, OcclusionBackend::None).expect("the scene is sound");
        let vertical_fov_radians = 2.0 * (0.5 * side as f64 * pixel / 500.0).atan();
        let eye = Eye { eye: target + 500.0 * o, target, vertical_fov_radians };
        let shot = gpu.render(&mut renderer, &eye.view([side as u32, side as u32]));
        shot.picture.pixels.iter().map(|pixel| f64::from(pixel[1])).collect()
    };
    let above = picture(DVec3::Y, cell, SIDE);
    let cell_at = |point: DVec2| {
        let index = ((point - DVec2::new(target.x, target.z)) / cell + 0.5 * SIDE as f64).floor();
        let inside = index.min_element() >= 0.0 && index.max_element() < SIDE as f64;
        inside.then(|| above[index.y as usize * SIDE + index.x as usize])
    };
    let (sin, cos) = 75f64.to_radians().sin_cos();
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    // The footprint's chord along an axis is then the width of a cell.
    let pixel = cell * diagonal;
    let aside = picture(DVec3::new(diagonal * sin, cos, diagonal * sin), pixel, ASIDE);
    let right = diagonal * pixel * DVec2::new(1.0, -1.0);
    let down = diagonal * pixel / cos * DVec2::new(1.0, 1.0);
    let predicted_by = |side_x: DVec2, side_y: DVec2| {
        let middle = 0.5 * ASIDE as f64;
        let pairs: Vec<(f64, f64)> = (0..ASIDE * ASIDE)
            .filter_map(|at| {
                let (column, row) = ((at % ASIDE) as f64 + 0.5 - middle, (at / ASIDE) as f64 + 0.5 - middle);
                let center = DVec2::new(target.x, target.z) + column * right + row * down;
                let part = |index: usize| (index as f64 + 0.5) / 16.0 - 0.5;
                let cells: Option<Vec<f64>> =
                    (0..256).map(|k| cell_at(center + part(k % 16) * side_x + part(k / 16) * side_y)).collect();
                Some((mean(&cells?), aside[at]))
            })
            .collect();
        assert!(pairs.len() > 2_000, "{}", pairs.len());
        correlation_of(&pairs)
    };
    let (under, turned) = (predicted_by(right, down), predicted_by(right.perp(), down.perp()));
    println!("correlation with the cells under a pixel {under:.3}, turned {turned:.3}");
    assert!(under > 0.8, "{under}");
    assert!(turned < 0.6, "{turned}");
}

/// A footprint without area, and one so far from the origin that its cells cannot be told apart, shows the smooth lobe.
#[test]
fn a_footprint_that_cannot_be_counted_is_smooth() {
    let mut gpu = Gpu::new();
    let near = Eye { eye: DVec3::new(0.3, 1.0, 1.4), target: DVec3::new(0.3, 0.0, 0.2), vertical_fov_radians: 1e-5 };
    for (name, place) in [
        ("no area", (|_: [f32; 2]| [0.25, 0.75]) as fn([f32; 2]) -> [f32; 2]),
        ("far away", |[u, v]| [u + 1e6, v - 1e6]),
    ] {
        let mut picture = |method: &str| {
            let glint = Glint { count: 1e12, alpha: 0.5, gamma_deg: 2.0, color: Some([1.0; 3]), ..Glint::default() };
            let mut scene = plane(conductor(method, glint), 8.0);
            scene.meshes[0].uv[0].iter_mut().for_each(|uv| *uv = place(*uv));
            let sun = Light::Directional { direction: DVec3::new(0.1, -1.0, -0.9).normalize(), irradiance: [1.0; 3] };
            let mut renderer = Renderer::new(scene, &[sun], None, OcclusionBackend::None).expect("the scene is sound");
            gpu.render(&mut renderer, &near.view([32, 18])).picture
        };
        let (counted, smooth) = (picture("zirr_kaplanyan"), picture("smooth"));
        assert_eq!(counted.apart(&smooth, 1e-4), Vec::<usize>::new(), "{name}");
    }
}
