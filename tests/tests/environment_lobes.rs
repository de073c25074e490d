//! The prefiltered environment between its layers: how they are mixed, and what other mixtures would be off by.

use glam::DVec3;
use mica_oracle::microfacet::{Microfacets, Ndf};
use mica_render::scene::{EquirectMap, procedural};
use mica_shaders::constants as c;
use mica_tests::Gpu;
use mica_tests::sky::under_the_sky;
use mica_tests::values::facets_of;
use std::f64::consts::PI;

/// Green as a lobe of perfect mirrors about a direction reflects it to its normal, over what it reflects of radiance 1.
fn mean_over_lobe(map: &EquirectMap, normal: DVec3, facets: &Microfacets) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for row in 0..map.height {
        let polar_sine = ((f64::from(row) + 0.5) / f64::from(map.height) * PI).sin();
        for column in 0..map.width {
            let place = |at: u32, size: u32| (f64::from(at) + 0.5) / f64::from(size);
            let cosine = EquirectMap::direction_from_uv([place(column, map.width), place(row, map.height)]).dot(normal);
            if cosine > 0.0 {
                let i = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                let weight = facets.brdf(i, DVec3::Z) * cosine * polar_sine;
                sum += weight * f64::from(map.texels[(row * map.width + column) as usize][1]);
                total += weight;
            }
        }
    }
    sum / total
}

/// Roughness of a layer of the prefiltered map, or between two.
fn alpha_of(layer: f64) -> f64 {
    (layer / f64::from(c::SPECULAR_LAYERS - 1)).powi(2)
}

/// Mean |error| over the sphere, over the mean radiance, of the integral at the layers' roughnesses as a mixture for the roughnesses in
/// the middle between them: mixed evenly, and in alpha^2, to which the spread of slopes is proportional.
fn errors_of_mixing(map: &EquirectMap, ndf: Ndf) -> [f64; 2] {
    // A spiral from pole to pole: each has the same share of the sphere.
    let directions: Vec<DVec3> = (0..40)
        .map(|index| {
            let height = 1.0 - (f64::from(index) + 0.5) / 20.0;
            let (sin, cos) = (2.399_963 * f64::from(index)).sin_cos();
            let radius = (1.0 - height * height).sqrt();
            DVec3::new(radius * cos, height, radius * sin)
        })
        .collect();
    let at = |layer: f64| -> Vec<f64> {
        let facets = facets_of(ndf, alpha_of(layer));
        directions.iter().map(|towards| mean_over_lobe(map, *towards, &facets)).collect()
    };
    let variance = |layer: f64| alpha_of(layer).powi(2);
    let mut errors = [0.0; 2];
    for below in [1.0, 2.0, 3.0, 4.0] {
        let [low, between, high] = [at(below), at(below + 0.5), at(below + 1.0)];
        let in_variance = (variance(below + 0.5) - variance(below)) / (variance(below + 1.0) - variance(below));
        for (error, part) in errors.iter_mut().zip([0.5, in_variance]) {
            let each = low.iter().zip(&high).zip(&between);
            let off: f64 = each.map(|((low, high), between)| (low + part * (high - low) - between).abs()).sum();
            *error += 0.25 * off / between.iter().sum::<f64>();
        }
    }
    errors
}

/// Mixing in alpha^2 keeps the variance of slopes right, but not what an edge or a lamp looks like through a lobe: how far light reaches
/// beyond an edge goes with alpha, how bright a lamp is in the middle with 1 / alpha^2.
#[test]
fn mixing_layers_evenly_is_nearer_to_the_integral_than_in_alpha_squared() {
    for (name, ndf, allowed) in [("studio", Ndf::Ggx, 0.8), ("studio", Ndf::Beckmann, 0.8), ("clear", Ndf::Ggx, 1.0)] {
        let map = procedural::environment(name).expect("listed").half().half();
        let [evenly, in_variance] = errors_of_mixing(&map, ndf);
        println!("{name}, {ndf:?}: off by {evenly:.4} of the mean, in alpha^2 {in_variance:.4}");
        assert!(evenly < allowed * in_variance, "{name}: {evenly} {in_variance}");
    }
}

/// What is shown between two layers is half of each.
#[test]
fn layers_are_mixed_evenly() {
    let mut gpu = Gpu::new();
    let mut shown = |map: &EquirectMap, layer: f64| {
        under_the_sky(&mut gpu, "smooth", &[], (map.clone(), [alpha_of(layer), 6.0], 1e4), 1).mean()[1]
    };
    let white = EquirectMap::constant([1.0; 3]);
    let map = procedural::environment("studio").expect("listed").half();
    for below in [1.0, 4.0] {
        let [low, between, high] =
            [below, below + 0.5, below + 1.0].map(|layer| shown(&map, layer) / shown(&white, layer));
        let part = (between - low) / (high - low);
        println!("{part:.4} of the upper layer");
        assert!((part - 0.5).abs() < 0.01, "{part}");
    }
}

/// Also at the poles and at the seam.
#[test]
fn a_constant_environment_is_constant_however_rough_the_lobe() {
    let mut gpu = Gpu::new();
    let one = |gpu: &mut Gpu, map: EquirectMap, alpha: f64| {
        under_the_sky(gpu, "smooth", &[], (map, [alpha, 6.0], 1e4), 1).mean()[1]
    };
    for alpha in [0.01, 0.0816, 0.12, 0.6, 1.0] {
        let texel = one(&mut gpu, EquirectMap::constant([1.0; 3]), alpha);
        let flat = EquirectMap { width: 256, height: 128, texels: vec![[40.0; 3]; 256 * 128] };
        let ratio = one(&mut gpu, flat, alpha) / texel / 40.0;
        assert!((ratio - 1.0).abs() < 1e-4, "{alpha}: {ratio}");
    }
}
