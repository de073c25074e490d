//! Typed arrays out of bytes: accessors, their buffer views and buffers, dense and sparse, every range checked before
//! anything is allocated (glTF 2.0, sections 3.6.1 and 3.6.2).

use super::limits::Budget;
use crate::scene::{SceneError, SceneErrorCode, memory};
use ::gltf::json::accessor::sparse::Sparse;
use ::gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, IndexComponentType, Type};
use ::gltf::json::buffer::View;
use ::gltf::json::validation::Checked::{Invalid, Valid};
use ::gltf::json::{Index, Root};

/// How many elements one accessor may have.
const MAX_ELEMENTS: u64 = 1 << 28;
/// How many without a buffer view, where they cost its author nothing.
const MAX_ZEROS: u64 = 1 << 24;

const DAMAGED: &str = "the file is damaged or its exporter is at fault: export it again";

/// Reads the accessors of one document.
pub struct Reader<'a> {
    pub document: &'a Root,
    /// One per buffer of the document; none where a buffer has no data.
    pub buffers: Vec<Option<Vec<u8>>>,
    pub budget: &'a Budget,
}

/// Elements in a buffer, all of them known to be there.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.count).map(move |k| &self.bytes[k * self.stride..][..self.size])
    }
}

/// An accessor whose every range has been checked.
struct Sound<'a> {
    count: usize,
    component: ComponentType,
    normalized: bool,
    /// None stands for zeros.
    dense: Option<Elements<'a>>,
    sparse: Option<Replaced<'a>>,
}

/// Positions of replaced elements, the type of these, and what replaces them.
type Replaced<'a> = (Elements<'a>, ComponentType, Elements<'a>);

/// One component as a number; normalised integers as glTF 2.0, section 3.6.2.2, decodes them.
fn float(component: ComponentType, bytes: &[u8], normalized: bool) -> f32 {
    let scale = |value: f32, full: f32| if normalized { (value / full).max(-1.0) } else { value };
    match component {
        ComponentType::I8 => scale(f32::from(bytes[0] as i8), 127.0),
        ComponentType::U8 => scale(f32::from(bytes[0]), 255.0),
        ComponentType::I16 => scale(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        ComponentType::U16 => scale(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        ComponentType::U32 => {
            scale(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32, u32::MAX as f32)
        }
        ComponentType::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// One component of an unsigned type.
fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => u32::from(bytes[0]),
        ComponentType::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

impl<'a> Reader<'a> {
    /// A whole buffer view, such as an image's.
    pub fn view_bytes(&'a self, view: Index<View>, location: &str) -> Result<&'a [u8], SceneError> {
        self.view(view, location).map(|(bytes, _)| bytes)
    }

    /// An attribute of vectors; integers become floats, missing components of `N` are filled by `fill`.
    ///
    /// `kinds` are the accessor types that fit, such as `[Type::Vec3, Type::Vec4]`.
    pub fn vectors<const N: usize>(
        &self,
        accessor: Index<Accessor>,
        kinds: &[Type],
        fill: f32,
        location: &str,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let (checked, width) = self.checked(accessor, kinds, location)?;
        self.budget.claim(checked.count as u64 * size_of::<[f32; N]>() as u64, location)?;
        let (component, normalized) = (checked.component, checked.normalized);
        let decode = |element: &[u8]| {
            let mut vector = [fill; N];
            for (out, bytes) in vector.iter_mut().zip(element.chunks_exact(component.size())) {
                *out = float(component, bytes, normalized);
            }
            vector
        };
        let mut zero = [fill; N];
        zero[..width.min(N)].fill(0.0);
        checked.read(zero, decode, location)
    }

    /// Indices of vertices.
    pub fn indices(&self, accessor: Index<Accessor>, location: &str) -> Result<Vec<u32>, SceneError> {
        let (checked, _) = self.checked(accessor, &[Type::Scalar], location)?;
        let component = checked.component;
        let is_unsigned = matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if !is_unsigned || checked.normalized {
            let what = "indices are unsigned integers of 8, 16 or 32 bits, not normalised";
            return Err(wrong_format(location, what));
        }
        self.budget.claim(checked.count as u64 * 4, location)?;
        checked.read(0, |element| unsigned(component, element), location)
    }

    fn checked(
        &self,
        index: Index<Accessor>,
        kinds: &[Type],
        location: &str,
    ) -> Result<(Sound<'_>, usize), SceneError> {
        let accessor = named(&self.document.accessors, index.value(), "accessors", location)?;
        let location = &format!("{location} (accessors[{}])", index.value());
        let width = match accessor.type_ {
            Valid(kind) if kinds.contains(&kind) => kind.multiplicity(),
            Valid(kind) => {
                return Err(wrong_format(location, format!("type {kind:?} where one of {kinds:?} is needed")));
            }
            Invalid => return Err(wrong_format(location, format!("a type that does not exist; {kinds:?} would do"))),
        };
        let count = accessor.count.0;
        let most = if accessor.buffer_view.is_some() { MAX_ELEMENTS } else { MAX_ZEROS };
        if count > most {
            let what = format!("{count} elements where {most} are allowed");
            return Err(SceneError::new(SceneErrorCode::AccessorTooLong, location, what, "split the mesh"));
        }
        let Valid(GenericComponentType(component)) = accessor.component_type else {
            return Err(wrong_format(location, "a component type that does not exist"));
        };
        let size = width * component.size();
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let dense = accessor.buffer_view.map(|view| self.elements(view, offset, count, size, location)).transpose()?;
        let sparse = accessor.sparse.as_ref().map(|sparse| self.sparse(sparse, count, size, location)).transpose()?;
        let checked = Sound { count: count as usize, component, normalized: accessor.normalized, dense, sparse };
        Ok((checked, width))
    }

    /// What replaces some of an accessor's `count` elements of `size` bytes.
    fn sparse(&self, sparse: &Sparse, count: u64, size: usize, location: &str) -> Result<Replaced<'_>, SceneError> {
        let replaced = sparse.count.0;
        if replaced > count {
            let what = format!("replaces {replaced} of {count} elements");
            return Err(SceneError::new(SceneErrorCode::SparseIndexOob, location, what, DAMAGED));
        }
        let (indices, values) = (&sparse.indices, &sparse.values);
        let Valid(IndexComponentType(at)) = indices.component_type else {
            return Err(wrong_format(location, "sparse indices are unsigned integers of 8, 16 or 32 bits"));
        };
        let places = self.elements(indices.buffer_view, indices.byte_offset.0, replaced, at.size(), location)?;
        let values = self.elements(values.buffer_view, values.byte_offset.0, replaced, size, location)?;
        Ok((places, at, values))
    }

    /// `count` elements of `size` bytes from a buffer view on, its stride respected.
    fn elements(
        &self,
        view: Index<View>,
        offset: u64,
        count: u64,
        size: usize,
        location: &str,
    ) -> Result<Elements<'_>, SceneError> {
        let (bytes, stride) = self.view(view, location)?;
        let stride = stride.unwrap_or(size as u64);
        if stride < size as u64 {
            let what = format!("a stride of {stride} bytes over elements of {size}");
            return Err(SceneError::new(SceneErrorCode::BufferViewStride, location, what, DAMAGED));
        }
        // In 128 bits none of this can overflow.
        let end = match count {
            0 => u128::from(offset),
            _ => u128::from(offset) + u128::from(count - 1) * u128::from(stride) + size as u128,
        };
        if end > bytes.len() as u128 {
            let what = format!("{count} elements end at byte {end} of a buffer view of {}", bytes.len());
            return Err(SceneError::new(SceneErrorCode::AccessorTooLong, location, what, DAMAGED));
        }
        // A stride counts only between elements, so for a single one it may be anything.
        let stride = if count > 1 { stride as usize } else { size };
        Ok(Elements { bytes: &bytes[offset as usize..], stride, size, count: count as usize })
    }

    /// A buffer view's bytes, and its stride if it has one (0 counts as none, as some exporters write it).
    fn view(&self, index: Index<View>, location: &str) -> Result<(&[u8], Option<u64>), SceneError> {
        let view = named(&self.document.buffer_views, index.value(), "bufferViews", location)?;
        let location = format!("{location} (bufferViews[{}])", index.value());
        let buffer = named(&self.buffers, view.buffer.value(), "buffers", &location)?.as_deref().ok_or_else(|| {
            let what = format!("buffers[{}] has no data", view.buffer.value());
            SceneError::new(SceneErrorCode::BufferTooShort, &location, what, DAMAGED)
        })?;
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        offset
            .checked_add(view.byte_length.0)
            .and_then(|end| buffer.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?))
            .map(|bytes| (bytes, view.byte_stride.map(|stride| stride.0 as u64).filter(|&stride| stride > 0)))
            .ok_or_else(|| {
                let what =
                    format!("{} bytes from byte {offset} on, of a buffer of {}", view.byte_length.0, buffer.len());
                SceneError::new(SceneErrorCode::BufferViewTooLong, &location, what, DAMAGED)
            })
    }
}

impl Sound<'_> {
    fn read<T: Copy>(&self, zero: T, decode: impl Fn(&[u8]) -> T, location: &str) -> Result<Vec<T>, SceneError> {
        let mut values: Vec<T> = match self.dense {
            Some(dense) => {
                let mut values = memory::with_room(self.count, location)?;
                values.extend(dense.iter().map(&decode));
                values
            }
            None => memory::filled(zero, self.count, location)?,
        };
        if let Some((places, component, replacements)) = &self.sparse {
            for (place, replacement) in places.iter().zip(replacements.iter()) {
                let place = unsigned(*component, place);
                let Some(value) = values.get_mut(place as usize) else {
                    let what = format!("replaces element {place} of {}", self.count);
                    return Err(SceneError::new(SceneErrorCode::SparseIndexOob, location, what, DAMAGED));
                };
                *value = decode(replacement);
            }
        }
        Ok(values)
    }
}

fn wrong_format(location: &str, what: impl Into<String>) -> SceneError {
    SceneError::new(SceneErrorCode::AccessorFormat, location, what, DAMAGED)
}

/// The object that an index names, or an error that says which list is shorter.
pub fn named<'a, T>(list: &'a [T], index: usize, name: &str, location: &str) -> Result<&'a T, SceneError> {
    list.get(index).ok_or_else(|| {
        let what = format!("refers to {name}[{index}], but there are {}", list.len());
        SceneError::new(SceneErrorCode::UnresolvedReference, location, what, DAMAGED)
    })
}
