//! Chermain, Sauvage, Dischler, Dachsbacher 2020: "Procedural Physically based BRDF for Real-Time Rendering of Glints".
//!
//! Texture space is cut into cells, on levels of which each has cells twice as wide as the one before, down to 2^-15 of
//! a square. The slopes of a cell follow the product of two distributions out of a dictionary (`dictionary.rs`), turned
//! by an angle of the cell's own; a distribution has the level of detail that the flakes in the cell ask for. A pixel
//! shows the weighted mean over the cells in its footprint, on the two levels nearest to its size.
//!
//! As published, faults included:
//! - lobes have a fixed width, .02 in slopes of the dictionary, which is .04 alpha of the surface: `gamma_deg` does not
//!   matter. That is the solid angle of a cone of 3.2 degrees at alpha .5 and of .65 at alpha .1. `gamma_lobe=true`
//!   makes a dictionary with lobes as wide as gamma asks for, at least those published;
//! - the number of flakes n of a cell is rounded to a power of 4, and below 1 to 1: however few flakes there are, every
//!   cell has some, and sparse flakes do not get rarer;
//! - distributions are even: two axes with 2^l pairs of lobes each make 4 n lobes, of which each has three mirror
//!   images, for n flakes. They stand on a grid, which shows as crosses on the low levels; and where lobes overlap, the
//!   variance falls with the square root of n, not with n;
//! - a cell's level of detail is spread by `density_randomization`, two powers of 4 by default: most of the contrast
//!   comes from cells with far fewer flakes than were asked for;
//! - 192 distributions are few: beyond two standard deviations of the slopes, the mean over the cells with one flake is
//!   off the limit by 5 %, beyond three by half;
//! - the lobes widen the limit's Gaussian: its variance grows by .3 %, its peak falls by .4 %;
//! - `microfacet_relative_area` below 1 leaves cells out without making up for it: the mean darkens by it;
//! - the sum s + 1549 t seeds a cell: cells (s, t) and (s + 1549, t - 1) are alike (`plane_seeds=true` repairs it);
//! - the published program stops after 100 cells of a footprint's bounding box: long footprints that lie askew lose
//!   most of their cells, and jump when the view changes (`whole_footprint=true` repairs it). Those that lose all,
//!   where the program divides 0 by 0, are smooth here;
//! - the ellipse of the footprint is spanned by the pixel's two derivatives, the shorter of which chooses the level:
//!   the axes of a skewed footprint are others.
//!
//! Decided here: shadowing by V-shaped cavities is Cook and Torrance's, the lesser of both factors and 1.
//!
//! Not as published: cells are seeded by integer mixers; a normal number is drawn by Box and Muller's transform; the
//! dictionary is our own; levels go on beyond a square of texture, to cells 2^16 squares wide, and all is smooth
//! beyond; cells outside the ellipse are not visited, though counted; where a pixel's steps run out, its other lights
//! shine on the smooth lobe. The paper has lights only: the environment is that of the smooth lobe, with Smith's
//! shadowing. `shadowing=smith` gives the lights Smith's too, for comparison with other methods: the limits differ at
//! grazing angles.
//!
//! The geometric anti-aliasing of Chermain, Lucas, Sauvage, Dischler and Dachsbacher 2021 ("Real-Time Geometric Glint
//! Anti-Aliasing with Normal Map Filtering") is left out: it filters the dictionary over the change of slope from pixel
//! to pixel, which is not among what a method is told of a surface.

mod dictionary;

use super::shared::Shared;
use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Buffer, Graph, Image, Lifetime};
use mica_shaders::glints::chermain::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "chermain",
    citation: "X. Chermain, B. Sauvage, J.-M. Dischler, C. Dachsbacher, Procedural Physically based BRDF for Real-Time \
               Rendering of Glints, Computer Graphics Forum 39(7), 2020",
    summary: "Slopes out of a dictionary of one-dimensional distributions, two multiplied in each cell of texture \
              space; lobes .04 alpha wide, whatever gamma is.",
    claim: Claim::Mean,
    mean_between: [0.95, 1.05],
    repeats: false,
    settings: &[
        Setting {
            key: "microfacet_relative_area",
            unit: "share of the cells",
            kind: Kind::Real { min: 0.0, max: 1.0 },
            default: Value::Number(1.0),
            meaning: "Cells that have flakes; the others are black, and the mean is darker by them.",
        },
        Setting {
            key: "density_randomization",
            unit: "powers of 4",
            kind: Kind::Real { min: 0.0, max: 8.0 },
            default: Value::Number(2.0),
            meaning: "Standard deviation of the number of flakes from cell to cell.",
        },
        Setting {
            key: "max_anisotropy",
            unit: "",
            kind: Kind::Real { min: 1.0, max: 32.0 },
            default: Value::Number(8.0),
            meaning: "Footprints are widened until they are at most so many times as long as wide.",
        },
        Setting {
            key: "shadowing",
            unit: "",
            kind: Kind::Choice(&["v-cavity", "smith"]),
            default: Value::Word("v-cavity"),
            meaning: "Shadowing by flakes: that of V-shaped cavities as published, or Smith's as in other methods.",
        },
        Setting {
            key: "gamma_lobe",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Lobes have the solid angle of the cone gamma_deg within .04 to .6 alpha, instead of .04 alpha.",
        },
        Setting {
            key: "whole_footprint",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Visits all cells of a footprint instead of the first 100 of its bounding box.",
        },
        Setting {
            key: "plane_seeds",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Seeds a cell by both coordinates instead of a sum that repeats.",
        },
    ],
    ladder: &[
        Rung { name: "isotropic", set: &[("max_anisotropy", "1")] },
        Rung { name: "printed", set: &[] },
        Rung { name: "whole footprint", set: &[("whole_footprint", "true")] },
        Rung { name: "anisotropy 32", set: &[("whole_footprint", "true"), ("max_anisotropy", "32")] },
    ],
};

/// The method at work.
#[derive(Default)]
pub(crate) struct Chermain {
    /// By their lobes' standard deviation.
    dictionaries: Shared<f64, Buffer>,
}

/// Standard deviation of the lobes that a material asks for, in slopes of the dictionary.
///
/// A cone gamma about the mirror direction is a disc of slopes with the area pi sin^2(gamma/2) at normal incidence; a
/// Gaussian of standard deviation s fills 2 pi s^2 at the height of its peak.
fn lobe(material: &GlintMaterial) -> f64 {
    if !material.values.flag("gamma_lobe") {
        return dictionary::PRINTED_LOBE;
    }
    let [narrowest, widest] = dictionary::LOBES;
    let on_the_surface = (0.5 * material.sin2_half_gamma()).sqrt();
    (on_the_surface * dictionary::ALPHA / material.values.number("alpha")).clamp(narrowest, widest)
}

impl Method for Chermain {
    fn update(
        &mut self,
        g: &mut Graph,
        _kept: &mut Kept,
        materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
        let of = |material: &GlintMaterial| Some(lobe(material));
        self.dictionaries.update(materials, of, |mut wanted| {
            let change = if wanted.before.is_some() { "lobes are now" } else { "first frame with lobes" };
            wanted.because(g, format_args!("{change} {:.3} wide", wanted.key));
            let new = || Buffer::new("chermain_dictionary", dictionary::BYTES, Lifetime::Settings);
            let mut buffer = wanted.spare.take().unwrap_or_else(new);
            g.upload(&mut buffer, dictionary::with_lobe(wanted.key));
            Some(buffer)
        });
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let environment = shading.environment.beckmann();
        let Some(dictionary) = self.dictionaries.of(material) else { return };
        let values = &material.values;
        let params = Params {
            material: material.index as u32,
            alpha: values.number("alpha") as f32,
            log4_flakes: (material.flakes() as f64).log(4.0) as f32,
            seed: values.number("seed") as u32,
            relative_area: values.number("microfacet_relative_area") as f32,
            density_deviation: values.number("density_randomization") as f32,
            max_anisotropy: values.number("max_anisotropy") as f32,
            whole_footprint: u32::from(values.flag("whole_footprint")),
            plane_seeds: u32::from(values.flag("plane_seeds")),
            smith: u32::from(values.word("shadowing") == "smith"),
        };
        let bind = bind_glints!(
            Bind, shading, glints,
            prefiltered: &environment.prefiltered,
            albedo: &environment.albedo,
            dictionary: dictionary,
        );
        shading.pass(g, bind, params, material);
    }
}
