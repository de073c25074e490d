//! The report of a render as text: what each pass costs, what was built once, what memory is taken.

use crate::error::one_line;
use crate::report::{FrameTimes, MemoryReport, RaysReport, RenderReport, UpdateReport};
use crate::table::{Column, bytes, milliseconds, table};
use std::path::PathBuf;

/// The whole report, and the files that were written.
pub fn for_people<'a>(report: &RenderReport, paths: impl Iterator<Item = &'a PathBuf>) -> String {
    let [width, height] = report.size;
    let mut text = format!(
        "{}, {}, {width}x{height}, {} on {} ({}), occlusion {}\n\n",
        report.scene,
        report.method,
        match report.samples {
            1 => "1 sample".to_owned(),
            samples => format!("{samples} samples"),
        },
        report.device.name,
        report.device.driver,
        report.occlusion
    );
    if let Some(budget) = &report.budget {
        text += &format!("{}\n", budget.words());
    }
    text += &every_frame_table(report);
    let FrameTimes { isolated_sum, overlapped_median, overlapped_cpu_median } = report.frame_ns;
    text += &format!(
        "\nframe: {} ms as it runs (processor {} ms), {} ms pass by pass, of which {} ms for glints; medians of {} \
         after {} to warm up\n",
        milliseconds(overlapped_median),
        milliseconds(overlapped_cpu_median),
        milliseconds(isolated_sum),
        milliseconds(report.glint_ns),
        report.frames.measured,
        report.frames.warmup,
    );
    text +=
        &format!("occlusion: {}, because {}{}\n", report.occlusion, report.occlusion_why, rays_traced(&report.rays));
    text.push('\n');
    text += &updates_table(&report.updates);
    text += &memory_table(&report.memory);
    if !report.left_out.is_empty() {
        let left_out: Vec<String> =
            report.left_out.iter().map(|left_out| format!("{} ({})", left_out.what, left_out.why)).collect();
        text += &format!("\nleft out: {}\n", left_out.join("; "));
    }
    if report.image.nonfinite > 0 {
        text += &format!("\n{} pixels are not finite\n", report.image.nonfinite);
    }
    for path in paths {
        text += &format!("\nwrote {}", one_line(&path.display().to_string()));
    }
    text.trim_end().to_owned() + "\n"
}

fn every_frame_table(report: &RenderReport) -> String {
    let sum = report.frame_ns.isolated_sum;
    let rows: Vec<Vec<String>> = report
        .passes
        .iter()
        .filter(|row| !row.once)
        .map(|row| {
            let share =
                row.median_ns.zip(sum).map(|(ns, sum)| format!("{:.1} %", 100.0 * ns as f64 / sum.max(1) as f64));
            let [median, min, max] = [row.median_ns, row.min_ns, row.max_ns].map(milliseconds);
            vec![row.name.clone(), row.runs.to_string(), median, min, max, share.unwrap_or_else(|| "-".to_owned())]
        })
        .collect();
    let columns = [
        Column::Left("every frame"),
        Column::Right("runs"),
        Column::Right("median ms"),
        Column::Right("min ms"),
        Column::Right("max ms"),
        Column::Right("share"),
    ];
    table(&columns, &rows)
}

/// How many rays each pass traced, and how fast; nothing where none did.
fn rays_traced(rays: &[RaysReport]) -> String {
    let of_pass = |of: &RaysReport| {
        let speed = of.mrays_per_s.map(|speed| format!(", {speed:.2} million a second")).unwrap_or_default();
        let cut = if of.cut_short > 0 { format!(", {} cut short", of.cut_short) } else { String::new() };
        format!("{} {}{speed}{cut}", of.pass, of.rays)
    };
    match rays {
        [] => String::new(),
        rays => format!("\nrays: {}", rays.iter().map(of_pass).collect::<Vec<_>>().join("; ")),
    }
}

fn updates_table(updates: &[UpdateReport]) -> String {
    let (uploads, built): (Vec<_>, Vec<_>) = updates.iter().partition(|update| update.pass.starts_with("upload "));
    let mut rows: Vec<Vec<String>> = built
        .iter()
        .map(|update| {
            let why = update
                .edit
                .as_ref()
                .map_or_else(|| update.why.clone(), |edit| format!("{} (--edit {edit})", update.why));
            vec![update.pass.clone(), update.runs.to_string(), milliseconds(update.ns), why]
        })
        .collect();
    if !uploads.is_empty() {
        let runs: usize = uploads.iter().map(|update| update.runs).sum();
        let ns = uploads.iter().map(|update| update.ns).sum();
        rows.push(vec![
            "uploads".to_owned(),
            runs.to_string(),
            milliseconds(ns),
            "scene, environment and settings".to_owned(),
        ]);
    }
    table(&[Column::Left("built once"), Column::Right("runs"), Column::Right("ms"), Column::Left("why")], &rows)
}

fn memory_table(memory: &[MemoryReport]) -> String {
    let mut rows: Vec<Vec<String>> =
        memory.iter().map(|row| vec![row.name.clone(), bytes(row.bytes), row.lifetime.to_owned()]).collect();
    rows.push(vec!["all".to_owned(), bytes(memory.iter().map(|row| row.bytes).sum())]);
    format!("\n{}", table(&[Column::Left("memory"), Column::Right("size"), Column::Left("kept for")], &rows))
}
