//! A primitive of the document, read, checked, repaired and completed into a mesh (glTF 2.0, section 3.7.2).

use super::accessor::Reader;
use crate::scene::tangents;
use crate::scene::{Material, Mesh, SceneError, SceneErrorCode};
use ::gltf::json::Index;
use ::gltf::json::accessor::{Accessor, Type};
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DVec2, DVec3, Vec3};

const DAMAGED: &str = "the mesh is damaged or its exporter is at fault: export it again";

/// A mesh of one primitive, or none where there is nothing to show, and what had to be said about it.
pub struct Built {
    pub mesh: Option<Mesh>,
    pub warnings: Vec<String>,
}

/// Builds the mesh of one primitive with its material (and the index of that); `location` names the primitive, such as
/// `meshes[2].primitives[0]`.
pub fn build(
    reader: &Reader,
    primitive: &Primitive,
    name: String,
    (material, surface): (usize, &Material),
    location: &str,
) -> Result<Built, SceneError> {
    let mut warnings = Vec::new();
    let mut warn = |what: String| warnings.push(format!("{location}: {what}"));
    let Checked::Valid(mode) = primitive.mode else {
        let what = "a mode that does not exist; 0 to 6 do";
        return Err(SceneError::new(SceneErrorCode::ValueNotInRange, format!("{location}.mode"), what, DAMAGED));
    };
    if let Some(kind) = skipped(mode) {
        warn(format!("made of {kind}, which are not shown"));
        return Ok(Built { mesh: None, warnings });
    }
    let Some(position) = attribute(primitive, Semantic::Positions) else {
        warn("has no positions, so it is not shown".to_owned());
        return Ok(Built { mesh: None, warnings });
    };
    if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
        warn("its morph targets are not applied, it is shown at rest".to_owned());
    }
    if attribute(primitive, Semantic::TexCoords(2)).is_some() {
        warn("has more than two sets of texture coordinates, of which two are kept".to_owned());
    }

    let mut mesh = Mesh { name, material, ..Mesh::default() };
    let at = |attribute: &str| format!("{location}.attributes.{attribute}");
    mesh.positions = reader.vectors(position, &[Type::Vec3], 0.0, &at("POSITION"))?;
    if let Some(bad) = mesh.positions.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        let what = format!("position {bad} is {:?}", mesh.positions[bad]);
        return Err(SceneError::new(SceneErrorCode::AccessorInvalidFloat, at("POSITION"), what, DAMAGED));
    }
    read_attributes(reader, primitive, &mut mesh, normal_map_set(surface).is_some(), location, &mut warn)?;
    let indices = read_indices(reader, primitive.indices, mesh.positions.len(), location)?;
    if mode == Mode::Triangles && indices.len() % 3 != 0 {
        warn(format!("{} indices are no whole number of triangles; the last are left out", indices.len()));
    }
    reader.budget.claim(indices.len() as u64 * 12, location)?;
    mesh.indices = triangles(indices, mode);
    let degenerate = drop_degenerate(&mut mesh);
    if degenerate > 0 {
        warn(format!("{degenerate} triangles without area are left out"));
    }
    if mesh.indices.is_empty() {
        warn("has no triangles, so it is not shown".to_owned());
        return Ok(Built { mesh: None, warnings });
    }

    mesh.drop_unused_vertices();
    // Vertices may be split, up to one for each corner of a triangle.
    reader.budget.claim(mesh.indices.len() as u64 * 72, location)?;
    if mesh.normals.is_empty() {
        // As the specification has it: flat normals, and tangents that came without normals are void.
        mesh.tangents.clear();
        make_flat(&mut mesh);
    } else {
        let repaired = repair_normals(&mut mesh);
        if repaired > 0 {
            warn(format!("{repaired} normals that are zero or not finite are replaced by the triangles'"));
        }
    }
    if let Some(glint) = &surface.glint {
        let flat = flat_in_texture_space(&mesh, glint.uv_set);
        if flat > 0 {
            warn(format!("{flat} of its triangles have no area in texture space, so nothing glints there"));
        }
    }
    if let Some(uv_set) = normal_map_set(surface).filter(|_| mesh.has_uv) {
        let bad = tangents::repair(&mut mesh);
        if bad > 0 {
            warn(format!("{bad} tangents span no frame, so all are made anew"));
            mesh.tangents.clear();
        }
        if mesh.tangents.is_empty() {
            tangents::generate(&mut mesh, uv_set);
        }
    }
    Ok(Built { mesh: Some(mesh), warnings })
}

/// The texture coordinates that tangents follow; none without a normal map, as nothing else calls for tangents.
fn normal_map_set(surface: &Material) -> Option<usize> {
    let of_coat = surface.clearcoat.and_then(|coat| coat.normal_texture);
    surface.normal_texture.or(of_coat).map(|texture| texture.uv_set as usize)
}

/// What a primitive is made of when that is not triangles.
fn skipped(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::Points => Some("points"),
        Mode::Lines | Mode::LineLoop | Mode::LineStrip => Some("lines"),
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => None,
    }
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    primitive.attributes.get(&Checked::Valid(semantic)).copied()
}

fn read_attributes(
    reader: &Reader,
    primitive: &Primitive,
    mesh: &mut Mesh,
    wants_tangents: bool,
    location: &str,
    warn: &mut impl FnMut(String),
) -> Result<(), SceneError> {
    let vertices = mesh.positions.len();
    let at = |attribute: &str| format!("{location}.attributes.{attribute}");
    let as_long = |length: usize, attribute: &str| {
        if length == vertices {
            return Ok(());
        }
        let what = format!("{length} elements where there are {vertices} positions");
        Err(SceneError::new(SceneErrorCode::UnequalCounts, at(attribute), what, DAMAGED))
    };
    if let Some(accessor) = attribute(primitive, Semantic::Normals) {
        mesh.normals = reader.vectors(accessor, &[Type::Vec3], 0.0, &at("NORMAL"))?;
        as_long(mesh.normals.len(), "NORMAL")?;
    }
    for (k, set) in (0..).zip(&mut mesh.uv) {
        let name = &format!("TEXCOORD_{k}");
        let Some(accessor) = attribute(primitive, Semantic::TexCoords(k)) else { continue };
        *set = reader.vectors(accessor, &[Type::Vec2], 0.0, &at(name))?;
        as_long(set.len(), name)?;
        let repaired = repair(set, [0.0; 2]);
        if repaired > 0 {
            warn(format!("{repaired} texture coordinates of {name} are not finite and become 0"));
        }
    }
    if mesh.uv[0].is_empty() && !mesh.uv[1].is_empty() {
        warn("has TEXCOORD_1 without TEXCOORD_0; the one serves as the other too".to_owned());
        mesh.uv[0] = mesh.uv[1].clone();
    }
    mesh.has_uv = !mesh.uv[0].is_empty();
    if let Some(accessor) = attribute(primitive, Semantic::Tangents).filter(|_| wants_tangents && mesh.has_uv) {
        mesh.tangents = reader.vectors(accessor, &[Type::Vec4], 0.0, &at("TANGENT"))?;
        as_long(mesh.tangents.len(), "TANGENT")?;
    }
    if let Some(accessor) = attribute(primitive, Semantic::Colors(0)) {
        mesh.colors = reader.vectors(accessor, &[Type::Vec3, Type::Vec4], 1.0, &at("COLOR_0"))?;
        as_long(mesh.colors.len(), "COLOR_0")?;
        let repaired = repair(&mut mesh.colors, [1.0; 4]);
        if repaired > 0 {
            warn(format!("{repaired} vertex colours are not finite and become white"));
        }
        for color in &mut mesh.colors {
            *color = color.map(|c| c.max(0.0));
            color[3] = color[3].min(1.0);
        }
    }
    Ok(())
}

/// Replaces vectors that are not finite, and counts them.
fn repair<const N: usize>(vectors: &mut [[f32; N]], replacement: [f32; N]) -> usize {
    let mut repaired = 0;
    for vector in vectors.iter_mut().filter(|vector| !vector.iter().all(|c| c.is_finite())) {
        *vector = replacement;
        repaired += 1;
    }
    repaired
}

fn read_indices(
    reader: &Reader,
    accessor: Option<Index<Accessor>>,
    vertices: usize,
    location: &str,
) -> Result<Vec<u32>, SceneError> {
    let Some(accessor) = accessor else {
        reader.budget.claim(vertices as u64 * 4, location)?;
        return Ok((0..vertices as u32).collect());
    };
    let location = format!("{location}.indices");
    let indices = reader.indices(accessor, &location)?;
    match indices.iter().position(|&index| index as usize >= vertices) {
        None => Ok(indices),
        Some(bad) => {
            let what = format!("index {bad} is {}, but there are {vertices} vertices", indices[bad]);
            Err(SceneError::new(SceneErrorCode::AccessorIndexOob, location, what, DAMAGED))
        }
    }
}

/// A list of triangles from a list, a strip or a fan, each with the winding that the specification gives it.
fn triangles(mut indices: Vec<u32>, mode: Mode) -> Vec<u32> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .flat_map(|(k, w)| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => match indices.split_first() {
            Some((&hub, rim)) => rim.windows(2).flat_map(|w| [w[0], w[1], hub]).collect(),
            None => Vec::new(),
        },
        _ => {
            indices.truncate(indices.len() / 3 * 3);
            indices
        }
    }
}

/// Twice the area times the normal, and the longest edge; in f64, where no f32 position overflows.
fn cross_of(mesh: &Mesh, triangle: &[u32]) -> (DVec3, f64) {
    let [a, b, c] = [0, 1, 2].map(|k| DVec3::from(mesh.positions[triangle[k] as usize].map(f64::from)));
    let edges = [b - a, c - a, c - b];
    let longest = edges.iter().fold(0.0, |most: f64, edge| most.max(edge.length()));
    (edges[0].cross(edges[1]), longest)
}

/// Removes triangles whose area is nothing beside their longest edge, and counts them.
fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let before = mesh.triangle_count();
    let kept: Vec<u32> = mesh
        .indices
        .chunks_exact(3)
        .filter(|triangle| {
            let (cross, longest) = cross_of(mesh, triangle);
            cross.length() > 1e-10 * longest * longest
        })
        .flatten()
        .copied()
        .collect();
    mesh.indices = kept;
    before - mesh.triangle_count()
}

fn make_flat(mesh: &mut Mesh) {
    let normals: Vec<[f32; 3]> = mesh
        .indices
        .chunks_exact(3)
        .flat_map(|triangle| [cross_of(mesh, triangle).0.normalize().as_vec3().to_array(); 3])
        .collect();
    let corners = std::mem::take(&mut mesh.indices);
    mesh.gather(&corners);
    mesh.normals = normals;
    mesh.indices = (0..corners.len() as u32).collect();
}

/// How many triangles have no texture coordinates of that set, or collinear ones.
fn flat_in_texture_space(mesh: &Mesh, uv_set: u32) -> usize {
    let uv = &mesh.uv[usize::from(uv_set != 0)];
    if uv.is_empty() {
        return mesh.triangle_count();
    }
    let flat = |triangle: &&[u32]| {
        let [a, b, c] = [0, 1, 2].map(|k| DVec2::from(uv[triangle[k] as usize].map(f64::from)));
        let (e1, e2) = (b - a, c - a);
        e1.perp_dot(e2).abs() <= 1e-12 * e1.length() * e2.length()
    };
    mesh.indices.chunks_exact(3).filter(flat).count()
}

/// Makes normals unit; those that cannot be become the area-weighted mean of their triangles'. Counts the latter.
fn repair_normals(mesh: &mut Mesh) -> usize {
    let mut bad = vec![false; mesh.normals.len()];
    for (normal, bad) in mesh.normals.iter_mut().zip(&mut bad) {
        match unit(*normal) {
            Some(unit) => *normal = unit,
            None => *bad = true,
        }
    }
    let count = bad.iter().filter(|&&bad| bad).count();
    if count == 0 {
        return 0;
    }
    let mut sums = vec![DVec3::ZERO; mesh.normals.len()];
    for triangle in mesh.indices.chunks_exact(3) {
        let cross = cross_of(mesh, triangle).0;
        for &vertex in triangle {
            sums[vertex as usize] += cross;
        }
    }
    for ((normal, sum), _) in mesh.normals.iter_mut().zip(sums).zip(bad).filter(|(_, bad)| *bad) {
        *normal = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array();
    }
    count
}

/// The unit vector along a vector that is finite and not zero.
pub fn unit(vector: [f32; 3]) -> Option<[f32; 3]> {
    // In f64 neither the squares of the largest nor those of the smallest f32 leave the range.
    let vector = Vec3::from(vector).as_dvec3();
    (vector.is_finite() && vector.length() > 1e-30).then(|| vector.normalize().as_vec3().to_array())
}
