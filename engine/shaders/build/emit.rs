//! The Rust that is derived from the shaders, as text.

use super::glsl::{Constant, Effect, Value};
use super::layout::{Struct, Structs};
use super::merge::{Bound, Interface};
use super::reflect::{Access, Kind, Stage, snake_case};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

/// Comments of the GLSL by declared name, and by block and member.
#[derive(Debug, Default)]
pub struct Docs {
    /// Of variables, blocks and structs.
    pub names: HashMap<String, String>,
    /// Of members.
    pub members: HashMap<(String, String), String>,
}

impl Docs {
    fn name(&self, name: &str) -> Option<&str> {
        self.names.get(name).map(String::as_str).filter(|doc| !doc.is_empty())
    }

    fn member(&self, block: &str, member: &str) -> Option<&str> {
        let key = (block.to_owned(), member.to_owned());
        self.members.get(&key).map(String::as_str).filter(|doc| !doc.is_empty())
    }
}

/// One shader in one variant, ready to be written.
#[derive(Debug)]
pub struct Unit {
    /// File stem.
    pub name: String,
    /// `method=wang2020`; empty without variants.
    pub variant: String,
    /// Name of the variant's module; empty without variants.
    pub module: String,
    /// The head comment of the shader's file.
    pub heading: String,
    /// The head comments of the files that make the variant.
    pub variant_heading: String,
    /// Its stages: which, the SPIR-V's file below the output folder, and its length in words.
    pub stages: Vec<(Stage, String, usize)>,
    /// What it declares.
    pub interface: Interface,
    /// Its comments.
    pub docs: Docs,
}

/// Writes the module tree: one module for each shader, `types`, `constants`, `effects` and `ALL`.
pub fn emit(
    units: &[Unit],
    structs: &Structs,
    struct_docs: &Docs,
    constants: &[(String, Constant)],
    effects: &[Effect],
) -> String {
    let mut rust = String::new();
    let mut by_name: BTreeMap<&str, Vec<&Unit>> = BTreeMap::new();
    for unit in units {
        by_name.entry(&unit.name).or_default().push(unit);
    }
    for (name, units) in &by_name {
        doc(&mut rust, &[first_or(&units[0].heading, &format!("`{name}`."))]);
        line(&mut rust, &format!("pub mod {} {{", field(name)));
        for unit in units {
            if unit.module.is_empty() {
                emit_unit(&mut rust, unit, structs, "super::types::");
            } else {
                let variant = format!("Variant `{}`.", unit.variant);
                doc(&mut rust, &[&variant, &unit.variant_heading]);
                line(&mut rust, &format!("pub mod {} {{", unit.module));
                emit_unit(&mut rust, unit, structs, "super::super::types::");
                line(&mut rust, "}");
            }
        }
        line(&mut rust, "}");
    }
    emit_types(&mut rust, structs, struct_docs);
    emit_constants(&mut rust, constants);
    emit_effects(&mut rust, effects);
    doc(&mut rust, &["Every shader in every variant."]);
    let all = units.iter().map(|unit| match unit.module.as_str() {
        "" => format!("&{}::SHADER", field(&unit.name)),
        module => format!("&{}::{module}::SHADER", field(&unit.name)),
    });
    let all = all.collect::<Vec<_>>().join(", ");
    line(&mut rust, &format!("pub static ALL: &[&::mica_graph::Shader] = &[{all}];"));
    rust
}

fn emit_unit(rust: &mut String, unit: &Unit, structs: &Structs, types: &str) {
    emit_shader(rust, unit);
    emit_bind(rust, unit);
    match &unit.interface.params {
        Some(params) => emit_params(rust, unit, params, types),
        None => {
            doc(rust, &["It has no push constants."]);
            line(rust, "pub type Params = ();");
        }
    }
    emit_bind_trait(rust, unit, structs);
}

fn emit_shader(rust: &mut String, unit: &Unit) {
    let interface = &unit.interface;
    for (stage, file, words) in &unit.stages {
        let name = static_name(*stage);
        line(rust, &format!("static {name}: [u32; {words}] = ::bytemuck::must_cast(*include_bytes!({file:?}));"));
    }
    doc(rust, &["The compiled shader."]);
    line(rust, "pub static SHADER: ::mica_graph::Shader = ::mica_graph::Shader {");
    line(rust, &format!("name: {:?}, variant: {:?},", unit.name, unit.variant));
    line(rust, "stages: &[");
    for (stage, _, _) in &unit.stages {
        let code = format!("stage: ::mica_graph::Stage::{stage:?}, spirv: &{}", static_name(*stage));
        line(rust, &format!("::mica_graph::StageCode {{ {code} }},"));
    }
    line(rust, &format!("], group: {:?}, bindings: &[", interface.group));
    for Bound { binding, stages } in &interface.bindings {
        let kind = match binding.kind {
            Kind::Sampler(sampler) => format!("Sampler(::mica_graph::Sampler::{sampler})"),
            kind => format!("{kind:?}"),
        };
        line(
            rust,
            &format!(
                "::mica_graph::Binding {{ name: {:?}, slot: {}, kind: ::mica_graph::BindingKind::{kind}, \
                 access: ::mica_graph::Access::{:?}, stages: {} }},",
                binding.name,
                binding.slot,
                binding.access,
                stages_of(stages)
            ),
        );
    }
    let bytes = interface.params.as_ref().map_or(0, |params| params.bytes);
    let outputs: Vec<&str> = interface.outputs.iter().map(|output| output.name.as_str()).collect();
    line(rust, &format!("], params_bytes: {bytes}, outputs: &{outputs:?},"));
    line(rust, &format!("effects: {} }};", effects_of(interface.effects)));
}

fn emit_bind(rust: &mut String, unit: &Unit) {
    let fields = resources(unit);
    let lifetime = if fields.is_empty() { "" } else { "<'a>" };
    doc(rust, &["What it works on: `&` is read, `&mut` is written."]);
    line(rust, "#[derive(Debug)]");
    line(rust, &format!("pub struct Bind{lifetime} {{"));
    for resource in &fields {
        doc(rust, &[&resource.comment, &resource.place]);
        let reference = if resource.writes { "&'a mut" } else { "&'a" };
        line(rust, &format!("pub {}: {reference} ::mica_graph::{},", resource.field, resource.handle));
    }
    line(rust, "}");
}

fn emit_params(rust: &mut String, unit: &Unit, params: &Struct, types: &str) {
    doc(rust, &["Its push constants."]);
    line(rust, "#[derive(Clone, Copy, Debug, PartialEq)]");
    line(rust, "pub struct Params {");
    for member in &params.members {
        let place = format!("At byte {} of the push constants.", member.offset);
        doc(rust, &[unit.docs.member(&params.name, &member.name).unwrap_or_default(), &place]);
        line(rust, &format!("pub {}: {},", field(&member.name), member.host.rust(types)));
    }
    line(rust, "}");
}

fn emit_bind_trait(rust: &mut String, unit: &Unit, structs: &Structs) {
    let fields = resources(unit);
    let lifetime = if fields.is_empty() { "" } else { "<'_>" };
    line(rust, &format!("impl ::mica_graph::Bind for Bind{lifetime} {{"));
    line(rust, "const SHADER: &'static ::mica_graph::Shader = &SHADER;");
    line(rust, "type Params = Params;");
    let visit = if fields.is_empty() { "_visit" } else { "visit" };
    line(
        rust,
        &format!(
            "fn visit(&self, {visit}: &mut dyn FnMut(&::std::sync::Arc<::mica_graph::Resource>, ::mica_graph::Slot, \
             ::mica_graph::Access, ::mica_graph::Stages)) {{"
        ),
    );
    for resource in &fields {
        let Resource { field, slot, access, stages, .. } = resource;
        let slot = format!("::mica_graph::Slot::{slot}");
        let access = format!("::mica_graph::Access::{access}");
        line(rust, &format!("visit(self.{field}.resource(), {slot}, {access}, {stages});"));
    }
    line(rust, "}");
    let Some(params) = &unit.interface.params else {
        line(rust, "fn params_bytes((): &()) -> Vec<u8> { Vec::new() } }");
        return;
    };
    line(rust, "fn params_bytes(params: &Params) -> Vec<u8> {");
    line(rust, &format!("let mut bytes = vec![0; {}];", params.bytes));
    for member in &params.members {
        let (from, to) = (member.offset, member.offset + member.host.bytes(structs));
        let source = format!("::bytemuck::bytes_of(&params.{})", field(&member.name));
        line(rust, &format!("bytes[{from}..{to}].copy_from_slice({source});"));
    }
    line(rust, "bytes } }");
}

/// One field of `Bind`.
struct Resource {
    field: String,
    /// `Image`, `Buffer` or `Structure`.
    handle: &'static str,
    writes: bool,
    slot: String,
    access: String,
    stages: String,
    comment: String,
    place: String,
}

/// The fields of `Bind`: bindings but samplers by slot, then colour attachments by location, then depth.
fn resources(unit: &Unit) -> Vec<Resource> {
    let comment = |name: &str| unit.docs.name(name).unwrap_or_default().to_owned();
    let mut resources = Vec::new();
    for Bound { binding, stages } in &unit.interface.bindings {
        let (handle, kind) = match binding.kind {
            Kind::Sampler(_) => continue,
            Kind::SampledImage => ("Image", "a texture".to_owned()),
            Kind::StorageImage => ("Image", "an image".to_owned()),
            Kind::AccelerationStructure => ("Structure", "an acceleration structure".to_owned()),
            Kind::UniformBuffer => ("Buffer", buffer_content("a uniform buffer", binding.block.as_ref())),
            Kind::StorageBuffer => ("Buffer", buffer_content("a buffer", binding.block.as_ref())),
        };
        let verb = match binding.access {
            Access::Sampled | Access::Uniform | Access::StorageRead => "read",
            Access::Traverse => "traversed",
            Access::StorageWrite => "written",
            Access::StorageReadWrite => "read and written",
        };
        resources.push(Resource {
            field: field(&binding.name),
            handle,
            writes: binding.access.writes(),
            slot: format!("Binding({})", binding.slot),
            access: format!("{:?}", binding.access),
            stages: stages_of(stages),
            comment: comment(&binding.declared),
            place: format!("Binding {}: {kind}, {verb}.", binding.slot),
        });
    }
    for output in &unit.interface.outputs {
        resources.push(Resource {
            field: field(&output.name),
            handle: "Image",
            writes: true,
            slot: format!("Color({})", output.location),
            access: "ColorWrite".to_owned(),
            stages: "::mica_graph::Stages::COLOR_OUTPUT".to_owned(),
            comment: comment(&output.name),
            place: format!("Colour attachment {}, cleared and written.", output.location),
        });
    }
    if unit.interface.raster {
        resources.push(Resource {
            field: "depth".to_owned(),
            handle: "Image",
            writes: true,
            slot: "Depth".to_owned(),
            access: "DepthWrite".to_owned(),
            stages: "::mica_graph::Stages::DEPTH_TEST".to_owned(),
            comment: String::new(),
            place: "Depth attachment, cleared, tested and written.".to_owned(),
        });
    }
    resources
}

/// What a buffer holds, for its documentation.
fn buffer_content(kind: &str, block: Option<&Struct>) -> String {
    let Some(block) = block else { return kind.to_owned() };
    match &block.tail {
        Some(tail) if block.members.is_empty() => {
            format!("{kind} of `{}`, one every {} bytes", tail.element.rust(""), tail.stride)
        }
        _ => format!("{kind} with a `{}`", block.name),
    }
}

fn emit_types(rust: &mut String, structs: &Structs, docs: &Docs) {
    doc(rust, &["Structs and blocks of the shaders, laid out as there, to fill buffers with."]);
    line(rust, "pub mod types {");
    for found in structs.values() {
        emit_struct(rust, found, structs, docs);
    }
    line(rust, "}");
}

fn emit_struct(rust: &mut String, found: &Struct, structs: &Structs, docs: &Docs) {
    let name = &found.name;
    let size = match &found.tail {
        Some(tail) => {
            let (array, element) = (&tail.name, tail.element.rust(""));
            format!(
                "The {} bytes before the array `{array}` of `{element}`, one every {} bytes.",
                found.bytes, tail.stride
            )
        }
        None => format!("{} bytes.", found.bytes),
    };
    doc(rust, &[docs.name(name).unwrap_or_default(), &size]);
    line(rust, "#[repr(C)]");
    line(rust, "#[derive(Clone, Copy, Debug, PartialEq, ::bytemuck::Pod, ::bytemuck::Zeroable)]");
    line(rust, &format!("pub struct {name} {{"));
    let mut end = 0;
    let mut gaps = 0;
    let mut gap = |rust: &mut String, from: u32, to: u32| {
        if to > from {
            doc(rust, &["Padding."]);
            line(rust, &format!("#[doc(hidden)] pub _padding{gaps}: [u32; {}],", (to - from) / 4));
            gaps += 1;
        }
    };
    for member in &found.members {
        gap(rust, end, member.offset);
        let place = format!("At byte {}.", member.offset);
        doc(rust, &[docs.member(name, &member.name).unwrap_or_default(), &place]);
        line(rust, &format!("pub {}: {},", field(&member.name), member.host.rust("")));
        end = member.offset + member.host.bytes(structs);
    }
    gap(rust, end, found.bytes);
    line(rust, "}");
    line(rust, &format!("impl Default for {name} {{ fn default() -> Self {{ ::bytemuck::Zeroable::zeroed() }} }}"));
    line(rust, "const _: () = {");
    line(rust, &format!("assert!(::core::mem::size_of::<{name}>() == {});", found.bytes));
    for member in &found.members {
        let offset = format!("::core::mem::offset_of!({name}, {})", field(&member.name));
        line(rust, &format!("assert!({offset} == {});", member.offset));
    }
    line(rust, "};");
}

fn emit_constants(rust: &mut String, constants: &[(String, Constant)]) {
    doc(rust, &["Numbers that shaders and host share, from `shared/`."]);
    line(
        rust,
        "#[allow(clippy::approx_constant, clippy::excessive_precision, reason = \"the numbers are the shaders'\")]",
    );
    line(rust, "pub mod constants {");
    for (file, constant) in constants {
        let (ty, value) = match constant.value {
            Value::Uint(value) => ("u32", value.to_string()),
            Value::Int(value) => ("i32", value.to_string()),
            Value::Float(value) if value.is_finite() => ("f32", format!("{value:?}")),
            Value::Float(value) => ("f32", if value > 0.0 { "f32::INFINITY" } else { "f32::NEG_INFINITY" }.to_owned()),
        };
        let origin = format!("From `{file}`.");
        doc(rust, &[&constant.declaration.doc, &origin]);
        line(rust, &format!("pub const {}: {ty} = {value};", constant.name));
    }
    line(rust, "}");
}

fn emit_effects(rust: &mut String, effects: &[Effect]) {
    doc(rust, &["What a frame may call for: the specialisation constants of `shared/effects.glsl`."]);
    line(rust, "pub mod effects {");
    for Effect { name, number, declaration } in effects {
        doc(rust, &[&declaration.doc]);
        line(rust, &format!("pub const {name}: ::mica_graph::Effects = ::mica_graph::Effects::one({number});"));
    }
    doc(rust, &["Each with its name."]);
    let all = effects.iter().map(|effect| format!("({0:?}, {0})", effect.name)).collect::<Vec<_>>().join(", ");
    line(rust, &format!("pub const ALL: &[(&str, ::mica_graph::Effects)] = &[{all}];"));
    line(rust, "}");
}

/// A set of effects as Rust.
fn effects_of(bits: u32) -> String {
    let ones = (0..u32::BITS).filter(|number| bits >> number & 1 == 1);
    let ones = ones.map(|number| format!("::mica_graph::Effects::one({number})"));
    ones.reduce(|all, next| format!("{all}.union({next})")).unwrap_or_else(|| "::mica_graph::Effects::NONE".to_owned())
}

fn static_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Compute => "COMPUTE",
        Stage::Vertex => "VERTEX",
        Stage::Fragment => "FRAGMENT",
    }
}

fn stages_of(stages: &[Stage]) -> String {
    let names = stages.iter().map(|stage| format!("::mica_graph::Stages::{}", static_name(*stage)));
    names.reduce(|all, next| format!("{all}.union({next})")).unwrap_or_else(|| "::mica_graph::Stages::NONE".to_owned())
}

fn line(rust: &mut String, text: &str) {
    rust.push_str(text);
    rust.push('\n');
}

fn first_or<'a>(text: &'a str, fallback: &'a str) -> &'a str {
    if text.is_empty() { fallback } else { text }
}

/// Writes a doc comment of several paragraphs, leaving out empty ones.
fn doc(rust: &mut String, paragraphs: &[&str]) {
    let paragraphs = paragraphs.iter().filter(|text| !text.is_empty()).map(|text| markdown(text));
    let text = paragraphs.collect::<Vec<_>>().join("\n\n");
    for text in text.lines() {
        let text = if text.is_empty() { String::new() } else { format!(" {text}") };
        // A String takes whatever is written.
        let _ = writeln!(rust, "#[doc = {text:?}]");
    }
}

/// Plain text as Markdown that shows it: brackets outside of back-quotes are escaped, addresses become links.
fn markdown(text: &str) -> String {
    let mut shown = String::new();
    for (i, part) in text.split('`').enumerate() {
        if i > 0 {
            shown.push('`');
        }
        if i % 2 == 1 {
            shown.push_str(part);
            continue;
        }
        for word in part.split_inclusive(char::is_whitespace) {
            if word.starts_with("https://") || word.starts_with("http://") {
                let address = word.trim_end().trim_end_matches(['.', ',', ';']);
                let _ = write!(shown, "<{address}>{}", &word[address.len()..]);
            } else {
                for c in word.chars() {
                    if matches!(c, '[' | ']' | '<' | '>' | '*') {
                        shown.push('\\');
                    }
                    shown.push(c);
                }
            }
        }
    }
    shown
}

const KEYWORDS: [&str; 42] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "do", "dyn", "else", "enum",
    "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod", "move",
    "mut", "override", "priv", "pub", "ref", "return", "static", "struct", "trait", "true", "try", "type", "typeof",
    "unsafe",
];

/// Whether a name cannot be a Rust module.
pub fn is_keyword(name: &str) -> bool {
    KEYWORDS.contains(&name)
        || ["unsized", "use", "virtual", "where", "while", "yield", "self", "super", "crate"].contains(&name)
}

/// A GLSL name as a Rust field or module.
fn field(name: &str) -> String {
    let snake = snake_case(name);
    match snake.as_str() {
        "self" | "super" | "crate" => format!("{snake}_"),
        keyword if is_keyword(keyword) => format!("r#{snake}"),
        _ => snake,
    }
}
