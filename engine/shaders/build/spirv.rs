//! SPIR-V, read as far as reflection needs: names, decorations, types, constants and global variables.
//!
//! Numbers are those of the SPIR-V specification, unified1.

use std::collections::{HashMap, HashSet};

/// Decorations.
pub mod decoration {
    pub const SPEC_ID: u32 = 1;
    pub const ROW_MAJOR: u32 = 4;
    pub const ARRAY_STRIDE: u32 = 6;
    pub const MATRIX_STRIDE: u32 = 7;
    pub const NON_WRITABLE: u32 = 24;
    pub const NON_READABLE: u32 = 25;
    pub const LOCATION: u32 = 30;
    pub const BINDING: u32 = 33;
    pub const DESCRIPTOR_SET: u32 = 34;
    pub const OFFSET: u32 = 35;
}

/// Storage classes.
pub mod storage {
    pub const UNIFORM_CONSTANT: u32 = 0;
    pub const INPUT: u32 = 1;
    pub const UNIFORM: u32 = 2;
    pub const OUTPUT: u32 = 3;
    pub const PUSH_CONSTANT: u32 = 9;
    pub const STORAGE_BUFFER: u32 = 12;
}

/// A type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Type {
    /// An integer.
    Int { bits: u32, signed: bool },
    /// A float.
    Float { bits: u32 },
    /// A vector.
    Vector { component: u32, count: u32 },
    /// A matrix of column vectors.
    Matrix { column: u32, count: u32 },
    /// An image; `sampled` is 1 with a sampler or a texel fetch, 2 for loads and stores.
    Image { dimension: u32, multisampled: bool, sampled: u32 },
    /// A sampler.
    Sampler,
    /// An image and a sampler in one.
    SampledImage,
    /// An array whose length is the constant `length`.
    Array { element: u32, length: u32 },
    /// An array as long as its buffer.
    RuntimeArray { element: u32 },
    /// A struct or a block.
    Struct { members: Vec<u32> },
    /// A pointer.
    Pointer { to: u32 },
    /// An acceleration structure.
    AccelerationStructure,
}

/// A global variable.
#[derive(Clone, Copy, Debug)]
pub struct Variable {
    /// Its id.
    pub id: u32,
    /// The id of its pointer type.
    pub pointer: u32,
    /// Its storage class.
    pub storage: u32,
}

/// A module.
#[derive(Debug, Default)]
pub struct Module {
    /// Types by id.
    pub types: HashMap<u32, Type>,
    /// 32-bit constants by id.
    pub constants: HashMap<u32, u32>,
    /// Global variables, in order.
    pub variables: Vec<Variable>,
    /// The entry point's `local_size`.
    pub local_size: Option<[u32; 3]>,
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    /// Id (and member) and decoration, with the first operand, 0 where there is none.
    decorations: HashMap<(u32, Option<u32>, u32), u32>,
    /// What the code refers to through pointers.
    pointers: HashSet<u32>,
    /// Specialisation constants by id: whether they are true by default; none of those that are no booleans.
    specializations: HashMap<u32, Option<bool>>,
    /// What the code refers to otherwise.
    values: HashSet<u32>,
    /// Constants that are made of others, each with those, in order.
    derived: Vec<(u32, Vec<u32>)>,
}

impl Module {
    /// Reads a module.
    ///
    /// # Errors
    /// One line, if the words are not a SPIR-V module.
    pub fn parse(words: &[u32]) -> Result<Self, String> {
        const MAGIC: u32 = 0x0723_0203;
        const HEADER_WORDS: usize = 5;
        if words.first() != Some(&MAGIC) || words.len() < HEADER_WORDS {
            return Err("the compiler's output is not SPIR-V".to_owned());
        }
        let mut module = Self::default();
        let mut rest = &words[HEADER_WORDS..];
        while let Some(&first) = rest.first() {
            let (count, opcode) = ((first >> 16) as usize, first & 0xffff);
            let Some(operands) = rest.get(1..count) else {
                return Err("the compiler's output is cut short".to_owned());
            };
            module.instruction(opcode, operands);
            rest = &rest[count..];
        }
        // A constant made of others uses them only if it is used itself. Each comes after those that it is made of.
        for (id, arguments) in module.derived.iter().rev() {
            if module.values.contains(id) {
                module.values.extend(arguments);
            }
        }
        Ok(module)
    }

    fn instruction(&mut self, opcode: u32, operands: &[u32]) {
        match (opcode, operands) {
            (5, [id, name @ ..]) => {
                self.names.insert(*id, text(name));
            }
            (6, [id, member, name @ ..]) => {
                self.member_names.insert((*id, *member), text(name));
            }
            // LocalSize among the execution modes.
            (16, [_, 17, x, y, z]) => self.local_size = Some([*x, *y, *z]),
            (21, [id, bits, sign]) => self.define(*id, Type::Int { bits: *bits, signed: *sign == 1 }),
            (22, [id, bits, ..]) => self.define(*id, Type::Float { bits: *bits }),
            (23, [id, component, count]) => self.define(*id, Type::Vector { component: *component, count: *count }),
            (24, [id, column, count]) => self.define(*id, Type::Matrix { column: *column, count: *count }),
            (25, [id, _, dimension, _, _, multisampled, sampled, ..]) => {
                let image = Type::Image { dimension: *dimension, multisampled: *multisampled == 1, sampled: *sampled };
                self.define(*id, image);
            }
            (26, [id]) => self.define(*id, Type::Sampler),
            (27, [id, _]) => self.define(*id, Type::SampledImage),
            (28, [id, element, length]) => self.define(*id, Type::Array { element: *element, length: *length }),
            (29, [id, element]) => self.define(*id, Type::RuntimeArray { element: *element }),
            (30, [id, members @ ..]) => self.define(*id, Type::Struct { members: members.to_vec() }),
            (32, [id, _, to]) => self.define(*id, Type::Pointer { to: *to }),
            (5341, [id]) => self.define(*id, Type::AccelerationStructure),
            (43, [_, id, value]) => {
                self.constants.insert(*id, *value);
            }
            // OpSpecConstantTrue, OpSpecConstantFalse, and others.
            (48, [_, id]) => self.specialize(*id, Some(true)),
            (49, [_, id]) => self.specialize(*id, Some(false)),
            (50 | 51, [_, id, ..]) => self.specialize(*id, None),
            (59, [pointer, id, storage, ..]) => {
                self.variables.push(Variable { id: *id, pointer: *pointer, storage: *storage });
            }
            (71, [id, decoration, operands @ ..]) => {
                self.decorations.insert((*id, None, *decoration), operands.first().copied().unwrap_or(0));
            }
            (72, [id, member, decoration, operands @ ..]) => {
                self.decorations.insert((*id, Some(*member), *decoration), operands.first().copied().unwrap_or(0));
            }
            // What takes a pointer: calls, texel pointers, loads, stores, copies, access chains, lengths, atomics.
            (57, [_, _, _, arguments @ ..]) => {
                self.pointers.extend(arguments);
                self.values.extend(arguments);
            }
            (60 | 61 | 65..=68 | 70 | 83 | 227 | 229..=242, [_, _, pointer, ..]) => {
                self.pointers.insert(*pointer);
            }
            (62 | 228, [pointer, rest @ ..]) => {
                self.pointers.insert(*pointer);
                self.values.extend(rest);
            }
            // OpSpecConstantOp: its operation, then what it takes.
            (52, [_, id, _, arguments @ ..]) => self.derived.push((*id, arguments.to_vec())),
            // What takes a boolean: logic, selections, phis, branches and returns.
            (80 | 164..=169 | 245, [_, _, arguments @ ..]) => self.values.extend(arguments),
            (250 | 254, arguments) => self.values.extend(arguments),
            (63, [to, from, ..]) => self.pointers.extend([to, from]),
            _ => {}
        }
    }

    fn define(&mut self, id: u32, ty: Type) {
        self.types.insert(id, ty);
    }

    /// The name of an id; empty if it has none.
    pub fn name(&self, id: u32) -> &str {
        self.names.get(&id).map_or("", String::as_str)
    }

    /// The name of a struct's member; empty if it has none.
    pub fn member_name(&self, id: u32, member: u32) -> &str {
        self.member_names.get(&(id, member)).map_or("", String::as_str)
    }

    /// Whether the code refers to a variable: a declaration alone does not count.
    pub fn is_used(&self, variable: &Variable) -> bool {
        self.pointers.contains(&variable.id)
    }

    fn specialize(&mut self, id: u32, default: Option<bool>) {
        self.specializations.insert(id, default);
    }

    /// The specialisation constants that the code refers to: each its id, its number, and whether it is true by default; none of those
    /// that are no booleans.
    pub fn specializations(&self) -> Vec<(u32, u32, Option<bool>)> {
        // What is no boolean is used in more ways than are looked for.
        let is_used = |(id, default): &(&u32, &Option<bool>)| default.is_none() || self.values.contains(*id);
        let used = self.specializations.iter().filter(is_used);
        let numbered =
            used.filter_map(|(id, default)| Some((*id, self.decoration(*id, decoration::SPEC_ID)?, *default)));
        let mut all: Vec<_> = numbered.collect();
        all.sort_by_key(|&(_, number, _)| number);
        all
    }

    /// The first operand of a decoration on an id.
    pub fn decoration(&self, id: u32, decoration: u32) -> Option<u32> {
        self.decorations.get(&(id, None, decoration)).copied()
    }

    /// The first operand of a decoration on a struct's member.
    pub fn member_decoration(&self, id: u32, member: u32, decoration: u32) -> Option<u32> {
        self.decorations.get(&(id, Some(member), decoration)).copied()
    }

    /// The type a variable's pointer leads to, with its id.
    pub fn pointee(&self, variable: &Variable) -> Option<(u32, &Type)> {
        match self.types.get(&variable.pointer)? {
            Type::Pointer { to } => Some((*to, self.types.get(to)?)),
            _ => None,
        }
    }
}

/// A nul-terminated string in words, lowest byte first.
fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).take_while(|&byte| byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
