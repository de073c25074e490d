//! The hierarchy over the triangles of one mesh, in the mesh's own space.

use super::build::{Limits, Primitive, build};
use super::{Bounds, BvhError, END_OF_TRIANGLES, LARGEST_COORDINATE, LEAF_TRIANGLES};
use mica_shaders::constants::BVH_MESH_LEVELS;
use mica_shaders::types::{BvhNode, BvhTriangle};
use rayon::prelude::*;

/// A hierarchy over the triangles of a mesh.
///
/// Nodes are depth first, the root first. References count the nodes and triangles of this mesh alone.
#[derive(Clone, Debug)]
pub struct MeshBvh {
    pub(super) nodes: Vec<BvhNode>,
    pub(super) triangles: Vec<BvhTriangle>,
    pub(super) root: u32,
    pub(super) bounds: Bounds,
}

impl MeshBvh {
    /// Builds over triangles whose corners are `positions` named by `indices`, three for each.
    ///
    /// Any shape is welcome: none, one, many the same, without area, of any size. The same input gives the same
    /// hierarchy on any number of threads.
    ///
    /// # Errors
    /// [`BvhError`] where the indices or a used position are unusable. Positions that no triangle uses may be anything.
    pub fn build(positions: &[[f32; 3]], indices: &[u32]) -> Result<Self, BvhError> {
        let (corners, rest) = indices.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(BvhError::PartialTriangle { indices: indices.len() });
        }
        let triangles = corners
            .iter()
            .enumerate()
            .map(|(triangle, corners)| {
                let [a, b, c] = corners.map(|vertex| corner(positions, triangle, vertex));
                Ok([a?, b?, c?])
            })
            .collect::<Result<Vec<_>, BvhError>>()?;
        Self::over(&triangles)
    }

    /// Builds over triangles given by their corners, all of them usable.
    pub(super) fn over(triangles: &[[[f32; 3]; 3]]) -> Result<Self, BvhError> {
        if triangles.len() > END_OF_TRIANGLES {
            return Err(BvhError::TooMany { what: "triangles", count: triangles.len(), limit: END_OF_TRIANGLES });
        }
        let mut primitives: Vec<Primitive> = triangles
            .par_iter()
            .enumerate()
            .map(|(index, corners)| {
                let bounds =
                    corners.iter().fold(Bounds::EMPTY, |bounds, &corner| bounds.union(Bounds::of_point(corner)));
                Primitive { bounds, index: index as u32 }
            })
            .collect();
        let tree = build(&mut primitives, Limits { leaf: LEAF_TRIANGLES, levels: BVH_MESH_LEVELS });
        let triangles = primitives
            .par_iter()
            .map(|primitive| {
                let [a, b, c] = triangles[primitive.index as usize];
                BvhTriangle { a, index: primitive.index, b, c, ..BvhTriangle::default() }
            })
            .collect();
        Ok(Self { nodes: tree.nodes, triangles, root: tree.root, bounds: tree.bounds })
    }

    /// The nodes, parents before children.
    pub fn nodes(&self) -> &[BvhNode] {
        &self.nodes
    }

    /// The triangles, in the order of the leaves.
    pub fn triangles(&self) -> &[BvhTriangle] {
        &self.triangles
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

/// The position of a corner, if it can be used.
fn corner(positions: &[[f32; 3]], triangle: usize, vertex: u32) -> Result<[f32; 3], BvhError> {
    let &position =
        positions.get(vertex as usize).ok_or(BvhError::NoSuchVertex { triangle, vertex, vertices: positions.len() })?;
    // Written so that NaN fails.
    if position.iter().all(|coordinate| coordinate.abs() <= LARGEST_COORDINATE) {
        Ok(position)
    } else {
        Err(BvhError::BadPosition { triangle, position })
    }
}
