//! GLSL to checked SPIR-V, with the two tools that do it.

use super::discover::Job;
use super::problem::Problem;
use super::reflect::Stage;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Vulkan 1.2 and its SPIR-V 1.5: what the oldest driver of interest has, ray queries included.
const TARGET: &str = "vulkan1.2";

/// The programs that are run.
#[derive(Clone, Debug)]
pub struct Tools {
    /// The compiler.
    pub glslang: OsString,
    /// The validator.
    pub spirv_val: OsString,
}

impl Tools {
    /// The environment variables that name other programs than those on the path.
    pub const VARIABLES: [&str; 2] = ["GLSLANG_VALIDATOR", "SPIRV_VAL"];

    /// The programs that the environment names, else those on the path.
    pub fn from_environment() -> Self {
        let [glslang, spirv_val] = Self::VARIABLES;
        Self {
            glslang: env::var_os(glslang).unwrap_or_else(|| "glslangValidator".into()),
            spirv_val: env::var_os(spirv_val).unwrap_or_else(|| "spirv-val".into()),
        }
    }

    /// Finds out before any work is done whether both programs start.
    ///
    /// # Errors
    /// One line for each that does not, naming the package that brings it.
    pub fn check(&self) -> Result<(), Vec<Problem>> {
        let [glslang, spirv_val] = Self::VARIABLES;
        let tools = [(&self.glslang, "glslang-tools", glslang), (&self.spirv_val, "spirv-tools", spirv_val)];
        let problems: Vec<Problem> = tools
            .into_iter()
            .filter_map(|(tool, package, variable)| {
                let error = Command::new(tool).arg("--version").output().err()?;
                let tool = tool.to_string_lossy();
                let message = if error.kind() == io::ErrorKind::NotFound {
                    format!(
                        "{tool} is missing: install the Debian package {package}, or name the program in {variable}"
                    )
                } else {
                    format!("{tool} does not start: {error}")
                };
                Some(Problem::of_machine(message))
            })
            .collect();
        if problems.is_empty() { Ok(()) } else { Err(problems) }
    }
}

/// The code of one stage.
#[derive(Debug)]
pub struct Module {
    /// Which stage.
    pub stage: Stage,
    /// Its GLSL, relative to the shaders' folder.
    pub source: String,
    /// File name of the SPIR-V below the output folder.
    pub file: String,
    /// The SPIR-V.
    pub words: Vec<u32>,
}

/// What became of one stage: its code or its errors, and warnings either way.
#[derive(Debug)]
pub struct Outcome {
    /// The code, or everything that is wrong.
    pub result: Result<Module, Vec<Problem>>,
    /// The compiler's warnings.
    pub warnings: Vec<Problem>,
}

/// Compiles and validates one stage of a job; `root` is the shaders' folder, `out` where the SPIR-V goes.
pub fn compile(tools: &Tools, root: &Path, out: &Path, job: &Job, stage: Stage, source: &str) -> Outcome {
    let mut warnings = Vec::new();
    let result = compile_into(tools, root, out, job, stage, source, &mut warnings);
    Outcome { result, warnings }
}

fn compile_into(
    tools: &Tools,
    root: &Path,
    out: &Path,
    job: &Job,
    stage: Stage,
    source: &str,
    warnings: &mut Vec<Problem>,
) -> Result<Module, Vec<Problem>> {
    let one = |message: String| vec![Problem::in_file(in_folder(root, source), message)];
    let extension = source.rsplit('.').next().unwrap_or_default();
    let file = format!("spirv/{}.{extension}.spv", job.label());
    let spirv = out.join(&file);
    let mut command = Command::new(&tools.glslang);
    command.args(["-V", "--target-env", TARGET, "-o"]).arg(&spirv);
    // The tool wants -I and its folder in one argument.
    command.arg(glued("-I", Path::new(&folder_name(root))));
    if !job.picks.is_empty() {
        command.arg(glued("-I", &variant_folder(out, job)));
    }
    if job.naive {
        command.arg("-DNAIVE_FORMS");
    }
    command.arg(in_folder(root, source)).current_dir(folder_above(root));
    let output = command.output().map_err(|error| one(format!("glslangValidator does not start: {error}")))?;
    let (mut errors, found) = messages(&output, &in_folder(root, source), job);
    warnings.extend(found);
    // An error in the GLSL brings others at the link, and in the files that were written for the variant.
    let in_glsl = |problem: &Problem| problem.line > 0 && problem.file.starts_with(&in_folder(root, ""));
    if errors.iter().any(in_glsl) {
        errors.retain(in_glsl);
    }
    if !output.status.success() {
        return Err(if errors.is_empty() {
            one(format!("glslangValidator failed: {}", said(&output)))
        } else {
            errors
        });
    }
    let bytes = fs::read(&spirv).map_err(|error| one(format!("no SPIR-V was written: {error}")))?;
    let words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let checked = Command::new(&tools.spirv_val).args(["--target-env", TARGET]).arg(&spirv).output();
    let checked = checked.map_err(|error| one(format!("spirv-val does not start: {error}")))?;
    if !checked.status.success() {
        return Err(one(format!("its SPIR-V is invalid: {}", said(&checked))));
    }
    Ok(Module { stage, source: source.to_owned(), file, words })
}

/// Writes the files that the per-variant includes of a job find.
///
/// # Errors
/// If a file cannot be written.
pub fn write_variant(out: &Path, job: &Job) -> io::Result<()> {
    let folder = variant_folder(out, job);
    fs::create_dir_all(&folder)?;
    for pick in &job.picks {
        // Each file of a folder of choices is included as it is, so that errors name that file.
        let text = format!(
            "// {} in this variant.\n#extension GL_GOOGLE_include_directive : require\n#include \"{}\"\n",
            pick.include, pick.path
        );
        fs::write(folder.join(pick.include), text)?;
    }
    Ok(())
}

fn variant_folder(out: &Path, job: &Job) -> PathBuf {
    out.join("variants").join(job.variant())
}

/// A path relative to the shaders' folder as one relative to the folder above, as people write it.
pub fn in_folder(root: &Path, path: &str) -> String {
    format!("{}/{path}", folder_name(root))
}

fn folder_name(root: &Path) -> String {
    root.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn folder_above(root: &Path) -> &Path {
    root.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn glued(option: &str, path: &Path) -> OsString {
    let mut argument = OsString::from(option);
    argument.push(path);
    argument
}

/// What a program said, as one line.
fn said(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text);
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

/// The errors and warnings that glslangValidator wrote: to stdout, as `ERROR: file:line: message`.
fn messages(output: &Output, source: &str, job: &Job) -> (Vec<Problem>, Vec<Problem>) {
    let (mut errors, mut warnings) = (Vec::new(), Vec::new());
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    for line in String::from_utf8_lossy(&text).lines() {
        let (list, said) = match (line.strip_prefix("ERROR: "), line.strip_prefix("WARNING: ")) {
            (Some(said), _) => (&mut errors, said),
            (_, Some(said)) => (&mut warnings, said),
            _ => continue,
        };
        // The sums at the end of the list.
        if said.contains("compilation terminated") || said.contains("No code generated") {
            continue;
        }
        let mut problem = located(said).unwrap_or_else(|| Problem::in_file(source, said.trim()));
        if !job.picks.is_empty() {
            problem.message = format!("{} ({} with {})", problem.message, job.name, job.variant());
        } else if problem.file != source {
            problem.message = format!("{} (included by {source})", problem.message);
        }
        list.push(problem);
    }
    (errors, warnings)
}

/// Splits `file:line: message`.
fn located(said: &str) -> Option<Problem> {
    let (place, message) = said.split_once(": ")?;
    let (file, line) = place.rsplit_once(':')?;
    // glslang names the token at fault even where it knows none.
    let message = message.trim().trim_start_matches("'' : ").trim();
    Some(Problem::at(file, line.parse().ok()?, message))
}
