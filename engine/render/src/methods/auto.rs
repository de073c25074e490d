//! The method of a material that leaves the choice to the renderer: by what its census says, and what was measured.

use super::{METHODS, MethodInfo, default_method};
use crate::GlintMaterial;
use crate::census::{EnvironmentCensus, LightCensus};

/// What asks for it in the place of a method's name.
pub const AUTO_METHOD: &str = "auto";

/// Up to so many flakes in a square of texture space are few: a footprint rarely holds more than some, and to look at each is
/// exact and costs no more than to estimate them.
const FEW_FLAKES: u64 = 20_000;
/// From this part of an environment's light on, its small lights make glints that a smooth lobe does not show.
const GLITTERING_SHARE: f64 = 0.2;

/// The method for a material, and why.
///
/// Measured against the reference (`mica accuracy --quick`, W1 over the mean): on `cloth` `deliot_belcour` .15 and `wang2020` .41,
/// on `shoe` .10 and .19, at 1.15 and 1.66, 1.09 and 1.32 times a frame without glints. `wang2020` is the one for light that comes
/// from small bright parts of an environment alone, which the others see through a smooth lobe.
pub(crate) fn choose(
    material: &GlintMaterial,
    lights: LightCensus,
    environment: Option<&EnvironmentCensus>,
) -> (&'static MethodInfo, String) {
    let flakes = material.flakes();
    let (name, why) = if flakes <= FEW_FLAKES {
        ("flakes", format!("{flakes} flakes a square are few enough to look at each"))
    } else if let Some(environment) = environment.filter(|_| lights.count() == 0)
        && environment.share_of_small_lights >= GLITTERING_SHARE
    {
        let percent = 100.0 * environment.share_of_small_lights;
        let why =
            format!("there are no lights, and {percent:.0} % of the environment's light comes from small parts of it");
        ("wang2020", why)
    } else {
        let by = if lights.count() > 0 { "lights" } else { "an even environment" };
        ("deliot_belcour", format!("many small flakes under {by} are estimated in constant time"))
    };
    (METHODS.iter().find(|method| method.name == name).unwrap_or_else(|| default_method()), why)
}
