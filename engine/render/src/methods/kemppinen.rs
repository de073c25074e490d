//! Kemppinen, Paulin, Thonat, Thiery, Lehtinen, Boubekeur 2025: "Evaluating and Sampling Glinty NDFs in Constant Time".
//!
//! N flakes a square of texture are points in four dimensions: a place and a normal, the latter on a disk. Space and
//! angle trade resolution from level to level; on the two levels that fit the footprint, the 16 points in the
//! neighbouring cells are summed by a Gaussian of the pixel and one of the flake's response, and all others by their
//! mean. As printed, with these slips, which `repaired=true` removes:
//! - a flake's Gaussian loses what lies outside the unit square about the disk: .37 of the light is left at alpha .02,
//!   gamma 6 degrees, .84 at grazing light with alpha .1;
//! - the roulette by which points appear between levels is not closed at its ends: a tenth of the points of a level
//!   appear or vanish at once, at up to half their brightness.
//!
//! What the method is, and stays: the pixel's Gaussian loses what lies outside the two by two cells of texture, a few
//! percent of the points' light, and as the surface moves points drop out there at up to half of their brightness; the
//! level follows the footprint's longer axis, so that a stretched pixel sees few of its flakes and has little contrast;
//! flakes do not have equal energy, as the weight D is not the warp's Jacobian; a fifth of the points lie in the
//! corners of the square, where no normal is. A pixel's Gaussian has the area of six pixels: the variance is .2 of the
//! count's in the pixel at most.
//!
//! Changed throughout: hashes are of whole numbers, where the published shader mixes bits of floats; erf is Abramowitz
//! and Stegun's to 1.5e-7, where theirs is Buermann's; ellipses are widened to 1 : 16384; levels end at 1, where the
//! neighbourhood covers the disk, and at 21, beyond which no flake is told from the mean. The paper has lights only:
//! under an environment the lobe is smooth.
//!
//! **Mapping.** The published shader's normals are GGX's; a flake material's are Beckmann's, whose roughness `alpha`
//! is. The paper allows either, and its warp has a clean form for Beckmann: slopes go to a cosine lobe by equal
//! probability (v_z = exp(-tan^2 / (2 alpha^2)); for GGX this is the stretch by 1 / alpha), and that to the disk by
//! equal area. So `ndf=beckmann` is the default, and `ndf=ggx` has the paper's lobe with `alpha` its own. Shadowing is
//! Smith's for Beckmann, and the environment's lobe Beckmann's, with both. The Gaussian on the disk has the solid angle
//! of half vectors to which a flake of cone sigma responds, sigma / (4 i.h), times the warp's Jacobian: for GGX,
//! alpha_g^2 = (1 - cos gamma) sqrt(den) / (32 i.h). `alpha_g` sets it as printed instead.

use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Graph, Image};
use mica_shaders::glints::kemppinen::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "kemppinen",
    citation: "P. Kemppinen, L. Paulin, T. Thonat, J.-M. Thiery, J. Lehtinen, T. Boubekeur, Evaluating and Sampling \
               Glinty NDFs in Constant Time, SIGGRAPH Asia 2025",
    summary: "Visits the 32 points of an implicit 4D grid that are nearest to the footprint and the half vector.",
    claim: Claim::Mean,
    mean_between: [0.85, 1.03],
    repeats: false,
    settings: &[
        Setting {
            key: "ndf",
            unit: "",
            kind: Kind::Choice(&["beckmann", "ggx"]),
            default: Value::Word("beckmann"),
            meaning: "Distribution of the flakes' normals: that of all methods here, or that of the published shader.",
        },
        Setting {
            key: "alpha_g",
            unit: "roughness",
            kind: Kind::Real { min: 0.0, max: 0.1 },
            default: Value::Number(0.0),
            meaning: "Roughness of a single flake, .001 to .1 in the paper; 0 derives it from gamma.",
        },
        Setting {
            key: "filter_width",
            unit: "pixels",
            kind: Kind::Real { min: 0.5, max: 1.2 },
            default: Value::Number(0.7),
            meaning: "Standard deviation of the Gaussian by which a pixel sees flakes.",
        },
        Setting {
            key: "repaired",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Gives back the light that a flake's Gaussian loses outside the disk's square, and closes the \
                      roulette between levels.",
        },
    ],
    ladder: &[Rung { name: "printed", set: &[] }, Rung { name: "repaired", set: &[("repaired", "true")] }],
};

/// The method at work. It needs no tables of its own, only the environment's.
#[derive(Default)]
pub(crate) struct Kemppinen;

impl Method for Kemppinen {
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let lobe = shading.environment.beckmann();
        let values = &material.values;
        let params = Params {
            material: material.index as u32,
            alpha: values.number("alpha") as f32,
            solid_angle: material.solid_angle() as f32,
            alpha_g: values.number("alpha_g") as f32,
            root_count: (material.flakes() as f64).sqrt() as f32,
            filter_width: values.number("filter_width") as f32,
            seed: values.number("seed") as u32,
            ggx: u32::from(values.word("ndf") == "ggx"),
            repaired: u32::from(values.flag("repaired")),
        };
        let bind = bind_glints!(Bind, shading, glints, prefiltered: &lobe.prefiltered, albedo: &lobe.albedo);
        shading.pass(g, bind, params, material);
    }
}
