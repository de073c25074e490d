//! Glints of a material, from the `glint_*` keys of its extras.

use super::materials::check_range;
use crate::scene::{Glint, SceneError, SceneErrorCode};
use serde_json::{Map, Value};
use std::ops::RangeInclusive;

const KEYS: [&str; 8] = [
    "glint_count",
    "glint_alpha",
    "glint_gamma_deg",
    "glint_seed",
    "glint_color",
    "glint_uv_scale",
    "glint_method",
    "glint_uv_set",
];

/// The glints that a material's extras ask for: none when they do not, or ask for none.
///
/// Every key is checked even so, that a mistake shows before someone raises the count.
pub fn read(extras: &Value, location: &str, warnings: &mut Vec<String>) -> Result<Option<Glint>, SceneError> {
    let Value::Object(extras) = extras else { return Ok(None) };
    for key in extras.keys().filter(|key| key.starts_with("glint_") && !KEYS.contains(&key.as_str())) {
        warnings.push(format!("{location}.extras.{key}: no such setting; there are {}", KEYS.join(", ")));
    }
    let keys = Keys { extras, location };
    let default = Glint::default();
    let glint = Glint {
        count: keys.number("glint_count", &Glint::COUNT_RANGE)?.unwrap_or(default.count),
        alpha: keys.number("glint_alpha", &Glint::ALPHA_RANGE)?.unwrap_or(default.alpha),
        gamma_deg: keys.number("glint_gamma_deg", &Glint::GAMMA_DEG_RANGE)?.unwrap_or(default.gamma_deg),
        seed: keys.whole("glint_seed", u32::MAX)?.unwrap_or(default.seed),
        color: keys.color("glint_color")?,
        uv_scale: keys.number("glint_uv_scale", &Glint::UV_SCALE_RANGE)?.map_or(default.uv_scale, |s| s as f32),
        method: keys.text("glint_method")?,
        uv_set: keys.whole("glint_uv_set", 1)?.unwrap_or(default.uv_set),
    };
    Ok((glint.count > 0.0).then_some(glint))
}

struct Keys<'a> {
    extras: &'a Map<String, Value>,
    location: &'a str,
}

impl Keys<'_> {
    fn at(&self, key: &str) -> String {
        format!("{}.extras.{key}", self.location)
    }

    fn wrong(&self, key: &str, needed: &str) -> SceneError {
        let what = format!("{}, where {needed} is needed", self.extras[key]);
        SceneError::new(SceneErrorCode::ValueNotInRange, self.at(key), what, "set one in the material's properties")
    }

    fn number(&self, key: &str, range: &RangeInclusive<f64>) -> Result<Option<f64>, SceneError> {
        let Some(value) = self.extras.get(key) else { return Ok(None) };
        let value = value.as_f64().ok_or_else(|| self.wrong(key, "a number"))?;
        check_range(value, range, &self.at(key)).map(Some)
    }

    /// A whole number, which exporters may write as `7.0`.
    fn whole(&self, key: &str, most: u32) -> Result<Option<u32>, SceneError> {
        let value = self.number(key, &(0.0..=f64::from(most)))?;
        match value {
            Some(value) if value.fract() != 0.0 => Err(self.wrong(key, "a whole number")),
            value => Ok(value.map(|value| value as u32)),
        }
    }

    fn color(&self, key: &str) -> Result<Option<[f32; 3]>, SceneError> {
        let Some(value) = self.extras.get(key) else { return Ok(None) };
        // Blender's colour properties have an alpha too, which means nothing here.
        let channels: Option<Vec<f64>> = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
        match channels.as_deref() {
            Some([r, g, b] | [r, g, b, _]) => {
                for channel in [r, g, b] {
                    check_range(*channel, &(0.0..=1.0), &self.at(key))?;
                }
                Ok(Some([*r as f32, *g as f32, *b as f32]))
            }
            _ => Err(self.wrong(key, "an array of three numbers")),
        }
    }

    fn text(&self, key: &str) -> Result<Option<String>, SceneError> {
        match self.extras.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(_) => Err(self.wrong(key, "a method's name")),
        }
    }
}
