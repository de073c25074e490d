//! What blocks a ray: bounding volume hierarchies built on the host in the layout that `occlusion/bvh.glsl` traverses.
//!
//! Two levels: a [`MeshBvh`] over the triangles of each mesh in its own space, and a [`SceneBvh`] over the instances
//! in scene space, which holds all of them in three arrays of [`mica_shaders::types`]. `shared/bvh_layout.glsl` says
//! what a reference, a node, a triangle and an instance are.
//!
//! The stack of a traversal needs one entry for each node on a path: the builders keep `BVH_MESH_LEVELS` and
//! `BVH_SCENE_LEVELS` for every input, by splitting in halves where the budget gets short.

mod build;
mod mesh;
mod placements;
mod scene;

pub use mesh::{MeshBvh, check};
use mica_shaders::constants::{BVH_FIRST_BITS, BVH_LEAF, BVH_NOTHING};
use mica_shaders::types::BvhNode;
pub use placements::{Placed, Placements};
pub use scene::{SceneBvh, SceneTop, TopLevel};
use std::sync::atomic::AtomicU64;

/// Triangles in a leaf, at most: 4 and 2 are equally fast on lavapipe, and 4 takes fewer nodes.
pub const LEAF_TRIANGLES: usize = 4;

/// Coordinates beyond this are refused: the product of three of them would overflow an f32.
pub const LARGEST_COORDINATE: f32 = 1e12;

/// The first triangle of all that a reference cannot name.
const END_OF_TRIANGLES: usize = (1 << BVH_FIRST_BITS) - 1;

/// What a build over a mesh is told beside its triangles.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildOptions<'a> {
    /// Whether an alpha mask cuts holes into its triangles: two in the same place then differ unless they have the same
    /// vertices.
    pub masked: bool,
    /// Raised by the number of triangles that have found their place, by and by, to all of them: another thread may read
    /// how far the build has come.
    pub placed: Option<&'a AtomicU64>,
}

/// What no hierarchy can be built over.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BvhError {
    /// The list of indices does not come in threes.
    #[error("{indices} indices do not make whole triangles: give three for each")]
    PartialTriangle {
        /// How many indices there are.
        indices: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {vertex}, but there are only {vertices}: repair the index list")]
    NoSuchVertex {
        /// Which triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A corner is infinite, not a number, or beyond [`LARGEST_COORDINATE`].
    #[error("triangle {triangle} has a corner at {position:?}: coordinates must be finite and at most 1e12")]
    BadPosition {
        /// Which triangle.
        triangle: usize,
        /// Where the corner is.
        position: [f32; 3],
    },
    /// An instance names a mesh that does not exist.
    #[error("instance {instance} uses mesh {mesh}, but there are only {meshes}: repair the list of instances")]
    NoSuchMesh {
        /// Which instance.
        instance: usize,
        /// The mesh it names.
        mesh: usize,
        /// How many there are.
        meshes: usize,
    },
    /// An instance moves its mesh out of the world, or its transform is not finite.
    #[error(
        "instance {instance} lies beyond coordinates of 1e12, or its transform is not finite: repair its transform"
    )]
    BadTransform {
        /// Which instance.
        instance: usize,
    },
    /// More triangles or instances than a reference can tell apart.
    #[error("{count} {what} are more than the {limit} one scene can hold: split or simplify it")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub lower: [f32; 3],
    /// Greatest corner.
    pub upper: [f32; 3],
}

impl Bounds {
    /// The box around nothing: the neutral element of [`Bounds::union`].
    pub const EMPTY: Self = Self { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// The box around a point.
    pub const fn of_point(point: [f32; 3]) -> Self {
        Self { lower: point, upper: point }
    }

    /// The least box around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            lower: std::array::from_fn(|axis| self.lower[axis].min(other.lower[axis])),
            upper: std::array::from_fn(|axis| self.upper[axis].max(other.upper[axis])),
        }
    }

    fn longest_side(&self) -> f32 {
        (0..3).fold(0.0, |longest, axis| (self.upper[axis] - self.lower[axis]).max(longest))
    }

    /// The same with so much more room on every side, and never less than an f32 can tell apart.
    fn widened(self, room: f32) -> Self {
        Self {
            lower: self.lower.map(|lower| (lower - room).next_down()),
            upper: self.upper.map(|upper| (upper + room).next_up()),
        }
    }

    /// Whether every point of `other` lies in this one.
    pub fn contains(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.lower[axis] <= other.lower[axis] && other.upper[axis] <= self.upper[axis])
    }

    /// Twice its middle. (The factor spares a product; only the order of centroids matters.)
    fn doubled_centre(&self) -> [f32; 3] {
        std::array::from_fn(|axis| self.lower[axis] + self.upper[axis])
    }

    /// Half its surface; in f64, where the square of no f32 overflows. Zero for the empty box.
    pub fn half_area(&self) -> f64 {
        let [x, y, z] = std::array::from_fn(|axis| f64::from((self.upper[axis] - self.lower[axis]).max(0.0)));
        x * y + y * z + z * x
    }
}

/// The children of a node: reference and box of each.
pub fn children(node: &BvhNode) -> [(u32, Bounds); 2] {
    [
        (node.child_0, Bounds { lower: node.lower_0, upper: node.upper_0 }),
        (node.child_1, Bounds { lower: node.lower_1, upper: node.upper_1 }),
    ]
}

/// The node over two children.
fn node_over([first, second]: [(u32, Bounds); 2]) -> BvhNode {
    BvhNode {
        lower_0: first.1.lower,
        child_0: first.0,
        upper_0: first.1.upper,
        child_1: second.0,
        lower_1: second.1.lower,
        upper_1: second.1.upper,
        ..BvhNode::default()
    }
}

/// The same boxes under other references.
fn renamed(node: &BvhNode, name: impl Fn(u32) -> u32) -> BvhNode {
    BvhNode { child_0: name(node.child_0), child_1: name(node.child_1), ..*node }
}

/// The reference to a leaf of `count` triangles, or of one instance.
const fn leaf(first: u32, count: u32) -> u32 {
    BVH_LEAF | (count - 1) << BVH_FIRST_BITS | first
}

/// The triangles (or the instance) of a leaf: first and number; `None` where the reference is a node or nothing.
pub const fn leaf_range(reference: u32) -> Option<(u32, u32)> {
    if reference & BVH_LEAF == 0 || reference == BVH_NOTHING {
        return None;
    }
    Some((reference & ((1 << BVH_FIRST_BITS) - 1), (reference >> BVH_FIRST_BITS & 3) + 1))
}

/// The same reference after its nodes and triangles have moved up by so many places.
const fn moved(reference: u32, nodes: u32, triangles: u32) -> u32 {
    if reference == BVH_NOTHING {
        reference
    } else if reference & BVH_LEAF == 0 {
        reference + nodes
    } else {
        reference + triangles
    }
}
