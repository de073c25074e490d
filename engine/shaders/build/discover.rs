//! Which shaders there are: compute shaders, pairs of a vertex and a fragment shader, and their variants.

use super::glsl::Source;
use super::problem::Problem;
use super::reflect::Stage;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// An include that stands for each file of a folder in turn.
struct Choice {
    /// What a pass includes.
    include: &'static str,
    /// Where the files are that it can stand for.
    folder: &'static str,
    /// What is chosen, in the names of variants.
    key: &'static str,
}

const CHOICES: [Choice; 8] = [
    Choice { include: "method.glsl", folder: "methods", key: "method" },
    Choice { include: "occlusion.glsl", folder: "occlusion", key: "occlusion" },
    Choice { include: "probability.glsl", folder: "rungs/probability", key: "probability" },
    Choice { include: "count.glsl", folder: "rungs/count", key: "count" },
    Choice { include: "arithmetic.glsl", folder: "rungs/arithmetic", key: "arithmetic" },
    Choice { include: "bits.glsl", folder: "rungs/bits", key: "bits" },
    Choice { include: "unary.glsl", folder: "rungs/unary", key: "unary" },
    Choice { include: "group.glsl", folder: "rungs/group", key: "group" },
];

/// Passes that are compiled once more with `NAIVE_FORMS` defined, under their name and `_naive`: what their stable forms cost
/// is measured against that.
const NAIVE_TOO: [&str; 2] = ["base", "glints"];

/// What a per-variant include stands for in one variant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pick {
    /// What the pass includes: `method.glsl`.
    pub include: &'static str,
    /// What is chosen: `method`.
    pub key: &'static str,
    /// Stem of the chosen file: `wang2020`.
    pub stem: String,
    /// The chosen file, relative to the shaders' folder: `methods/wang2020.glsl`.
    pub path: String,
}

/// One shader in one variant.
#[derive(Clone, Debug)]
pub struct Job {
    /// File stem.
    pub name: String,
    /// Its stages and their files, relative to the shaders' folder.
    pub stages: Vec<(Stage, String)>,
    /// What its per-variant includes stand for; empty without variants.
    pub picks: Vec<Pick>,
    /// Whether `NAIVE_FORMS` is defined.
    pub naive: bool,
}

impl Job {
    /// What the per-variant includes stand for, as `method=wang2020`; empty without variants.
    pub fn variant(&self) -> String {
        self.picks.iter().map(|pick| format!("{}={}", pick.key, pick.stem)).collect::<Vec<_>>().join(",")
    }

    /// Name of the variant's module: `wang2020`; `wang2020_bvh` for two includes; empty without variants.
    pub fn module(&self) -> String {
        self.picks.iter().map(|pick| pick.stem.as_str()).collect::<Vec<_>>().join("_")
    }

    /// Name for people and for files: `glints-wang2020`.
    pub fn label(&self) -> String {
        if self.picks.is_empty() { self.name.clone() } else { format!("{}-{}", self.name, self.module()) }
    }
}

/// What a folder of GLSL holds.
#[derive(Debug, Default)]
pub struct Found {
    /// Every shader in every variant, by name.
    pub jobs: Vec<Job>,
    /// Every file's text taken apart, by its path relative to the folder.
    pub sources: BTreeMap<String, Source>,
    /// What is odd and no error.
    pub warnings: Vec<Problem>,
}

/// Looks through the folder `root`.
///
/// # Errors
/// Every file that is in the wrong place or has an unsuitable name.
pub fn discover(root: &Path) -> Result<Found, Vec<Problem>> {
    let mut found = Found::default();
    let mut problems = Vec::new();
    for file in files(root, "").map_err(|problem| vec![problem])? {
        match fs::read_to_string(root.join(&file)) {
            Ok(text) => {
                found.sources.insert(file, Source::parse(&text));
            }
            Err(error) => problems.push(Problem::in_file(file, format!("cannot be read: {error}"))),
        }
    }
    let mut shaders: BTreeMap<String, Vec<(Stage, String)>> = BTreeMap::new();
    for (file, source) in &found.sources {
        if let Some(rest) = file.strip_prefix("passes/") {
            let (stem, extension) = stem_and_extension(rest);
            let stage = match extension {
                "comp" => Stage::Compute,
                "vert" => Stage::Vertex,
                "frag" => Stage::Fragment,
                _ => {
                    let message = "passes/ holds .comp, .vert and .frag files only: includes belong in shared/";
                    problems.push(Problem::in_file(file, message));
                    continue;
                }
            };
            if !is_module_name(stem) {
                problems.push(Problem::in_file(file, MODULE_NAMES));
            }
            shaders.entry(stem.to_owned()).or_default().push((stage, file.clone()));
        } else {
            for (include, line) in &source.includes {
                if CHOICES.iter().any(|choice| choice.include == include) {
                    problems.push(Problem::at(file, *line, format!("only a file in passes/ may include {include}")));
                }
            }
        }
    }
    for (name, stages) in shaders {
        if let Err(problem) = check_stages(&name, &stages) {
            problems.push(problem);
            continue;
        }
        match variants(&found.sources, &stages) {
            Ok(variants) => {
                let twin = NAIVE_TOO.contains(&name.as_str()).then(|| (format!("{name}_naive"), true));
                for (name, naive) in [(name, false)].into_iter().chain(twin) {
                    found.jobs.extend(variants.iter().map(|picks| Job {
                        name: name.clone(),
                        stages: stages.clone(),
                        picks: picks.clone(),
                        naive,
                    }));
                }
            }
            Err(VariantError::Problem(problem)) => problems.push(problem),
            Err(VariantError::Nothing(folder)) => {
                let message = format!("is not compiled: it is made for each file in {folder}/, which has none");
                found.warnings.push(Problem::in_file(&stages[0].1, message));
            }
        }
    }
    if problems.is_empty() { Ok(found) } else { Err(problems) }
}

/// All files below `root`/`folder` but hidden ones, sorted, as paths with slashes relative to `root`.
fn files(root: &Path, folder: &str) -> Result<Vec<String>, Problem> {
    let unreadable = |error| Problem::in_file(folder, format!("cannot be listed: {error}"));
    let mut files = Vec::new();
    for entry in fs::read_dir(root.join(folder)).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") };
        if name.starts_with('.') {
            continue;
        }
        if entry.path().is_dir() {
            files.extend(self::files(root, &path)?);
        } else if ["glsl", "comp", "vert", "frag"].contains(&stem_and_extension(&name).1)
            || folder.starts_with("passes")
        {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn stem_and_extension(path: &str) -> (&str, &str) {
    let name = path.rsplit('/').next().unwrap_or(path);
    name.rsplit_once('.').unwrap_or((name, ""))
}

const MODULE_NAMES: &str = "the name becomes a Rust module: use lower-case letters, digits and _, beginning with a \
                            letter, and neither a keyword nor `types` or `constants`";

fn is_module_name(stem: &str) -> bool {
    stem.starts_with(|c: char| c.is_ascii_lowercase())
        && stem.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !super::emit::is_keyword(stem)
        && !["types", "constants"].contains(&stem)
}

/// A shader is one compute stage, or one vertex and one fragment stage.
fn check_stages(name: &str, stages: &[(Stage, String)]) -> Result<(), Problem> {
    let with = |wanted| stages.iter().filter(|(stage, _)| *stage == wanted).collect::<Vec<_>>();
    let (compute, vertex, fragment) = (with(Stage::Compute), with(Stage::Vertex), with(Stage::Fragment));
    match (&compute[..], &vertex[..], &fragment[..]) {
        ([_], [], []) | ([], [_], [_]) => Ok(()),
        ([], [(_, file)], []) => Err(Problem::in_file(file, format!("there is no {name}.frag to go with it"))),
        ([], [], [(_, file)]) => Err(Problem::in_file(file, format!("there is no {name}.vert to go with it"))),
        _ => {
            let (first, rest) = stages.split_first().map_or(("", &[][..]), |((_, file), rest)| (file.as_str(), rest));
            let others = rest.iter().map(|(_, file)| file.as_str()).collect::<Vec<_>>().join(" and ");
            Err(Problem::in_file(others, format!("is called {name} as {first} is: file stems are unique in passes/")))
        }
    }
}

enum VariantError {
    Problem(Problem),
    /// The folder that a per-variant include chooses from has no files.
    Nothing(&'static str),
}

/// The product of the choices that the stages' files include.
fn variants(sources: &BTreeMap<String, Source>, stages: &[(Stage, String)]) -> Result<Vec<Vec<Pick>>, VariantError> {
    let mut variants = vec![Vec::new()];
    for choice in &CHOICES {
        let includes = |file: &String| {
            sources.get(file).is_some_and(|s| s.includes.iter().any(|(path, _)| path == choice.include))
        };
        if !stages.iter().any(|(_, file)| includes(file)) {
            continue;
        }
        let folder = format!("{}/", choice.folder);
        let mut picks = Vec::new();
        for path in sources.keys().filter(|path| path.starts_with(&folder)) {
            let stem = stem_and_extension(path).0.to_owned();
            if !is_module_name(&stem) {
                return Err(VariantError::Problem(Problem::in_file(path, MODULE_NAMES)));
            }
            picks.push(Pick { include: choice.include, key: choice.key, stem, path: path.clone() });
        }
        if picks.is_empty() {
            return Err(VariantError::Nothing(choice.folder));
        }
        variants = variants
            .iter()
            .flat_map(|chosen: &Vec<Pick>| picks.iter().map(|pick| [chosen, std::slice::from_ref(pick)].concat()))
            .collect();
    }
    Ok(variants)
}

/// The files that the stages of a job read, each once: their own, what those include, and what is chosen for them.
pub fn files_of<'a>(sources: &'a BTreeMap<String, Source>, job: &Job) -> Vec<(&'a str, &'a Source)> {
    let mut files: Vec<(&str, &Source)> = Vec::new();
    let mut waiting: Vec<String> = job.stages.iter().rev().map(|(_, file)| file.clone()).collect();
    while let Some(path) = waiting.pop() {
        let Some((path, source)) = sources.get_key_value(&path) else { continue };
        if files.iter().any(|(known, _)| known == path) {
            continue;
        }
        files.push((path, source));
        for (include, _) in &source.includes {
            let chosen = job.picks.iter().find(|pick| pick.include == include).map(|pick| pick.path.clone());
            let beside = path.rsplit_once('/').map(|(folder, _)| format!("{folder}/{include}"));
            let beside = beside.filter(|beside| sources.contains_key(beside));
            waiting.push(chosen.or(beside).unwrap_or_else(|| include.clone()));
        }
    }
    files
}
