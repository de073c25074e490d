//! `mica scenes`: what comes with the program, and how it glints.

use crate::args::JsonFlag;
use crate::error::Failure;
use crate::output;
use crate::report::CameraReport;
use crate::table::{Column, table};
use mica_render::scene::{Glint, Scene, procedural};
use mica_render::{DEFAULT_METHOD, EMBEDDED_SCENES};
use serde_json::{Value as Json, json};

/// Prints all embedded scenes and environments.
pub fn scenes(args: &JsonFlag) -> Result<(), Failure> {
    let mut scenes = Vec::new();
    for embedded in EMBEDDED_SCENES {
        scenes.push((embedded.name, embedded.description, embedded.load()?));
    }
    if args.json {
        let scenes: Vec<Json> =
            scenes.iter().map(|(name, description, scene)| as_json(name, description, scene)).collect();
        let environments: Vec<Json> = procedural::NAMES
            .iter()
            .map(|(name, description)| json!({ "name": name, "description": description }))
            .collect();
        return output::print_json(&json!({
            "schema": "mica-scenes-1",
            "scenes": scenes,
            "environments": environments,
        }));
    }
    let mut text = String::new();
    for (name, description, scene) in &scenes {
        text += &format!("{name}: {description}\n");
        text += &format!(
            "  triangles {}, lights {}, environment {}, cameras {}\n",
            scene.triangle_count(),
            scene.lights.len(),
            scene.environment.as_deref().unwrap_or("none"),
            list(scene.cameras.iter().map(|camera| camera.name.as_str())),
        );
        text += &indented(&glints_table(scene));
        text.push('\n');
    }
    let rows: Vec<Vec<String>> = procedural::NAMES
        .iter()
        .map(|(name, description)| vec![(*name).to_owned(), (*description).to_owned()])
        .collect();
    text += &table(&[Column::Left("environment"), Column::Left("")], &rows);
    output::print(&text)
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn glinting(scene: &Scene) -> impl Iterator<Item = (&str, &Glint)> {
    scene.materials.iter().filter_map(|material| Some((material.name.as_str(), material.glint.as_ref()?)))
}

fn glints_table(scene: &Scene) -> String {
    let rows: Vec<Vec<String>> = glinting(scene)
        .map(|(name, glint)| {
            vec![
                name.to_owned(),
                format!("{:e}", glint.count),
                glint.alpha.to_string(),
                glint.gamma_deg.to_string(),
                glint.seed.to_string(),
                glint.uv_scale.to_string(),
                glint.color.map_or_else(|| "base colour".to_owned(), |[r, g, b]| format!("{r},{g},{b}")),
                glint.method.clone().unwrap_or_else(|| DEFAULT_METHOD.to_owned()),
            ]
        })
        .collect();
    let columns = [
        Column::Left("glinting material"),
        Column::Right("count"),
        Column::Right("alpha"),
        Column::Right("gamma_deg"),
        Column::Right("seed"),
        Column::Right("uv_scale"),
        Column::Left("color"),
        Column::Left("method"),
    ];
    table(&columns, &rows)
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}\n")).collect()
}

fn as_json(name: &str, description: &str, scene: &Scene) -> Json {
    let materials: Vec<Json> = glinting(scene)
        .map(|(name, glint)| {
            json!({
                "name": name,
                "count": glint.count,
                "alpha": glint.alpha,
                "gamma_deg": glint.gamma_deg,
                "seed": glint.seed,
                "uv_scale": glint.uv_scale,
                "color": glint.color,
                "method": glint.method.as_deref().unwrap_or(DEFAULT_METHOD),
            })
        })
        .collect();
    let cameras: Vec<Json> =
        scene.cameras.iter().map(|camera| json!({ "name": camera.name, "view": CameraReport::new(camera) })).collect();
    json!({
        "name": name,
        "description": description,
        "triangles": scene.triangle_count(),
        "lights": scene.lights.len(),
        "environment": scene.environment,
        "glinting_materials": materials,
        "cameras": cameras,
    })
}
