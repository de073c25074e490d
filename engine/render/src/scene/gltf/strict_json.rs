//! JSON text into values, bounded and unambiguous, as glTF 2.0, section 2.7, asks of JSON.

use crate::scene::{SceneError, SceneErrorCode};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt;

/// How many objects a text may hold: an empty material takes 3 bytes there, and 1.7 kB in memory (measured).
const MAX_OBJECTS: usize = 1 << 21;

/// How many values a text may hold: a digit and a comma become 32 bytes.
const MAX_VALUES: usize = 1 << 26;

/// What a text says: an object without doubled keys. `24.0` becomes `24`, which some exporters mean by it.
///
/// Whatever the `gltf` crate would cut to 32 bits, so that 2^32 came to mean 0, becomes [`BEYOND_ANY_LIST`] instead.
pub fn parse(text: &[u8]) -> Result<Map<String, Value>, SceneError> {
    let count = |wanted: u8| text.iter().filter(|&&byte| byte == wanted).count();
    if count(b'{') > MAX_OBJECTS || count(b',') > MAX_VALUES {
        let what = format!("its JSON holds more than {MAX_OBJECTS} objects or {MAX_VALUES} values");
        return Err(SceneError::new(SceneErrorCode::SceneTooLarge, "", what, "split the scene"));
    }
    let mut deserializer = serde_json::Deserializer::from_slice(text);
    let value = Place::Plain.deserialize(&mut deserializer).and_then(|value| deserializer.end().map(|()| value));
    match value {
        Ok(Value::Object(members)) => Ok(members),
        Ok(_) => Err(invalid("", "not an object")),
        Err(error) => Err(invalid("", error.to_string())),
    }
}

/// What is wrong with the JSON at a place.
pub fn invalid(location: impl Into<String>, what: impl Into<String>) -> SceneError {
    SceneError::new(SceneErrorCode::InvalidJson, location, what, "export the file again, or mend it there")
}

/// An index that names nothing, as no list holds as many objects. One more, and the crate takes it for none at all.
const BEYOND_ANY_LIST: u64 = u32::MAX as u64 - 1;

/// Keys of numbers that have 32 bits in the `gltf` crate: indices and enumerations.
const WORDS: [&str; 19] = [
    "buffer",
    "bufferView",
    "camera",
    "children",
    "componentType",
    "index",
    "indices",
    "light",
    "magFilter",
    "material",
    "mesh",
    "mode",
    "nodes",
    "sampler",
    "scene",
    "skin",
    "source",
    "wrapS",
    "wrapT",
];

/// Where a value stands, as far as that changes its meaning.
#[derive(Clone, Copy)]
enum Place {
    Plain,
    /// A number of 32 bits, or a list of such.
    Word,
    /// An object of which every member is a `Word`.
    Attributes,
    /// Free-form data of an application, numbers of any size.
    Extras,
}

impl Place {
    fn of_member(self, key: &str) -> Self {
        match self {
            Self::Extras => Self::Extras,
            Self::Attributes => Self::Word,
            _ if key == "extras" => Self::Extras,
            _ if key == "attributes" => Self::Attributes,
            _ if WORDS.contains(&key) => Self::Word,
            _ => Self::Plain,
        }
    }
}

impl<'de> DeserializeSeed<'de> for Place {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Place {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::from(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::from(match self {
            Self::Word if value > u64::from(u32::MAX) => BEYOND_ANY_LIST,
            _ => value,
        }))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        if value.fract() == 0.0 && (0.0..u64::MAX as f64).contains(&value) {
            return self.visit_u64(value as u64);
        }
        Ok(Value::from(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::from(value))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = sequence.next_element_seed(self)? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Value, A::Error> {
        let mut members = Map::new();
        while let Some(key) = object.next_key::<String>()? {
            let value = object.next_value_seed(self.of_member(&key))?;
            if members.contains_key(&key) {
                return Err(A::Error::custom(format_args!("the key `{key}` occurs twice in one object")));
            }
            members.insert(key, value);
        }
        Ok(Value::Object(members))
    }
}
