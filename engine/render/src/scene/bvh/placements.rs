//! Where the instances of a scene are, and which of them f32 can look at in their own space.

use super::{Bounds, BvhError, LARGEST_COORDINATE};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use mica_shaders::constants::BVH_SCENE_LEVELS;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicU64, Ordering};

/// Instances in one scene, at most: what halving alone can tell apart in [`BVH_SCENE_LEVELS`].
const MAX_INSTANCES: usize = 1 << BVH_SCENE_LEVELS;

/// Relative error of each term of a ray in local space, in units of rounding. Of the origin: its coefficient, a product and
/// three sums make 5. Of the way from there to what is met, which is up to twice as long as the scene reaches: a
/// coefficient, a product and two sums make 8. The test of boxes and triangles in local space moves things by another 16.
const RAY_ROUNDOFF: f64 = 32.0 * 0.5 * f32::EPSILON as f64;

/// An instance whose transform makes rounding errors so many times larger, beside the scene's size, is stored in scene space
/// instead. A rotation and a translation make them at most 6 times larger, and so does a scale along the mesh's axes
/// before, or along the scene's after: these stay as they are.
const TOLERABLE_GAIN: f64 = 8.0;

/// The same beside the numbers that one of its triangles is made of, however small it is in the scene: for each of four
/// parts, which are the instance's translation and its mesh's three axes. A triangle is as large and as far out as they make
/// it together, so its gain is at most four times this, and rays that `offset_origin` (`shared/ray_offset.glsl`) moved off
/// it do not meet it again. A scale along the mesh's axes, then a rotation, then a translation have 4.8 at most.
const TOLERABLE_PART: f64 = 6.0;

/// How far from the local origin a ray may begin, at most and at least: products of three such lengths, as in the test of
/// triangles, stay within f32.
const LOCAL_REACH: RangeInclusive<f64> = 1.0 / LARGEST_COORDINATE as f64..=LARGEST_COORDINATE as f64;

/// An instance that a ray can meet.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Which one.
    pub instance: usize,
    /// Its mesh.
    pub mesh: usize,
    /// From the space of the mesh to scene space.
    pub scene_from_local: DAffine3,
    /// The least corner, in scene space and without the rounding of f32, of the box around the box of its mesh.
    pub lower: DVec3,
    /// The greatest corner of that box.
    pub upper: DVec3,
    /// Whether it is stored in scene space, as triangles of its own, since f32 would lose too much between the spaces.
    pub in_scene_space: bool,
}

/// The instances of a scene that a ray can meet, in order.
#[derive(Clone, Debug, Default)]
pub struct Placements {
    list: Vec<Placed>,
    reach: DVec3,
}

impl Placements {
    /// Of `instances`: the index of one of so many `meshes`, and where it is in scene space. `corners_of` a mesh are those of
    /// its triangles, or those of the box around them: only that box is looked at. Instances without triangles are left out.
    ///
    /// # Errors
    /// [`BvhError`] for meshes that do not exist and transforms that are not finite or leave the range of coordinates.
    pub fn new<C: Iterator<Item = [f32; 3]>>(
        instances: &[(usize, DAffine3)],
        meshes: usize,
        corners_of: impl Fn(usize) -> C + Sync,
    ) -> Result<Self, BvhError> {
        Self::new_with(instances, meshes, corners_of, None)
    }

    /// As [`Placements::new`]; `placed` is raised by 1 for each instance.
    pub(super) fn new_with<C: Iterator<Item = [f32; 3]>>(
        instances: &[(usize, DAffine3)],
        meshes: usize,
        corners_of: impl Fn(usize) -> C + Sync,
        placed: Option<&AtomicU64>,
    ) -> Result<Self, BvhError> {
        if instances.len() > MAX_INSTANCES {
            return Err(BvhError::TooMany { what: "instances", count: instances.len(), limit: MAX_INSTANCES });
        }
        let boxes: Vec<Option<[DVec3; 2]>> = (0..meshes).into_par_iter().map(|mesh| box_of(corners_of(mesh))).collect();
        let locate = |(instance, &(mesh, scene_from_local)): (usize, &(usize, DAffine3))| {
            if mesh >= meshes {
                return Err(BvhError::NoSuchMesh { instance, mesh, meshes });
            }
            let located = Placed::new(instance, mesh, scene_from_local, boxes[mesh]);
            if let Some(placed) = placed {
                placed.fetch_add(1, Ordering::Relaxed);
            }
            located
        };
        let located: Vec<Result<_, BvhError>> =
            instances.par_iter().enumerate().filter_map(|instance| locate(instance).transpose()).collect();
        // The first fault, whichever thread finds one first.
        let mut placements = Self::over(located.into_iter().collect::<Result<_, _>>()?);
        for placed in &mut placements.list {
            placed.in_scene_space = placed.ray_error(placements.reach).is_none();
        }
        Ok(placements)
    }

    /// The same after instances were moved, each to where it then is in scene space; `None` where that changes what has to
    /// be stored in scene space. `corners_of` as in [`Placements::new`]; 8 are quicker than those of all triangles.
    ///
    /// # Errors
    /// [`BvhError`] for transforms that are not finite or leave the range of coordinates.
    pub fn moved<C: Iterator<Item = [f32; 3]>>(
        &self,
        moved: &[(usize, DAffine3)],
        corners_of: impl Fn(usize) -> C,
    ) -> Result<Option<Self>, BvhError> {
        let mut list = self.list.clone();
        for &(instance, scene_from_local) in moved {
            // One without triangles is nowhere, and stays there.
            let Ok(position) = list.binary_search_by_key(&instance, |placed| placed.instance) else { continue };
            let mesh = list[position].mesh;
            let Some(placed) = Placed::new(instance, mesh, scene_from_local, box_of(corners_of(mesh)))? else {
                continue;
            };
            if list[position].in_scene_space {
                return Ok(None);
            }
            list[position] = placed;
        }
        let placements = Self::over(list);
        let as_before = |placed: &Placed| placed.in_scene_space == placed.ray_error(placements.reach).is_none();
        Ok(placements.list.iter().all(as_before).then_some(placements))
    }

    fn over(list: Vec<Placed>) -> Self {
        let farther = |reach: DVec3, placed: &Placed| reach.max(placed.lower.abs()).max(placed.upper.abs());
        let reach = list.iter().fold(DVec3::ZERO, farther);
        Self { list, reach }
    }

    /// The instances that have triangles, in order.
    pub fn list(&self) -> &[Placed] {
        &self.list
    }

    /// The largest coordinate, along each axis, of anything a ray can meet.
    pub(super) fn reach(&self) -> DVec3 {
        self.reach
    }
}

impl Placed {
    /// Locates an instance by the box of its mesh, from the least corner to the greatest; `None` without one.
    fn new(
        instance: usize,
        mesh: usize,
        scene_from_local: DAffine3,
        local_box: Option<[DVec3; 2]>,
    ) -> Result<Option<Self>, BvhError> {
        let Some(ends) = local_box else { return Ok(None) };
        let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for k in 0..8 {
            let pick = |axis: usize| ends[k >> axis & 1][axis];
            let corner = scene_from_local.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
            // Written so that NaN fails.
            if !corner.abs().cmple(DVec3::splat(f64::from(LARGEST_COORDINATE))).all() {
                return Err(BvhError::BadTransform { instance });
            }
            lower = lower.min(corner);
            upper = upper.max(corner);
        }
        Ok(Some(Self { instance, mesh, scene_from_local, lower, upper, in_scene_space: false }))
    }

    /// How far, along each axis of scene space, a ray traced in local space by f32 may pass from where it should; `None`
    /// where that is too far, or the transform has no inverse.
    ///
    /// The local origin `M o + t`, and any point along the ray, carries [`RAY_ROUNDOFF`] in each of its terms, and `W` takes
    /// that back to scene space: with `R` the reach of the scene, `|W| (|M| R + |t|)` bounds the sum of the terms. Coefficients
    /// below the least normal f32 may become 0 on the way to the device: that is the second part.
    pub(super) fn ray_error(&self, reach: DVec3) -> Option<DVec3> {
        let scene_from_local = self.scene_from_local;
        let local_from_scene = scene_from_local.inverse();
        let local = absolute(local_from_scene.matrix3) * reach + local_from_scene.translation.abs();
        let vanishing = f64::from(f32::MIN_POSITIVE) * (reach.element_sum() + 1.0);
        let terms = RAY_ROUNDOFF * local + vanishing;
        let error = absolute(scene_from_local.matrix3) * terms;
        let fits = |map: &DMat3| map.to_cols_array().iter().all(|&coefficient| (coefficient as f32).is_finite());
        let tolerable = TOLERABLE_GAIN * RAY_ROUNDOFF * reach.max_element();
        // Written so that NaN, from a transform without inverse, fails.
        let exact_enough = error.cmple(DVec3::splat(tolerable)).all();
        let in_range = LOCAL_REACH.contains(&local.max_element())
            && fits(&scene_from_local.matrix3)
            && fits(&local_from_scene.matrix3);
        (exact_enough && in_range && serves_small_triangles(&scene_from_local, &local_from_scene)).then_some(error)
    }
}

fn absolute(matrix: DMat3) -> DMat3 {
    DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
}

/// Whether a ray that starts on any triangle of an instance is exact enough beside that triangle, as [`TOLERABLE_PART`] has it.
///
/// With `|M| |c| + |t|` the terms of a corner `c` in scene space, `|M| (|W| (|M| |c| + |t|) + |W t|)` bounds those of a ray
/// that starts there: of `t`, and of each column of `M`, the second has to stay near the first.
fn serves_small_triangles(scene_from_local: &DAffine3, local_from_scene: &DAffine3) -> bool {
    let (there, back) = (absolute(scene_from_local.matrix3), absolute(local_from_scene.matrix3));
    let translation = scene_from_local.translation.abs();
    let of_translation = there * (back * translation + local_from_scene.translation.abs());
    let parts = [(of_translation, translation)]
        .into_iter()
        .chain([there.x_axis, there.y_axis, there.z_axis].map(|column| (there * (back * column), column)));
    // Written so that NaN fails.
    parts.into_iter().all(|(error, terms)| error.max_element() <= TOLERABLE_PART * terms.max_element())
}

/// The least and the greatest corner of the box around points; `None` around none.
fn box_of(points: impl Iterator<Item = [f32; 3]>) -> Option<[DVec3; 2]> {
    let bounds = points.map(Bounds::of_point).reduce(Bounds::union)?;
    Some([bounds.lower, bounds.upper].map(|corner| Vec3::from(corner).as_dvec3()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use std::sync::atomic::AtomicUsize;

    const POINTS: [[f32; 3]; 4] = [[-1.0, 2.0, 0.0], [1.0, 0.5, -0.25], [0.0, -1.0, 0.5], [0.25, 0.0, 0.125]];

    /// The corners of the box around [`POINTS`].
    fn box_corners() -> impl Iterator<Item = [f32; 3]> {
        let pick = |k: usize, bit: usize, ends: [f32; 2]| ends[k >> bit & 1];
        (0..8).map(move |k| [pick(k, 0, [-1.0, 1.0]), pick(k, 1, [-1.0, 2.0]), pick(k, 2, [-0.25, 0.5])])
    }

    fn places() -> Vec<(usize, DAffine3)> {
        let turned = |turn| DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), DVec3::splat(turn));
        (0..9).map(|k| (0, turned(f64::from(k)))).collect()
    }

    #[test]
    fn the_corners_of_a_mesh_are_walked_once_however_many_instances_it_has() {
        let asked = AtomicUsize::new(0);
        let corners = |_| {
            asked.fetch_add(1, Ordering::Relaxed);
            POINTS.into_iter()
        };
        let made = Placements::new(&places(), 1, corners).expect("usable places");
        assert_eq!((made.list().len(), asked.into_inner()), (9, 1));
    }

    #[test]
    fn the_box_of_a_mesh_places_it_as_its_corners_do() {
        let bits = |placements: &Placements| -> Vec<_> {
            placements.list().iter().map(|placed| (placed.lower, placed.upper, placed.in_scene_space)).collect()
        };
        let made = Placements::new(&places(), 1, |_| POINTS.into_iter()).expect("usable places");
        assert_eq!(bits(&made), bits(&Placements::new(&places(), 1, |_| box_corners()).expect("usable places")));
        let mut there = places();
        there[4].1 = DAffine3::from_rotation_x(0.3);
        let moved = made.moved(&[(4, there[4].1)], |_| box_corners()).expect("usable places").expect("stored alike");
        let fresh = Placements::new(&there, 1, |_| POINTS.into_iter()).expect("usable places");
        assert_eq!(bits(&moved), bits(&fresh));
        assert_ne!(bits(&moved), bits(&made));
    }

    /// Whether the transform is large, small, or has an inverse that is.
    #[test]
    fn what_f32_cannot_hold_is_stored_in_scene_space() {
        let stored = |x: f64, size: f32| {
            let points = POINTS.map(|point| [point[0] * size, point[1], point[2]]);
            let place = DAffine3::from_scale(DVec3::new(x, 1.0, 1.0));
            let made = Placements::new(&[(0, place)], 1, |_| points.into_iter()).expect("a usable place");
            made.list()[0].in_scene_space
        };
        for (x, size) in [(1e-46, 1.0), (1e-39, 1.0), (-1e-46, 1e12), (1e39, 1e-38), (1e38, 1e-38)] {
            assert!(stored(x, size), "{x}, a mesh {size} wide");
        }
        for (x, size) in [(1.0, 1.0), (1e-6, 1.0), (1e-11, 1e11), (1e6, 1.0), (1e11, 1e-11), (1e20, 1e-20)] {
            assert!(!stored(x, size), "{x}, a mesh {size} wide");
        }
    }

    /// Beside something large, the scene is no measure of what f32 loses of a small triangle: its own numbers are. What a
    /// node's translation, rotation and scale make serves all, whatever they are.
    #[test]
    fn what_is_lost_on_its_own_triangles_is_stored_in_scene_space_in_any_scene() {
        let turned = DAffine3::from_quat(DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0));
        let to = |y| DAffine3::from_translation(DVec3::new(0.0, y, 0.0));
        let stretched = DAffine3::from_scale(DVec3::new(1e3, 1.0, 0.1));
        // The scene is as large along each axis as rounding along it would have to be.
        let large = DAffine3::from_scale(DVec3::new(1e9, 1e6, 1e5));
        let places = [
            (to(5.0) * turned * stretched, false),
            (to(5.0) * stretched, false),
            (stretched * turned, false),
            // A y of 5 is 50 along the mesh's axes, turned, and 50,000 along x.
            (to(5.0) * stretched * turned, true),
            (large, false),
        ];
        let instances = places.map(|(place, _)| (0, place));
        let made = Placements::new(&instances, 1, |_| POINTS.into_iter()).expect("usable places");
        let stored: Vec<bool> = made.list().iter().map(|placed| placed.in_scene_space).collect();
        assert_eq!(stored, places.map(|(_, stored)| stored));
        // And where it moves there.
        let [.., unmoved, _, large] = instances;
        let made = Placements::new(&[unmoved, large], 1, |_| POINTS.into_iter()).expect("usable places");
        let moved = |y| made.moved(&[(0, to(y) * unmoved.1)], |_| box_corners()).expect("a usable place");
        assert!(moved(0.0).is_some() && moved(5.0).is_none());
    }
}
