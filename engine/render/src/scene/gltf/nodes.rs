//! The hierarchy of nodes, walked once: instances, lights and cameras in world space (glTF 2.0, section 3.5).

use super::accessor::named;
use super::limits::LoadLimits;
use crate::scene::{Camera, EquirectMap, Light, SceneError, SceneErrorCode};
use ::gltf::json;
use ::gltf::json::extensions::scene::khr_lights_punctual as punctual;
use ::gltf::json::validation::Checked;
use ::gltf::json::{Node, Root};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

const DAMAGED: &str = "export the scene again, or mend it in an editor";

/// The greatest power of a light, W/sr or W/m2: as for an environment, so that sums fit a 32-bit float.
const MOST_POWER: f32 = EquirectMap::GREATEST;

/// What the nodes of a scene place in the world.
#[derive(Default)]
pub struct Placed {
    /// The index of the document's mesh, from its space to the world's, and the node's name.
    pub meshes: Vec<(usize, DAffine3, String)>,
    pub lights: Vec<Light>,
    pub cameras: Vec<Camera>,
    pub warnings: Vec<String>,
}

/// Walks the document's scene: the one it names, or its first, or all roots when it has none.
pub fn walk(document: &Root, limits: &LoadLimits) -> Result<Placed, SceneError> {
    let parents = parents(document)?;
    let mut listed = vec![false; document.nodes.len()];
    let roots: Vec<usize> = match scene_index(document)? {
        Some(scene) => {
            let roots: Vec<usize> = document.scenes[scene].nodes.iter().map(json::Index::value).collect();
            for (k, &root) in roots.iter().enumerate() {
                let location = format!("scenes[{scene}].nodes[{k}]");
                named(&document.nodes, root, "nodes", &location)?;
                if parents[root].is_some() {
                    let what = format!("nodes[{root}] is a child of another node");
                    return Err(SceneError::new(SceneErrorCode::SceneNonRootNode, location, what, DAMAGED));
                }
                if std::mem::replace(&mut listed[root], true) {
                    let what = format!("lists nodes[{root}] twice");
                    return Err(SceneError::new(SceneErrorCode::NodeParentOverride, location, what, DAMAGED));
                }
            }
            roots
        }
        None => (0..document.nodes.len()).filter(|&k| parents[k].is_none()).collect(),
    };

    let mut placed = Placed::default();
    let mut instances = 0;
    // A stack of our own: a file's depth must not become the thread's.
    let mut pending: Vec<(usize, DAffine3, usize)> =
        roots.into_iter().rev().map(|n| (n, DAffine3::IDENTITY, 0)).collect();
    while let Some((index, world_from_parent, depth)) = pending.pop() {
        let location = format!("nodes[{index}]");
        if depth > limits.node_depth {
            let what = format!("has more than {} ancestors", limits.node_depth);
            return Err(SceneError::new(SceneErrorCode::NodeTooDeep, location, what, "flatten the hierarchy"));
        }
        let node = named(&document.nodes, index, "nodes", &location)?;
        let world_from_node = world_from_parent * local_transform(node, &location)?;
        if !world_from_node.is_finite() {
            let what = "its place in the world is not finite";
            return Err(SceneError::new(SceneErrorCode::NodeTransform, location, what, DAMAGED));
        }
        if let Some(mesh) = node.mesh {
            instances += named(&document.meshes, mesh.value(), "meshes", &location)?.primitives.len();
            if instances > limits.instances {
                let what = format!("more than {} placements of primitives", limits.instances);
                return Err(SceneError::new(SceneErrorCode::SceneTooLarge, location, what, "split the scene"));
            }
        }
        placed.add(document, node, world_from_node, &location)?;
        pending.extend(children(node).rev().map(|child| (child, world_from_node, depth + 1)));
    }
    Ok(placed)
}

/// Which scene is shown; none when the document has no scenes.
pub fn scene_index(document: &Root) -> Result<Option<usize>, SceneError> {
    match document.scene {
        Some(index) => named(&document.scenes, index.value(), "scenes", "scene").map(|_| Some(index.value())),
        None if document.scenes.is_empty() => Ok(None),
        None => Ok(Some(0)),
    }
}

/// Each node's parent. Fails unless the nodes form trees.
fn parents(document: &Root) -> Result<Vec<Option<usize>>, SceneError> {
    let mut parents = vec![None; document.nodes.len()];
    for (parent, node) in document.nodes.iter().enumerate() {
        for (k, child) in children(node).enumerate() {
            let location = format!("nodes[{parent}].children[{k}]");
            named(&document.nodes, child, "nodes", &location)?;
            if let Some(other) = parents[child].replace(parent) {
                let code = if other == parent || child != parent {
                    SceneErrorCode::NodeParentOverride
                } else {
                    SceneErrorCode::NodeLoop
                };
                let what = format!("nodes[{child}] is a child of nodes[{other}] already");
                return Err(SceneError::new(code, location, what, DAMAGED));
            }
        }
    }
    // With one parent each, a loop is exactly what no root reaches.
    let mut reached = vec![false; parents.len()];
    let mut pending: Vec<usize> = (0..parents.len()).filter(|&k| parents[k].is_none()).collect();
    while let Some(node) = pending.pop() {
        reached[node] = true;
        pending.extend(children(&document.nodes[node]));
    }
    match reached.iter().position(|&reached| !reached) {
        None => Ok(parents),
        Some(node) => Err(SceneError::new(
            SceneErrorCode::NodeLoop,
            format!("nodes[{node}]"),
            "is its own ancestor, or hangs from a node that is",
            DAMAGED,
        )),
    }
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(json::Index::value)
}

fn local_transform(node: &Node, location: &str) -> Result<DAffine3, SceneError> {
    let wrong = |what: String| SceneError::new(SceneErrorCode::NodeTransform, location, what, DAMAGED);
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        if matrix.row(3).abs_diff_eq(glam::DVec4::W, 1e-6) {
            return Ok(DAffine3::from_mat4(matrix));
        }
        return Err(wrong("its matrix is not affine: the last row is not 0, 0, 0, 1".to_owned()));
    }
    let rotation = match node.rotation {
        None => DQuat::IDENTITY,
        Some(rotation) => {
            let [x, y, z, w] = rotation.0.map(f64::from);
            let largest = [x, y, z, w].into_iter().fold(0.0, |most: f64, c| most.max(c.abs()));
            // Scaled first, so that the length of a huge quaternion does not overflow.
            let scaled = DQuat::from_xyzw(x / largest, y / largest, z / largest, w / largest);
            if largest < 1e-6 || !scaled.is_finite() {
                return Err(wrong(format!("rotation ({x}, {y}, {z}, {w}) is no quaternion of a rotation")));
            }
            scaled.normalize()
        }
    };
    let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]).map(f64::from));
    let translation = DVec3::from(node.translation.unwrap_or_default().map(f64::from));
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

impl Placed {
    fn add(
        &mut self,
        document: &Root,
        node: &Node,
        world_from_node: DAffine3,
        location: &str,
    ) -> Result<(), SceneError> {
        if let Some(mesh) = node.mesh {
            let [x, y, z] = world_from_node.matrix3.to_cols_array_2d().map(DVec3::from);
            let volume = world_from_node.matrix3.determinant().abs();
            if volume <= 1e-12 * x.length() * y.length() * z.length() || !world_from_node.inverse().is_finite() {
                self.warnings.push(format!("{location}: its scale is zero along an axis, so its mesh is not shown"));
            } else {
                let name = node.name.clone().unwrap_or_else(|| location.to_owned());
                self.meshes.push((mesh.value(), world_from_node, name));
            }
            if node.skin.is_some() {
                self.warnings.push(format!("{location}: its skin is not applied, the mesh is shown at rest"));
            }
        }
        if let Some(reference) = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref())
        {
            let location = format!("{location}.extensions.KHR_lights_punctual.light");
            let lights: &[punctual::Light] = document.as_ref();
            let light = named(lights, reference.light.value(), "lights", &location)?;
            self.lights.push(placed_light(light, world_from_node, &location)?);
        }
        if let Some(index) = node.camera {
            let camera = named(&document.cameras, index.value(), "cameras", location)?;
            let location = format!("cameras[{}]", index.value());
            let name = camera.name.as_ref().or(node.name.as_ref()).unwrap_or(&location).clone();
            match rigid(world_from_node) {
                Some(rigid) => self.cameras.extend(placed_camera(camera, name, rigid, &location, &mut self.warnings)?),
                None => self.warnings.push(format!("{location}: its node is flat, so it is left out")),
            }
        }
        Ok(())
    }
}

/// The transform without its scale and shear: what it does to a camera's axes, made orthonormal.
fn rigid(transform: DAffine3) -> Option<DAffine3> {
    let backwards = transform.matrix3.z_axis.try_normalize()?;
    let right = transform.matrix3.y_axis.cross(backwards).try_normalize()?;
    let rotation = DMat3::from_cols(right, backwards.cross(right), backwards);
    Some(DAffine3::from_mat3_translation(rotation, transform.translation))
}

fn placed_light(light: &punctual::Light, world_from_node: DAffine3, location: &str) -> Result<Light, SceneError> {
    let wrong = |what: String| {
        SceneError::new(SceneErrorCode::ValueNotInRange, location, what, "set it in the exporter to a physical value")
    };
    let power = light.color.map(|c| c * light.intensity);
    if !power.iter().all(|p| (0.0..=MOST_POWER).contains(p)) {
        return Err(wrong(format!("colour times intensity is {power:?}, where 0 to {MOST_POWER:e} is needed")));
    }
    let range = light.range;
    if range.is_some_and(|range| range.is_nan() || range <= 0.0) {
        return Err(wrong(format!("range {range:?} is not positive")));
    }
    let position = world_from_node.translation;
    let direction = -world_from_node.matrix3.z_axis;
    let direction =
        || direction.try_normalize().ok_or_else(|| wrong("its node's scale is zero, so it points nowhere".to_owned()));
    match light.type_ {
        Checked::Valid(punctual::Type::Point) => Ok(Light::Point { position, radiant_intensity: power, range }),
        Checked::Valid(punctual::Type::Directional) => {
            Ok(Light::Directional { direction: direction()?, irradiance: power })
        }
        Checked::Valid(punctual::Type::Spot) => {
            let (inner, outer) =
                light.spot.as_ref().map_or((0.0, FRAC_PI_4), |spot| (spot.inner_cone_angle, spot.outer_cone_angle));
            // Exporters round pi/2 upwards.
            if !(inner >= 0.0 && inner < outer && outer <= FRAC_PI_2 + 1e-5) {
                return Err(wrong(format!("cone angles {inner} and {outer}, where 0 <= inner < outer <= pi/2")));
            }
            Ok(Light::Spot {
                position,
                direction: direction()?,
                radiant_intensity: power,
                range,
                inner_cone_radians: inner,
                outer_cone_radians: outer.min(FRAC_PI_2),
            })
        }
        Checked::Invalid => Err(wrong("its type does not exist; point, directional and spot do".to_owned())),
    }
}

fn placed_camera(
    camera: &json::Camera,
    name: String,
    world_from_camera: DAffine3,
    location: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<Camera>, SceneError> {
    let wrong =
        |what: String| SceneError::new(SceneErrorCode::ValueNotInRange, location, what, "set it in the exporter");
    if let Some(lens) = &camera.perspective {
        if !(lens.yfov > 0.0 && lens.yfov < PI) {
            return Err(wrong(format!("yfov {}, where more than 0 and less than pi is needed", lens.yfov)));
        }
        if lens.znear.is_nan() || lens.znear <= 0.0 {
            return Err(wrong(format!("znear {}, where more than 0 is needed", lens.znear)));
        }
        let (vertical_fov_radians, near) = (f64::from(lens.yfov), f64::from(lens.znear));
        return Ok(Some(Camera { name, world_from_camera, vertical_fov_radians, near }));
    }
    let Some(lens) = &camera.orthographic else {
        warnings.push(format!("{location}: neither perspective nor orthographic, left out"));
        return Ok(None);
    };
    if lens.ymag == 0.0 || lens.znear.is_nan() || lens.znear < 0.0 {
        return Err(wrong(format!("ymag {} and znear {}, where 0 < ymag and 0 <= znear", lens.ymag, lens.znear)));
    }
    // So far away that lines diverge by 2 degrees over the picture, with nothing seen that was behind the camera.
    let vertical_fov_radians = 2f64.to_radians();
    let distance = f64::from(lens.ymag).abs() / (vertical_fov_radians / 2.0).tan();
    let mut world_from_camera = world_from_camera;
    world_from_camera.translation += distance * world_from_camera.matrix3.z_axis;
    warnings.push(format!("{location}: orthographic, approximated by a perspective of 2 degrees from {distance} away"));
    Ok(Some(Camera { name, world_from_camera, vertical_fov_radians, near: distance + f64::from(lens.znear) }))
}
