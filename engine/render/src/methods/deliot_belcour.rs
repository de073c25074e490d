//! Deliot and Belcour 2023: "Real-Time Rendering of Glinty Appearances using Distributed Binomial Laws on Anisotropic
//! Grids".
//!
//! Flakes are counted by four grids about the footprint (two levels, ratios and angles, blended by barycentric
//! coordinates in a tetrahedron), each at the three vertices of a triangle and in four cells of slopes, by a gated
//! normal number. As printed, with these slips, which `repaired=true` removes:
//! - levels are cut towards zero, not down: where cells are narrower than 1 in UV, which is everywhere near, they are
//!   twice as wide as meant, and the picture jumps where they pass 1;
//! - below one flake a cell the deviation is the root of a negative number, taken as 0 here, and one flake is lit more
//!   often than it is there: with p = .34 and .1 flakes a pixel the mean is 1.5 times too bright;
//! - beside the one that the gate lets through, all n may be lit, not n - 1;
//! - 1 - (1 - p)^n is formed from the rounded 1 - p: below p = 3e-8 no flake is ever lit;
//! - a square of texture holds at least one flake.
//!
//! What the method is, and stays: the gate's mean is off by up to 11 % between .1 and 10 lit flakes; blends of cells
//! and of vertices leave a fraction of a count's variance, .06 to .14 of it as printed, .25 to .55 repaired (seen from
//! above), so that glitter is too grey and hardly any pixel dark; what happens less often than in one of the noise
//! map's 262,144 cells happens never, or too often; slopes are mirrored at both axes. On moving along the surface the
//! picture is continuous; where the footprint or the angles change, counts change by whole flakes.
//!
//! Changed throughout: all random numbers are integer hashes of whole numbers, where the paper seeds grids with 24 bits
//! of a float's; angles are taken modulo 180 degrees, as the axis of an ellipse has no sign; ellipses are widened to
//! 1:16384; the frame of slopes is about the normal and does not turn with the texture. The paper has lights only:
//! under an environment the lobe is smooth.
//!
//! **Mapping.** The paper's parameters are a logarithmic density and a roughness R, with p = R D / max D. Here p = D s
//! / S_D, where s = sigma / (4 i.h) is the solid angle of half vectors to which a flake of cone sigma responds and S_D
//! the integral of D, and cells of slopes are sqrt(s) wide. Where the cone is wider than the lobe, D / max D is taken.
//! `microfacet_roughness` sets R as printed instead. Flakes are as dense everywhere; the published shader multiplies
//! the density by exp(2 z), which `density_randomization=2` does with the mean density that `count` says.

use super::shared::Shared;
use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Buffer, Extent, Graph, Image, Lifetime};
use mica_shaders::constants::DELIOT_BELCOUR_NOISE_SIZE;
use mica_shaders::deliot_belcour_noise;
use mica_shaders::glints::deliot_belcour::{Bind, Params};
use std::f64::consts::PI;

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "deliot_belcour",
    citation: "T. Deliot and L. Belcour, Real-Time Rendering of Glinty Appearances using Distributed Binomial Laws on \
               Anisotropic Grids, Computer Graphics Forum 42(8), 2023",
    summary: "Counts lit flakes on four anisotropic grids about the footprint by gated normal numbers; constant time.",
    claim: Claim::Mean,
    mean_between: [0.9, 1.12],
    repeats: false,
    settings: &[
        Setting {
            key: "microfacet_roughness",
            unit: "slope",
            kind: Kind::Real { min: 0.0, max: 1.0 },
            default: Value::Number(0.0),
            meaning: "The paper's R: width of a flake's response, and how many flakes the lobe's peak lights; 0 derives \
                      both from gamma.",
        },
        Setting {
            key: "density_randomization",
            unit: "logarithm of flakes",
            kind: Kind::Real { min: 0.0, max: 4.0 },
            default: Value::Number(0.0),
            meaning: "Standard deviation of the logarithm of the density from cell to cell; the published shader has 2.",
        },
        Setting {
            key: "screen_space_scale",
            unit: "pixels",
            kind: Kind::Real { min: 0.25, max: 8.0 },
            default: Value::Number(1.5),
            meaning: "Width of the grids' cells.",
        },
        Setting {
            key: "repaired",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Repairs the level that is cut towards zero, counts below one flake and above n, and the chance \
                      of rare flakes.",
        },
    ],
    ladder: &[
        Rung { name: "printed", set: &[] },
        Rung { name: "wide cells", set: &[("repaired", "true"), ("screen_space_scale", "3")] },
        Rung { name: "repaired", set: &[("repaired", "true")] },
    ],
};

/// The method at work.
#[derive(Default)]
pub(crate) struct DeliotBelcour {
    /// The same for all materials and settings.
    noise: Shared<(), Buffer>,
}

/// The greatest value of Beckmann's D: beyond alpha^2 = 1/2 it is not at the normal.
fn peak(alpha: f64) -> f64 {
    let alpha2 = alpha * alpha;
    let tan2 = (2.0 * alpha2 - 1.0).max(0.0);
    (-tan2 / alpha2).exp() * (1.0 + tan2).powi(2) / (PI * alpha2)
}

/// S_D: the integral of Beckmann's D over the hemisphere. With x = tan^2 / alpha^2 it is that of exp(-x) sqrt(1 +
/// alpha^2 x), by Simpson's rule.
fn normals(alpha: f64) -> f64 {
    const STEPS: u32 = 2000;
    const END: f64 = 40.0;
    let width = END / f64::from(STEPS);
    let at = |step: u32| {
        let x = f64::from(step) * width;
        (-x).exp() * (1.0 + alpha * alpha * x).sqrt()
    };
    let inner: f64 = (1..STEPS).map(|step| at(step) * if step % 2 == 1 { 4.0 } else { 2.0 }).sum();
    (at(0) + inner + at(STEPS)) * width / 3.0
}

impl Method for DeliotBelcour {
    fn update(
        &mut self,
        g: &mut Graph,
        _kept: &mut Kept,
        materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
        self.noise.update(
            materials,
            |_| Some(()),
            |wanted| {
                wanted.because(g, "the noise map of Deliot and Belcour 2023; first frame");
                let bytes = 16 * u64::from(DELIOT_BELCOUR_NOISE_SIZE).pow(2);
                let mut noise = Buffer::new("deliot_belcour_noise", bytes, Lifetime::Scene);
                let bind = deliot_belcour_noise::Bind { noise: &mut noise };
                g.pass(bind, (), Extent::new(DELIOT_BELCOUR_NOISE_SIZE, DELIOT_BELCOUR_NOISE_SIZE));
                Some(noise)
            },
        );
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let Some(noise) = self.noise.of(material) else { return };
        let lobe = shading.environment.beckmann();
        let values = &material.values;
        let alpha = values.number("alpha");
        let randomization = values.number("density_randomization");
        let params = Params {
            material: material.index as u32,
            alpha: alpha as f32,
            solid_angle: material.solid_angle() as f32,
            normals: normals(alpha) as f32,
            peak: peak(alpha) as f32,
            microfacet_roughness: values.number("microfacet_roughness") as f32,
            log_density: ((material.flakes() as f64).ln() - 0.5 * randomization * randomization) as f32,
            density_randomization: randomization as f32,
            screen_space_scale: values.number("screen_space_scale") as f32,
            seed: values.number("seed") as u32,
            repaired: u32::from(values.flag("repaired")),
        };
        let bind = bind_glints!(
            Bind, shading, glints,
            prefiltered: &lobe.prefiltered,
            albedo: &lobe.albedo,
            noise: noise,
        );
        shading.pass(g, bind, params, material);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_d_is_its_closed_form() {
        // 1 + sqrt(pi)/2 alpha exp(1/alpha^2) erfc(1/alpha), erfc(1) = .157299207, erfc(2) = .004677735.
        let closed = |alpha: f64, erfc: f64| 1.0 + 0.5 * PI.sqrt() * alpha * (alpha * alpha).recip().exp() * erfc;
        assert!((normals(1.0) - closed(1.0, 0.157_299_207)).abs() < 1e-7, "{}", normals(1.0));
        assert!((normals(0.5) - closed(0.5, 0.004_677_735)).abs() < 1e-7, "{}", normals(0.5));
        assert!((normals(0.001) - 1.0).abs() < 1e-6, "{}", normals(0.001));
    }

    #[test]
    fn the_peak_is_nowhere_exceeded() {
        for alpha in [0.05, 0.5, 0.8, 1.0] {
            let d = |tan2: f64| (-tan2 / (alpha * alpha)).exp() * (1.0 + tan2).powi(2) / (PI * alpha * alpha);
            let greatest = (0..4000).map(|step| d(f64::from(step) * 1e-3)).fold(0.0, f64::max);
            assert!((peak(alpha) / greatest - 1.0).abs() < 1e-5, "alpha {alpha}: {} {greatest}", peak(alpha));
        }
    }
}
