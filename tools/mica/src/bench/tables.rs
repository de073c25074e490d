//! What a bench of occlusion found, for people.

use super::report::{BodyReport, SceneReport, Spread};
use crate::table::{Column, bytes, milliseconds, table};
use mica_gpu::DeviceInfo;

/// What it was measured on.
pub fn heading(device: &DeviceInfo) -> String {
    let driver = format!("{} {}", device.driver, device.driver_version);
    format!("{}, {}, {}\n", device.name, device.kind.name(), driver.trim())
}

/// A scene: how each body is made ready, and how fast it answers.
pub fn for_people(report: &SceneReport) -> String {
    let SceneReport { scene, triangles, triangles_placed, meshes, instances, size: [width, height], rounds, .. } =
        report;
    let mut text = format!(
        "\n{scene}: {triangles} triangles in {meshes} meshes, {triangles_placed} in {instances} instances; camera \
         {width}x{height}; medians of {} rounds after {} that warmed up\n\n",
        rounds.measured, rounds.warmup
    );
    text += &ready_table(&report.bodies);
    for body in &report.bodies {
        if let Some(why) = &body.not_offered {
            text += &format!("{} is not offered: {why}\n", body.body);
        }
    }
    text.push('\n');
    text += &rays_table(&report.bodies);
    for left_out in &report.left_out {
        text += &format!("left out: {left_out}\n");
    }
    text
}

fn offered(bodies: &[BodyReport]) -> impl Iterator<Item = &BodyReport> {
    bodies.iter().filter(|body| body.not_offered.is_none())
}

/// A row for each body, and one for each step of its build.
fn ready_table(bodies: &[BodyReport]) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for body in offered(bodies) {
        let (Some(ready), Some(memory)) = (&body.ready, &body.memory) else { continue };
        rows.push(vec![
            body.body.to_owned(),
            milliseconds(Some(ready.wall_ns.median)),
            range(Some(ready.wall_ns)),
            milliseconds(ready.cpu_ns.map(|cpu| cpu.median)),
            bytes(memory.bytes),
            format!("{:.1}", memory.bytes_per_triangle),
            memory.bytes_as_built.map_or_else(|| "-".to_owned(), bytes),
        ]);
        for step in &ready.steps {
            rows.push(vec![format!("  {}", step.step), milliseconds(Some(step.ns.median)), range(Some(step.ns))]);
        }
    }
    let columns = [
        Column::Left("ready to answer"),
        Column::Right("ms"),
        Column::Right("least-most"),
        Column::Right("CPU ms"),
        Column::Right("memory"),
        Column::Right("bytes a triangle"),
        Column::Right("as built"),
    ];
    table(&columns, &rows)
}

/// A row for each kind of rays and each question, the bodies side by side.
fn rays_table(bodies: &[BodyReport]) -> String {
    let bodies: Vec<&BodyReport> = offered(bodies).collect();
    let Some(first) = bodies.first() else { return String::new() };
    let mut columns = vec![Column::Left("rays"), Column::Left("hit"), Column::Right("count"), Column::Right("blocked")];
    for body in &bodies {
        let heading = if body.body == "bvh" { "bvh Mray/s" } else { "ray-query Mray/s" };
        columns.extend([Column::Right(heading), Column::Right("ms least-most"), Column::Right("a CPU second")]);
    }
    if bodies.len() > 1 {
        columns.extend(["times as fast", "by CPU", "differ in hit", "in triangle"].map(Column::Right));
    }
    columns.push(Column::Right("cut short"));
    let rows: Vec<Vec<String>> = (0..first.rays.len())
        .map(|index| {
            let rays = &first.rays[index];
            let blocked = format!("{:.1} %", 100.0 * rays.blocked as f64 / f64::from(rays.count.max(1)));
            let mut row = vec![rays.rays.to_owned(), rays.question.to_owned(), rays.count.to_string(), blocked];
            let of_bodies = || bodies.iter().map(|body| &body.rays[index]);
            for rays in of_bodies() {
                row.push(times(rays.mrays_per_s));
                row.push(range(rays.ns));
                row.push(times(rays.mrays_per_cpu_s));
            }
            for beside in of_bodies().filter_map(|rays| rays.beside.as_ref()) {
                row.extend([beside.speed, beside.speed_by_cpu].map(times));
                row.push(beside.differ_in_blocked.to_string());
                row.push(beside.differ_in_triangle.to_string());
            }
            let cut_short: Vec<String> = of_bodies().map(|rays| rays.cut_short.to_string()).collect();
            row.push(cut_short.join(" "));
            row
        })
        .collect();
    table(&columns, &rows)
}

/// A figure with two places; a dash for what was not measured.
fn times(figure: Option<f64>) -> String {
    figure.map_or_else(|| "-".to_owned(), |figure| format!("{figure:.2}"))
}

/// The least and the greatest, in milliseconds.
fn range(spread: Option<Spread>) -> String {
    let tenths = |ns: u64| format!("{:.1}", ns as f64 * 1e-6);
    spread.map_or_else(|| "-".to_owned(), |spread| format!("{}-{}", tenths(spread.min), tenths(spread.max)))
}
