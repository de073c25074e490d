//! H34. Nothing depends on denormals.
//!
//! A device may flush them wherever it likes, and most cannot be told not to. So each is asked the same twice, the second
//! time with every float that is read or computed and lies below 1.2e-38 made 0.

use crate::flushed::{LEAST_NORMAL, flushed};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_difference, worst_ratio};
use glam::{DAffine3, DVec2, DVec3};
use mica_gpu::Timing;
use mica_graph::{Download, Graph};
use mica_render::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{METHODS, OcclusionBackend, Renderer, View};
use mica_shaders::types::Operands;
use std::f64::consts::TAU;

/// Pixels of a method's strip, along x and y.
const STRIP: [u32; 2] = [4, 16];

/// Of the strips, metres: a plane along the grid of Wang and Bowles must not pass between its sparkles.
const HEIGHT: f32 = 0.37;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![masking(laboratory)?, areas(laboratory)?, pictures(laboratory)?])
}

/// Pictures of glints by all methods, a strip each, under light so dim that denormals are near.
fn pictures(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const AS_IT_COMES: f64 = 3.0 * 9.403_954_806_578_3e-38; // 2^-123
    const SCALED: f64 = 3.0 * 7.888_609_052_210_118e-31; // 2^-100
    // One makes tables first, which takes longer than the rest and has no light in it.
    const TABLES: &str = "wang2020";
    // Both in one frame, so that a shader is changed and compiled once for both.
    let mut shown = |below: f32| -> Result<[Vec<Vec<f32>>; 2], StabilityError> {
        let mut graph = Graph::new();
        let naive = strips(laboratory, &mut graph, AS_IT_COMES, Some(TABLES))?;
        let stable = strips(laboratory, &mut graph, SCALED, None)?;
        let mut run = laboratory.executor.run(flushed(&graph, below), Timing::Overlapped)?;
        Ok([naive, stable].map(|(_renderer, download)| {
            let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&run.take(download));
            let row = STRIP[0] as usize * METHODS.len();
            let of_strip = |strip: usize| {
                let part = strip * STRIP[0] as usize..(strip + 1) * STRIP[0] as usize;
                pixels.chunks(row).flat_map(|row| &row[part.clone()]).flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
            };
            (0..METHODS.len()).map(of_strip).collect()
        }))
    };
    // Nothing lies between 0 and the least denormal. Shaders changed alike are optimised alike.
    let (kept, normal) = (shown(f32::from_bits(1))?, shown(LEAST_NORMAL)?);
    let [naive, stable] = [0, 1].map(|of| {
        let strips = kept[of].iter().zip(&normal[of]).zip(METHODS);
        let there = strips.filter(|(_, method)| of == 1 || method.name != TABLES);
        there.fold(0.0_f64, |worst, ((kept, normal), _)| {
            let truth: Vec<f64> = kept.iter().copied().map(f64::from).collect();
            let mean = truth.iter().sum::<f64>() / truth.len() as f64;
            let off = worst_difference(normal, &truth) / mean;
            // A method that shows nothing says nothing.
            if off.is_nan() { f64::INFINITY } else { worst.max(off) }
        })
    });
    Ok(Check {
        what: "pictures of glints by all methods under dim light, denormals flushed".to_owned(),
        error_of: "|channel with - channel without| / mean of the method".to_owned(),
        inputs: u64::from(STRIP[0] * STRIP[1]) * METHODS.len() as u64,
        naive: Form::new("light of 2^-123 as it comes", naive),
        stable: Form::new("the same, scaled by 2^23 before anything is multiplied by it", stable),
        tolerance: 1.9e-6,
    })
}

/// Declares a picture of a strip by each method, but one if it is left out; the renderer keeps what it shows until the frame has run.
fn strips(
    laboratory: &mut Laboratory,
    graph: &mut Graph,
    irradiance: f64,
    left_out: Option<&str>,
) -> Result<(Renderer, Download), StabilityError> {
    let mut scene = Scene { name: "strips".to_owned(), ..Scene::default() };
    for (index, method) in METHODS.iter().enumerate().filter(|(_, method)| Some(method.name) != left_out) {
        let at = scene.meshes.len();
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(|[x, z]| [index as f32 + x, 4.0 * z]);
        scene.meshes.push(Mesh {
            name: method.name.to_owned(),
            positions: corners.map(|[x, z]| [x, HEIGHT, z]).to_vec(),
            normals: vec![[0.0, 1.0, 0.0]; 4],
            uv: [corners.to_vec(), Vec::new()],
            indices: vec![0, 1, 2, 0, 2, 3],
            has_uv: true,
            material: at,
            ..Mesh::default()
        });
        scene.instances.push(Instance { mesh: at, world_from_local: DAffine3::IDENTITY, name: method.name.to_owned() });
        let glint = Glint {
            count: 1e4,
            alpha: 0.5,
            gamma_deg: 6.0,
            color: Some([1.0; 3]),
            method: Some(method.name.to_owned()),
            ..Glint::default()
        };
        scene.materials.push(Material {
            name: method.name.to_owned(),
            base_color: [0.0, 0.0, 0.0, 1.0],
            glint: Some(glint),
            ..Material::default()
        });
    }
    let light =
        Light::Directional { direction: DVec3::new(-0.3, -0.8, -0.2).normalize(), irradiance: [irradiance as f32; 3] };
    let mut renderer = Renderer::new(scene, &[light], None, OcclusionBackend::None)?;
    renderer.set(Some("wang2018"), "dpf", "closed")?;
    renderer.precompute(laboratory.executor, None, &mut |_, _, _| {})?;
    let middle = DVec3::new(0.5 * METHODS.len() as f64, 0.0, 2.0);
    // A metre is four pixels wide from there.
    let camera = Camera::looking_at("above", middle + 4.0 * DVec3::Y, middle, 2.0 * 0.5_f64.atan(), 0.1);
    let size = [STRIP[0] * METHODS.len() as u32, STRIP[1]];
    let frame = renderer.frame(graph, &View::new(camera, size), None)?;
    let download = graph.download_image(&frame.radiance);
    Ok((renderer, download))
}

/// Areas of footprints, down to the least that are no denormals.
fn areas(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(3434);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let [long, aspect] = [random.log_between(1e-15, 1e-10), random.log_between(1.0, 1e4)];
            let (turn, slant) = (DVec2::from_angle(random.between(0.0, TAU)), random.between(-2.0, 2.0));
            let x = long * turn;
            let y = slant * x + long / aspect * turn.perp();
            Operands { a: [x.x as f32, x.y as f32, y.x as f32, y.y as f32], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [x, y, z, w] = of.a.map(f64::from);
            (x * w - y * z).abs()
        })
        .collect();
    let naive = laboratory.flushed_floats(&operands, LEAST_NORMAL, arithmetic!(determinant_exact_products))?;
    let naive: Vec<f32> = naive.into_iter().map(f32::abs).collect();
    let stable = laboratory.flushed_floats(&operands, LEAST_NORMAL, arithmetic!(footprint_area))?;
    Ok(Check {
        what: "areas of footprints with sides of 1e-19 to 1e-10, all denormals flushed".to_owned(),
        error_of: "|value / truth - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("exact products of the sides as they are", worst_ratio(&naive, &truth)),
        stable: Form::new("exact products of the sides scaled by powers of two", worst_ratio(&stable, &truth)),
        // As far as the function promises.
        tolerance: 2.4e-7,
    })
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
