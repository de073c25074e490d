//! Triangles and where they stand.

use glam::{DAffine3, DVec3, Vec3};

/// One list of triangles with one material: a glTF primitive, after repair.
///
/// Every attribute that is not empty has one element per vertex, every index is in range, and every triangle has an
/// area. Vertices are in the mesh's own space (metres); [`Instance`] places them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// From the file, or made from the primitive's place in it.
    pub name: String,
    /// Metres, finite.
    pub positions: Vec<[f32; 3]>,
    /// Unit; one per vertex. Flat where the file has none.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangent (towards +u) and, in `w`, the sign of the bitangent `w * cross(normal, tangent)`, which points
    /// towards -v as glTF has it; one per vertex. An instance that mirrors (see [`Instance::mirrors`]) flips the sign.
    ///
    /// Empty unless the material has a normal map, of its base or of its clear coat, and the mesh texture coordinates:
    /// nothing else needs them. They follow the coordinates of the base's map, or else of the clear coat's.
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinates, v downwards; each set is empty when the file has none.
    pub uv: [Vec<[f32; 2]>; 2],
    /// Linear colour and alpha that multiply the material's; empty when the file has none.
    pub colors: Vec<[f32; 4]>,
    /// Three per triangle, counter-clockwise seen from the front (clockwise after an instance that mirrors).
    pub indices: Vec<u32>,
    /// Into [`Scene::materials`](super::Scene::materials).
    pub material: usize,
    /// Whether `uv[0]` exists; without it a surface has no texture space, so no textures and no glints.
    pub has_uv: bool,
}

impl Mesh {
    /// How many triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// The smallest box around the triangles, in the mesh's space; none when there are none. Vertices that no triangle has
    /// may be anywhere.
    pub fn bounds(&self) -> Option<Bounds> {
        let used = self.indices.iter().filter_map(|&vertex| self.positions.get(vertex as usize));
        let [min, max] = used
            .map(|&corner| [Vec3::from(corner); 2])
            .reduce(|[low, high], [min, max]| [low.min(min), high.max(max)])?;
        Some(Bounds { min: min.as_dvec3(), max: max.as_dvec3() })
    }

    /// Drops the vertices that no triangle has, as of an array that many primitives of a file share.
    pub(crate) fn drop_unused_vertices(&mut self) {
        const UNUSED: u32 = u32::MAX;
        let mut places = vec![UNUSED; self.positions.len()];
        for &index in &self.indices {
            places[index as usize] = 0;
        }
        let origins: Vec<u32> = (0..).zip(&places).filter(|(_, place)| **place != UNUSED).map(|(k, _)| k).collect();
        if origins.len() == places.len() {
            return;
        }
        for (place, &origin) in (0..).zip(&origins) {
            places[origin as usize] = place;
        }
        for index in &mut self.indices {
            *index = places[*index as usize];
        }
        self.gather(&origins);
    }

    /// Replaces the vertices by copies of old ones: new vertex `k` is old vertex `origins[k]`. Indices stay as they are.
    pub(crate) fn gather(&mut self, origins: &[u32]) {
        fn gathered<T: Copy>(attribute: &mut Vec<T>, origins: &[u32]) {
            if !attribute.is_empty() {
                *attribute = origins.iter().map(|&origin| attribute[origin as usize]).collect();
            }
        }
        gathered(&mut self.positions, origins);
        gathered(&mut self.normals, origins);
        gathered(&mut self.tangents, origins);
        self.uv.iter_mut().for_each(|set| gathered(set, origins));
        gathered(&mut self.colors, origins);
    }
}

/// One placement of a mesh in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Into [`Scene::meshes`](super::Scene::meshes).
    pub mesh: usize,
    /// From the mesh's space to the world's; finite and invertible, any scale of any sign.
    pub world_from_local: DAffine3,
    /// The node's name.
    pub name: String,
}

impl Instance {
    /// Whether the transform mirrors: front faces then wind clockwise, and bitangents change their sign.
    pub fn mirrors(&self) -> bool {
        self.world_from_local.matrix3.determinant() < 0.0
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least corner.
    pub min: DVec3,
    /// The greatest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The smallest box around some points; none when there are none.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().map(|p| Self { min: p, max: p }).reduce(Self::union)
    }

    /// The smallest box around two.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// The length of half the diagonal.
    pub fn radius(&self) -> f64 {
        (self.max - self.min).length() * 0.5
    }
}
