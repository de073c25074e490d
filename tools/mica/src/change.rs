//! Settings as they are typed: `KEY=VALUE`, for all glinting materials or for one.

use mica_render::{COMMON_SETTINGS, GlintMaterial, METHODS, Renderer, Setting, SettingError, check_method};

/// The key that stands for the method itself.
const METHOD: &str = "method";

/// A setting to change. The key `method` changes the method.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Which glinting material; all of them without a name.
    pub material: Option<String>,
    /// Which setting.
    pub key: String,
    /// To what, not checked yet.
    pub value: String,
}

impl Change {
    /// Reads `KEY=VALUE`.
    pub fn of_all(text: &str) -> Result<Self, String> {
        let (key, value) = split(text).ok_or("expected KEY=VALUE")?;
        Ok(Self { material: None, key: key.to_owned(), value: value.to_owned() })
    }

    /// Reads `MATERIAL:KEY=VALUE`.
    pub fn of_one(text: &str) -> Result<Self, String> {
        let change = Self::of_any(text)?;
        if change.material.is_some() { Ok(change) } else { Err("expected MATERIAL:KEY=VALUE".into()) }
    }

    /// Reads `KEY=VALUE` or `MATERIAL:KEY=VALUE`. Names of materials may hold any character, as neither keys nor values
    /// hold a colon or an equals sign.
    pub fn of_any(text: &str) -> Result<Self, String> {
        let (left, value) = split(text).ok_or("expected KEY=VALUE or MATERIAL:KEY=VALUE")?;
        let (material, key) = match left.rsplit_once(':') {
            Some((material, key)) => (Some(material.to_owned()), key),
            None => (None, left),
        };
        Ok(Self { material, key: key.to_owned(), value: value.to_owned() })
    }

    /// Whether it can be made of some method, and names one of the materials. Scenes may have no material that it
    /// applies to, and still its mistakes are told.
    pub fn check(&self, materials: &[GlintMaterial]) -> Result<(), SettingError> {
        if let Some(name) = &self.material
            && materials.iter().all(|material| material.name != *name)
        {
            let known: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(SettingError::NoMaterial { name: name.clone(), known });
        }
        if self.key == METHOD {
            return check_method(&self.value);
        }
        let settings: Vec<&Setting> =
            COMMON_SETTINGS.iter().chain(METHODS.iter().flat_map(|method| method.settings)).collect();
        let mut last = Err(SettingError::Unknown {
            key: self.key.clone(),
            method: METHODS.iter().map(|method| method.name).collect::<Vec<_>>().join(" or "),
            known: settings.iter().map(|setting| setting.key).chain([METHOD]).collect::<Vec<_>>().join(", "),
        });
        for setting in settings.into_iter().filter(|setting| setting.key == self.key) {
            last = setting.parse(&self.value).map(|_| ());
            if last.is_ok() {
                break;
            }
        }
        last
    }

    /// Makes the change.
    pub fn apply(&self, renderer: &mut Renderer) -> Result<(), SettingError> {
        if self.key == METHOD {
            renderer.set_method(self.material.as_deref(), &self.value)
        } else {
            renderer.set(self.material.as_deref(), &self.key, &self.value)
        }
    }
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(material) = &self.material {
            write!(f, "{material}:")?;
        }
        write!(f, "{}={}", self.key, self.value)
    }
}

/// At the last equals sign, with something on its left.
fn split(text: &str) -> Option<(&str, &str)> {
    text.rsplit_once('=').filter(|(left, _)| !left.is_empty() && !left.ends_with(':'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(material: Option<&str>, key: &str, value: &str) -> Change {
        Change { material: material.map(str::to_owned), key: key.to_owned(), value: value.to_owned() }
    }

    #[test]
    fn names_of_materials_may_hold_colons_and_equals_signs() {
        assert_eq!(Change::of_any("count=1e5"), Ok(change(None, "count", "1e5")));
        assert_eq!(Change::of_one("a:b=c:count=2"), Ok(change(Some("a:b=c"), "count", "2")));
        for bad in ["", "count", "=3", "leather:=3"] {
            assert!(Change::of_any(bad).is_err(), "{bad}");
        }
        assert!(Change::of_one("count=2").is_err());
    }

    #[test]
    fn mistakes_are_told_even_where_nothing_glints() {
        assert_eq!(change(None, "count", "1e5").check(&[]), Ok(()));
        assert!(matches!(change(None, "cuont", "1e5").check(&[]), Err(SettingError::Unknown { .. })));
        assert!(matches!(change(None, "alpha", "7").check(&[]), Err(SettingError::Malformed { .. })));
        assert!(matches!(change(None, "alpha", "NaN").check(&[]), Err(SettingError::Malformed { .. })));
        assert!(matches!(change(None, "method", "magic").check(&[]), Err(SettingError::NoMethod { .. })));
        assert!(matches!(change(Some("hat"), "count", "1").check(&[]), Err(SettingError::NoMaterial { .. })));
    }
}
