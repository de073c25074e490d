//! H34. Nothing depends on denormals.
//!
//! A device may flush them wherever it likes, and most cannot be told not to. So each is asked the same twice, the second
//! time with every float that is read or computed and lies below 1.2e-38 made 0.

use crate::flushed::{LEAST_NORMAL, flushed};
use crate::{Check, Effort, Form, Laboratory, Random, StabilityError, arithmetic, worst_difference, worst_ratio};
use glam::DVec3;
use mica_gpu::Timing;
use mica_graph::Graph;
use mica_render::scene::{Camera, Light};
use mica_render::{METHODS, OcclusionBackend, Renderer, View, embedded_scene};
use mica_shaders::types::Operands;

/// The reference, whose shaders compile fast.
const QUICK_METHOD: &str = "flakes";
/// Pixels along a side.
const SIDE: u32 = 48;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![masking(laboratory)?, pictures(laboratory)?])
}

/// Pictures of glints through all passes. That the flush is there is seen at a higher threshold.
fn pictures(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let methods: Vec<&str> = match laboratory.effort {
        Effort::Quick => vec![QUICK_METHOD],
        Effort::Full => METHODS.iter().map(|method| method.name).collect(),
    };
    let (mut channels, mut below_millionth, mut denormals) = (0, 0.0_f64, 0.0_f64);
    for method in &methods {
        // Nothing lies between 0 and the least denormal. Shaders changed alike are optimised alike.
        let kept: Vec<f64> = picture(laboratory, method, f32::from_bits(1))?.into_iter().map(f64::from).collect();
        let mean = kept.iter().sum::<f64>() / kept.len() as f64;
        below_millionth = below_millionth.max(worst_difference(&picture(laboratory, method, 1e-6)?, &kept) / mean);
        denormals = denormals.max(worst_difference(&picture(laboratory, method, LEAST_NORMAL)?, &kept) / mean);
        channels += kept.len();
    }
    Ok(Check {
        what: format!("pictures of glints by {}, small numbers flushed", methods.join(", ")),
        error_of: "|channel with - channel without| / mean".to_owned(),
        inputs: channels as u64,
        naive: Form::new("everything below 1e-6", below_millionth),
        stable: Form::new("all denormals", denormals),
        tolerance: 1.9e-6,
    })
}

/// The radiance of a glinting sphere in a light, through all passes.
fn picture(laboratory: &mut Laboratory, method: &str, below: f32) -> Result<Vec<f32>, StabilityError> {
    let sphere = embedded_scene("sphere").ok_or_else(|| StabilityError::Missing("no scene `sphere`".to_owned()))?;
    let light = Light::Directional { direction: DVec3::new(-0.5, -0.7, -0.5), irradiance: [3.0; 3] };
    let mut renderer = Renderer::new(sphere.load()?, &[light], None, OcclusionBackend::None)?;
    renderer.set_method(None, method)?;
    let camera = Camera::looking_at("camera", DVec3::new(1.0, 1.5, 3.0), DVec3::ZERO, 0.8, 1.0);
    let mut graph = Graph::new();
    let frame = renderer.frame(&mut graph, &View::new(camera, [SIDE; 2]), None)?;
    let download = graph.download_image(&frame.radiance);
    let bytes = laboratory.executor.run(flushed(&graph, below), Timing::Overlapped)?.take(download);
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// G1 / cos down to the least cosines that are no denormals.
fn masking(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(34);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let alpha = random.log_between(1e-3, 1.0);
            // Up to the angle at which the fit ends, and steps by 6e-5.
            let cosine = random.log_between(2e-38, 0.8 * alpha);
            Operands { a: [cosine as f32, alpha as f32, 0.0, 0.0], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    // The rational fit of Walter et al. 2007, eq. 27, with the cosine cancelled.
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [cosine, alpha] = [of.a[0], of.a[1]].map(f64::from);
            let k = 1.0 / (alpha * (1.0 - cosine * cosine).sqrt());
            let a = k * cosine;
            if a < 1.6 { (3.535 * k + 2.181 * k * a) / (1.0 + 2.276 * a + 2.577 * a * a) } else { 1.0 / cosine }
        })
        .collect();
    let tangent = laboratory.flushed_floats(&operands, LEAST_NORMAL, arithmetic!(masking_tangent))?;
    let cancelled = laboratory.flushed_floats(&operands, LEAST_NORMAL, arithmetic!(masking_cancelled))?;
    Ok(Check {
        what: "G1 / cos of cosines from 2e-38 on, all denormals flushed".to_owned(),
        error_of: "|value / truth - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("with the tangent", worst_ratio(&tangent, &truth)),
        stable: Form::new("with the cosine cancelled", worst_ratio(&cancelled, &truth)),
        // Class T1 of hard cases: 16 units of rounding.
        tolerance: 1.9e-6,
    })
}
