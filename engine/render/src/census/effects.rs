//! What a census calls for: the effects that pipelines are specialised by.

use super::Census;
use mica_graph::Effects;
use mica_shaders::effects as e;

/// Something that a frame simulates, or does without.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effect {
    /// What, in words.
    pub what: &'static str,
    /// Its bit.
    pub bit: Effects,
    /// Whether it is called for.
    pub called_for: bool,
    /// Which material, light or setting calls for it, or why none does.
    pub why: String,
}

impl Census {
    /// The effects that a frame is called for, where `occlusion` says whether anybody answers what blocks light.
    pub fn effects(&self, occlusion: bool) -> Effects {
        let called_for = self.effect_list(occlusion).into_iter().filter(|effect| effect.called_for);
        called_for.fold(Effects::NONE, |all, effect| all | effect.bit)
    }

    /// Each effect that there is, with what calls for it.
    pub fn effect_list(&self, occlusion: bool) -> Vec<Effect> {
        let mut list = Vec::new();
        let mut add = |what, bit, called: Result<String, String>| {
            let called_for = called.is_ok();
            list.push(Effect { what, bit, called_for, why: called.unwrap_or_else(|why| why) });
        };
        let environment = self.environment.as_ref().map(|environment| {
            let [width, height] = environment.size;
            format!("a map of {width}x{height} texels")
        });
        add("environment", e::ENVIRONMENT, environment.ok_or_else(|| "the scene has none".to_owned()));
        let lights = self.lights;
        for (what, bit, count) in [
            ("point lights", e::POINT_LIGHTS, lights.point),
            ("directional lights", e::DIRECTIONAL_LIGHTS, lights.directional),
            ("spot lights", e::SPOT_LIGHTS, lights.spot),
        ] {
            let called = if count > 0 { Ok(format!("there are {count}")) } else { Err("there are none".to_owned()) };
            add(what, bit, called);
        }
        let shadows = match (lights.count(), occlusion) {
            (0, _) => Err("no point, directional or spot lights".to_owned()),
            (_, false) => Err("occlusion is off".to_owned()),
            (1, true) => Ok("1 light may be hidden".to_owned()),
            (count, true) => Ok(format!("{count} lights may be hidden")),
        };
        add("shadows", e::SHADOWS, shadows);
        add("alpha masks", e::ALPHA_MASKS, self.by(|material| material.alpha_mask));
        add("textures", e::TEXTURES, self.by(|material| material.textures > 0));
        add("normal maps", e::NORMAL_MAPS, self.by(|material| material.normal_map));
        add("vertex colours", e::VERTEX_COLORS, self.by(|material| material.vertex_colors));
        add("clear coat", e::CLEAR_COAT, self.by(|material| material.clear_coat));
        add("diffuse reflection", e::DIFFUSE, self.by(|material| material.diffuse));
        add("smooth specular", e::SMOOTH_SPECULAR, self.by(|material| material.smooth_specular));
        add("glints", e::GLINTS, self.by(|material| material.glints.is_some()));
        list
    }

    /// The names of the materials that are shown and have something, or that none has.
    pub(crate) fn by(&self, has: impl Fn(&super::MaterialCensus) -> bool) -> Result<String, String> {
        let found = self.materials.iter().filter(|material| material.triangles > 0 && has(material));
        let names: Vec<&str> = found.map(|material| material.name.as_str()).collect();
        match names[..] {
            [] => Err("no material that is shown has any".to_owned()),
            [name] => Ok(format!("material {name}")),
            [..] if names.len() <= 4 => Ok(format!("materials {}", names.join(", "))),
            [..] => Ok(format!("materials {} and {} more", names[..3].join(", "), names.len() - 3)),
        }
    }
}
