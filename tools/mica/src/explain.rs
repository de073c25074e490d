//! `mica explain`: the plan of a frame, and why each part of it is there. Nothing is rendered.

use crate::args::ExplainArgs;
use crate::error::Failure;
use crate::output;
use crate::progress::Progress;
use crate::report::{DeviceReport, LeftOutReport};
use crate::session::Session;
use crate::table::{self, Column};
use mica_graph::{Access, Pass, Plan, ResourceId, Step};
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

    let bytes: BTreeMap<ResourceId, u64> =
        plan.resources.iter().map(|usage| (usage.resource.id, usage.bytes)).collect();
    let passes = plan.passes.iter().zip(is_update);
    let passes = passes.map(|(pass, is_update)| PassReport::new(pass, is_update, &bytes)).collect();
    let report = ExplainReport {
        schema: "mica-explain-1",
        scene: session.scene.clone(),
        method: session.method(),
        size: session.view.size,
        device: DeviceReport::new(session.device()),
        occlusion: session.renderer.occlusion().name(),
        occlusion_why: session.occlusion_why.clone(),
        passes,
        culled: plan.culled.clone(),
        first_frame: FrameReport::new(&plan),
        later_frames: FrameReport::new(&later),
        resources: resources(&plan),
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
    passes: Vec<PassReport>,
    /// Passes that were declared and that nothing needs.
    culled: Vec<String>,
    first_frame: FrameReport,
    later_frames: FrameReport,
    resources: Vec<ResourceReport>,
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

#[derive(Serialize)]
struct UseReport {
    resource: String,
    bytes: u64,
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
    text += "\nbuilt once, in the first frame\n";
    text += &passes_text(report.passes.iter().enumerate().filter(|(_, pass)| pass.once));
    text += "\nevery frame\n";
    text += &passes_text(report.passes.iter().enumerate().filter(|(_, pass)| !pass.once));
    if !report.culled.is_empty() {
        text += &format!("\nculled, as nothing needs them: {}\n", report.culled.join(", "));
    }
    text += "\nleft out\n";
    for left_out in &report.left_out {
        text += &format!("  {}: {}\n", left_out.what, left_out.why);
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
