//! What one compiled stage declares: bindings, push constants, group size, outputs.

use super::layout::{self, Struct, Structs};
use super::spirv::{Module, Type, Variable, decoration, storage};

/// The kinds of `mica_graph::Stage`, by the extension of their files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// `.comp`
    Compute,
    /// `.vert`
    Vertex,
    /// `.frag`
    Fragment,
}

/// The kinds of `mica_graph::BindingKind`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A separate texture.
    SampledImage,
    /// An image.
    StorageImage,
    /// A `buffer` block.
    StorageBuffer,
    /// A `uniform` block.
    UniformBuffer,
    /// What ray queries are asked of.
    AccelerationStructure,
    /// A sampler, with its name in `mica_graph::Sampler`.
    Sampler(&'static str),
}

/// The kinds of `mica_graph::Access` that a binding can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Textures, and samplers.
    Sampled,
    /// Uniform blocks.
    Uniform,
    /// `readonly`.
    StorageRead,
    /// `writeonly`.
    StorageWrite,
    /// Neither.
    StorageReadWrite,
    /// Acceleration structures.
    Traverse,
}

impl Access {
    /// Whether the shader may write.
    pub fn writes(self) -> bool {
        matches!(self, Self::StorageWrite | Self::StorageReadWrite)
    }
}

/// One binding of set 0.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Name of the variable, or of the block in snake case where it has no instance name.
    pub name: String,
    /// What the text calls it: the variable, or the block where it has no instance name.
    pub declared: String,
    /// The number in `layout(binding = N)`.
    pub slot: u32,
    /// What it holds.
    pub kind: Kind,
    /// What the shader does with it.
    pub access: Access,
    /// The block, of buffers.
    pub block: Option<Struct>,
}

impl Binding {
    /// Whether two stages mean the same by their bindings of one slot.
    pub fn agrees_with(&self, other: &Self) -> bool {
        let same_block = match (&self.block, &other.block) {
            (Some(block), Some(other)) => block.agrees_with(other),
            (None, None) => true,
            _ => false,
        };
        (&self.name, self.kind, self.access) == (&other.name, other.kind, other.access) && same_block
    }
}

/// What passes from the vertex to the fragment stage at one location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Varying {
    /// Name of the variable.
    pub name: String,
    /// The number in `layout(location = N)`.
    pub location: u32,
    /// The type, comparable between modules.
    pub ty: String,
}

/// What a stage declares.
#[derive(Debug, Default)]
pub struct Reflection {
    /// Bindings by slot.
    pub bindings: Vec<Binding>,
    /// The push-constant block.
    pub params: Option<Struct>,
    /// Invocations in a group, of compute stages.
    pub group: [u32; 3],
    /// Inputs by location.
    pub inputs: Vec<Varying>,
    /// Outputs by location.
    pub outputs: Vec<Varying>,
    /// The structs that its blocks hold.
    pub structs: Structs,
    /// Names of the bindings that are declared and not used; they need not be bound.
    pub unused: Vec<String>,
    /// The effects that its code asks about: name and number of each specialisation constant.
    pub effects: Vec<(String, u32)>,
}

/// Something that Mica's shaders may not do, with the name in the GLSL it is about (empty: the whole file).
#[derive(Debug)]
pub struct Complaint {
    /// The name.
    pub about: String,
    /// The message.
    pub message: String,
}

impl Complaint {
    /// A complaint about a declared name.
    pub fn new(about: &str, message: impl Into<String>) -> Self {
        Self { about: about.to_owned(), message: message.into() }
    }
}

/// Bytes of push constants that every Vulkan device has.
const MOST_PARAMS_BYTES: u32 = 128;

/// Reads what the stage in the file `origin` declares.
///
/// # Errors
/// Everything that is wrong with it, at least one complaint.
pub fn reflect(module: &Module, stage: Stage, origin: &str) -> Result<Reflection, Vec<Complaint>> {
    let mut reflection = Reflection { group: [1; 3], ..Reflection::default() };
    let mut complaints = Vec::new();
    for variable in &module.variables {
        if let Err(complaint) = reflection.add(module, variable, origin) {
            complaints.push(complaint);
        }
    }
    reflection.bindings.sort_by_key(|binding| binding.slot);
    reflection.inputs.sort_by_key(|input| input.location);
    reflection.outputs.sort_by_key(|output| output.location);
    for pair in reflection.bindings.windows(2) {
        if pair[0].slot == pair[1].slot {
            let (first, second, slot) = (&pair[0].name, &pair[1].name, pair[0].slot);
            complaints.push(Complaint::new(
                &pair[1].declared,
                format!("`{second}` and `{first}` both have binding = {slot}"),
            ));
        }
    }
    for found in reflection.all_structs() {
        let name = &found.name;
        if !name.starts_with(|c: char| c.is_ascii_uppercase()) || name.contains('_') {
            complaints.push(Complaint::new(name, format!("`{name}` becomes a Rust type: write it in camel case")));
        }
    }
    for (id, number, default) in module.specializations() {
        let name = module.name(id);
        if default != Some(true) || number >= u32::BITS {
            let message =
                format!("`{name}` is no effect: specialisation constants are bools that are true, numbered below 32");
            complaints.push(Complaint::new(name, message));
        }
        reflection.effects.push((name.to_owned(), number));
    }
    match stage {
        Stage::Compute => reflection.group = module.local_size.unwrap_or([1; 3]),
        Stage::Vertex => {
            for input in &reflection.inputs {
                let message = format!("`{}` is a vertex attribute: pull vertices from a readonly buffer", input.name);
                complaints.push(Complaint::new(&input.name, message));
            }
        }
        Stage::Fragment => {
            for (expected, output) in (0..).zip(&reflection.outputs) {
                if output.location != expected {
                    let message = format!("`{}` should have location = {expected}: no gaps", output.name);
                    complaints.push(Complaint::new(&output.name, message));
                }
            }
        }
    }
    if complaints.is_empty() { Ok(reflection) } else { Err(complaints) }
}

impl Reflection {
    /// The structs that the host needs: those in blocks, and blocks that are more than one array without end.
    pub fn all_structs(&self) -> Vec<Struct> {
        let blocks = self.bindings.iter().filter_map(|binding| binding.block.clone());
        self.structs.values().cloned().chain(blocks.filter(|block| !block.members.is_empty())).collect()
    }

    fn add(&mut self, module: &Module, variable: &Variable, origin: &str) -> Result<(), Complaint> {
        let Some((ty, pointee)) = module.pointee(variable) else { return Ok(()) };
        let block_name = module.name(ty);
        let name = match module.name(variable.id) {
            "" => snake_case(block_name),
            name => name.to_owned(),
        };
        let about = if module.name(variable.id).is_empty() { block_name.to_owned() } else { name.clone() };
        let complain = |message: String| Complaint::new(&about, message);
        match variable.storage {
            storage::UNIFORM_CONSTANT | storage::UNIFORM | storage::STORAGE_BUFFER if !module.is_used(variable) => {
                self.unused.push(about.to_owned());
            }
            storage::UNIFORM_CONSTANT => {
                let (kind, access) = opaque(module, variable, &name, pointee).map_err(complain)?;
                let slot = slot(module, variable, &name).map_err(complain)?;
                self.bindings.push(Binding { name, declared: about.to_owned(), slot, kind, access, block: None });
            }
            storage::UNIFORM | storage::STORAGE_BUFFER => {
                let Type::Struct { members } = pointee else {
                    return Err(complain(format!("`{name}` is an array of descriptors: declare one block")));
                };
                let slot = slot(module, variable, &name).map_err(complain)?;
                let block = layout::read_struct(module, ty, origin, &mut self.structs).map_err(complain)?;
                let (kind, access) = if variable.storage == storage::UNIFORM {
                    (Kind::UniformBuffer, Access::Uniform)
                } else {
                    (Kind::StorageBuffer, block_access(module, variable, ty, members.len()))
                };
                self.bindings.push(Binding {
                    name,
                    declared: about.to_owned(),
                    slot,
                    kind,
                    access,
                    block: Some(block),
                });
            }
            storage::PUSH_CONSTANT => {
                let block = layout::read_struct(module, ty, origin, &mut self.structs).map_err(complain)?;
                if block.bytes > MOST_PARAMS_BYTES {
                    let message = format!(
                        "push constants take {} bytes, and devices promise only {MOST_PARAMS_BYTES}: use a uniform block",
                        block.bytes
                    );
                    return Err(complain(message));
                }
                self.params = Some(block);
            }
            storage::INPUT | storage::OUTPUT => {
                if let Some(location) = module.decoration(variable.id, decoration::LOCATION) {
                    let varying = Varying { name, location, ty: describe(module, ty) };
                    if variable.storage == storage::INPUT { &mut self.inputs } else { &mut self.outputs }.push(varying);
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// The slot of a variable in set 0.
fn slot(module: &Module, variable: &Variable, name: &str) -> Result<u32, String> {
    match module.decoration(variable.id, decoration::DESCRIPTOR_SET) {
        None | Some(0) => {}
        Some(set) => return Err(format!("`{name}` is in set {set}: Mica's shaders have set 0 only")),
    }
    module.decoration(variable.id, decoration::BINDING).ok_or_else(|| format!("`{name}` has no layout(binding = N)"))
}

/// Kind and access of a texture, an image or a sampler.
fn opaque(module: &Module, variable: &Variable, name: &str, ty: &Type) -> Result<(Kind, Access), String> {
    const DIM_2D: u32 = 1;
    const DIM_3D: u32 = 2;
    match ty {
        Type::Image { dimension, multisampled, .. } if !matches!(*dimension, DIM_2D | DIM_3D) || *multisampled => Err(
            format!("`{name}`: Mica has images of two and three dimensions and arrays of flat ones, one sample each"),
        ),
        Type::Image { sampled: 1, .. } => Ok((Kind::SampledImage, Access::Sampled)),
        Type::Image { .. } => {
            let has = |decoration| module.decoration(variable.id, decoration).is_some();
            Ok((Kind::StorageImage, access(has(decoration::NON_WRITABLE), has(decoration::NON_READABLE))))
        }
        Type::Sampler => match name {
            "nearest" => Ok((Kind::Sampler("Nearest"), Access::Sampled)),
            "linear" => Ok((Kind::Sampler("Linear"), Access::Sampled)),
            "linear_wrap_u" => Ok((Kind::Sampler("LinearWrapU"), Access::Sampled)),
            _ => Err(format!("no sampler is called `{name}`: there are nearest, linear and linear_wrap_u")),
        },
        Type::SampledImage => Err(format!(
            "`{name}` is a texture and a sampler in one: declare a texture2D and one of the samplers nearest, linear and \
             linear_wrap_u"
        )),
        Type::Array { .. } | Type::RuntimeArray { .. } => {
            Err(format!("`{name}` is an array of descriptors: declare one, or an array texture"))
        }
        Type::AccelerationStructure => Ok((Kind::AccelerationStructure, Access::Traverse)),
        _ => Err(format!("`{name}` is of a kind that Bind cannot hold")),
    }
}

/// Access of a storage block. Compilers decorate the variable, or every member.
fn block_access(module: &Module, variable: &Variable, block: u32, members: usize) -> Access {
    let all = |decoration| {
        module.decoration(variable.id, decoration).is_some()
            || (0..).take(members).all(|member: u32| module.member_decoration(block, member, decoration).is_some())
    };
    access(all(decoration::NON_WRITABLE), all(decoration::NON_READABLE))
}

fn access(non_writable: bool, non_readable: bool) -> Access {
    match (non_writable, non_readable) {
        (true, _) => Access::StorageRead,
        (false, true) => Access::StorageWrite,
        (false, false) => Access::StorageReadWrite,
    }
}

/// A type in words that are equal for equal types of two modules.
fn describe(module: &Module, id: u32) -> String {
    match module.types.get(&id) {
        Some(Type::Float { bits }) => format!("float{bits}"),
        Some(Type::Int { bits, signed }) => format!("{}{bits}", if *signed { "int" } else { "uint" }),
        Some(Type::Vector { component, count }) => format!("{} x {count}", describe(module, *component)),
        Some(Type::Matrix { column, count }) => format!("({}) x {count}", describe(module, *column)),
        Some(Type::Array { element, length }) => {
            format!("{}[{}]", describe(module, *element), module.constants.get(length).copied().unwrap_or(0))
        }
        Some(Type::Struct { members }) => {
            members.iter().map(|&member| describe(module, member)).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    }
}

/// `EnvironmentMap` and `environmentMap` as `environment_map`.
pub fn snake_case(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let mut snake = String::new();
    for (i, letter) in letters.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| letters[i]);
        let after_lower = before.is_some_and(|c| c.is_ascii_lowercase());
        // The last capital of several begins the next word: `BVHNodes`.
        let ends_capitals =
            before.is_some_and(|c| c != '_') && letters.get(i + 1).is_some_and(char::is_ascii_lowercase);
        if letter.is_ascii_uppercase() && (after_lower || ends_capitals) {
            snake.push('_');
        }
        snake.push(letter.to_ascii_lowercase());
    }
    snake
}
