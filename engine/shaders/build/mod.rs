//! From a folder of GLSL to SPIR-V and Rust: what build.rs runs, and what the tests run on folders of their own.

pub mod compile;
pub mod discover;
pub mod emit;
pub mod glsl;
pub mod layout;
pub mod merge;
pub mod problem;
pub mod reflect;
pub mod spirv;

use compile::{Module, Outcome, Tools, in_folder};
use discover::{Found, Job};
use emit::{Docs, Unit};
use glsl::{Constant, Effect};
use layout::Structs;
use problem::Problem;
use reflect::{Complaint, Reflection, Stage};
use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// What a build gives.
#[derive(Debug)]
pub struct Generated {
    /// The Rust; it includes SPIR-V files that lie below the output folder.
    pub rust: String,
    /// Warnings.
    pub warnings: Vec<Problem>,
}

/// Compiles the GLSL below `root` and derives the Rust. SPIR-V and the variants' includes are written below `out`.
///
/// # Errors
/// Everything that is wrong with any shader.
pub fn generate(root: &Path, out: &Path, tools: &Tools) -> Result<Generated, Vec<Problem>> {
    let found = discover::discover(root).map_err(|problems| {
        problems.into_iter().map(|p| Problem { file: in_folder(root, &p.file), ..p }).collect::<Vec<_>>()
    })?;
    let unwritable = |error| vec![Problem::of_machine(format!("cannot write to {}: {error}", out.display()))];
    fs::create_dir_all(out.join("spirv")).map_err(unwritable)?;
    for job in found.jobs.iter().filter(|job| !job.picks.is_empty()) {
        compile::write_variant(out, job).map_err(unwritable)?;
    }
    let mut warnings: Vec<Problem> =
        found.warnings.iter().map(|p| Problem { file: in_folder(root, &p.file), ..p.clone() }).collect();
    let mut problems = Vec::new();
    let mut structs = Structs::new();
    let mut struct_docs = Docs::default();
    let mut units = Vec::new();
    for (job, outcomes) in found.jobs.iter().zip(compile_all(&found.jobs, root, out, tools)) {
        let mut modules = Vec::new();
        for outcome in outcomes {
            warnings.extend(outcome.warnings);
            match outcome.result {
                Ok(module) => modules.push(module),
                Err(errors) => problems.extend(errors),
            }
        }
        if modules.len() < job.stages.len() {
            continue;
        }
        let text = Text { root, found: &found, job };
        match unit(&text, &modules, &mut structs, &mut warnings) {
            Ok(unit) => {
                struct_docs.names.extend(unit.docs.names.clone());
                struct_docs.members.extend(unit.docs.members.clone());
                units.push(unit);
            }
            Err(found) => problems.extend(found),
        }
    }
    for found in structs.values().chain(units.iter().filter_map(|unit| unit.interface.params.as_ref())) {
        if let Err(message) = layout::check_room(found, &structs) {
            problems.push(Problem::in_file(&found.origin, message));
        }
    }
    let constants = constants(root, &found).unwrap_or_else(|found| {
        problems.extend(found);
        Vec::new()
    });
    let effects = effects(root, &found).unwrap_or_else(|found| {
        problems.extend(found);
        Vec::new()
    });
    // Variants repeat what they share. The order stays: what the compiler says first is the cause of the rest.
    for list in [&mut problems, &mut warnings] {
        let mut known = HashSet::new();
        list.retain(|problem| known.insert(problem.clone()));
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let rust = emit::emit(&units, &structs, &struct_docs, &constants, &effects);
    Ok(Generated { rust, warnings })
}

/// Compiles every stage of every job, on as many threads as there are cores; outcomes in the order of the jobs.
fn compile_all(jobs: &[Job], root: &Path, out: &Path, tools: &Tools) -> Vec<Vec<Outcome>> {
    let work: Vec<(usize, &Job, Stage, &str)> = (0..)
        .zip(jobs)
        .flat_map(|(index, job)| job.stages.iter().map(move |(stage, file)| (index, job, *stage, file.as_str())))
        .collect();
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let threads = thread::available_parallelism().map_or(1, usize::from).min(work.len());
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((index, job, stage, file)) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = compile::compile(tools, root, out, job, *stage, file);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((*index, *stage, outcome));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, stage, _)| (*index, *stage != Stage::Vertex));
    let mut outcomes: Vec<Vec<Outcome>> = jobs.iter().map(|_| Vec::new()).collect();
    for (index, _, outcome) in done {
        outcomes[index].push(outcome);
    }
    outcomes
}

/// The text of a job's files, to say where something was declared.
struct Text<'a> {
    root: &'a Path,
    found: &'a Found,
    job: &'a Job,
}

impl Text<'_> {
    /// A complaint with the place of what it is about; `file` is the stage's own.
    fn locate(&self, file: &str, complaint: &Complaint) -> Problem {
        let mut files = discover::files_of(&self.found.sources, self.job);
        // Both stages of a raster shader may declare the name: the stage that complains is meant.
        files.sort_by_key(|(path, _)| *path != file);
        let declared = files.iter().find_map(|(path, source)| {
            source.declarations.get(&complaint.about).map(|declaration| (*path, declaration.line))
        });
        let (path, line) = declared.unwrap_or((file, 0));
        Problem::at(in_folder(self.root, path), line, &complaint.message)
    }

    fn docs(&self) -> Docs {
        let mut docs = Docs::default();
        for (_, source) in discover::files_of(&self.found.sources, self.job) {
            for (name, declaration) in &source.declarations {
                docs.names.entry(name.clone()).or_insert_with(|| declaration.doc.clone());
            }
            for (member, declaration) in &source.members {
                docs.members.entry(member.clone()).or_insert_with(|| declaration.doc.clone());
            }
        }
        docs
    }

    fn heading(&self, path: &str) -> String {
        self.found.sources.get(path).map(|source| source.heading.clone()).unwrap_or_default()
    }
}

/// Reflects the modules of one job.
fn unit(
    text: &Text<'_>,
    modules: &[Module],
    structs: &mut Structs,
    warnings: &mut Vec<Problem>,
) -> Result<Unit, Vec<Problem>> {
    let mut reflections: Vec<(Stage, Reflection)> = Vec::new();
    let mut problems = Vec::new();
    for module in modules {
        let origin = in_folder(text.root, &module.source);
        let locate = |complaint: &Complaint| text.locate(&module.source, complaint);
        let parsed = spirv::Module::parse(&module.words);
        let parsed = parsed.map_err(|message| vec![Problem::in_file(&origin, message)])?;
        match reflect::reflect(&parsed, module.stage, &origin) {
            Ok(reflection) => {
                for found in reflection.all_structs() {
                    if let Err(message) = layout::add(structs, found) {
                        problems.push(Problem::in_file(&origin, message));
                    }
                }
                warnings.extend(unused_here(text, &module.source, &reflection));
                reflections.push((module.stage, reflection));
            }
            Err(complaints) => problems.extend(complaints.iter().map(locate)),
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let stages: Vec<(Stage, &Reflection)> = reflections.iter().map(|(stage, found)| (*stage, found)).collect();
    let last = modules.last().map_or("", |module| module.source.as_str());
    let interface = merge::merge(&stages)
        .map_err(|complaints| complaints.iter().map(|complaint| text.locate(last, complaint)).collect::<Vec<_>>())?;
    let picked = text.job.picks.iter().map(|pick| text.heading(&pick.path));
    Ok(Unit {
        name: text.job.name.clone(),
        variant: text.job.variant(),
        module: text.job.module(),
        heading: text.heading(&modules[0].source),
        variant_heading: picked.collect::<Vec<_>>().join("\n\n"),
        stages: modules.iter().map(|m| (m.stage, m.file.clone(), m.words.len())).collect(),
        interface,
        docs: text.docs(),
    })
}

/// Warnings about bindings that a pass declares in its own file and does not use. Includes may offer more than is used.
fn unused_here(text: &Text<'_>, file: &str, reflection: &Reflection) -> Vec<Problem> {
    let Some(source) = text.found.sources.get(file) else { return Vec::new() };
    let here = reflection.unused.iter().filter_map(|name| source.declarations.get(name).map(|d| (name, d.line)));
    here.map(|(name, line)| {
        Problem::at(
            in_folder(text.root, file),
            line,
            format!("`{name}` is declared and not used, so it is not in Bind"),
        )
    })
    .collect()
}

/// The constants of `shared/`, with the files they are from.
fn constants(root: &Path, found: &Found) -> Result<Vec<(String, Constant)>, Vec<Problem>> {
    let mut constants: Vec<(String, Constant)> = Vec::new();
    let mut problems = Vec::new();
    for (path, source) in found.sources.iter().filter(|(path, _)| path.starts_with("shared/")) {
        for constant in &source.constants {
            let name = &constant.name;
            if name.contains(|c: char| c.is_ascii_lowercase()) {
                let message = format!("`{name}` becomes a Rust constant: write it in capitals");
                problems.push(Problem::at(in_folder(root, path), constant.declaration.line, message));
            } else if let Some((other, _)) = constants.iter().find(|(_, known)| known.name == *name) {
                let message = format!("`{name}` is also a constant of {other}: keep one of them");
                problems.push(Problem::at(in_folder(root, path), constant.declaration.line, message));
            } else {
                constants.push((in_folder(root, path), constant.clone()));
            }
        }
    }
    if problems.is_empty() { Ok(constants) } else { Err(problems) }
}

/// Where effects are declared: nowhere else.
const EFFECTS: &str = "shared/effects.glsl";

/// The effects that a frame may call for.
fn effects(root: &Path, found: &Found) -> Result<Vec<Effect>, Vec<Problem>> {
    let mut problems = Vec::new();
    for (path, source) in found.sources.iter().filter(|(path, _)| *path != EFFECTS) {
        for effect in &source.effects {
            let message = format!("`{}` is an effect: declare it in {EFFECTS}", effect.name);
            problems.push(Problem::at(in_folder(root, path), effect.declaration.line, message));
        }
    }
    let effects = found.sources.get(EFFECTS).map(|source| source.effects.clone()).unwrap_or_default();
    for (index, effect) in effects.iter().enumerate() {
        if let Some(other) = effects[..index].iter().find(|other| other.number == effect.number) {
            let message = format!("`{}` has the number of `{}`", effect.name, other.name);
            problems.push(Problem::at(in_folder(root, EFFECTS), effect.declaration.line, message));
        }
    }
    if problems.is_empty() { Ok(effects) } else { Err(problems) }
}
