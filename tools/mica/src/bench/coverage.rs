//! `mica bench --coverage`: what glints cost as they fill more of the screen, and what is fixed.

use super::BenchArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::progress::Progress;
use crate::report::DeviceReport;
use crate::session::{cache, check_size, device, executor};
use crate::study::Clock;
use crate::table::{Column, table};
use glam::{DAffine3, DVec3};
use mica_gpu::{Executor, Timing};
use mica_graph::Graph;
use mica_render::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{MethodInfo, OcclusionBackend, Renderer, View, method};
use mica_shaders::{constants as c, types};
use serde::Serialize;
use std::path::Path;

/// Parts of the screen that glint.
const SHARES: [f64; 5] = [0.0, 0.01, 0.1, 0.5, 1.0];
/// What is timed where nobody says: the methods whose passes are the cheapest, and the default with its blurs and its occlusion.
const DEFAULT_METHODS: [&str; 3] = ["kemppinen", "deliot_belcour", "wang2020"];
/// Frames of both kinds before those that are measured.
const WARMUP: u32 = 2;
const FOV_RADIANS: f64 = 0.8;

/// One part of the screen by one method.
#[derive(Serialize)]
struct Row {
    schema: &'static str,
    device: DeviceReport,
    method: &'static str,
    size: [u32; 2],
    share: f64,
    /// Tiles on which the method runs, and tiles in all.
    tiles: [u32; 2],
    /// Where times are from: `gpu` or `cpu`.
    clock: &'static str,
    /// A frame with glints less one without, in nanoseconds: the median of pairs in turns.
    glint_ns: f64,
    /// What of it does not depend on the share: that of none.
    fixed_ns: f64,
    /// What goes beyond that, over what does so where the whole screen glints; none for that itself being 0.
    beyond_fixed: Option<f64>,
}

/// Measures, writes and prints. Methods that were measured before Ctrl-C are kept.
pub fn coverage(args: &BenchArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let destination = args.json.as_deref().filter(|_| !to_stdout).map(Destination::check).transpose()?;
    let methods =
        if args.method.is_empty() { DEFAULT_METHODS.map(str::to_owned).to_vec() } else { args.method.clone() };
    let methods = methods.iter().map(|name| method(name)).collect::<Result<Vec<&MethodInfo>, _>>()?;
    let sizes = if args.size.is_empty() { vec![[640, 360]] } else { args.size.clone() };
    let device = device(&args.device)?;
    sizes.iter().try_for_each(|size| check_size(*size, device.info()))?;
    let clock = Clock::of(device.info())?;
    let mut executor = executor(device, cache(&args.device).as_ref(), args.device.memory)?;
    let mut progress = Progress::new(args.quiet);
    let mut lines = String::new();
    let mut rows = Vec::new();
    interrupt.defer();
    for (method, size) in methods.iter().flat_map(|method| sizes.iter().map(move |size| (*method, *size))) {
        let mut measured = Vec::new();
        for (done, share) in (0..).zip(SHARES) {
            progress.update(&format!("coverage by {}", method.name), done, SHARES.len() as u64);
            let timed = timed(&mut executor, (method, size, share), args.rounds, clock, interrupt)?;
            let Some((glint_ns, tiles)) = timed else { break };
            let device = DeviceReport::new(executor.device().info());
            let name = method.name;
            let (schema, clock) = ("mica-coverage-1", clock.name());
            let (fixed_ns, beyond_fixed) = (0.0, None);
            measured.push(Row {
                schema,
                device,
                method: name,
                size,
                share,
                tiles,
                clock,
                glint_ns,
                fixed_ns,
                beyond_fixed,
            });
        }
        if measured.len() < SHARES.len() {
            break;
        }
        let (fixed, full) = (measured[0].glint_ns, measured[SHARES.len() - 1].glint_ns);
        for mut row in measured {
            row.fixed_ns = fixed;
            row.beyond_fixed = (full > fixed).then(|| (row.glint_ns - fixed) / (full - fixed));
            lines += &(serde_json::to_string(&row).map_err(|error| Failure::bad_input(error.to_string()))? + "\n");
            rows.push(row);
        }
        if let Some(destination) = &destination {
            destination.write(lines.as_bytes())?;
        }
    }
    progress.clear();
    if to_stdout {
        output::print(&lines)?;
    } else if !args.quiet {
        output::print(&for_people(&rows))?;
    }
    if interrupt.requested() {
        return Err(Failure::with_code(INTERRUPTED, "interrupted; methods that were measured as a whole were kept"));
    }
    Ok(())
}

fn for_people(rows: &[Row]) -> String {
    let columns = [
        Column::Left("method"),
        Column::Left("size"),
        Column::Right("screen"),
        Column::Right("tiles"),
        Column::Right("glints ms"),
        Column::Right("fixed ms"),
        Column::Right("beyond fixed"),
    ];
    let row = |row: &Row| {
        let beyond = row.beyond_fixed.map_or_else(|| "-".to_owned(), |part| format!("{:.1} %", 100.0 * part));
        vec![
            row.method.to_owned(),
            format!("{}x{}", row.size[0], row.size[1]),
            format!("{:.0} %", 100.0 * row.share),
            format!("{} of {}", row.tiles[0], row.tiles[1]),
            format!("{:.3}", row.glint_ns / 1e6),
            format!("{:.3}", row.fixed_ns / 1e6),
            beyond,
        ]
    };
    table(&columns, &rows.iter().map(row).collect::<Vec<_>>())
}

/// Nanoseconds of glints, and the tiles that show them; nothing after Ctrl-C.
fn timed(
    executor: &mut Executor,
    (method, size, share): (&'static MethodInfo, [u32; 2], f64),
    rounds: u32,
    clock: Clock,
    interrupt: &Interrupt,
) -> Result<Option<(f64, [u32; 2])>, Failure> {
    let sun = Light::Directional { direction: DVec3::new(0.2, -0.3, -1.0).normalize(), irradiance: [3.0; 3] };
    let mut renderer = Renderer::new(screen(size, share), &[sun], None, OcclusionBackend::Bvh)?;
    renderer.set_method(None, method.name)?;
    renderer.precompute(executor, None, &mut |_, _, _| {})?;
    let camera = Camera::looking_at("before the screen", DVec3::ZERO, DVec3::NEG_Z, FOV_RADIANS, 1e-3);
    let with = View::new(camera, size);
    let without = View { glints: false, ..with.clone() };
    let mut tiles = [0, size[0].div_ceil(c::TILE_SIDE) * size[1].div_ceil(c::TILE_SIDE)];
    let mut differences = Vec::new();
    for round in 0..WARMUP + rounds {
        if interrupt.requested() {
            return Ok(None);
        }
        let mut ns = [0.0; 2];
        // In turns, so that what drifts does so for both.
        for seen in [round % 2 == 0, round % 2 == 1] {
            let mut graph = Graph::new();
            let frame = renderer.frame(&mut graph, if seen { &with } else { &without }, None)?;
            graph.export(&frame.display);
            let lists = frame.tile_lists.as_ref().filter(|_| round == 0).map(|lists| graph.download(lists));
            let mut run = executor.run(graph, Timing::Overlapped)?;
            ns[usize::from(seen)] = clock.ns(&run)?;
            if let Some(lists) = lists {
                let lists: Vec<types::TileList> = bytemuck::pod_collect_to_vec(&run.take(lists));
                tiles[0] = lists.first().map_or(0, |list| list.tiles);
            }
        }
        if round >= WARMUP {
            differences.push(ns[1] - ns[0]);
        }
    }
    differences.sort_by(f64::total_cmp);
    Ok(Some((differences[differences.len() / 2], tiles)))
}

/// A wall that fills the screen, and before it a rectangle of the screen's shape that glints and fills a part of it; of none
/// it lies behind the camera.
fn screen(size: [u32; 2], share: f64) -> Scene {
    let half_height = (0.5 * FOV_RADIANS).tan();
    let half = [half_height * f64::from(size[0]) / f64::from(size[1]), half_height];
    let rectangle = |name: &str, scale: f64, material: usize| {
        let [x, y] = half.map(|half| (scale * half) as f32);
        let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
        Mesh {
            name: name.to_owned(),
            positions: corners.map(|[x, y]| [x, y, 0.0]).to_vec(),
            normals: vec![[0.0, 0.0, 1.0]; 4],
            uv: [corners.to_vec(), Vec::new()],
            indices: vec![0, 1, 2, 0, 2, 3],
            material,
            has_uv: true,
            ..Mesh::default()
        }
    };
    let at = |mesh: usize, name: &str, z: f64| Instance {
        mesh,
        world_from_local: DAffine3::from_translation(z * DVec3::Z),
        name: name.to_owned(),
    };
    let glint = Glint { count: 1e6, alpha: 0.3, gamma_deg: 3.0, ..Glint::default() };
    let part = if share > 0.0 { share.sqrt() } else { 1.0 };
    // A hair more, so that its edge does not run through the outermost pixels.
    let scale = if share < 1.0 { part } else { 1.01 };
    Scene {
        name: "screen".to_owned(),
        meshes: vec![rectangle("glitter", scale, 0), rectangle("wall", 2.0, 1)],
        instances: vec![at(0, "glitter", if share > 0.0 { -1.0 } else { 1.0 }), at(1, "wall", -1.1)],
        materials: vec![
            Material { name: "glitter".to_owned(), roughness: 0.4, glint: Some(glint), ..Material::default() },
            Material { name: "wall".to_owned(), metallic: 0.0, ..Material::default() },
        ],
        ..Scene::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_measured_by_default_exists() {
        assert!(DEFAULT_METHODS.iter().all(|name| method(name).is_ok()));
    }

    #[test]
    fn the_glinting_part_has_its_share_of_the_screen() {
        for share in [0.01, 0.1, 0.5] {
            let scene = screen([640, 360], share);
            let area = |mesh: &Mesh| f64::from(mesh.positions[2][0]) * f64::from(mesh.positions[2][1]);
            let full = screen([640, 360], 1.0);
            // Of a screen that is 1.01 times as wide and high.
            let expected = share / (1.01 * 1.01);
            assert!((area(&scene.meshes[0]) / area(&full.meshes[0]) / expected - 1.0).abs() < 1e-5, "{share}");
        }
    }
}
