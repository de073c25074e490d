//! How glints are estimated: each method in a file of its own, which says what it claims and what it can be set to.

mod auto;
#[cfg(feature = "glints")]
mod dpf;
mod shared;
mod smooth;

pub use auto::AUTO_METHOD;
pub(crate) use auto::choose;
#[cfg(feature = "glints")]
pub use dpf::lit_probability_table;
#[cfg(feature = "glints")]
pub use jakob::JakobTable;

use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::passes::{GBuffer, GlintTiles};
use crate::scene_buffers::SceneBuffers;
use crate::settings::{Kind, Setting, SettingError, Value, Values};
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::Executor;
use mica_graph::{Bind, Buffer, Graph, Image};
use mica_shaders::constants::FLAKES_A_LEAF;

/// What a method promises of its pictures; the tests hold it to this.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claim {
    /// The very flakes of `shared/flake_set.glsl`, pixel by pixel.
    Pixels,
    /// The distribution of pixel values: mean, variance, share of dark pixels, and whole numbers of flakes.
    Distribution,
    /// The mean over many pixels: that of the smooth limit.
    Mean,
    /// A look: its mean is bounded, and nothing else.
    Look,
}

impl Claim {
    /// The word used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pixels => "pixels",
            Self::Distribution => "distribution",
            Self::Mean => "mean",
            Self::Look => "look",
        }
    }
}

/// A point on a method's curve of accuracy against time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// Name of the point.
    pub name: &'static str,
    /// What to set, as `KEY=VALUE`.
    pub set: &'static [(&'static str, &'static str)],
}

/// What a method says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodInfo {
    /// Its name on command lines and in glTF extras.
    pub name: &'static str,
    /// Where it was published.
    pub citation: &'static str,
    /// What it does, in a sentence or two.
    pub summary: &'static str,
    /// What it promises.
    pub claim: Claim,
    /// Least and greatest that its mean may be, over the true one, where the cone is narrow beside the lobe (the grid of
    /// `tests/tests/claims.rs`).
    pub mean_between: [f64; 2],
    /// Whether its flakes are the same in each square of texture, so that only the place within it matters.
    pub repeats: bool,
    /// Its settings beyond those that every method has.
    pub settings: &'static [Setting],
    /// From cheap to dear.
    pub ladder: &'static [Rung],
}

/// The one list of methods: what each says of itself, and how it is started. The smooth limit comes first, and is what a
/// program built without the feature `glints` knows no more than the others.
macro_rules! methods {
    ($($module:ident::$method:ident),* $(,)?) => {
        $(#[cfg(feature = "glints")]
        mod $module;)*

        /// The methods there are.
        pub const METHODS: &[MethodInfo] =
            &[#[cfg(feature = "glints")] smooth::INFO, $(#[cfg(feature = "glints")] $module::INFO),*];

        /// The method of that name, at work.
        pub(crate) fn start(info: &MethodInfo) -> Box<dyn Method> {
            $(#[cfg(feature = "glints")]
            if info.name == $module::INFO.name {
                return Box::new($module::$method::default());
            })*
            Box::new(smooth::Smooth::default())
        }
    };
}

methods! {
    flakes::EveryFlake,
    jakob::Jakob,
    wang2018::Wang2018,
    wang2020::Wang2020,
    atanasov::Atanasov,
    zirr_kaplanyan::ZirrKaplanyan,
    wang_bowles::WangBowles,
    shopf::Shopf,
    chermain::Chermain,
    deliot_belcour::DeliotBelcour,
    kemppinen::Kemppinen,
}

/// The method of materials that name none.
pub const DEFAULT_METHOD: &str = "wang2020";

/// What every method takes: the same physical material, whoever renders it.
pub const COMMON_SETTINGS: &[Setting] = &[
    Setting {
        key: "count",
        unit: "flakes per UV square",
        kind: Kind::Real { min: 0.0, max: 1e12 },
        default: Value::Number(1e6),
        meaning: "How many flakes there are.",
    },
    Setting {
        key: "alpha",
        unit: "",
        kind: Kind::Real { min: 0.001, max: 1.0 },
        default: Value::Number(0.1),
        meaning: "Beckmann roughness of the flakes' normals; their slopes have variance alpha^2/2 an axis.",
    },
    Setting {
        key: "gamma_deg",
        unit: "degrees",
        kind: Kind::Real { min: 0.01, max: 30.0 },
        default: Value::Number(6.0),
        meaning: "Half-angle of the cone into which a flake reflects a ray.",
    },
    Setting {
        key: "seed",
        unit: "",
        kind: Kind::Integer { min: 0, max: u32::MAX as u64 },
        default: Value::Number(0.0),
        meaning: "Chooses the flakes.",
    },
    Setting {
        key: "uv_scale",
        unit: "UV squares per texture coordinate",
        kind: Kind::Real { min: 1e-6, max: 1e6 },
        default: Value::Number(1.0),
        meaning: "Texture coordinates are multiplied by it before flakes are placed.",
    },
    Setting {
        key: "color",
        unit: "",
        kind: Kind::Color,
        default: Value::Color([1.0, 1.0, 1.0]),
        meaning: "Reflectance of a flake at normal incidence.",
    },
];

/// A method by its name.
pub fn method(name: &str) -> Result<&'static MethodInfo, SettingError> {
    METHODS.iter().find(|method| method.name == name).ok_or_else(|| SettingError::NoMethod {
        name: name.to_owned(),
        known: METHODS.iter().map(|method| method.name).collect::<Vec<_>>().join(", "),
    })
}

/// Whether a material can ask for a method by that name: one of [`METHODS`], or [`AUTO_METHOD`].
pub fn check_method(name: &str) -> Result<(), SettingError> {
    if name == AUTO_METHOD { Ok(()) } else { method(name).map(|_| ()) }
}

/// The method of materials that name none.
pub(crate) fn default_method() -> &'static MethodInfo {
    METHODS.iter().find(|method| method.name == DEFAULT_METHOD).unwrap_or(&smooth::INFO)
}

impl MethodInfo {
    /// All its settings at their defaults.
    pub fn values(&self) -> Values {
        Values::new(COMMON_SETTINGS.iter().chain(self.settings).copied().collect())
    }
}

/// A glinting material of a scene, with the settings it is rendered with.
#[derive(Clone, Debug, PartialEq)]
pub struct GlintMaterial {
    /// Which of the scene's materials it is.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The method that renders it.
    pub method: &'static MethodInfo,
    /// Why the renderer chose it; none where it was asked for by name.
    pub chosen: Option<String>,
    /// The method's settings.
    pub values: Values,
    /// Which set of texture coordinates the flakes lie in.
    pub uv_set: u32,
}

impl GlintMaterial {
    /// Flakes in a square of texture space: a whole number, N.
    pub(crate) fn flakes(&self) -> u64 {
        self.values.number("count").round() as u64
    }

    /// sin^2(gamma/2), of which 1 - cos gamma is twice: computed in f64, as f32 loses it for small angles.
    pub(crate) fn sin2_half_gamma(&self) -> f64 {
        (0.5 * self.values.number("gamma_deg").to_radians()).sin().powi(2)
    }

    /// Solid angle of the reflection cone in steradians: sigma.
    pub(crate) fn solid_angle(&self) -> f64 {
        4.0 * std::f64::consts::PI * self.sin2_half_gamma()
    }

    /// Flakes of a square of texture space that are lit where the lobe is brightest, seen and lit along the normal: the
    /// cone's solid angle times D(n) / 4 is the probability, while the cone is narrower than the lobe.
    pub(crate) fn lit_at_most(&self) -> f64 {
        let alpha = self.values.number("alpha");
        self.flakes() as f64 * (self.sin2_half_gamma() / (alpha * alpha)).min(1.0)
    }
}

/// The first level of the flakes' quadtree on which nodes hold [`FLAKES_A_LEAF`] flakes or fewer on average: its leaves.
pub(crate) fn leaf_level(flakes: u64) -> u32 {
    (0..).find(|level| flakes <= u64::from(FLAKES_A_LEAF) << (2 * level)).unwrap_or(0)
}

/// What a method may read when it shades.
pub(crate) struct Shading<'a> {
    pub scene: &'a SceneBuffers,
    pub frame: &'a Buffer,
    pub gbuffer: &'a GBuffer,
    /// Derivatives of the flakes' texture coordinates.
    pub footprint: &'a Image,
    pub shadow_mask: &'a Image,
    pub environment: &'a EnvironmentTables,
    pub tiles: &'a GlintTiles,
}

impl Shading<'_> {
    /// Declares a glint shader over the tiles that show a material.
    pub fn pass<B: Bind>(&self, g: &mut Graph, bind: B, params: B::Params, material: &GlintMaterial) {
        self.pass_named(g, B::SHADER.name, bind, params, material);
    }

    /// The same under another name.
    pub fn pass_named<B: Bind>(
        &self,
        g: &mut Graph,
        name: &'static str,
        bind: B,
        params: B::Params,
        material: &GlintMaterial,
    ) {
        let list = self.tiles.of_material(material);
        g.pass_indirect_named(name, bind, params, &self.tiles.lists, GlintTiles::arguments(list));
    }
}

/// Fills the `Bind` of a glint shader: what all of them read, and what is its method's own.
macro_rules! bind_glints {
    ($bind:ident, $shading:expr, $glints:expr $(, $name:ident: $value:expr)* $(,)?) => {
        $bind {
            frame: $shading.frame,
            instances: &$shading.scene.instances.buffer,
            lights: &$shading.scene.lights.buffer,
            ids: &$shading.gbuffer.ids,
            position: &$shading.gbuffer.position,
            normal: &$shading.gbuffer.normal,
            uv: &$shading.gbuffer.uv,
            footprint: $shading.footprint,
            specular: &$shading.gbuffer.specular,
            shadow_mask: $shading.shadow_mask,
            materials: &$shading.scene.materials,
            listed_tiles: &$shading.tiles.listed,
            tile_lists: &$shading.tiles.lists,
            $($name: $value,)*
            glints: &mut *$glints,
        }
    };
}
pub(crate) use bind_glints;

/// A method at work: its tables, and the passes that fill and read them.
pub(crate) trait Method {
    /// Makes, on a device of our own, what takes too long for a frame or is worth keeping between runs. Optional: a
    /// frame declares what it needs itself.
    fn precompute(
        &mut self,
        _material: &GlintMaterial,
        _executor: &mut Executor,
        _cache: Option<&Cache>,
        _progress: Progress,
    ) -> Result<Vec<Update>, RenderError> {
        Ok(Vec::new())
    }

    /// Declares the passes that bring the tables of its materials up to date, none where nothing they depend on changed, and
    /// gives back what these materials do not use.
    fn update(
        &mut self,
        _g: &mut Graph,
        _kept: &mut Kept,
        _materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
    }

    /// What it reads of the environment, where there is one.
    fn reads(&self) -> Reads {
        Reads::Lobe
    }

    /// Declares the pass that writes this material's pixels of `glints`.
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image);

    /// What is to happen to the shaded glints.
    fn finish(&self, _material: &GlintMaterial) -> Finish {
        Finish::default()
    }
}

/// What a method reads of the environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reads {
    /// What a smooth Beckmann lobe sees of it: for methods whose papers have lights only.
    Lobe,
    /// Means over the flakes' cones.
    Cones,
    /// Its map.
    Map,
}

/// What a method asks for after shading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Finish {
    /// The visibility of the mirror direction dims the glints.
    pub mirror_occlusion: bool,
    /// Taps on each side of the centre of the visibility's blur.
    pub visibility_blur: i32,
    /// Taps on each side of the centre of the glints' blur.
    pub glint_blur: i32,
}

#[cfg(test)]
mod tests {
    use super::leaf_level;

    #[test]
    fn leaves_lie_where_four_flakes_share_a_node() {
        let levels = [0, 1, 4, 5, 16, 17, 1_000_000, 1_000_000_000_000].map(leaf_level);
        assert_eq!(levels, [0, 0, 0, 1, 1, 2, 9, 19]);
    }
}
