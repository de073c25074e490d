//! Sweeps drawn: a chart for each, as SVG and PNG, and the figures as lines of JSON.

use crate::charts::{Line, Lines, Use, look_of_number, png, svg};
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::progress::Progress;
use mica_stability::{Laboratory, SWEEPS, Sweep};
use std::path::Path;

/// Makes every sweep and draws it into the folder as soon as it is made; returns those whose claim does not hold.
pub fn draw(
    folder: &Path,
    laboratory: &mut Laboratory,
    (interrupt, progress, quiet): (&Interrupt, &mut Progress, bool),
) -> Result<Vec<String>, Failure> {
    let unwritable =
        |error| Failure::bad_input(format!("{}: {error}; name a folder that can be made", folder.display()));
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    // All names are tried before anything is made.
    let file = |name: String| Destination::check(&folder.join(name));
    let lines_file = file("sweeps.jsonl".to_owned())?;
    let charts = SWEEPS.map(|(name, _)| ["svg", "png"].map(|kind| file(format!("{name}.{kind}"))));
    let mut beyond = Vec::new();
    let mut lines = String::new();
    for ((name, make), [svg_file, png_file]) in SWEEPS.into_iter().zip(charts) {
        let (svg_file, png_file) = (svg_file?, png_file?);
        if interrupt.requested() {
            return Err(Failure::with_code(INTERRUPTED, format!("interrupted before the sweep {name}")));
        }
        let sweep = progress.during(&format!("sweep: {name}"), || make(laboratory)).map_err(Failure::from)?;
        progress.clear();
        let chart = chart(&sweep).draw();
        svg_file.write(svg(&chart, Use::File).as_bytes())?;
        png_file.write(&png(&chart)?)?;
        lines += &serde_json::to_string(&sweep).map_err(|error| Failure::bad_input(error.to_string()))?;
        lines.push('\n');
        lines_file.write(lines.as_bytes())?;
        if !quiet {
            let verdict = if sweep.holds() { "holds" } else { "BEYOND" };
            let Sweep { claim, worst, tolerance, .. } = &sweep;
            let claim = claim.trim_end_matches('.');
            output::print(&format!("{name}: {claim}: {worst:.1e} of {tolerance:.1e}, {verdict}\n"))?;
        }
        if !sweep.holds() {
            beyond.push(name.to_owned());
        }
    }
    Ok(beyond)
}

fn chart(sweep: &Sweep) -> Lines {
    let lines = (0..)
        .zip(&sweep.series)
        .map(|(number, series)| Line {
            name: series.name.clone(),
            look: look_of_number(number),
            dashed: number > 0,
            points: series.points.iter().map(|(x, y)| [*x, *y]).collect(),
        })
        .collect();
    Lines {
        linear_up: !sweep.y.log,
        title: sweep.title.clone(),
        note: sweep.claim.clone(),
        across: sweep.x.label.clone(),
        up: sweep.y.label.clone(),
        lines,
    }
}
