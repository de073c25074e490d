//! H20. Far and near cameras.

use crate::stage::{ALPHA, SIDE, Stage};
use crate::{Check, Form, Laboratory, StabilityError};
use glam::{DMat2, DVec3};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let count = laboratory.inputs(11, 22);
    let (mut naive, mut stable) = ([0.0f64; 2], [0.0f64; 2]);
    for k in 0..count {
        let distance = 10f64.powf(-4.0 + 10.0 * k as f64 / (count - 1) as f64);
        let stage = Stage { distance, half: distance, place: DVec3::new(6e5, -3e5, 7e5), ..Stage::default() };
        for (worst, scene) in [(&mut naive, stage.scene_in_the_world()), (&mut stable, stage.scene())] {
            let off = off(laboratory, &stage, scene)?;
            *worst = [worst[0].max(off[0]), worst[1].max(off[1])];
        }
    }
    let inputs = count as u64 * u64::from(SIDE * SIDE);
    let check = |k: usize, what: &str, error_of: &str| Check {
        what: what.to_owned(),
        error_of: error_of.to_owned(),
        inputs,
        naive: Form::new("corners in world space, in f32", naive[k]),
        stable: Form::new("placed about the scene's centre by the host, in f64", stable[k]),
        // What the row asks for: half a percent of the smooth BRDF.
        tolerance: 5e-3,
    };
    Ok(vec![
        check(
            0,
            "a surface 1e6 m from the world's origin, seen from 1e-4 to 1e6 m",
            "|mean radiance / smooth BRDF - 1|",
        ),
        check(1, "how many flakes a pixel of it holds, 1e-8 to 1e12 times as many", "|area / area in f64 - 1|"),
    ])
}

/// How far the mean radiance of a frame is from the BRDF, and the area of its footprints from theirs.
fn off(
    laboratory: &mut Laboratory,
    stage: &Stage,
    scene: mica_render::scene::Scene,
) -> Result<[f64; 2], StabilityError> {
    let seen = stage.seen(laboratory, scene)?;
    let [i, o] = stage.directions();
    let expected = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational)?.brdf(i, o) * i.z;
    let mean = seen.radiance.iter().map(|radiance| f64::from(*radiance)).sum::<f64>() / f64::from(SIDE * SIDE);
    let areas = seen.footprint.iter().zip(stage.footprints()).fold(0.0, |worst: f64, (sides, truth)| {
        let area = DMat2::from_cols_array(&sides.map(f64::from)).determinant().abs();
        let off = (area / truth.determinant().abs() - 1.0).abs();
        if off.is_nan() { f64::INFINITY } else { worst.max(off) }
    });
    Ok([(mean / expected - 1.0).abs(), areas])
}
