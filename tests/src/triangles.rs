//! A scene's triangles in f64, and rays against every one of them: slow and plain.

use glam::DVec3;
use mica_render::scene::Scene;

/// One triangle of one instance.
struct Triangle {
    corners: [DVec3; 3],
    instance: usize,
    index: usize,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// In lengths of the ray's direction.
    pub t: f64,
    /// Into the scene's instances.
    pub instance: usize,
    /// In the list of its mesh.
    pub triangle: usize,
    /// Weights of its second and third corner.
    pub barycentrics: [f64; 2],
    /// The triangle's normal: unit, towards where the ray comes from.
    pub normal: DVec3,
}

/// All triangles of a scene, in world space.
pub struct Triangles(Vec<Triangle>);

impl Triangles {
    /// The triangles of every instance.
    pub fn of(scene: &Scene) -> Self {
        let instances = scene.instances.iter().enumerate();
        let of_instance = |(instance, placed): (usize, &mica_render::scene::Instance)| {
            let mesh = &scene.meshes[placed.mesh];
            let world_from_local = placed.world_from_local;
            let corner = move |vertex: &u32| {
                let local = DVec3::from(mesh.positions[*vertex as usize].map(f64::from));
                world_from_local.transform_point3(local)
            };
            mesh.indices.chunks_exact(3).enumerate().map(move |(index, vertices)| {
                let corners = [corner(&vertices[0]), corner(&vertices[1]), corner(&vertices[2])];
                Triangle { corners, instance, index }
            })
        };
        Self(instances.flat_map(of_instance).collect())
    }

    /// What a ray meets beyond `t_min`, in no order.
    pub fn met(&self, origin: DVec3, direction: DVec3, t_min: f64) -> impl Iterator<Item = Met> + '_ {
        self.0.iter().filter_map(move |triangle| {
            let [a, b, c] = triangle.corners;
            // Moeller and Trumbore 1997.
            let across = direction.cross(c - a);
            let determinant = (b - a).dot(across);
            let from_a = origin - a;
            let second = from_a.dot(across) / determinant;
            let turned = from_a.cross(b - a);
            let third = direction.dot(turned) / determinant;
            let t = (c - a).dot(turned) / determinant;
            // Edge-on, they are not finite, and no comparison holds.
            if !(second >= 0.0 && third >= 0.0 && second + third <= 1.0 && t > t_min && t.is_finite()) {
                return None;
            }
            let normal = (b - a).cross(c - a).normalize();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let barycentrics = [second, third];
            Some(Met { t, instance: triangle.instance, triangle: triangle.index, barycentrics, normal })
        })
    }

    /// What a ray meets first.
    pub fn first_met(&self, origin: DVec3, direction: DVec3) -> Option<Met> {
        self.met(origin, direction, 0.0).min_by(|a, b| a.t.total_cmp(&b.t))
    }
}

/// What holds at the centre of a pixel and a 64th of a pixel to each side of it; `None` where that differs, as there
/// rounding in f32 and the rasteriser's grid, of 256ths of a pixel, may decide either way.
pub fn decided<T: PartialEq>(pixel: [u32; 2], at: impl Fn([f64; 2]) -> T) -> Option<T> {
    const OFF: f64 = 1.0 / 64.0;
    let [x, y] = pixel.map(|part| f64::from(part) + 0.5);
    let here = at([x, y]);
    let around = [[x - OFF, y], [x + OFF, y], [x, y - OFF], [x, y + OFF]];
    around.into_iter().all(|point| at(point) == here).then_some(here)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::plane;
    use mica_render::scene::Material;

    #[test]
    fn a_ray_meets_the_plane_where_it_crosses_it() {
        let triangles = Triangles::of(&plane(Material::default(), 2.0));
        let met = triangles.first_met(DVec3::new(0.5, 3.0, 1.0), DVec3::new(0.0, -2.0, 0.1)).expect("it is below");
        assert!((met.t - 1.5).abs() < 1e-12 && met.normal == DVec3::Y, "{met:?}");
        assert!(triangles.first_met(DVec3::new(0.5, 3.0, 1.0), DVec3::Y).is_none(), "nothing is above");
        assert!(triangles.first_met(DVec3::new(2.5, 3.0, 1.0), -DVec3::Y).is_none(), "nothing is beside");
    }

    #[test]
    fn a_pixel_on_an_edge_is_undecided() {
        let right_of = |edge: f64| move |[x, _]: [f64; 2]| x > edge;
        assert_eq!(decided([3, 0], right_of(3.51)), None);
        assert_eq!(decided([3, 0], right_of(3.45)), Some(true));
    }
}
