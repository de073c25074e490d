//! The hierarchy over the triangles of one mesh, in the mesh's own space.

use super::build::{Limits, Primitive, build};
use super::{Bounds, BuildOptions, BvhError, END_OF_TRIANGLES, LARGEST_COORDINATE, LEAF_TRIANGLES};
use mica_shaders::constants::BVH_MESH_LEVELS;
use mica_shaders::types::{BvhNode, BvhTriangle};
use rayon::prelude::*;
use std::sync::atomic::AtomicU64;

/// Room around a triangle, over the longest side of its box. The test of a triangle moves its edges by up to 8 units of
/// rounding of the distance from the ray's origin to its corners; of that, the part to the point that is met is covered by
/// the test of boxes, and what remains is no longer than the triangle.
const ROOM: f32 = 16.0 * 0.5 * f32::EPSILON;

/// From so many triangles that no plane separates, it is worth looking for copies: each would cost every ray through
/// that place a step.
const MANY_IN_ONE_PLACE: usize = 64;

// Halving alone stays within the levels, whatever the mesh: a traversal's stack cannot overflow.
const _: () = assert!(END_OF_TRIANGLES <= LEAF_TRIANGLES << BVH_MESH_LEVELS);

/// A hierarchy over the triangles of a mesh.
///
/// Nodes are depth first, the root first. References count the nodes and triangles of this mesh alone.
#[derive(Clone, Debug)]
pub struct MeshBvh {
    pub(super) nodes: Vec<BvhNode>,
    pub(super) triangles: Vec<BvhTriangle>,
    pub(super) root: u32,
    pub(super) bounds: Bounds,
    /// Whether triangles in the same place may differ.
    masked: bool,
}

/// What makes one triangle of a mesh a copy of another, as far as rays can tell.
#[derive(Clone, Copy)]
enum Identity<'a> {
    /// The same corners.
    Corners,
    /// The same vertices, with all their attributes.
    Vertices(&'a [[u32; 3]]),
    /// Nothing.
    Index,
}

impl MeshBvh {
    /// Builds over triangles whose corners are `positions` named by `indices`, three for each.
    ///
    /// Any shape is welcome: none, one, many the same, without area, of any size. The same input gives the same
    /// hierarchy on any number of threads. Where many triangles lie in one place, of exact copies the first is kept.
    ///
    /// # Errors
    /// [`BvhError`] where the indices or a used position are unusable. Positions that no triangle uses may be anything.
    pub fn build(positions: &[[f32; 3]], indices: &[u32]) -> Result<Self, BvhError> {
        Self::build_with(positions, indices, BuildOptions::default())
    }

    /// As [`MeshBvh::build`], with options.
    ///
    /// # Errors
    /// As [`MeshBvh::build`].
    pub fn build_with(positions: &[[f32; 3]], indices: &[u32], options: BuildOptions) -> Result<Self, BvhError> {
        check(positions, indices)?;
        let (vertices, _) = indices.as_chunks::<3>();
        let triangle = |(index, vertices): (usize, &[u32; 3])| {
            let [a, b, c] = vertices.map(|vertex| positions[vertex as usize]);
            BvhTriangle { a, index: index as u32, b, c, ..BvhTriangle::default() }
        };
        let triangles: Vec<_> = vertices.par_iter().enumerate().map(triangle).collect();
        let identity = if options.masked { Identity::Vertices(vertices) } else { Identity::Corners };
        Ok(Self::over(&triangles, identity, options.placed))
    }

    /// The same mesh with its corners somewhere else.
    pub(super) fn rebuilt(&self, triangles: &[BvhTriangle]) -> Self {
        Self::over(triangles, if self.masked { Identity::Index } else { Identity::Corners }, None)
    }

    fn over(triangles: &[BvhTriangle], identity: Identity, placed: Option<&AtomicU64>) -> Self {
        let primitive = |(position, triangle): (usize, &BvhTriangle)| {
            let corners = [triangle.a, triangle.b, triangle.c].map(Bounds::of_point);
            let bounds = corners[0].union(corners[1]).union(corners[2]);
            let room = ROOM * bounds.longest_side();
            Primitive { bounds: bounds.widened(room), index: position as u32 }
        };
        let limits = Limits { leaf: LEAF_TRIANGLES, levels: BVH_MESH_LEVELS };
        let mut primitives: Vec<Primitive> = triangles.par_iter().enumerate().map(primitive).collect();
        let mut tree = build(&mut primitives, limits, placed);
        if tree.most_in_one_place > MANY_IN_ONE_PLACE {
            let distinct = distinct(triangles, identity);
            if distinct.len() < triangles.len() {
                primitives =
                    distinct.into_iter().map(|index| primitive((index as usize, &triangles[index as usize]))).collect();
                tree = build(&mut primitives, limits, None);
            }
        }
        Self {
            nodes: tree.nodes,
            triangles: primitives.par_iter().map(|primitive| triangles[primitive.index as usize]).collect(),
            root: tree.root,
            bounds: tree.bounds,
            masked: !matches!(identity, Identity::Corners),
        }
    }

    /// The nodes, parents before children.
    pub fn nodes(&self) -> &[BvhNode] {
        &self.nodes
    }

    /// The triangles, in the order of the leaves.
    pub fn triangles(&self) -> &[BvhTriangle] {
        &self.triangles
    }

    /// The corners of all triangles.
    pub(super) fn corners(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.triangles.iter().flat_map(|triangle| [triangle.a, triangle.b, triangle.c])
    }

    /// Where a traversal starts: node 0, the only leaf, or [`mica_shaders::constants::BVH_NOTHING`].
    pub fn root(&self) -> u32 {
        self.root
    }

    /// The box around all triangles; [`Bounds::EMPTY`] without any.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
}

/// Whether rays can be traced through triangles whose corners are `positions` named by `indices`, by any means.
///
/// # Errors
/// As from [`MeshBvh::build`].
pub fn check(positions: &[[f32; 3]], indices: &[u32]) -> Result<(), BvhError> {
    let (triangles, rest) = indices.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(BvhError::PartialTriangle { indices: indices.len() });
    }
    let count = triangles.len();
    if count > END_OF_TRIANGLES {
        return Err(BvhError::TooMany { what: "triangles", count, limit: END_OF_TRIANGLES });
    }
    let fault = |(triangle, vertices): (usize, &[u32; 3])| {
        vertices.iter().find_map(|&vertex| match positions.get(vertex as usize) {
            None => Some(BvhError::NoSuchVertex { triangle, vertex, vertices: positions.len() }),
            // Written so that NaN fails.
            Some(position) if position.iter().all(|coordinate| coordinate.abs() <= LARGEST_COORDINATE) => None,
            Some(&position) => Some(BvhError::BadPosition { triangle, position }),
        })
    };
    // The first fault, whichever thread finds one first.
    triangles.par_iter().enumerate().find_map_first(fault).map_or(Ok(()), Err)
}

/// The positions in `triangles` of those that are no copies, in their order; of copies, that of the first.
fn distinct(triangles: &[BvhTriangle], identity: Identity) -> Vec<u32> {
    // Adding 0 makes -0 the same as 0.
    let key = |position: u32| match (&triangles[position as usize], identity) {
        (triangle, Identity::Corners) => {
            [triangle.a, triangle.b, triangle.c].map(|corner| corner.map(|x| (x + 0.0).to_bits()))
        }
        (triangle, Identity::Vertices(vertices)) => [vertices[triangle.index as usize], [0; 3], [0; 3]],
        (triangle, Identity::Index) => [[triangle.index, 0, 0], [0; 3], [0; 3]],
    };
    let mut keyed: Vec<_> =
        (0..triangles.len() as u32).into_par_iter().map(|position| (key(position), position)).collect();
    keyed.par_sort_unstable();
    keyed.dedup_by_key(|(key, _)| *key);
    let mut positions: Vec<u32> = keyed.into_iter().map(|(_, position)| position).collect();
    positions.sort_unstable();
    positions
}
