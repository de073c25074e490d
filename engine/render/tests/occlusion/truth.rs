//! What f64 says of a ray, and what rounding to f32 may change of it.
//!
//! Both bodies take a ray into the space of a mesh, shear it onto its longest axis there and look at three edge
//! functions (Woop, Benthin and Wald 2013): ours in f32, lavapipe's driver in f32 up to the products. [`Crossing`] is
//! that computation in f64 with a running bound beside each value (Higham 2002, section 3.3): one [`U`] of the operands
//! for each operation of f32, [`PLACING`] of them for the ray's way into the mesh. What lies within the bound f32
//! cannot decide; what lies outside it, it must get right.

use crate::driver_inverse;
use glam::{DAffine3, DMat3, DVec2, DVec3};
use mica_render::OcclusionBackend;
use mica_render::scene::bvh::Placements;
use mica_render::scene::{Mesh, Scene};
use mica_shaders::types::{Ray, RayAnswer};
use std::collections::HashMap;

/// What one operation of f32 rounds by, relative to its result.
pub const U: f64 = 0.5 * f32::EPSILON as f64;

/// Operations on a ray's way into a mesh: a coefficient, a product, three sums, and three in reserve.
pub const PLACING: f64 = 8.0;

/// What a quotient rounds by, in [`U`]: Vulkan lets it be wrong by 2.5 units in the last place.
const DIVISION: f64 = 5.0;

/// One triangle along one ray.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// How far inside its edges the ray passes, over what rounding may move it by: above 1 surely inside, below -1 surely
    /// outside.
    pub margin: f64,
    /// Where the ray meets its plane, in lengths of the ray's direction.
    pub t: f64,
    /// What rounding may move that by.
    pub t_error: f64,
    /// Weights of the second and the third corner.
    pub barycentrics: [f64; 2],
    /// What rounding may move each of them by.
    pub barycentrics_error: f64,
}

/// Where an instance is, with what f32 makes of that.
struct Place {
    scene_from_local: DAffine3,
    local_from_scene: DAffine3,
    /// Whether its triangles are stored in scene space, each corner rounded to f32.
    in_scene_space: bool,
    /// What becomes of a ray by the hierarchy, and by a driver.
    by_bvh: Placing,
    by_driver: Placing,
    /// Its triangles among all.
    first: usize,
}

/// Error of a point taken into a mesh, in [`PLACING`] times [`U`].
#[derive(Clone, Copy)]
struct Placing {
    /// For each unit of the point's coordinates.
    per_unit: DMat3,
    /// Whatever the point.
    fixed: DVec3,
}

impl Placing {
    /// Of what stays in the space it is in.
    const NONE: Self = Self { per_unit: DMat3::ZERO, fixed: DVec3::ZERO };
}

/// Every triangle of a scene.
pub struct World {
    places: Vec<Place>,
    /// Corners in the space that the bodies test them in.
    local: Vec<[DVec3; 3]>,
    /// Corners in scene space.
    scene: Vec<[DVec3; 3]>,
    /// Which instance each belongs to.
    instance: Vec<u32>,
    /// The first triangle of the same instance with the same corners.
    twin: Vec<u32>,
    /// The triangles that are their own twin, each with a sphere around it.
    distinct: Vec<(u32, DVec3, f64)>,
    /// Largest coordinate of all, in scene space.
    reach: f64,
    masks: Option<Masks>,
}

/// Whether a triangle of an instance is there where a ray crosses it; nothing where rounding decides.
type Masks = Box<dyn Fn(usize, usize, &Crossing) -> Option<bool> + Sync>;

impl World {
    /// About `center`, where scene space has its origin.
    pub fn new(scene: &Scene, center: DVec3) -> Self {
        let mut world = Self {
            places: Vec::new(),
            local: Vec::new(),
            scene: Vec::new(),
            instance: Vec::new(),
            twin: Vec::new(),
            distinct: Vec::new(),
            reach: 0.0,
            masks: None,
        };
        let to_scene = DAffine3::from_translation(-center);
        let places: Vec<(usize, DAffine3)> =
            scene.instances.iter().map(|instance| (instance.mesh, to_scene * instance.world_from_local)).collect();
        let corners_of = |mesh: usize| {
            let mesh = &scene.meshes[mesh];
            mesh.indices.iter().map(|&vertex| mesh.positions[vertex as usize])
        };
        // Which of them both bodies look at in scene space is theirs to say: it decides where the roundings fall.
        let placements = Placements::new(&places, scene.meshes.len(), corners_of).expect("a usable scene");
        let in_scene_space = |instance: usize| {
            placements.list().iter().any(|placed| placed.instance == instance && placed.in_scene_space)
        };
        for placed in placements.list() {
            world.reach = world.reach.max(placed.lower.abs().max(placed.upper.abs()).max_element());
        }
        for (index, &(mesh, scene_from_local)) in places.iter().enumerate() {
            let place = Place::new(scene_from_local, in_scene_space(index), world.local.len());
            world.add(index as u32, &scene.meshes[mesh], place);
        }
        world
    }

    fn add(&mut self, index: u32, mesh: &Mesh, place: Place) {
        let scene_from_local = place.scene_from_local;
        let mut seen = HashMap::new();
        for corners in mesh.indices.as_chunks::<3>().0 {
            let exact = corners.map(|vertex| DVec3::from(mesh.positions[vertex as usize].map(f64::from)));
            let (local, scene) = if place.in_scene_space {
                let rounded = exact.map(|corner| scene_from_local.transform_point3(corner).as_vec3().as_dvec3());
                (rounded, rounded)
            } else {
                (exact, exact.map(|corner| scene_from_local.transform_point3(corner)))
            };
            let triangle = self.local.len() as u32;
            let bits = local.map(|corner| corner.to_array().map(f64::to_bits));
            let twin = *seen.entry(bits).or_insert(triangle);
            if twin == triangle {
                let middle = (scene[0] + scene[1] + scene[2]) / 3.0;
                let radius = scene.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
                self.distinct.push((triangle, middle, (radius * (1.0 + 1e-9)).powi(2)));
            }
            self.local.push(local);
            self.scene.push(scene);
            self.instance.push(index);
            self.twin.push(twin);
        }
        self.places.push(place);
    }

    /// The same with holes in its triangles.
    pub fn with_masks(self, masks: impl Fn(usize, usize, &Crossing) -> Option<bool> + Sync + 'static) -> Self {
        Self { masks: Some(Box::new(masks)), ..self }
    }

    /// Whether a triangle is there where a ray crosses it.
    pub fn is_there(&self, triangle: u32, crossing: &Crossing) -> Option<bool> {
        let (instance, of_mesh) = self.in_mesh(triangle);
        self.masks.as_ref().map_or(Some(true), |masks| masks(instance, of_mesh, crossing))
    }

    /// How many triangles there are, each as often as its mesh is placed.
    pub fn triangles(&self) -> usize {
        self.local.len()
    }

    /// The largest coordinate in scene space.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The corners of a triangle, in scene space.
    pub fn triangle(&self, triangle: usize) -> [DVec3; 3] {
        self.scene[triangle]
    }

    /// The instance of a triangle, and which one of its mesh it is.
    pub fn in_mesh(&self, triangle: u32) -> (usize, usize) {
        let instance = self.instance[triangle as usize] as usize;
        (instance, triangle as usize - self.places[instance].first)
    }

    /// The first triangle of the same instance with the same corners.
    pub fn twin(&self, triangle: u32) -> u32 {
        self.twin[triangle as usize]
    }

    /// The triangle that an answer names, or the first one that is the same; none if there is no such triangle.
    pub fn named(&self, answer: &RayAnswer) -> Option<u32> {
        let place = self.places.get(answer.instance as usize)?;
        let triangle = place.first + answer.triangle as usize;
        (self.instance.get(triangle) == Some(&answer.instance)).then(|| self.twin[triangle])
    }

    /// The nearest place at which a ray surely meets something, with what rounding may add to it: no answer of that body may
    /// be later.
    pub fn first_certain(&self, ray: &Ray, of: OcclusionBackend) -> f64 {
        let origin = DVec3::from(ray.origin.map(f64::from));
        let unit = DVec3::from(ray.direction.map(f64::from)).normalize();
        let mut first = f64::INFINITY;
        for &(triangle, middle, radius_squared) in &self.distinct {
            if (middle - origin).cross(unit).length_squared() > radius_squared {
                continue;
            }
            let found = self.crossing(triangle, ray, of);
            let late = found.t + found.t_error;
            let between = found.t - found.t_error > f64::from(ray.t_min) && late < f64::from(ray.t_max);
            if found.margin > 1.0 && between && self.is_there(triangle, &found) == Some(true) {
                first = first.min(late);
            }
        }
        first
    }

    /// Where a ray passes one triangle, as that body may see it.
    pub fn crossing(&self, triangle: u32, ray: &Ray, of: OcclusionBackend) -> Crossing {
        let place = &self.places[self.instance[triangle as usize] as usize];
        place.crossing(self.local[triangle as usize], ray, of)
    }
}

fn absolute(matrix: DMat3) -> DMat3 {
    DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
}

/// A value and what rounding may have moved it by.
#[derive(Clone, Copy)]
struct Rounded {
    value: f64,
    error: f64,
}

impl Rounded {
    /// a * b - c * d, as an edge function has it.
    fn cross(a: Self, b: Self, c: Self, d: Self) -> Self {
        let product = |x: Self, y: Self| {
            x.value.abs() * y.error + y.value.abs() * x.error + x.error * y.error + 2.0 * U * (x.value * y.value).abs()
        };
        Self { value: a.value * b.value - c.value * d.value, error: product(a, b) + product(c, d) }
    }
}

impl Place {
    fn new(scene_from_local: DAffine3, in_scene_space: bool, first: usize) -> Self {
        if in_scene_space || scene_from_local == DAffine3::IDENTITY {
            let local_from_scene = DAffine3::IDENTITY;
            let (by_bvh, by_driver) = (Placing::NONE, Placing::NONE);
            return Self { scene_from_local, local_from_scene, in_scene_space, by_bvh, by_driver, first };
        }
        let local_from_scene = scene_from_local.inverse();
        let (there, back) = (absolute(scene_from_local.matrix3), absolute(local_from_scene.matrix3));
        // The host inverts in f64 and rounds the inverse.
        let by_bvh = Placing { per_unit: back, fixed: local_from_scene.translation.abs() };
        // A driver is given the rounded placement, to which |M| |W| |M| is what its inverse is sensitive, and inverts it in
        // f32 itself.
        let per_unit = back * there * back + driver_inverse::inverse_error(scene_from_local);
        let by_driver = Placing { per_unit, fixed: per_unit * scene_from_local.translation.abs() };
        Self { scene_from_local, local_from_scene, in_scene_space, by_bvh, by_driver, first }
    }

    fn crossing(&self, corners: [DVec3; 3], ray: &Ray, of: OcclusionBackend) -> Crossing {
        let origin = DVec3::from(ray.origin.map(f64::from));
        let direction = DVec3::from(ray.direction.map(f64::from));
        let Placing { per_unit, fixed } = if of == OcclusionBackend::Bvh { self.by_bvh } else { self.by_driver };
        let origin_error = PLACING * U * (per_unit * origin.abs() + fixed);
        let direction_error = PLACING * U * (per_unit * direction.abs());
        let origin = self.local_from_scene.transform_point3(origin);
        let direction = self.local_from_scene.transform_vector3(direction);

        let axis = direction.abs().max_position();
        let turned = |v: DVec3| match axis {
            2 => v,
            1 => DVec3::new(v.z, v.x, v.y),
            _ => DVec3::new(v.y, v.z, v.x),
        };
        let (along, along_error) = (turned(direction), turned(direction_error));
        let shear = along.truncate() / along.z;
        let shear_error =
            (along_error.truncate() + shear.abs() * along_error.z) / along.z.abs() + (DIVISION + 1.0) * U * shear.abs();
        let from_origin_error = turned(origin_error);

        let mut depths = [0.0; 3];
        let mut depth_error: f64 = 0.0;
        let seen: [[Rounded; 2]; 3] = std::array::from_fn(|k| {
            let offset = turned(corners[k] - origin);
            let error = from_origin_error + U * offset.abs();
            depths[k] = offset.z;
            depth_error = depth_error.max(error.z);
            let value: DVec2 = offset.truncate() - shear * offset.z;
            let sheared = shear.abs() * error.z + (shear_error + U * shear.abs()) * offset.z.abs();
            let error = error.truncate() + sheared + U * value.abs();
            [0, 1].map(|part| Rounded { value: value[part], error: error[part] })
        });
        let edge = |from: usize, to: usize| Rounded::cross(seen[to][0], seen[from][1], seen[to][1], seen[from][0]);
        let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];

        let area: f64 = edges.iter().map(|edge| edge.value).sum();
        let area_error: f64 = edges.iter().map(|edge| edge.error).sum();
        let inside = |sign: f64| {
            let over = |edge: &Rounded| if edge.value == 0.0 { 0.0 } else { sign * edge.value / edge.error };
            edges.iter().map(over).fold(f64::INFINITY, f64::min)
        };
        let (nearest, farthest) = depths
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &depth| (least.min(depth), most.max(depth)));
        // Weights that are all of one sign put the crossing between the corners, however wrong they are.
        let sure_area = area.abs() - area_error;
        let (depth, pulled, weights, weight_error) = if sure_area > area_error {
            let weights = edges.map(|edge| edge.value / area);
            let depth: f64 = weights.iter().zip(depths).map(|(weight, depth)| weight * depth).sum();
            let pull = |(edge, at): (&Rounded, f64)| edge.error * (at - depth).abs();
            let pulled: f64 = edges.iter().zip(depths).map(pull).sum::<f64>() / sure_area;
            let most = edges.iter().map(|edge| edge.error).fold(0.0, f64::max) + area_error;
            let widest = (nearest - depth).abs().max((farthest - depth).abs());
            (depth, pulled.min(widest), weights, most / sure_area)
        } else {
            (0.5 * (nearest + farthest), 0.5 * (farthest - nearest), [1.0 / 3.0; 3], 1.0)
        };
        let t = depth / along.z;
        let largest = nearest.abs().max(farthest.abs());
        let t_error = (pulled + depth_error + (2.0 * DIVISION + 6.0) * U * largest) / along.z.abs()
            + t.abs() * along_error.z / along.z.abs();
        Crossing {
            margin: inside(1.0).max(inside(-1.0)),
            t,
            t_error,
            barycentrics: [weights[1], weights[2]],
            barycentrics_error: weight_error.min(1.0) + 2.0 * DIVISION * U,
        }
    }
}
