//! `mica methods`: what estimates glints, where it was published, and what it can be set to.

use crate::args::JsonFlag;
use crate::error::Failure;
use crate::output;
use crate::report;
use crate::table::{Column, table};
use mica_render::{AUTO_METHOD, COMMON_SETTINGS, DEFAULT_METHOD, Kind, METHODS, MethodInfo, Setting};
use serde_json::{Map, Value as Json, json};

/// Prints all methods.
pub fn methods(args: &JsonFlag) -> Result<(), Failure> {
    if args.json {
        let methods: Vec<Json> = METHODS.iter().map(as_json).collect();
        return output::print_json(&json!({
            "schema": "mica-methods-1",
            "default": DEFAULT_METHOD,
            "methods": methods,
        }));
    }
    let mut text = String::new();
    for method in METHODS {
        let default = if method.name == DEFAULT_METHOD { " (default)" } else { "" };
        text += &format!("{}{default}: {}\n", method.name, method.summary);
        let [least, most] = method.mean_between;
        text += &format!(
            "  source: {}\n  claim: {}, its mean {least} to {most} of the truth\n",
            method.citation,
            method.claim.name()
        );
        for rung in method.ladder {
            text += &format!("  rung {}: {}\n", rung.name, rung_text(rung.set));
        }
        if !method.settings.is_empty() {
            text += &format!("\n{}", indented(&settings_table(method.settings)));
        }
        text.push('\n');
    }
    text += &format!("{AUTO_METHOD}: chooses one for each material, by what the scene holds (see `mica explain`)\n\n");
    text += &format!("every method\n\n{}", indented(&settings_table(COMMON_SETTINGS)));
    text += "\nSet with --set KEY=VALUE, or for one material with --glint MATERIAL:KEY=VALUE.\n";
    output::print(&text)
}

fn rung_text(set: &[(&str, &str)]) -> String {
    let pairs: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
    if pairs.is_empty() { "defaults".to_owned() } else { pairs.join(" ") }
}

fn settings_table(settings: &[Setting]) -> String {
    let row = |setting: &Setting| {
        vec![setting.key.to_owned(), setting.default.to_string(), setting.expectation(), setting.meaning.to_owned()]
    };
    let rows: Vec<Vec<String>> = settings.iter().map(row).collect();
    table(&[Column::Left("setting"), Column::Left("default"), Column::Left("takes"), Column::Left("meaning")], &rows)
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}\n")).collect()
}

fn as_json(method: &MethodInfo) -> Json {
    let ladder: Vec<Json> = method
        .ladder
        .iter()
        .map(|rung| {
            let set: Map<String, Json> =
                rung.set.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
            json!({ "name": rung.name, "set": set })
        })
        .collect();
    let settings: Vec<Json> = COMMON_SETTINGS.iter().chain(method.settings).map(setting_as_json).collect();
    json!({
        "name": method.name,
        "summary": method.summary,
        "citation": method.citation,
        "claim": method.claim.name(),
        "mean_between": method.mean_between,
        "settings": settings,
        "ladder": ladder,
    })
}

fn setting_as_json(setting: &Setting) -> Json {
    let (kind, range) = match setting.kind {
        Kind::Real { min, max } => ("real", json!([min, max])),
        Kind::Integer { min, max } => ("integer", json!([min, max])),
        Kind::Flag => ("flag", json!([false, true])),
        Kind::Choice(words) => ("choice", json!(words)),
        Kind::Color => ("color", json!([0, 1])),
    };
    json!({
        "key": setting.key,
        "unit": setting.unit,
        "kind": kind,
        "range": range,
        "default": report::json(setting.default),
        "meaning": setting.meaning,
    })
}
