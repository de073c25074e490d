//! Memory layouts: what lies where in a block, and the Rust types of the same layout.

use super::spirv::{Module, Type, decoration};
use std::collections::BTreeMap;

/// A 32-bit scalar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `float`.
    Float,
    /// `int`.
    Int,
    /// `uint`, and `bool`, which GLSL stores as one.
    Uint,
}

impl Scalar {
    fn rust(self) -> &'static str {
        match self {
            Self::Float => "f32",
            Self::Int => "i32",
            Self::Uint => "u32",
        }
    }
}

/// A type of the host that lies in memory as one of GLSL does. All are aligned to four bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Host {
    /// One number.
    Scalar(Scalar),
    /// So many of a type, one after the other.
    Array(Box<Host>, u32),
    /// A struct, by name.
    Struct(String),
}

impl Host {
    /// Its Rust type, where `types` is the path of the module that has the structs, with its trailing colons.
    pub fn rust(&self, types: &str) -> String {
        match self {
            Self::Scalar(scalar) => scalar.rust().to_owned(),
            Self::Array(element, count) => format!("[{}; {count}]", element.rust(types)),
            Self::Struct(name) => format!("{types}{name}"),
        }
    }

    /// Its size in bytes.
    pub fn bytes(&self, structs: &Structs) -> u32 {
        match self {
            Self::Scalar(_) => 4,
            Self::Array(element, count) => element.bytes(structs) * count,
            Self::Struct(name) => structs.get(name).map_or(0, |found| found.bytes),
        }
    }
}

/// A member of a [`Struct`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Name in the GLSL.
    pub name: String,
    /// Its type.
    pub host: Host,
    /// Bytes from the start of the struct.
    pub offset: u32,
}

/// A GLSL struct or block as it lies in memory.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Name in the GLSL.
    pub name: String,
    /// Its members, by offset.
    pub members: Vec<Member>,
    /// Its size.
    pub bytes: u32,
    /// Whether an array fixes the size; otherwise it is the end of the last member, rounded up to the alignment.
    pub bytes_fixed: bool,
    /// The array without end behind the members, where the struct is a block that has one.
    pub tail: Option<Tail>,
    /// The file it was first seen in.
    pub origin: String,
}

impl Struct {
    /// Whether each member of both lies at the same place.
    pub fn agrees_with(&self, other: &Self) -> bool {
        self.members == other.members && self.tail == other.tail
    }
}

/// An array as long as its buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tail {
    /// Name in the GLSL.
    pub name: String,
    /// Type of an element.
    pub element: Host,
    /// Bytes from one element to the next.
    pub stride: u32,
    /// Bytes from the start of the block.
    pub offset: u32,
}

/// Structs by name.
pub type Structs = BTreeMap<String, Struct>;

/// Reads the struct type `id` of a shader in the file `origin`. Those that it holds are added to `structs`, not itself.
///
/// # Errors
/// One line about what has no counterpart on the host.
pub fn read_struct(module: &Module, id: u32, origin: &str, structs: &mut Structs) -> Result<Struct, String> {
    let reader = Reader { module, origin };
    reader.read_struct(id, structs)
}

struct Reader<'a> {
    module: &'a Module,
    origin: &'a str,
}

impl Reader<'_> {
    fn read_struct(&self, id: u32, structs: &mut Structs) -> Result<Struct, String> {
        let module = self.module;
        let name = module.name(id).to_owned();
        let Some(Type::Struct { members: types }) = module.types.get(&id) else {
            return Err(format!("`{name}` is not a struct"));
        };
        let origin = self.origin.to_owned();
        let mut read = Struct { name, members: Vec::new(), bytes: 0, bytes_fixed: false, tail: None, origin };
        let mut alignment = 4;
        for (index, &ty) in (0..).zip(types) {
            let member = module.member_name(id, index).to_owned();
            let place = format!("`{}` of `{}`", member, read.name);
            let decorated = |decoration| module.member_decoration(id, index, decoration);
            let offset = decorated(decoration::OFFSET).ok_or_else(|| format!("{place} has no offset in the SPIR-V"))?;
            if decorated(decoration::ROW_MAJOR).is_some() {
                return Err(format!("{place} is row_major: Mica's matrices are column-major"));
            }
            let matrix_stride = decorated(decoration::MATRIX_STRIDE).unwrap_or(0);
            alignment = alignment.max(self.natural_alignment(ty));
            if let Some(Type::RuntimeArray { element }) = module.types.get(&ty) {
                let stride = self.array_stride(ty, &place)?;
                let element = self.read_element(*element, stride, matrix_stride, &place, structs)?;
                read.tail = Some(Tail { name: member, element, stride, offset });
            } else {
                let host = self.read_host(ty, matrix_stride, &place, structs)?;
                read.members.push(Member { name: member, host, offset });
            }
        }
        read.members.sort_by_key(|member| member.offset);
        read.bytes = match (&read.tail, read.members.last()) {
            (Some(tail), _) => tail.offset,
            (None, Some(last)) => (last.offset + last.host.bytes(structs)).next_multiple_of(alignment),
            (None, None) => 0,
        };
        Ok(read)
    }

    /// Reads a type; `matrix_stride` is what its member is decorated with, for the matrices in it.
    fn read_host(&self, id: u32, matrix_stride: u32, place: &str, structs: &mut Structs) -> Result<Host, String> {
        let unsupported = || format!("{place} has a type without a counterpart on the host: use 32-bit scalars");
        match self.module.types.get(&id).ok_or_else(unsupported)? {
            Type::Float { bits: 32 } => Ok(Host::Scalar(Scalar::Float)),
            Type::Int { bits: 32, signed } => Ok(Host::Scalar(if *signed { Scalar::Int } else { Scalar::Uint })),
            Type::Vector { component, count } => {
                let component = self.read_host(*component, matrix_stride, place, structs)?;
                Ok(Host::Array(Box::new(component), *count))
            }
            Type::Matrix { column, count } => {
                let column = self.read_host(*column, matrix_stride, place, structs)?;
                Ok(Host::Array(Box::new(padded(column, matrix_stride, place, structs)?), *count))
            }
            Type::Array { element, length } => {
                let stride = self.array_stride(id, place)?;
                let count = self.module.constants.get(length);
                let count = *count.ok_or_else(|| format!("{place} has no constant length"))?;
                let element = self.read_element(*element, stride, matrix_stride, place, structs)?;
                Ok(Host::Array(Box::new(element), count))
            }
            Type::Struct { .. } => {
                let inner = self.read_struct(id, structs)?;
                let name = inner.name.clone();
                add(structs, inner)?;
                Ok(Host::Struct(name))
            }
            _ => Err(unsupported()),
        }
    }

    /// Reads the element of an array, whose size the array's stride fixes.
    fn read_element(
        &self,
        id: u32,
        stride: u32,
        matrix_stride: u32,
        place: &str,
        structs: &mut Structs,
    ) -> Result<Host, String> {
        if let Some(Type::Struct { .. }) = self.module.types.get(&id) {
            let inner = self.read_struct(id, structs)?;
            let name = inner.name.clone();
            add(structs, Struct { bytes: stride, bytes_fixed: true, ..inner })?;
            return Ok(Host::Struct(name));
        }
        padded(self.read_host(id, matrix_stride, place, structs)?, stride, place, structs)
    }

    fn array_stride(&self, id: u32, place: &str) -> Result<u32, String> {
        let stride = self.module.decoration(id, decoration::ARRAY_STRIDE);
        stride.ok_or_else(|| format!("{place} has no array stride in the SPIR-V"))
    }

    /// The alignment of std430: vectors of two and four are aligned to their size, vectors of three as those of four.
    fn natural_alignment(&self, id: u32) -> u32 {
        match self.module.types.get(&id) {
            Some(Type::Vector { count: 2, .. }) => 8,
            Some(Type::Vector { .. }) => 16,
            Some(Type::Matrix { column, .. }) => self.natural_alignment(*column),
            Some(Type::Array { element, .. } | Type::RuntimeArray { element }) => self.natural_alignment(*element),
            Some(Type::Struct { members }) => members.iter().map(|&m| self.natural_alignment(m)).max().unwrap_or(4),
            _ => 4,
        }
    }
}

/// A scalar or a vector made as long as `stride`; any other type must be so long already.
fn padded(host: Host, stride: u32, place: &str, structs: &Structs) -> Result<Host, String> {
    let words = stride / 4;
    match &host {
        _ if host.bytes(structs) == stride => Ok(host),
        Host::Scalar(_) => Ok(Host::Array(Box::new(host), words)),
        Host::Array(component, _) if matches!(**component, Host::Scalar(_)) => {
            Ok(Host::Array(component.clone(), words))
        }
        _ => Err(format!("{place} has gaps between its elements: use std430")),
    }
}

/// Adds a struct to those known.
///
/// # Errors
/// One line, if one of the same name is laid out otherwise.
pub fn add(structs: &mut Structs, new: Struct) -> Result<(), String> {
    let Some(known) = structs.get_mut(&new.name) else {
        structs.insert(new.name.clone(), new);
        return Ok(());
    };
    let (name, here, there) = (&new.name, &new.origin, &known.origin);
    if !known.agrees_with(&new) {
        let (new, known) = (outline(&new), outline(known));
        return Err(format!("`{name}` has two layouts, {new} in {here} and {known} in {there}: rename one of them"));
    }
    if known.bytes_fixed && new.bytes_fixed && known.bytes != new.bytes {
        let (new, known) = (new.bytes, known.bytes);
        return Err(format!(
            "`{name}` has two layouts, {new} bytes an element in {here} and {known} in {there}: use std430 in both"
        ));
    }
    if new.bytes_fixed {
        known.bytes = new.bytes;
        known.bytes_fixed = true;
    }
    Ok(())
}

/// Refuses a struct with a member whose type is longer than the room it has there.
///
/// An array may have fixed the size of a struct after it was read as a member elsewhere, so this needs all structs.
///
/// # Errors
/// One line that names the member.
pub fn check_room(read: &Struct, structs: &Structs) -> Result<(), String> {
    let ends = read.members.iter().skip(1).map(|next| next.offset).chain([read.bytes]);
    for (member, end) in read.members.iter().zip(ends) {
        if member.offset + member.host.bytes(structs) > end {
            let (member, name) = (&member.name, &read.name);
            return Err(format!("`{member}` of `{name}` is longer in an array than here: use std430 in both"));
        }
    }
    Ok(())
}

/// The members of a struct with their offsets, for messages.
fn outline(read: &Struct) -> String {
    let members = read.members.iter().map(|m| format!("{}: {} at {}", m.name, m.host.rust(""), m.offset));
    let tail = read.tail.iter().map(|t| format!("{}: {}[] at {}", t.name, t.element.rust(""), t.offset));
    format!("{{ {} }}", members.chain(tail).collect::<Vec<_>>().join(", "))
}
