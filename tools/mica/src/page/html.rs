//! HTML from words that may hold anything.

use std::fmt::{self, Write};

pub use crate::charts::escaped;

/// HTML that is made of escaped words and of tags of this program alone.
#[derive(Default)]
pub struct Html(String);

impl Html {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self(String::new())
    }

    /// Tags, as they are.
    pub fn tag(&mut self, tags: &str) -> &mut Self {
        self.0 += tags;
        self
    }

    /// Tags with numbers or words in them that were escaped.
    pub fn tags(&mut self, tags: fmt::Arguments<'_>) -> &mut Self {
        // Writing to a string does not fail.
        let _ = self.0.write_fmt(tags);
        self
    }

    /// Words.
    pub fn words(&mut self, words: &str) -> &mut Self {
        self.0 += &escaped(words);
        self
    }

    /// The text of it.
    pub fn done(self) -> String {
        self.0
    }
}

/// A template with its `{{names}}` replaced; what is put in is not looked at again.
pub fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text += before;
        let Some((name, after)) = after.split_once("}}") else { break };
        text += parts.iter().find(|(key, _)| *key == name).map_or("", |(_, part)| part);
        rest = after;
    }
    text + rest
}

/// JSON as it may stand in a script element, which ends at the first thing that looks like its end.
pub fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// Words as a part of a link or the name of a file: letters, digits and hyphens, not very long.
pub fn slug(words: &str) -> String {
    let mut text = String::new();
    for letter in words.chars() {
        match letter {
            letter if letter.is_ascii_alphanumeric() => text.push(letter.to_ascii_lowercase()),
            '.' => text.push('p'),
            '×' => text.push('x'),
            _ if text.ends_with('-') || text.is_empty() => {}
            _ => text.push('-'),
        }
        if text.len() >= 80 {
            break;
        }
    }
    let text = text.trim_end_matches('-');
    if text.is_empty() { "unnamed".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fills_a_template_is_not_filled_itself() {
        assert_eq!(filled("a {{x}} b {{y}} {{z}}", &[("x", "{{y}}"), ("y", "1")]), "a {{y}} b 1 ");
    }

    #[test]
    fn no_data_ends_a_script() {
        let text = in_script(r#"{"a":"</script><!--&"}"#);
        assert!(!text.contains('<') && !text.contains('>'));
        let read: serde_json::Value = serde_json::from_str(&text).expect("JSON still");
        assert_eq!(read["a"], "</script><!--&");
    }

    #[test]
    fn slugs_are_plain() {
        assert_eq!(slug("../<b>.glb own 320x180"), "pp-b-pglb-own-320x180");
        assert_eq!(
            (slug("epsilon .02"), slug("???"), slug("ä")),
            ("epsilon-p02".into(), "unnamed".into(), "unnamed".into())
        );
        assert!(slug(&"long ".repeat(100)).len() <= 80);
    }
}
