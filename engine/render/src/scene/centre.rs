//! Meshes far from their own origin, brought to it: f32 then tells their points apart as finely as the scene's.

use super::Scene;
use glam::{DAffine3, DVec3};

/// A mesh is far if the middle of its box is so many of the box's longest sides away from its origin.
const FAR: f64 = 2.0;

impl Scene {
    /// Moves the positions of each mesh that lies far from its own origin there, and its instances' transforms with it, so
    /// that everything stays where it is in the world to within half a unit in the last place of its size.
    ///
    /// A position in the world is computed from the local one in f32, and is off by as much as f32 rounds the local one.
    /// Rays that leave its surface start as much farther off it: at 1,000 times a mesh's size, by a twentieth of that.
    pub fn centre_far_meshes(&mut self) {
        let offsets: Vec<Option<DVec3>> = self.meshes.iter_mut().map(centre_if_far).collect();
        for instance in &mut self.instances {
            if let Some(Some(offset)) = offsets.get(instance.mesh) {
                instance.world_from_local *= DAffine3::from_translation(*offset);
            }
        }
    }
}

/// Where the origin of a mesh is now, in its former space; `None` if it stayed.
fn centre_if_far(mesh: &mut super::Mesh) -> Option<DVec3> {
    let bounds = mesh.bounds()?;
    let size = (bounds.max - bounds.min).max_element();
    // Rounded, so that differences between positions, which are multiples of the same unit, are mostly exact.
    let offset = bounds.center().as_vec3().as_dvec3();
    if offset.abs().max_element() <= FAR * size {
        return None;
    }
    for position in &mut mesh.positions {
        *position = (DVec3::from(position.map(f64::from)) - offset).as_vec3().to_array();
    }
    Some(offset)
}

#[cfg(test)]
mod tests {
    use crate::scene::{Instance, Mesh, Scene};
    use glam::{DAffine3, DQuat, DVec3};

    fn scene(place: DVec3) -> Scene {
        let corners = [DVec3::new(-0.5, 0.25, 0.125), DVec3::new(0.5, -0.75, 0.0), DVec3::new(0.0, 0.5, 1.0)];
        let mesh = Mesh {
            positions: corners.map(|corner| (corner + place).as_vec3().to_array()).to_vec(),
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
        let back = DAffine3::from_quat(turn) * DAffine3::from_translation(-place);
        let instance = |world_from_local| Instance { mesh: 0, world_from_local, name: String::new() };
        let instances = vec![instance(back), instance(DAffine3::from_scale(DVec3::new(-2.0, 1.0, 0.5)))];
        Scene { meshes: vec![mesh], instances, ..Scene::default() }
    }

    fn corners(scene: &Scene) -> Vec<DVec3> {
        let place = |position: &[f32; 3], map: &DAffine3| map.transform_point3(DVec3::from(position.map(f64::from)));
        let instances = scene.instances.iter();
        instances
            .flat_map(|instance| scene.meshes[0].positions.iter().map(move |p| place(p, &instance.world_from_local)))
            .collect()
    }

    #[test]
    fn a_far_mesh_comes_to_its_origin_and_stays_where_it_is_in_the_world() {
        let far = scene(DVec3::new(6e3, -7e3, 1e4));
        let mut near = far.clone();
        near.centre_far_meshes();
        let largest = near.meshes[0].positions.as_flattened().iter().fold(0.0f32, |largest, x| largest.max(x.abs()));
        assert!(largest < 1.0, "a coordinate is still {largest}");
        for (before, after) in corners(&far).into_iter().zip(corners(&near)) {
            assert!(before.distance(after) < 1e-6, "{before} moved to {after}");
        }
    }

    #[test]
    fn a_mesh_about_its_origin_keeps_its_bits() {
        let near = scene(DVec3::new(1.0, -1.0, 0.5));
        let mut same = near.clone();
        same.centre_far_meshes();
        assert_eq!(near, same);
    }
}
