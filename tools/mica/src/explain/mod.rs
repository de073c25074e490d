//! `mica explain`: what there is to simulate, the plan of a frame that follows from it, and why each part of that is there.
//! Nothing is rendered, unless times are asked for.

mod effects;

use crate::args::ExplainArgs;
use crate::error::Failure;
use crate::output;
use crate::progress::Progress;
use crate::report::{DeviceReport, LeftOutReport};
use crate::session::Session;
use crate::table::{self, Column};
use effects::EffectReport;
use mica_graph::{Access, Effects, Pass, Plan, ResourceId, Step, Usage};
use mica_render::Census;
use mica_shaders::effects as names;
use serde::Serialize;
use std::collections::BTreeMap;

/// Prints the plan of the first frame, which builds all tables, and what remains of it in later ones.
pub fn explain(args: &ExplainArgs) -> Result<(), Failure> {
    let mut session = Session::new(&args.scene, &mut Progress::new(args.json))?;
    let first = session.declare(None)?;
    let updates_of = first.updates_of();
    let left_out: Vec<LeftOutReport> = first.left_out().iter().map(LeftOutReport::new).collect();
    let plan = session.executor.plan(first.graph)?;
    let is_update = updates_of(&plan);
    let later = session.declare(None)?;
    let later = session.executor.plan(later.graph)?;
    let is_later = |pass: &Pass| later.passes.iter().any(|other| (&other.name, &other.why) == (&pass.name, &pass.why));
    let is_once: Vec<bool> =
        plan.passes.iter().zip(is_update).map(|(pass, is_update)| is_update || !is_later(pass)).collect();
    let effects = effects::report(&mut session, args.cost)?;

    let bytes: BTreeMap<ResourceId, u64> =
        plan.resources.iter().map(|usage| (usage.resource.id, usage.bytes)).collect();
    let passes = plan.passes.iter().zip(&is_once).map(|(pass, once)| PassReport::new(pass, *once, &bytes)).collect();
    let report = ExplainReport {
        schema: "mica-explain-1",
        scene: session.scene.clone(),
        method: session.method(),
        size: session.view.size,
        device: DeviceReport::new(session.device()),
        occlusion: session.renderer.occlusion().name(),
        occlusion_why: session.occlusion_why.clone(),
        census: session.renderer.census().clone(),
        effects,
        passes,
        culled: plan.culled.clone(),
        first_frame: FrameReport::new(&plan),
        later_frames: FrameReport::new(&later),
        tables: tables(&plan, &is_once),
        resources: resources(&plan),
        total_bytes: effects::bytes(&plan),
        left_out,
    };
    if args.json { output::print_json(&report) } else { output::print(&for_people(&report)) }
}

#[derive(Serialize)]
struct ExplainReport {
    schema: &'static str,
    scene: String,
    method: String,
    size: [u32; 2],
    device: DeviceReport,
    occlusion: &'static str,
    occlusion_why: String,
    census: Census,
    effects: Vec<EffectReport>,
    passes: Vec<PassReport>,
    /// Passes that were declared and that nothing needs.
    culled: Vec<String>,
    first_frame: FrameReport,
    later_frames: FrameReport,
    tables: Vec<TableReport>,
    resources: Vec<ResourceReport>,
    /// Of tables, of the scene and of what frames share.
    total_bytes: u64,
    left_out: Vec<LeftOutReport>,
}

/// Figures of a whole frame.
#[derive(Serialize)]
struct FrameReport {
    passes: usize,
    barriers: usize,
    /// Bytes of the memory that images and buffers of the frame share.
    shared_bytes: u64,
    /// Bytes they would take side by side.
    unshared_bytes: u64,
}

impl FrameReport {
    fn new(plan: &Plan) -> Self {
        Self {
            passes: plan.passes.len(),
            barriers: plan.steps.iter().filter(|step| matches!(step, Step::Synchronize { .. })).count(),
            shared_bytes: plan.shared_bytes,
            unshared_bytes: plan.unshared_bytes,
        }
    }
}

#[derive(Serialize)]
struct PassReport {
    name: String,
    /// Which variant of its shader runs; empty where there is one only, or no shader.
    variant: &'static str,
    /// The effects that its shader is specialised for: of those that it asks about, the ones that are called for.
    effects: Vec<&'static str>,
    /// The effects that it asks about and that its code is compiled without.
    without: Vec<&'static str>,
    why: String,
    /// Whether it is in the first frame only, until something it depends on changes.
    once: bool,
    reads: Vec<UseReport>,
    writes: Vec<UseReport>,
}

impl PassReport {
    fn new(pass: &Pass, once: bool, bytes: &BTreeMap<ResourceId, u64>) -> Self {
        let uses = |wanted: fn(Access) -> bool| {
            let mut uses: Vec<UseReport> = Vec::new();
            for used in pass.uses.iter().filter(|used| wanted(used.access)) {
                if !uses.iter().any(|known| known.resource == used.resource.name) {
                    let bytes = bytes.get(&used.resource.id).copied().unwrap_or_default();
                    uses.push(UseReport { resource: used.resource.name.clone(), bytes });
                }
            }
            uses
        };
        Self {
            name: pass.name.clone(),
            variant: pass.work.shader().map_or("", |shader| shader.variant),
            effects: named(pass.effects),
            without: named(pass.work.shader().map_or(Effects::NONE, |shader| shader.effects.without(pass.effects))),
            why: pass.why.clone(),
            once,
            reads: uses(Access::reads),
            writes: uses(Access::writes),
        }
    }

    /// Whether people can be told of both at once: dispatches of one shader with the same reason and resources.
    fn repeats(&self, other: &Self) -> bool {
        let names = |uses: &[UseReport]| uses.iter().map(|used| used.resource.clone()).collect::<Vec<_>>();
        self.name == other.name
            && self.why == other.why
            && names(&self.reads) == names(&other.reads)
            && names(&self.writes) == names(&other.writes)
    }
}

/// Effects by their names in the shaders.
fn named(effects: Effects) -> Vec<&'static str> {
    names::ALL.iter().filter(|(_, bit)| effects.contains(*bit)).map(|(name, _)| *name).collect()
}

#[derive(Serialize)]
struct UseReport {
    resource: String,
    bytes: u64,
}

/// Something that was made once and is kept.
#[derive(Serialize)]
struct TableReport {
    name: String,
    bytes: u64,
    /// Which pass filled it, and why.
    pass: String,
    why: String,
}

/// The tables that updates of the first frame fill, each with the last pass that does.
fn tables(plan: &Plan, is_update: &[bool]) -> Vec<TableReport> {
    let of = |usage: &Usage| {
        let mut updates = plan.passes.iter().zip(is_update).filter(|(_, is_update)| **is_update).map(|(pass, _)| pass);
        let writes =
            |pass: &&Pass| pass.uses.iter().any(|used| used.access.writes() && used.resource.id == usage.resource.id);
        let pass = updates.rfind(writes).filter(|_| usage.placement.is_none())?;
        let (name, pass_name) = (usage.resource.name.clone(), pass.name.clone());
        Some(TableReport { name, bytes: usage.bytes, pass: pass_name, why: pass.why.clone() })
    };
    plan.resources.iter().filter_map(of).collect()
}

#[derive(Serialize)]
struct ResourceReport {
    name: String,
    bytes: u64,
    lifetime: &'static str,
    /// First and last pass of the first frame that uses it.
    passes: [usize; 2],
    /// Where it lies in the frame's shared memory; none for what has memory of its own.
    offset: Option<u64>,
}

fn resources(plan: &Plan) -> Vec<ResourceReport> {
    plan.resources
        .iter()
        .map(|usage| ResourceReport {
            name: usage.resource.name.clone(),
            bytes: usage.placement.map_or(usage.bytes, |placement| placement.bytes),
            lifetime: usage.resource.lifetime.name(),
            passes: [usage.passes.0, usage.passes.1],
            offset: usage.placement.map(|placement| placement.offset),
        })
        .collect()
}

fn for_people(report: &ExplainReport) -> String {
    let [width, height] = report.size;
    let mut text = format!(
        "{}, {}, {width}x{height} on {} ({})\nocclusion: {}, because {}\n",
        report.scene, report.method, report.device.name, report.device.driver, report.occlusion, report.occlusion_why
    );
    text += "\nwhat there is\n";
    text += &census_text(&report.census);
    text += "\ncalled for\n";
    for effect in report.effects.iter().filter(|effect| effect.called_for) {
        text += &format!("  {}: {}\n", effect.what, effect.why);
    }
    text += "\nbuilt once, in the first frame\n";
    text += &passes_text(report.passes.iter().enumerate().filter(|(_, pass)| pass.once));
    text += "\nevery frame\n";
    text += &passes_text(report.passes.iter().enumerate().filter(|(_, pass)| !pass.once));
    if !report.culled.is_empty() {
        text += &format!("\nculled, as nothing needs them: {}\n", report.culled.join(", "));
    }
    text += "\nleft out\n";
    for left_out in &report.left_out {
        let effect = report.effects.iter().find(|effect| effect.what == left_out.what);
        let cost = effect.and_then(|effect| effect.would_cost.as_ref());
        let cost = cost.map(|cost| format!("; it would cost {}", cost.text())).unwrap_or_default();
        text += &format!("  {}: {}{cost}\n", left_out.what, left_out.why);
    }
    if report.left_out.is_empty() {
        text += "  nothing\n";
    }
    let rows: Vec<Vec<String>> = report
        .resources
        .iter()
        .map(|resource| {
            vec![
                resource.name.clone(),
                table::bytes(resource.bytes),
                resource.lifetime.to_owned(),
                range(resource.passes),
            ]
        })
        .collect();
    let columns = [Column::Left("resource"), Column::Right("size"), Column::Left("kept for"), Column::Left("passes")];
    text += &format!("\n{}\n", table::table(&columns, &rows));
    if !report.tables.is_empty() {
        let row = |table: &TableReport| vec![table.name.clone(), table::bytes(table.bytes), table.why.clone()];
        let rows: Vec<Vec<String>> = report.tables.iter().map(row).collect();
        let columns = [Column::Left("table"), Column::Right("size"), Column::Left("because")];
        text += &format!("\n{}\n", table::table(&columns, &rows));
    }
    text += &format!("in all: {}\n", table::bytes(report.total_bytes));
    for (name, frame) in [("first frame", &report.first_frame), ("later frames", &report.later_frames)] {
        let saved = frame.unshared_bytes.saturating_sub(frame.shared_bytes);
        text += &format!(
            "{name}: {} passes, {} barriers; images and buffers of the frame take {} together, {} less than side by \
             side\n",
            frame.passes,
            frame.barriers,
            table::bytes(frame.shared_bytes),
            table::bytes(saved),
        );
    }
    text
}

/// The census in lines: one a material, one for the lights, one for the environment.
fn census_text(census: &Census) -> String {
    let mut text = format!(
        "  {} triangles in {} instances, {} of which moved\n",
        census.triangles, census.instances, census.moved_instances
    );
    for material in &census.materials {
        let mut has: Vec<String> = [
            (material.diffuse, "diffuse"),
            (material.smooth_specular, "smooth specular"),
            (material.emissive, "emissive"),
            (material.unlit, "unlit"),
            (material.alpha_mask, "alpha mask"),
            (material.normal_map, "normal map"),
            (material.vertex_colors, "vertex colours"),
            (material.clear_coat, "clear coat"),
        ]
        .into_iter()
        .filter(|(has, _)| *has)
        .map(|(_, what)| what.to_owned())
        .collect();
        if material.textures > 0 {
            has.push(format!("{} textures", material.textures));
        }
        if let Some(glints) = &material.glints {
            let range = glints.uv_range.map_or_else(
                || "no texture coordinates".to_owned(),
                |[[u0, v0], [u1, v1]]| format!("u {u0:.3} to {u1:.3}, v {v0:.3} to {v1:.3}"),
            );
            let chosen = glints.chosen.as_ref().map(|why| format!(", chosen because {why}")).unwrap_or_default();
            has.push(format!(
                "glints by {}{chosen} ({:e} flakes a square, alpha {}, gamma {} degrees, {range})",
                glints.method, glints.count as f64, glints.alpha, glints.gamma_deg
            ));
        }
        let has = if has.is_empty() { "black".to_owned() } else { has.join(", ") };
        let seen =
            if material.triangles > 0 { format!("{} triangles", material.triangles) } else { "not shown".to_owned() };
        text += &format!("  material {}: {seen}; {has}\n", material.name);
    }
    let lights = census.lights;
    text += &format!("  lights: {} point, {} directional, {} spot\n", lights.point, lights.directional, lights.spot);
    text += &match &census.environment {
        None => "  environment: none\n".to_owned(),
        Some(environment) => format!(
            "  environment: {}x{}, {} small bright lights with {:.1} % of its light, {} bad texels\n",
            environment.size[0],
            environment.size[1],
            environment.small_lights,
            100.0 * environment.share_of_small_lights,
            environment.bad_texels
        ),
    };
    text
}

fn passes_text<'a>(passes: impl Iterator<Item = (usize, &'a PassReport)>) -> String {
    let mut groups: Vec<(usize, usize, &PassReport)> = Vec::new();
    for (index, pass) in passes {
        match groups.last_mut() {
            Some((_, end, last)) if last.repeats(pass) => *end = index,
            _ => groups.push((index, index, pass)),
        }
    }
    let mut text = String::new();
    for (first, last, pass) in groups {
        let numbers = range([first, last]);
        let variant = if pass.variant.is_empty() { String::new() } else { format!(" [{}]", pass.variant) };
        text += &format!("{numbers:>7}  {}{variant}: {}\n", pass.name, pass.why);
        if !(pass.effects.is_empty() && pass.without.is_empty()) {
            let list = |names: &[&str]| if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
            text += &format!("           for    {}; without {}\n", list(&pass.effects), list(&pass.without));
        }
        for (what, uses) in [("reads ", &pass.reads), ("writes", &pass.writes)] {
            let uses: Vec<String> =
                uses.iter().map(|used| format!("{} ({})", used.resource, table::bytes(used.bytes))).collect();
            if !uses.is_empty() {
                text += &format!("           {what} {}\n", uses.join(", "));
            }
        }
    }
    text
}

/// Numbers of passes, from the first to the last.
fn range([first, last]: [usize; 2]) -> String {
    if first == last { first.to_string() } else { format!("{first}-{last}") }
}
