//! Where the instances of a scene are, and which of them f32 can look at in their own space.

use super::{BvhError, LARGEST_COORDINATE};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use mica_shaders::constants::BVH_SCENE_LEVELS;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Instances in one scene, at most: what halving alone can tell apart in [`BVH_SCENE_LEVELS`].
const MAX_INSTANCES: usize = 1 << BVH_SCENE_LEVELS;

/// Relative error of each term of a ray in local space, in units of rounding. Of the origin: its coefficient, a product and
/// three sums make 5. Of the way from there to what is met, which is up to twice as long as the scene reaches: a
/// coefficient, a product and two sums make 8. The test of boxes and triangles in local space moves things by another 16.
const RAY_ROUNDOFF: f64 = 32.0 * 0.5 * f32::EPSILON as f64;

/// An instance whose transform makes rounding errors so many times larger is stored in scene space instead. A rotation
/// and a translation make them at most 6 times larger, and so does a scale along the mesh's axes before, or along the
/// scene's after: these stay as they are, and rays that leave their surfaces do not meet them again.
const TOLERABLE_GAIN: f64 = 8.0;

/// An instance that a ray can meet.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Which one.
    pub instance: usize,
    /// Its mesh.
    pub mesh: usize,
    /// From the space of the mesh to scene space.
    pub scene_from_local: DAffine3,
    /// The least corner of its box in scene space, without the rounding of f32.
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
    /// its triangles. Instances without triangles are left out.
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
        let locate = |(instance, &(mesh, scene_from_local)): (usize, &(usize, DAffine3))| {
            if mesh >= meshes {
                return Err(BvhError::NoSuchMesh { instance, mesh, meshes });
            }
            let located = Placed::new(instance, mesh, scene_from_local, corners_of(mesh));
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
    /// be stored in scene space. `corners_of` as in [`Placements::new`].
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
            let Some(placed) = Placed::new(instance, mesh, scene_from_local, corners_of(mesh))? else { continue };
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
    /// Locates an instance; `None` without corners.
    fn new(
        instance: usize,
        mesh: usize,
        scene_from_local: DAffine3,
        corners: impl Iterator<Item = [f32; 3]>,
    ) -> Result<Option<Self>, BvhError> {
        let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in corners {
            let corner = scene_from_local.transform_point3(Vec3::from(corner).as_dvec3());
            // Written so that NaN fails.
            if !corner.abs().cmple(DVec3::splat(f64::from(LARGEST_COORDINATE))).all() {
                return Err(BvhError::BadTransform { instance });
            }
            lower = lower.min(corner);
            upper = upper.max(corner);
        }
        let placed = Self { instance, mesh, scene_from_local, lower, upper, in_scene_space: false };
        Ok((lower.x <= upper.x).then_some(placed))
    }

    /// How far, along each axis of scene space, a ray traced in local space by f32 may pass from where it should; `None`
    /// where that is too far, or the transform has no inverse.
    ///
    /// The local origin `M o + t`, and any point along the ray, carries [`RAY_ROUNDOFF`] in each of its terms, and `W` takes
    /// that back to scene space: with `R` the reach of the scene, `|W| (|M| R + |t|)` bounds the sum of the terms.
    pub(super) fn ray_error(&self, reach: DVec3) -> Option<DVec3> {
        let scene_from_local = self.scene_from_local;
        let local_from_scene = scene_from_local.inverse();
        let absolute = |matrix: DMat3| DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs());
        let local = absolute(local_from_scene.matrix3) * reach + local_from_scene.translation.abs();
        let error = RAY_ROUNDOFF * (absolute(scene_from_local.matrix3) * local);
        let tolerable = TOLERABLE_GAIN * RAY_ROUNDOFF * reach.max_element();
        // Written so that NaN, from a transform without inverse, fails.
        error.cmple(DVec3::splat(tolerable)).all().then_some(error)
    }
}
