//! Tangent frames along texture coordinates: those given, repaired, and those missing, by MikkTSpace.

use super::Mesh;
use bevy_mikktspace::{Geometry, TangentSpace};
use glam::{DVec3, Vec3};

/// Gives a mesh with normals and texture coordinates its tangents: along u of one set (of the first, if that is
/// missing) by MikkTSpace, which may split vertices; where u leads nowhere, any that are orthogonal to the normals.
pub(crate) fn generate(mesh: &mut Mesh, uv_set: usize) {
    let uv_set = if mesh.uv[uv_set].is_empty() { 0 } else { uv_set };
    let mut corners = Corners { mesh, uv_set, tangents: vec![None; mesh.indices.len()] };
    // Its error has no values yet; should it get one, corners without an answer take any tangent.
    let _ = bevy_mikktspace::generate_tangents(&mut corners);
    let found = corners.tangents;
    let tangents: Vec<[f32; 4]> = found
        .into_iter()
        .zip(&mesh.indices)
        .map(|(found, &vertex)| {
            let normal = mesh.normals[vertex as usize];
            // MikkTSpace's bitangent points towards +v; with glTF's downward v, +Y of a normal map is -v.
            found
                .and_then(|space| orthonormal(space.tangent(), normal).map(|t| (t, space.is_orientation_preserving())))
                .map_or_else(
                    || any_tangent(normal),
                    |(t, along_v)| [t[0], t[1], t[2], if along_v { -1.0 } else { 1.0 }],
                )
        })
        .collect();
    weld(mesh, &tangents);
}

/// Makes given tangents unit and orthogonal to the normals; counts those that span no frame, and leaves them.
pub(crate) fn repair(mesh: &mut Mesh) -> usize {
    let mut bad = 0;
    for (tangent, &normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        let [x, y, z, w] = *tangent;
        match orthonormal([x, y, z], normal) {
            Some(t) if w != 0.0 && w.is_finite() => *tangent = [t[0], t[1], t[2], w.signum()],
            _ => bad += 1,
        }
    }
    bad
}

/// The part of a tangent that is orthogonal to a unit normal, made unit; none when there is next to nothing of it.
fn orthonormal(tangent: [f32; 3], normal: [f32; 3]) -> Option<[f32; 3]> {
    // Made unit again in f64: what an f32 normal lacks would grow where the tangent is all but parallel to it.
    let (tangent, normal) = (Vec3::from(tangent).as_dvec3(), Vec3::from(normal).as_dvec3().normalize());
    let flat = tangent - normal * normal.dot(tangent);
    (flat.is_finite() && flat.length_squared() > 1e-8 * tangent.length_squared())
        .then(|| flat.normalize().as_vec3().to_array())
}

/// A tangent for a normal, continuous but for one seam (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
fn any_tangent(normal: [f32; 3]) -> [f32; 4] {
    let n = Vec3::from(normal).as_dvec3().normalize();
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    DVec3::new(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x).as_vec3().extend(1.0).to_array()
}

/// The mesh as MikkTSpace asks for it.
struct Corners<'a> {
    mesh: &'a Mesh,
    uv_set: usize,
    tangents: Vec<Option<TangentSpace>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[face * 3 + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangle_count()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)]
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.mesh.uv[self.uv_set][self.vertex(face, corner)]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[face * 3 + corner] = space;
    }
}

/// Gives each corner its tangent; a vertex whose corners disagree is split into as many as needed.
fn weld(mesh: &mut Mesh, tangents: &[[f32; 4]]) {
    const NONE: u32 = u32::MAX;
    // Each old vertex heads a list of the new ones that came of it.
    let mut heads = vec![NONE; mesh.positions.len()];
    let mut next: Vec<u32> = Vec::new();
    let mut origins: Vec<u32> = Vec::new();
    let mut kept: Vec<[f32; 4]> = Vec::new();
    for (corner, tangent) in mesh.indices.iter_mut().zip(tangents) {
        let head = &mut heads[*corner as usize];
        let mut vertex = *head;
        while vertex != NONE && kept[vertex as usize] != *tangent {
            vertex = next[vertex as usize];
        }
        if vertex == NONE {
            vertex = kept.len() as u32;
            kept.push(*tangent);
            origins.push(*corner);
            next.push(*head);
            *head = vertex;
        }
        *corner = vertex;
    }
    mesh.gather(&origins);
    mesh.tangents = kept;
}
