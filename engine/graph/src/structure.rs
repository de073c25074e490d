//! Acceleration structures: what shaders with ray queries ask.

use crate::declare::{Graph, Use, Work};
use crate::resource::{Buffer, Description, Lifetime, Resource, ResourceId};
use crate::shader::{Access, Slot, Stages};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The triangles that a bottom level is built over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TrianglesDesc {
    /// How many there are, at least 1.
    pub triangles: u32,
    /// How many vertices they may name.
    pub vertices: u32,
    /// Whether each of them blocks a ray; if not, shaders are asked about each that a ray meets.
    pub opaque: bool,
}

/// What an acceleration structure is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StructureDesc {
    /// A bottom level, as built.
    Triangles(TrianglesDesc),
    /// A bottom level without the room that its build did not need.
    Compacted {
        /// What it is a copy of.
        of: ResourceId,
        /// What that was built over.
        triangles: TrianglesDesc,
    },
    /// The top level: placements of bottom levels.
    Instances {
        /// How many there are; none is as good as many.
        count: u32,
    },
}

impl StructureDesc {
    /// A guess at the bytes it takes, for plans without a device: only the device knows.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Triangles(built) => 128 + 112 * u64::from(built.triangles),
            Self::Compacted { triangles, .. } => 128 + 64 * u64::from(triangles.triangles),
            Self::Instances { count } => 128 + 192 * u64::from(*count),
        }
    }
}

/// An acceleration structure. Neither `Copy` nor `Clone`: a pass that takes `&Structure` traverses it, one that takes
/// `&mut Structure` builds it. It outlives the frame that builds it.
#[derive(Debug)]
pub struct Structure {
    resource: Arc<Resource>,
    desc: StructureDesc,
}

impl Structure {
    /// A bottom level, not built yet.
    pub fn over_triangles(name: impl Into<String>, triangles: TrianglesDesc, lifetime: Lifetime) -> Self {
        Self::new(name, StructureDesc::Triangles(triangles), lifetime)
    }

    /// A top level, not built yet.
    pub fn over_instances(name: impl Into<String>, count: u32, lifetime: Lifetime) -> Self {
        Self::new(name, StructureDesc::Instances { count }, lifetime)
    }

    /// What [`Graph::compact`] makes of a bottom level; nothing for a top level, or one that is compacted already.
    ///
    /// It takes as many bytes as the device said that the build needed. That is known once the frame that built it is
    /// finished; before, it takes as many as the original.
    pub fn compacted(of: &Self) -> Option<Self> {
        let StructureDesc::Triangles(triangles) = of.desc else { return None };
        let desc = StructureDesc::Compacted { of: of.resource.id, triangles };
        Some(Self::new(of.resource.name.clone(), desc, of.resource.lifetime))
    }

    fn new(name: impl Into<String>, desc: StructureDesc, lifetime: Lifetime) -> Self {
        Self { resource: Resource::new(name, Description::Structure(desc), lifetime), desc }
    }

    /// What it is.
    pub fn desc(&self) -> StructureDesc {
        self.desc
    }

    /// What stands behind the handle.
    pub fn resource(&self) -> &Arc<Resource> {
        &self.resource
    }
}

/// Where the triangles of one mesh lie in the buffers of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshRange {
    /// The first of its indices, three a triangle: 32-bit numbers.
    pub first_index: u32,
    /// Added to each index: positions are three 32-bit floats each.
    pub first_vertex: u32,
}

/// A placement of a bottom level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StructureInstance {
    /// The bottom level.
    pub structure: ResourceId,
    /// Rows of the affine map, which has an inverse.
    pub scene_from_local: [[f32; 4]; 3],
    /// What shaders read as its custom index: 24 bits.
    pub index: u32,
}

impl Graph {
    /// Builds bottom levels over meshes that lie in two buffers, in one pass, so that a device may build them side by
    /// side. Each gets working space of its own for the pass.
    ///
    /// An index of a mesh is below its [`TrianglesDesc::vertices`]: nothing checks what is in the buffers, and what a device
    /// does with an index beyond is not defined.
    pub fn build_meshes<'a>(
        &mut self,
        name: impl Into<String>,
        indices: &Buffer,
        positions: &Buffer,
        meshes: impl IntoIterator<Item = (&'a mut Structure, MeshRange)>,
    ) {
        let mut uses = vec![build(&indices.resource, Access::BuildRead), build(&positions.resource, Access::BuildRead)];
        let mut ranges = Vec::new();
        for (structure, range) in meshes {
            uses.extend(written_with_scratch(structure));
            ranges.push(range);
        }
        self.push(name, Work::BuildMeshes { meshes: ranges.into() }, uses);
    }

    /// Builds a top level over placements of bottom levels, as many as it was made for. It holds on to them until it is
    /// built again or dropped, so their handles may go before it.
    ///
    /// # Panics
    /// If there are more or fewer, or one is no bottom level: a mistake of the pass's author, not of any input.
    pub fn build_instances<'a>(
        &mut self,
        name: impl Into<String>,
        instances: impl IntoIterator<Item = (&'a Structure, [[f32; 4]; 3], u32)>,
        structure: &mut Structure,
    ) {
        let mut uses = Vec::new();
        let mut seen = BTreeSet::new();
        let mut placed = Vec::new();
        for (bottom, scene_from_local, index) in instances {
            let is_bottom = !matches!(bottom.desc, StructureDesc::Instances { .. });
            assert!(is_bottom, "build of {}: {} is no bottom level", structure.resource.name, bottom.resource.name);
            if seen.insert(bottom.resource.id) {
                uses.push(build(&bottom.resource, Access::BuildRead));
            }
            placed.push(StructureInstance { structure: bottom.resource.id, scene_from_local, index });
        }
        let count = StructureDesc::Instances { count: placed.len() as u32 };
        assert_eq!(structure.desc, count, "build of {}: it was made for others", structure.resource.name);
        uses.extend(written_with_scratch(structure));
        self.push(name, Work::BuildInstances { instances: placed.into() }, uses);
    }

    /// Copies a bottom level into one without spare room. The original may be dropped afterwards.
    ///
    /// # Panics
    /// If `to` is not [`Structure::compacted`] of `from`: a mistake of the pass's author, not of any input.
    pub fn compact(&mut self, from: &Structure, to: &mut Structure) {
        let is_of = matches!(to.desc, StructureDesc::Compacted { of, .. } if of == from.resource.id);
        assert!(is_of, "{} is not {} compacted", to.resource.name, from.resource.name);
        let uses = vec![build(&from.resource, Access::BuildRead), build(&to.resource, Access::BuildWrite)];
        self.push(format!("compact {}", from.resource.name), Work::Compact, uses);
    }
}

fn written_with_scratch(structure: &mut Structure) -> [Use; 2] {
    let name = format!("scratch of {}", structure.resource.name);
    let scratch = Resource::new(name, Description::Scratch(structure.desc), Lifetime::Frame);
    [&structure.resource, &scratch].map(|resource| build(resource, Access::BuildWrite))
}

fn build(resource: &Arc<Resource>, access: Access) -> Use {
    Use { resource: resource.clone(), slot: Slot::None, access, stages: Stages::BUILD }
}
