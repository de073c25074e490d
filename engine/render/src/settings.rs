//! What a user may set of a method: keys with units, defaults and ranges, and values checked against them.

use std::collections::BTreeMap;
use std::fmt;

/// What kind of value a setting takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number within a range, both ends included.
    Real {
        /// Least.
        min: f64,
        /// Greatest.
        max: f64,
    },
    /// A whole number within a range, both ends included.
    Integer {
        /// Least.
        min: u64,
        /// Greatest.
        max: u64,
    },
    /// On or off.
    Flag,
    /// One of some words.
    Choice(&'static [&'static str]),
    /// Three linear factors, red, green and blue, each 0 to 1.
    Color,
}

/// The value of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Of a [`Kind::Real`] or [`Kind::Integer`].
    Number(f64),
    /// Of a [`Kind::Flag`].
    Flag(bool),
    /// Of a [`Kind::Choice`].
    Word(&'static str),
    /// Of a [`Kind::Color`].
    Color([f32; 3]),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) if number.abs() >= 1e5 => write!(f, "{number:e}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Word(word) => f.write_str(word),
            Self::Color([r, g, b]) => write!(f, "{r},{g},{b}"),
        }
    }
}

/// Something that can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The key of `--set KEY=VALUE`.
    pub key: &'static str,
    /// Unit of its value; empty without one.
    pub unit: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What it is when nobody says.
    pub default: Value,
    /// What it does, in one sentence.
    pub meaning: &'static str,
}

/// A setting that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// No method in use has such a key.
    #[error("no setting `{key}` in method {method}: it has {known}")]
    Unknown {
        /// As given.
        key: String,
        /// Name of the method.
        method: String,
        /// The keys there are.
        known: String,
    },
    /// The text is no value of this kind.
    #[error("{key}={text}: {expected}")]
    Malformed {
        /// The setting.
        key: String,
        /// As given.
        text: String,
        /// What would do.
        expected: String,
    },
    /// No glinting material has this name.
    #[error("no glinting material `{name}`: the scene has {known}")]
    NoMaterial {
        /// As given.
        name: String,
        /// The names there are.
        known: String,
    },
    /// No method has this name.
    #[error("no method `{name}`: there are {known}")]
    NoMethod {
        /// As given.
        name: String,
        /// The names there are.
        known: String,
    },
}

impl Setting {
    /// Reads a value from text and checks it.
    pub fn parse(&self, text: &str) -> Result<Value, SettingError> {
        let malformed = || SettingError::Malformed {
            key: self.key.to_owned(),
            text: text.to_owned(),
            expected: format!("expected {}", self.expectation()),
        };
        match self.kind {
            Kind::Real { min, max } => {
                let number: f64 = text.trim().parse().map_err(|_| malformed())?;
                if (min..=max).contains(&number) { Ok(Value::Number(number)) } else { Err(malformed()) }
            }
            Kind::Integer { min, max } => {
                // `1e6` is a whole number too.
                let number: f64 = text.trim().parse().map_err(|_| malformed())?;
                let whole = number.fract() == 0.0 && number >= min as f64 && number <= max as f64;
                if whole { Ok(Value::Number(number)) } else { Err(malformed()) }
            }
            Kind::Flag => match text.trim() {
                "true" | "on" | "1" => Ok(Value::Flag(true)),
                "false" | "off" | "0" => Ok(Value::Flag(false)),
                _ => Err(malformed()),
            },
            Kind::Choice(words) => {
                words.iter().find(|word| **word == text.trim()).map(|word| Value::Word(word)).ok_or_else(malformed)
            }
            Kind::Color => {
                let parts: Vec<f32> = text
                    .split(',')
                    .map(|part| part.trim().parse())
                    .collect::<Result<_, _>>()
                    .map_err(|_| malformed())?;
                let color: [f32; 3] = parts.try_into().map_err(|_| malformed())?;
                if color.iter().all(|c| (0.0..=1.0).contains(c)) { Ok(Value::Color(color)) } else { Err(malformed()) }
            }
        }
    }

    /// What values it takes, in words.
    pub fn expectation(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) };
        match self.kind {
            Kind::Real { min, max } => format!("a number from {min} to {}{unit}", Value::Number(max)),
            Kind::Integer { min, max } => format!("a whole number from {min} to {}{unit}", Value::Number(max as f64)),
            Kind::Flag => "true or false".to_owned(),
            Kind::Choice(words) => format!("one of {}", words.join(", ")),
            Kind::Color => "three numbers from 0 to 1: red,green,blue".to_owned(),
        }
    }
}

/// The settings of one material: what was set, the rest at its default.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    settings: Vec<Setting>,
    set: BTreeMap<&'static str, Value>,
}

impl Values {
    /// All settings of a method at their defaults.
    pub fn new(settings: Vec<Setting>) -> Self {
        Self { settings, set: BTreeMap::new() }
    }

    /// The settings there are.
    pub fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// Sets a value from text.
    pub fn parse(&mut self, method: &str, key: &str, text: &str) -> Result<(), SettingError> {
        let setting = self.settings.iter().find(|setting| setting.key == key).ok_or_else(|| SettingError::Unknown {
            key: key.to_owned(),
            method: method.to_owned(),
            known: self.settings.iter().map(|setting| setting.key).collect::<Vec<_>>().join(", "),
        })?;
        let value = setting.parse(text)?;
        self.set.insert(setting.key, value);
        Ok(())
    }

    /// Sets a value that is known to be right; a key that the method does not have is left alone.
    pub fn set(&mut self, key: &str, value: Value) {
        if let Some(setting) = self.settings.iter().find(|setting| setting.key == key) {
            self.set.insert(setting.key, value);
        }
    }

    /// Takes over what was set of another method, as far as this one has such a setting and accepts the value. Defaults are
    /// a method's own.
    pub fn adopt(&mut self, other: &Self) {
        for (key, value) in &other.set {
            let setting = self.settings.iter().find(|setting| setting.key == *key);
            if let Some((key, Ok(value))) = setting.map(|setting| (setting.key, setting.parse(&value.to_string()))) {
                self.set.insert(key, value);
            }
        }
    }

    /// The value of a setting.
    ///
    /// # Panics
    /// If the method has no such key: a mistake of the method's author, not of any input.
    pub fn get(&self, key: &str) -> Value {
        self.set.get(key).copied().unwrap_or_else(|| {
            let setting = self.settings.iter().find(|setting| setting.key == key);
            setting.unwrap_or_else(|| panic!("the method declares no setting `{key}`")).default
        })
    }

    /// The value of a number.
    pub fn number(&self, key: &str) -> f64 {
        match self.get(key) {
            Value::Number(number) => number,
            _ => 0.0,
        }
    }

    /// The value of a flag.
    pub fn flag(&self, key: &str) -> bool {
        self.get(key) == Value::Flag(true)
    }

    /// The value of a choice.
    pub fn word(&self, key: &str) -> &'static str {
        match self.get(key) {
            Value::Word(word) => word,
            _ => "",
        }
    }

    /// The value of a colour.
    pub fn color(&self, key: &str) -> [f32; 3] {
        match self.get(key) {
            Value::Color(color) => color,
            _ => [0.0; 3],
        }
    }

    /// Every key with its value.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, Value)> + '_ {
        self.settings.iter().map(|setting| (setting.key, self.get(setting.key)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method;

    fn values(name: &str) -> Values {
        method(name).expect("there is such a method").values()
    }

    #[test]
    fn a_method_has_its_own_defaults_whatever_was_used_before() {
        for before in crate::METHODS {
            for after in crate::METHODS {
                let mut adopted = after.values();
                adopted.adopt(&before.values());
                assert_eq!(adopted, after.values(), "{} after {}", after.name, before.name);
            }
        }
        assert_ne!(values("wang2020").get("samples"), values("jakob").get("samples"), "the test says something");
    }

    #[test]
    fn what_was_set_is_kept_where_it_is_accepted() {
        let mut before = values("wang2020");
        let color = [1.0 / 3.0, 0.1, 1e-7];
        before.set("color", Value::Color(color));
        for (key, text) in
            [("count", "987654321012"), ("alpha", "0.12345678901234567"), ("samples", "64"), ("dpf", "counted")]
        {
            assert_eq!(before.parse("wang2020", key, text), Ok(()));
        }
        let mut after = values("wang2018");
        after.adopt(&before);
        assert_eq!(after.number("count"), 987_654_321_012.0);
        assert_eq!(after.number("alpha"), 0.123_456_789_012_345_67);
        assert_eq!((after.color("color"), after.word("dpf")), (color, "counted"));
        assert_eq!(after.get("samples"), values("wang2018").get("samples"), "64 are more than it takes");
    }
}
