//! The report of a study: one page that needs nothing else, and its charts as files.

mod album;
mod body;
mod exactness;
mod figures;
mod html;
mod papers;
mod place;
mod read;
mod summary;

use crate::charts::{Drawing, Use, png, svg};
use crate::error::Failure;
use crate::output::{self, Destination};
use album::Album;
use html::{in_script, slug};
use place::Section;
use read::Study;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The page, with `{{names}}` where its parts go.
const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A chart with the name of its files.
struct Plot {
    file: String,
    drawing: Drawing,
}

/// Draws what is in the folder of a study: `index.html`, and `plots/` as SVG and PNG. Returns what was written.
/// Files in `plots/` of other names are left alone, be they of places that the study had once or somebody's own.
pub fn write(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let study = Study::read(folder)?;
    if study.is_empty() {
        let folder = folder.display();
        return Err(Failure::bad_input(format!(
            "{folder}: there is nothing of a study to draw; make one with `mica accuracy -o`, or name its folder"
        )));
    }
    let sections = Section::of(&study);
    let mut plots = Vec::new();
    let mut album = Album::new(folder);
    let body = body::body(&study, &sections, &mut plots);
    let places: Vec<_> = sections.iter().map(|section| section.as_json(&mut album)).collect();
    let pictures = album.embed();
    let data = json!({ "places": places, "images": pictures.images });
    let page = html::filled(
        TEMPLATE,
        &[
            ("style", STYLE),
            ("body", &body),
            ("pictures", &pictures.remark),
            ("data", &in_script(&data.to_string())),
            ("script", SCRIPT),
        ],
    );
    let mut written = Vec::new();
    let mut put = |path: PathBuf, bytes: &[u8]| {
        Destination::check(&path)?.write(bytes)?;
        written.push(path);
        Ok::<_, Failure>(())
    };
    // The page first: it is what a reader opens.
    put(folder.join("index.html"), page.as_bytes())?;
    if !plots.is_empty() {
        let plots = folder.join("plots");
        output::make_folder(&plots)?;
    }
    for Plot { file, drawing } in &plots {
        let name = folder.join("plots").join(file);
        put(name.with_extension("svg"), svg(drawing, Use::File).as_bytes())?;
        put(name.with_extension("png"), &png(drawing)?)?;
    }
    Ok(written)
}

/// A name for files and links, different from those that were given before.
fn unused(words: &str, used: &mut Vec<String>) -> String {
    let name = slug(words);
    let mut unused = name.clone();
    let mut number = 2;
    while used.contains(&unused) {
        unused = format!("{name}-{number}");
        number += 1;
    }
    used.push(unused.clone());
    unused
}
