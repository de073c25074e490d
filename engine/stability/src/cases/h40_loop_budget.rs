//! H40. Loops within the device's budget.
//!
//! Lavapipe 22.3 ends the loops of eight invocations, which run as one vector, after 65,535 rounds between them, without a word. 25.0 does
//! not, nor need any other device: so what is compared is how often loops go round, as counted by the device in the shaders of
//! the renderer.

use crate::counted_loops::{LANES, Rounds};
use crate::stage::Plane;
use crate::{Check, Form, Laboratory, StabilityError, bits};
use glam::DVec3;
use mica_graph::{Graph, Work};
use mica_render::scene::{Camera, Light};
use mica_render::{OcclusionBackend, Renderer, View, embedded_scene};
use mica_shaders::constants::{FLAKE_STEPS_A_PASS, JAKOB_STEPS, STEPS_A_INVOCATION};
use mica_shaders::glints::flakes;
use mica_shaders::types::Words;
use std::mem::offset_of;

/// Rounds after which lavapipe 22.3 ends the loops of one vector.
const BUDGET: f64 = 65_535.0;
/// Pixels along each side of the frames.
const SIDE: u32 = 16;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![ended(laboratory)?, walks(laboratory)?])
}

/// Rounds asked for and rounds gone, in one invocation and in as many as the budget asks for.
fn ended(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let rounds: Vec<u32> = vec![7_000, 59_999, 65_536, 70_000, 200_000];
    let budget = STEPS_A_INVOCATION as u32;
    let parts = |of: u32| (0..of.div_ceil(budget)).map(move |part| (of - part * budget).min(budget));
    let shares: Vec<u32> = rounds.iter().flat_map(|of| parts(*of)).collect();
    let mut form = |form: &str, loops: &[u32]| -> Result<Form, StabilityError> {
        let asked: Vec<Words> = loops.iter().map(|rounds| Words { a: [*rounds, 0, 0, 0], b: [0; 4] }).collect();
        let gone = laboratory.words(&asked, bits!(rounds_of_a_loop))?;
        let whole = gone.iter().zip(loops).all(|(gone, asked)| gone[0] == *asked);
        let longest = loops.iter().max().copied().unwrap_or_default();
        let in_a_vector = f64::from(longest) * LANES as f64;
        Ok(Form::new(form, if whole { in_a_vector / BUDGET } else { f64::INFINITY }))
    };
    Ok(Check {
        what: "loops of 7,000 to 200,000 rounds".to_owned(),
        error_of: "rounds of 8 invocations over 65,535; infinite where this device ends them early".to_owned(),
        inputs: rounds.len() as u64,
        naive: form("in one invocation", &rounds)?,
        stable: form("7,000 an invocation", &shares)?,
        tolerance: 1.0,
    })
}

/// A method and its settings.
type Walk = (&'static str, &'static [(&'static str, &'static str)]);

/// Those that walk farthest, with settings that let them.
const WALKS: [Walk; 6] = [
    ("flakes", &[("most", "20000")]),
    ("jakob", &[("epsilon", "0")]),
    ("wang2020", &[("cut_depth", "11"), ("macro", "1e6"), ("micro", "1e6"), ("samples", "16")]),
    ("wang2018", &[("depth", "18"), ("dpf", "closed"), ("expectation", "1e12")]),
    ("atanasov", &[("enumerated", "2000")]),
    ("chermain", &[("max_anisotropy", "32"), ("whole_footprint", "true")]),
];

/// The longest walks there are: of methods over footprints of each size, and of rays through a scene.
fn walks(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    // The others take seconds to make their tables or to compile.
    let methods = laboratory.inputs(2, WALKS.len());
    let mut stable = rays(laboratory)?;
    let mut naive = 0.0;
    for (method, own) in &WALKS[..methods] {
        // Seen from along the plane, so that footprints are of many sizes.
        let plane = Plane { half: 40.0, uv: [0.0; 2], light: Some(DVec3::Y), environment: None };
        let settings = [&[("count", "1e5"), ("alpha", "0.1"), ("gamma_deg", "6")], *own].concat();
        let mut renderer = plane.renderer(method, &settings)?;
        let camera = Camera::looking_at("low", DVec3::new(0.0, 0.3, 2.0), DVec3::ZERO, 0.6, 0.01);
        let mut graph = Graph::new();
        renderer.frame(&mut graph, &View::new(camera, [SIDE; 2]), None)?;
        let rounds = laboratory.rounds(&graph, "glints")?;
        stable.longest = stable.longest.max(rounds.longest);
        stable.invocations += rounds.invocations;
        if *method == "flakes" {
            let whole = laboratory.rounds(&in_one_pass(&graph), "glints")?.longest;
            // Fewer than the parts took: it was ended.
            naive = if whole < 0.9 * rounds.together { f64::INFINITY } else { whole / BUDGET };
        }
    }
    Ok(Check {
        what: "the longest walks of methods over flakes and of rays through triangles".to_owned(),
        error_of:
            "rounds of loops of 8 invocations, counted on the device, over 65,535; infinite where they were ended"
                .to_owned(),
        inputs: stable.invocations,
        naive: Form::new("all flakes of a footprint in one pass", naive),
        stable: Form::new("a budget of steps in each pass", stable.longest / BUDGET),
        tolerance: 1.0,
    })
}

/// Those of shadow rays through one of the embedded scenes with most triangles.
fn rays(laboratory: &mut Laboratory) -> Result<Rounds, StabilityError> {
    const SCENE: &str = "shoe";
    let missing = || StabilityError::Missing(format!("no scene `{SCENE}` with a camera"));
    let scene = embedded_scene(SCENE).ok_or_else(missing)?.load()?;
    let camera = scene.cameras.first().cloned().ok_or_else(missing)?;
    let sun = Light::Directional { direction: DVec3::new(-0.5, -0.2, -0.5), irradiance: [3.0; 3] };
    let mut renderer = Renderer::new(scene, &[sun], None, OcclusionBackend::Bvh)?;
    renderer.set_method(None, "smooth")?;
    let mut graph = Graph::new();
    renderer.frame(&mut graph, &View::new(camera, [4 * SIDE; 2]), None)?;
    laboratory.rounds(&graph, "shadows")
}

/// The frame with all steps of every flake's walk in its first pass.
fn in_one_pass(graph: &Graph) -> Graph {
    let mut changed = Graph::new();
    let mut walking = false;
    for pass in graph.passes() {
        let mut work = pass.work.clone();
        if let Work::Compute { shader, params, .. } | Work::ComputeIndirect { shader, params, .. } = &mut work
            && shader.name == flakes::SHADER.name
        {
            if walking {
                continue;
            }
            walking = true;
            for (at, value) in
                [(offset_of!(flakes::Params, steps), i32::MAX as u32), (offset_of!(flakes::Params, last), 1)]
            {
                params[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
        }
        changed.push_with(pass, work);
    }
    changed
}

// No traversal is declared longer than what one vector of invocations may take.
const _: () = {
    assert!(STEPS_A_INVOCATION as usize * LANES <= BUDGET as usize);
    assert!(FLAKE_STEPS_A_PASS <= STEPS_A_INVOCATION);
    assert!(JAKOB_STEPS <= STEPS_A_INVOCATION as u32);
};
