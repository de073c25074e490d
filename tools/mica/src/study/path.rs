//! The camera's path: sideways, a quarter of a pixel with each frame.

use super::place::OpenPlace;
use crate::session::Surface;
use glam::{DVec3, Vec3};
use mica_render::View;
use mica_render::scene::{Camera, Scene};

/// Pixels by which glints at their median distance move from frame to frame.
const STEP_PIXELS: f64 = 0.25;

/// The views of a path, the first of them the place's own; `surface` is what that one sees. Empty where a path of so few
/// frames shows no change.
pub fn views(open: &OpenPlace, surface: &Surface, frames: u32) -> Vec<View> {
    let view = &open.session.view;
    let glinting = open.glinting(surface);
    let mut depths: Vec<f64> = (0..)
        .zip(surface.ids.iter().zip(&glinting))
        .filter(|(_, (_, glints))| **glints)
        .filter_map(|(pixel, (ids, _))| depth(open.session.renderer.scene(), view, pixel, *ids))
        .collect();
    if frames < 2 || depths.is_empty() {
        return Vec::new();
    }
    depths.sort_by(f64::total_cmp);
    let pixel = 2.0 * (0.5 * view.camera.vertical_fov_radians).tan() / f64::from(view.size[1]);
    let step = view.camera.world_from_camera.matrix3.x_axis * (STEP_PIXELS * pixel * depths[depths.len() / 2]);
    let moved = |frame: u32| {
        let mut camera: Camera = view.camera.clone();
        camera.world_from_camera.translation += step * f64::from(frame);
        View { camera, ..view.clone() }
    };
    (0..frames).map(moved).collect()
}

/// Distance along the view of what the centre of a pixel sees: where its ray meets the plane of the triangle.
fn depth(scene: &Scene, view: &View, pixel: u32, [instance, triangle]: [u32; 2]) -> Option<f64> {
    let instance = scene.instances.get((instance as usize).checked_sub(1)?)?;
    let mesh = scene.meshes.get(instance.mesh)?;
    let corners = mesh.indices.as_chunks::<3>().0.get(triangle as usize)?;
    let camera_from_world = view.camera.world_from_camera.inverse();
    let corner = |vertex: u32| {
        let local = Vec3::from(mesh.positions[vertex as usize]).as_dvec3();
        camera_from_world.transform_point3(instance.world_from_local.transform_point3(local))
    };
    let [a, b, c] = corners.map(corner);
    let normal = (b - a).cross(c - a);
    let [width, height] = view.size.map(f64::from);
    let side = 2.0 * (0.5 * view.camera.vertical_fov_radians).tan() / height;
    let [x, y] = [f64::from(pixel % view.size[0]), f64::from(pixel / view.size[0])];
    let ray = DVec3::new((x + 0.5 - 0.5 * width) * side, (0.5 * height - y - 0.5) * side, -1.0);
    Some(normal.dot(a) / normal.dot(ray)).filter(|depth| depth.is_finite() && *depth > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use mica_render::scene::{Instance, Mesh};

    #[test]
    fn depth_is_where_the_ray_meets_the_triangle() {
        // A wall 7 m in front of the eye, turned by 45 degrees about the vertical.
        let positions = vec![[-9.0, -5.0, -9.0], [9.0, -5.0, 9.0], [0.0, 9.0, 0.0]];
        let mesh = Mesh { positions, indices: vec![0, 1, 2], ..Mesh::default() };
        let world_from_local = DAffine3::from_translation(DVec3::new(0.0, 0.0, -2.0));
        let instance = Instance { mesh: 0, world_from_local, name: String::new() };
        let scene = Scene { meshes: vec![mesh], instances: vec![instance], ..Scene::default() };
        let camera = Camera::looking_at("test", DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 90_f64.to_radians(), 0.1);
        let view = View::new(camera, [3, 3]);
        let at = |pixel| depth(&scene, &view, pixel, [1, 0]).expect("it is seen");
        assert!((at(4) - 7.0).abs() < 1e-9);
        // Half a right angle covers 1.5 pixels: the next pixel's ray leans by 2/3, and x = d 2/3 = 7 - d.
        assert!((at(5) - 7.0 / (1.0 + 2.0 / 3.0)).abs() < 1e-9);
        assert_eq!(depth(&scene, &view, 4, [0, 0]), None);
        assert_eq!(depth(&scene, &view, 4, [1, 7]), None);
    }
}
