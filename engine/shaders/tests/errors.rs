//! What the build says of GLSL that it does not accept: each case is a folder written for the test.

#[path = "../build/mod.rs"]
mod build;

use build::compile::Tools;
use build::{Generated, generate};
use std::fs;

/// The head of a compute shader; the next line is the sixth.
const HEAD: &str = "// A test.\n#version 460\n#extension GL_GOOGLE_include_directive : require\n\
                    #extension GL_EXT_samplerless_texture_functions : require\nlayout(local_size_x = 1) in;\n";
const OUT: &str = "layout(binding = 0) writeonly buffer Out { float written[]; };\n";

/// Builds a folder `glsl` with these files.
fn build_with(tools: &Tools, files: &[(&str, &str)]) -> Result<Generated, Vec<String>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = folder.path().join("glsl");
    fs::create_dir_all(root.join("passes")).expect("a folder for passes");
    for (path, text) in files {
        let path = root.join(path);
        fs::create_dir_all(path.parent().expect("files are in the folder")).expect("a folder for the file");
        fs::write(path, text).expect("a file");
    }
    generate(&root, &folder.path().join("out"), tools)
        .map_err(|problems| problems.iter().map(ToString::to_string).collect())
}

fn build(files: &[(&str, &str)]) -> Result<Generated, Vec<String>> {
    build_with(&Tools::from_environment(), files)
}

fn problems(files: &[(&str, &str)]) -> Vec<String> {
    build(files).expect_err("the folder should not build")
}

/// What is wrong with one compute shader of these declarations and this body.
fn problems_of(declarations: &str, body: &str) -> Vec<String> {
    problems(&[("passes/x.comp", &compute(declarations, body))])
}

fn compute(declarations: &str, body: &str) -> String {
    format!("{HEAD}{declarations}\nvoid main() {{ {body} }}\n")
}

fn rust(files: &[(&str, &str)]) -> String {
    build(files).expect("the folder should build").rust
}

#[test]
fn errors_of_all_shaders_are_reported_with_file_and_line() {
    let broken = compute(OUT, "written[0] = nowhere;");
    let found = problems(&[("passes/a.comp", &broken), ("passes/deep/b.comp", &broken), ("passes/c.comp", "bad")]);
    assert_eq!(found[0], "glsl/passes/a.comp:8: 'nowhere' : undeclared identifier");
    assert!(found.iter().any(|line| line == "glsl/passes/deep/b.comp:8: 'nowhere' : undeclared identifier"));
    assert!(found.iter().any(|line| line.starts_with("glsl/passes/c.comp:1: ")));
    assert!(!found.iter().any(|line| line.contains("compilation terminated")));
}

#[test]
fn an_error_in_an_include_names_the_include_and_who_includes_it() {
    let pass = compute("#include \"shared/sums.glsl\"", "");
    let found =
        problems(&[("passes/x.comp", &pass), ("shared/sums.glsl", "// Sums.\n\nfloat sum() { return more; }\n")]);
    let expected = "glsl/shared/sums.glsl:3: 'more' : undeclared identifier (included by glsl/passes/x.comp)";
    assert_eq!(found[0], expected);
}

#[test]
fn an_error_in_one_variant_names_its_file_and_the_variant() {
    let pass = compute(&format!("#include \"method.glsl\"\n{OUT}"), "written[0] = value();");
    let good = ("methods/good.glsl", "float value() { return 1.0; }\n");
    let bad = ("methods/bad.glsl", "float value() { return one; }\n");
    let found = problems(&[("passes/x.comp", &pass), good, bad]);
    assert_eq!(found[0], "glsl/methods/bad.glsl:1: 'one' : undeclared identifier (x with method=bad)");
    assert!(!found.iter().any(|line| line.contains("good")));
}

#[test]
fn a_choice_may_lie_in_a_folder_of_folders() {
    let pass = compute(&format!("#include \"count.glsl\"\n{OUT}"), "written[0] = value();");
    let good = ("rungs/count/good.glsl", "float value() { return 1.0; }\n");
    let other = ("rungs/arithmetic/other.glsl", "float value() { return 1.0; }\n");
    let rust = rust(&[("passes/nested/x.comp", &pass), good, other]);
    assert!(rust.contains("variant: \"count=good\"") && !rust.contains("other"), "{rust}");
}

#[test]
fn a_missing_include_is_an_error_at_its_line() {
    let found = problems_of("#include \"shared/absent.glsl\"", "");
    assert!(found[0].starts_with("glsl/passes/x.comp:6: "), "{found:?}");
    assert!(found[0].contains("shared/absent.glsl"), "{found:?}");
}

#[test]
fn a_sampler_of_another_name_is_refused_with_the_names_there_are() {
    let declarations =
        format!("{OUT}layout(binding = 1) uniform texture2D image;\nlayout(binding = 2) uniform sampler smooth_one;");
    let found = problems_of(&declarations, "written[0] = textureLod(sampler2D(image, smooth_one), vec2(0), 0.0).r;");
    let expected =
        "glsl/passes/x.comp:8: no sampler is called `smooth_one`: there are nearest, linear and linear_wrap_u";
    assert_eq!(found, [expected]);
}

#[test]
fn a_combined_sampler_is_refused_with_what_to_declare() {
    let declarations = format!("{OUT}layout(binding = 1) uniform sampler2D image;");
    let found = problems_of(&declarations, "written[0] = textureLod(image, vec2(0), 0.0).r;");
    assert!(found[0].starts_with("glsl/passes/x.comp:7: `image` is a texture and a sampler in one"), "{found:?}");
}

#[test]
fn bindings_that_share_a_slot_are_refused() {
    let declarations = format!("{OUT}layout(binding = 0) uniform texture2D image;");
    let found = problems_of(&declarations, "written[0] = texelFetch(image, ivec2(0), 0).r;");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].contains("`image`") && found[0].contains("`out`") && found[0].contains("binding = 0"),
        "{found:?}"
    );
}

#[test]
fn push_constants_may_take_128_bytes_and_no_more() {
    let pass = |words: u32| {
        let block = format!("{OUT}layout(push_constant) uniform Push {{ uint words[{words}]; }};");
        compute(&block, "written[0] = float(words[0]);")
    };
    assert!(rust(&[("passes/x.comp", &pass(32))]).contains("params_bytes: 128"));
    let found = problems(&[("passes/x.comp", &pass(33))]);
    assert!(found[0].starts_with("glsl/passes/x.comp:7: push constants take 132 bytes"), "{found:?}");
}

#[test]
fn other_sets_and_arrays_of_descriptors_are_refused() {
    let found = problems_of("layout(set = 1, binding = 0) buffer Out { float written; };", "written = 1.0;");
    assert_eq!(found, ["glsl/passes/x.comp:6: `out` is in set 1: Mica's shaders have set 0 only"]);
    let images = format!("{OUT}layout(binding = 1) uniform texture2D images[4];");
    let found = problems_of(&images, "written[0] = texelFetch(images[1], ivec2(0), 0).r;");
    assert!(found[0].starts_with("glsl/passes/x.comp:7: `images` is an array of descriptors"), "{found:?}");
    let blocks = "layout(binding = 0) buffer Out { float written; } blocks[2];";
    let found = problems_of(blocks, "blocks[0].written = 1.0;");
    assert!(found[0].starts_with("glsl/passes/x.comp:6: `blocks` is an array of descriptors"), "{found:?}");
}

#[test]
fn images_that_the_graph_has_not_are_refused() {
    let cube =
        format!("{OUT}layout(binding = 1) uniform textureCube sky;\nlayout(binding = 2) uniform sampler linear;");
    let found = problems_of(&cube, "written[0] = textureLod(samplerCube(sky, linear), vec3(1), 0.0).r;");
    assert!(
        found[0].starts_with("glsl/passes/x.comp:7: `sky`: Mica has images of two and three dimensions"),
        "{found:?}"
    );
}

#[test]
fn one_name_with_two_layouts_is_refused_naming_both_files() {
    let pass = |members: &str| {
        let structs =
            format!("struct Flake {{ {members} }};\nlayout(binding = 1) readonly buffer Flakes {{ Flake flakes[]; }};");
        compute(&format!("{OUT}{structs}"), "written[0] = flakes[0].radius;")
    };
    let (first, second) = (pass("float radius; vec3 position;"), pass("vec3 position; float radius;"));
    let found = problems(&[("passes/a.comp", &first), ("passes/b.comp", &second)]);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("glsl/passes/a.comp") && found[0].contains("glsl/passes/b.comp"), "{found:?}");
    assert!(found[0].contains("`Flake` has two layouts"), "{found:?}");
    assert!(build(&[("passes/a.comp", &first), ("passes/b.comp", &first)]).is_ok());
}

#[test]
fn one_struct_in_std140_and_in_std430_is_refused() {
    let flake = "struct Flake { float radius; };\n";
    let uniform = "layout(std140, binding = 1) uniform A { Flake a[4]; } few;\n";
    let storage = "layout(std430, binding = 2) readonly buffer B { Flake b[]; } many;\n";
    let found =
        problems_of(&format!("{OUT}{flake}{uniform}{storage}"), "written[0] = few.a[1].radius + many.b[1].radius;");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("4 bytes an element") && found[0].contains(" 16 "), "{found:?}");
}

#[test]
fn a_struct_lengthened_by_an_array_elsewhere_must_still_fit() {
    let flake = "struct Flake { float radius; };\n";
    let uniform = "layout(std140, binding = 1) uniform A { Flake a[4]; } few;\n";
    let storage = "layout(std430, binding = 2) readonly buffer B { Flake one; float behind; } tight;\n";
    let body = "written[0] = few.a[1].radius + tight.one.radius + tight.behind;";
    let found = problems_of(&format!("{OUT}{flake}{uniform}{storage}"), body);
    assert_eq!(found, ["glsl/passes/x.comp: `one` of `B` is longer in an array than here: use std430 in both"]);
}

#[test]
fn types_without_a_counterpart_are_refused() {
    let found = problems_of("layout(binding = 0) buffer Out { double written; };", "written = 1.0lf;");
    assert!(found[0].starts_with("glsl/passes/x.comp:6: `written` of `Out` has a type without"), "{found:?}");
    let found = problems_of("layout(row_major, binding = 0) buffer Out { mat4 written; };", "written = mat4(1);");
    assert!(found[0].starts_with("glsl/passes/x.comp:6: `written` of `Out` is row_major"), "{found:?}");
}

#[test]
fn specialisation_constants_are_refused() {
    let declarations = format!("{OUT}layout(constant_id = 0) const int N = 4;");
    let found = problems_of(&declarations, "written[0] = float(N);");
    assert!(found[0].contains("specialisation constants"), "{found:?}");
}

const VERTEX: &str =
    "#version 460\nlayout(location = 0) out vec2 uv;\nvoid main() { uv = vec2(0); gl_Position = vec4(0); }\n";
const FRAGMENT: &str = "#version 460\nlayout(location = 0) in vec2 uv;\nlayout(location = 0) out vec4 color;\nvoid main() { color = uv.xyxy; }\n";

fn problems_of_pair(vertex: &str, fragment: &str) -> Vec<String> {
    problems(&[("passes/x.vert", vertex), ("passes/x.frag", fragment)])
}

#[test]
fn a_pair_builds_and_one_stage_alone_does_not() {
    assert!(build(&[("passes/x.vert", VERTEX), ("passes/x.frag", FRAGMENT)]).is_ok());
    assert_eq!(problems(&[("passes/x.vert", VERTEX)]), ["glsl/passes/x.vert: there is no x.frag to go with it"]);
    assert_eq!(problems(&[("passes/x.frag", FRAGMENT)]), ["glsl/passes/x.frag: there is no x.vert to go with it"]);
}

#[test]
fn what_the_stages_of_a_pair_disagree_in_is_refused() {
    let unfed = FRAGMENT.replace("location = 0) in", "location = 1) in");
    let expected = "glsl/passes/x.frag:2: the vertex stage writes nothing to location = 1, which `uv` reads";
    assert_eq!(problems_of_pair(VERTEX, &unfed), [expected]);
    let other = FRAGMENT.replace("vec2 uv", "vec3 uv");
    assert!(problems_of_pair(VERTEX, &other)[0].starts_with("glsl/passes/x.frag:2: `uv` is float32 x 3"));

    let view = "layout(push_constant) uniform View { float scale; };\n";
    let vertex = VERTEX.replace("void main", &format!("{view}void main")).replace("vec2(0)", "vec2(scale)");
    let other_view = view.replace("float", "uint");
    let fragment = FRAGMENT.replace("void main", &format!("{other_view}void main")).replace("uv.xyxy", "vec4(scale)");
    let found = problems_of_pair(&vertex, &fragment);
    assert!(found[0].contains("push constants differ between the stages"), "{found:?}");

    let tint = "layout(binding = 0) readonly buffer Tints { float tint[]; };\n";
    let vertex = VERTEX.replace("void main", &format!("{tint}void main")).replace("vec2(0)", "vec2(tint[0])");
    let other_tint = tint.replace("Tints", "Shades");
    let fragment = FRAGMENT.replace("void main", &format!("{other_tint}void main")).replace("uv.xyxy", "vec4(tint[0])");
    let found = problems_of_pair(&vertex, &fragment);
    assert_eq!(found, ["glsl/passes/x.frag:4: `shades` has binding = 0, which the vertex stage declares otherwise"]);
}

#[test]
fn attributes_gaps_in_outputs_and_an_output_called_depth_are_refused() {
    let attribute =
        VERTEX.replace("void main", "layout(location = 0) in vec2 corner;\nvoid main").replace("vec2(0)", "corner");
    let found = problems_of_pair(&attribute, FRAGMENT);
    assert_eq!(found, ["glsl/passes/x.vert:3: `corner` is a vertex attribute: pull vertices from a readonly buffer"]);
    let gap = FRAGMENT.replace("location = 0) out", "location = 1) out");
    assert_eq!(problems_of_pair(VERTEX, &gap), ["glsl/passes/x.frag:3: `color` should have location = 0: no gaps"]);
    let depth = FRAGMENT.replace("color", "depth");
    let found = problems_of_pair(VERTEX, &depth);
    assert!(found[0].starts_with("glsl/passes/x.frag:3: `depth` is the depth attachment"), "{found:?}");
}

#[test]
fn two_fields_of_one_name_are_refused() {
    let declarations = format!("{OUT}layout(binding = 1) uniform texture2D Out_;\n").replace("Out_", "oUT");
    let declarations = declarations.replace("Out {", "OUt {");
    let found = problems_of(&declarations, "written[0] = texelFetch(oUT, ivec2(0), 0).r;");
    assert!(found[0].contains("would be the second field `o_ut` of Bind"), "{found:?}");
}

#[test]
fn names_become_those_of_rust() {
    let snake = ["EnvironmentMap", "environmentMap", "BVHNodes", "lut2D", "Mat4Array", "clip_from_world", "A"];
    let snake = snake.map(build::reflect::snake_case);
    assert_eq!(
        snake,
        ["environment_map", "environment_map", "bvh_nodes", "lut2d", "mat4_array", "clip_from_world", "a"]
    );
    let declarations = "struct my_flake { float radius; };\nlayout(binding = 0) buffer Out { my_flake written[]; };";
    let found = problems_of(declarations, "written[0].radius = 1.0;");
    assert_eq!(found, ["glsl/passes/x.comp:6: `my_flake` becomes a Rust type: write it in camel case"]);
    let found = problems(&[("shared/a.glsl", "// A.\nconst float pi = 3.14;\n")]);
    assert_eq!(found, ["glsl/shared/a.glsl:2: `pi` becomes a Rust constant: write it in capitals"]);
}

#[test]
fn files_in_the_wrong_place_or_with_unsuitable_names_are_refused() {
    let pass = compute(OUT, "written[0] = 1.0;");
    let found = problems(&[("passes/a/x.comp", &pass), ("passes/b/x.comp", &pass)]);
    assert_eq!(found, ["glsl/passes/b/x.comp: is called x as passes/a/x.comp is: file stems are unique in passes/"]);
    let found = problems(&[("passes/x.glsl", "")]);
    assert!(found[0].starts_with("glsl/passes/x.glsl: passes/ holds .comp, .vert and .frag files only"), "{found:?}");
    for name in ["Tone", "1st", "match", "types", "tone-map"] {
        let found = problems(&[(&format!("passes/{name}.comp"), &pass)]);
        assert!(found[0].starts_with(&format!("glsl/passes/{name}.comp: the name becomes a Rust module")), "{found:?}");
    }
    let found = problems(&[("shared/x.glsl", "// A.\n#include \"method.glsl\"\n")]);
    assert_eq!(found, ["glsl/shared/x.glsl:2: only a file in passes/ may include method.glsl"]);
}

#[test]
fn a_pass_without_any_method_to_choose_is_left_out_with_a_warning() {
    let pass = compute("#include \"method.glsl\"", "");
    let generated = build(&[("passes/x.comp", &pass)]).expect("nothing to build is no error");
    assert!(generated.rust.contains("pub static ALL: &[&::mica_graph::Shader] = &[];"));
    let warnings: Vec<String> = generated.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["glsl/passes/x.comp: is not compiled: it is made for each file in methods/, which has none"]);
}

#[test]
fn a_binding_that_its_own_file_declares_and_does_not_use_is_warned_about() {
    let shared = ("shared/more.glsl", "layout(binding = 5) uniform texture2D offered;\n");
    let declarations = format!("{OUT}layout(binding = 1) uniform texture2D forgotten;\n#include \"shared/more.glsl\"");
    let generated =
        build(&[("passes/x.comp", &compute(&declarations, "written[0] = 1.0;")), shared]).expect("it builds");
    let warnings: Vec<String> = generated.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings, ["glsl/passes/x.comp:7: `forgotten` is declared and not used, so it is not in Bind"]);
    assert!(!generated.rust.contains("offered"));
}

#[test]
fn comments_become_documentation_that_rustdoc_shows_as_written() {
    let pass = "// Sums [all] of it.\n// In two lines.\n#version 460\nlayout(local_size_x = 1) in;\n\
                // Above the block.\nlayout(binding = 0) buffer Sums {\n  float total; // In <units>.\n  float kept[];\n} sums;\n\
                layout(push_constant) uniform Push {\n  float scale; // Of `x[i]`.\n};\n\
                void main() { sums.kept[0] = sums.total * scale; }\n";
    let rust = rust(&[("passes/x.comp", pass)]);
    for line in [
        "#[doc = \" Sums \\\\[all\\\\] of it.\"]\n#[doc = \" In two lines.\"]\npub mod x {",
        "#[doc = \" Above the block.\"]",
        "#[doc = \" In \\\\<units\\\\>.\"]",
        "#[doc = \" Of `x[i]`.\"]",
    ] {
        assert!(rust.contains(line), "{line} is not in\n{rust}");
    }
}

#[test]
fn a_constant_of_two_files_is_refused() {
    let text = "// A.\nconst uint N = 1u;\n";
    let found = problems(&[("shared/a.glsl", text), ("shared/b.glsl", text)]);
    assert_eq!(found, ["glsl/shared/b.glsl:2: `N` is also a constant of glsl/shared/a.glsl: keep one of them"]);
}

#[test]
fn a_missing_tool_is_one_line_that_names_its_package() {
    let tools = Tools { glslang: "no-such-compiler".into(), spirv_val: "no-such-validator".into() };
    let found = tools.check().expect_err("there are no tools");
    assert_eq!(
        found.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "no-such-compiler is missing: install the Debian package glslang-tools, or name the program in GLSLANG_VALIDATOR",
            "no-such-validator is missing: install the Debian package spirv-tools, or name the program in SPIRV_VAL",
        ]
    );
}

#[test]
fn code_that_the_validator_rejects_fails_the_build() {
    let tools = Tools { spirv_val: "false".into(), ..Tools::from_environment() };
    let found = build_with(&tools, &[("passes/x.comp", &compute(OUT, "written[0] = 1.0;"))]);
    assert!(found.expect_err("the validator says no")[0].starts_with("glsl/passes/x.comp: its SPIR-V is invalid"));
}
