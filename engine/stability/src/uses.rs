//! Where the stable forms are at work: what renders with each, or that nothing does yet.

use serde::Serialize;

/// A stable form that cases hold to the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StableForm {
    /// A function of `shaders_glsl/shared`, or in words what is no single function.
    pub name: &'static str,
    /// Methods and then passes, or what part of the host; empty if it is a library that nothing renders with yet.
    pub used_by: &'static str,
}

impl StableForm {
    /// The form of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FUNCTIONS.iter().chain(&OTHERS).find(|form| form.name == name)
    }
}

const fn stable(name: &'static str, used_by: &'static str) -> StableForm {
    StableForm { name, used_by }
}

/// What a function is used by that all methods use.
#[cfg(test)]
const EVERY_METHOD: &str = "every method";

/// Functions of `shaders_glsl/shared`. That each is used by these and no others is tested.
static FUNCTIONS: [StableForm; 48] = [
    stable("ADD_FIXED_POINT", ""),
    stable("angle_between", ""),
    stable(
        "beckmann_d",
        "deliot_belcour, shopf, smooth, wang_bowles, zirr_kaplanyan, environment_specular, moments_lobes, \
         prefilter",
    ),
    stable("beckmann_g1_over_cosine", "every method, prefilter, specular_albedo"),
    stable("binomial", "atanasov, wang2018"),
    stable("blurred", "blur_glints, blur_visibility"),
    stable("cell_of", "shopf, zirr_kaplanyan"),
    stable("chance_of_any", "deliot_belcour"),
    stable("chance_of_first", ""),
    stable("children_of", "atanasov, jakob, wang2018, flake_counts"),
    stable("conic_across", "atanasov, flakes, jakob, wang2018, dpf"),
    stable("count_rays", "occlusion, shadows, trace_rays"),
    stable(
        "equirect_from",
        "atanasov, chermain, deliot_belcour, flakes, jakob, kemppinen, shopf, smooth, wang2018, wang_bowles, \
         zirr_kaplanyan, base, environment_specular, moments_lobes, prefilter",
    ),
    stable(
        "exact_product",
        "atanasov, deliot_belcour, flakes, kemppinen, shopf, wang2018, wang2020, wang_bowles, \
         zirr_kaplanyan",
    ),
    stable("exact_sum", ""),
    stable("flake_is_lit", "flakes"),
    stable("flakes_in_cell", "deliot_belcour"),
    stable("footprint_area", "flakes, shopf, wang2020, wang_bowles, zirr_kaplanyan"),
    stable("footprint_axes", ""),
    stable(
        "frame_about",
        "atanasov, chermain, deliot_belcour, flakes, jakob, kemppinen, wang2018, wang2020, zirr_kaplanyan, \
         environment_specular, moments_lobes, surface",
    ),
    stable("frame_along", "surface"),
    stable("half_vector", "deliot_belcour, jakob, kemppinen, shopf, smooth, wang_bowles, zirr_kaplanyan, base"),
    stable("half_vector_cosine", "every method, base"),
    stable(
        "hash",
        "atanasov, chermain, deliot_belcour, flakes, jakob, kemppinen, shopf, wang2018, wang2020, \
         wang_bowles, zirr_kaplanyan, deliot_belcour_noise, dpf_count, flake_counts",
    ),
    stable("integer_from", ""),
    stable("is_finite", "blur_glints, blur_visibility"),
    stable("jakob_side_of_cone", "jakob"),
    stable("lit_probability", "atanasov, flakes, jakob, wang2018, dpf"),
    stable("log_of_rest", "deliot_belcour, zirr_kaplanyan"),
    stable("offset_origin", "occlusion, shadows, trace_rays"),
    stable("one_minus_exp", "atanasov, deliot_belcour, wang2018, zirr_kaplanyan"),
    stable("packed_halves", "deliot_belcour_noise"),
    stable("quotient", ""),
    stable("rare_unit_from", "atanasov, wang2018, wang2020, zirr_kaplanyan"),
    stable("reflects_into_cone", "atanasov"),
    stable("running_mean", "accumulate"),
    stable("selection_probability", "prefilter_probability"),
    stable("shifted_left", ""),
    stable("shifted_right", ""),
    stable("sine_between", ""),
    stable("slerp", ""),
    stable("sparkle_distance", "wang_bowles"),
    stable("sparkle_shift", "wang_bowles"),
    stable("sparkle_stretch", "wang_bowles"),
    stable("texture_place", "surface"),
    stable("whole_from", ""),
    stable("within_cell", "atanasov, jakob, wang2018, wang2020"),
    stable("words_of", "deliot_belcour, kemppinen"),
];

/// What is no single function: parts of the host, whole passes.
static OTHERS: [StableForm; 10] = [
    stable("derivatives by triangles", "every method, surface"),
    stable("triangles without area", "the loader of scenes"),
    stable("placing about the centre", "the loader of scenes, surface"),
    stable("rays against triangles", "occlusion, shadows, trace_rays"),
    stable("hierarchies of triangles", "the loader of scenes, occlusion, shadows, trace_rays"),
    stable("frames of flakes", "flakes"),
    stable("environments", "the loader of environments"),
    stable("differences of timestamps", "times of passes"),
    stable("budgets of steps", "flakes, jakob, wang2018, trace_rays"),
    stable("sizes of buffers", "the executor"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CASES;
    use std::collections::{BTreeMap, BTreeSet};
    use std::fs;
    use std::path::{Path, PathBuf};

    /// Files of the shaders' folder by path, comments taken out.
    fn sources() -> BTreeMap<String, String> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders_glsl");
        let mut sources = BTreeMap::new();
        let mut folders = vec![root.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder") {
                let path: PathBuf = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let text = fs::read_to_string(&path).expect("text");
                    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
                    let name = path.strip_prefix(&root).expect("below it").to_string_lossy().replace('\\', "/");
                    sources.insert(name, lines.collect::<Vec<_>>().join("\n"));
                }
            }
        }
        sources
    }

    /// What the functions and macros of a text call, by their names.
    fn calls(text: &str) -> Vec<(String, BTreeSet<String>)> {
        let mut found: Vec<(String, BTreeSet<String>)> = Vec::new();
        let mut inside = false;
        for line in text.lines() {
            let begins = line.starts_with("#define ") || line.starts_with(|c: char| c.is_ascii_alphabetic());
            let head = line.split('(').next().unwrap_or_default();
            let mut rest = line;
            if begins && head.len() < line.len() && !head.contains('=') && head.split_whitespace().count() > 1 {
                found.push((head.split_whitespace().last().unwrap_or_default().to_owned(), BTreeSet::new()));
                rest = &line[head.len()..];
                inside = true;
            } else if line.starts_with('}') || begins {
                inside = false;
            }
            if let (true, Some((_, called))) = (inside, found.last_mut()) {
                let names = rest.split('(').map(|before| {
                    before
                        .trim_end()
                        .rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                        .next()
                        .unwrap_or_default()
                });
                called.extend(names.filter(|name| !name.is_empty()).map(str::to_owned));
            }
        }
        found
    }

    /// Everything that a pass calls from its entry on, a method put in where it includes one.
    fn called_by(sources: &BTreeMap<String, String>, pass: &str, method: &str) -> BTreeSet<String> {
        let mut table: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let (mut files, mut next) = (vec![pass.to_owned()], 0);
        while let Some(file) = files.get(next).cloned() {
            next += 1;
            for (name, called) in calls(&sources[&file]) {
                table.entry(name).or_default().extend(called);
            }
            for include in sources[&file].lines().filter_map(|line| line.strip_prefix("#include ")) {
                let include = include.trim().trim_matches('"');
                let beside = format!("{}/{include}", file.rsplit_once('/').map_or("", |(folder, _)| folder));
                let chosen = match include {
                    "method.glsl" => vec![method.to_owned()],
                    "occlusion.glsl" => sources.keys().filter(|path| path.starts_with("occlusion/")).cloned().collect(),
                    _ if sources.contains_key(&beside) => vec![beside],
                    _ => vec![include.to_owned()],
                };
                for file in chosen {
                    if sources.contains_key(&file) && !files.contains(&file) {
                        files.push(file);
                    }
                }
            }
        }
        let (mut reached, mut waiting) = (BTreeSet::new(), vec!["main".to_owned()]);
        while let Some(name) = waiting.pop() {
            if let Some(called) = table.get(&name).filter(|_| reached.insert(name)) {
                waiting.extend(called.iter().cloned());
            }
        }
        reached
    }

    /// Stems of files in a folder; tries and measurements are no use.
    fn stems<'a>(sources: &'a BTreeMap<String, String>, folder: &str) -> Vec<(&'a str, &'a str)> {
        let measuring = |path: &str| path.starts_with("passes/stability/") || path.starts_with("passes/exactness/");
        let paths = sources.keys().filter(|path| path.starts_with(folder) && !measuring(path));
        paths.map(|path| (path.as_str(), path.rsplit('/').next().unwrap_or_default())).collect()
    }

    #[test]
    fn functions_are_used_by_whom_it_says() {
        let sources = sources();
        let methods = stems(&sources, "methods/");
        let mut users: BTreeMap<String, [BTreeSet<String>; 2]> = BTreeMap::new();
        for (pass, file) in stems(&sources, "passes/") {
            let takes_methods = sources[pass].contains("#include \"method.glsl\"");
            let variants = if takes_methods { methods.clone() } else { vec![("", file)] };
            for (method, user) in variants {
                let user = user.split('.').next().unwrap_or_default();
                for function in called_by(&sources, pass, method) {
                    users.entry(function).or_default()[usize::from(!takes_methods)].insert(user.to_owned());
                }
            }
        }
        for form in &FUNCTIONS {
            let [by_methods, by_passes] = users.remove(form.name).unwrap_or_default();
            let all = by_methods.len() == methods.len();
            let by_methods = if all { BTreeSet::from([EVERY_METHOD.to_owned()]) } else { by_methods };
            let by_passes = by_passes.into_iter().collect::<Vec<_>>();
            let derived: Vec<String> = by_methods.into_iter().chain(by_passes).collect();
            assert_eq!(form.used_by, derived.join(", "), "{}", form.name);
            let shared = sources.iter().filter(|(path, _)| path.starts_with("shared/"));
            let defined = shared.flat_map(|(_, text)| calls(text)).any(|(name, _)| name == form.name);
            assert!(defined, "{} is no function of shaders_glsl/shared", form.name);
        }
    }

    #[test]
    fn every_case_names_its_stable_forms_and_every_form_has_a_case() {
        for case in &CASES {
            assert!(!case.stable.is_empty(), "{}", case.id);
            for name in case.stable {
                assert!(StableForm::named(name).is_some(), "{}: {name}", case.id);
            }
        }
        for form in FUNCTIONS.iter().chain(&OTHERS) {
            assert!(CASES.iter().any(|case| case.stable.contains(&form.name)), "{}", form.name);
        }
    }
}
