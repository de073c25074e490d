//! Rays of every kind that a scene may be asked about.

use crate::random::Random;
use crate::truth::World;
use glam::DVec3;
use mica_shaders::types::Ray;
use rayon::prelude::*;

/// Rays that share a seed.
const BATCH: usize = 4096;

/// A place in a triangle, all equally likely.
pub fn within(random: &mut Random, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let [second, third] = weights(random);
    a + second * (b - a) + third * (c - a)
}

/// Weights of the second and the third corner of such a place.
pub fn weights(random: &mut Random) -> [f64; 2] {
    let (u, v) = (random.unit().sqrt(), random.unit());
    [u * (1.0 - v), u * v]
}

/// An endless ray, in scene space.
pub fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray {
        origin: origin.as_vec3().to_array(),
        t_min: 0.0,
        direction: direction.as_vec3().to_array(),
        t_max: 1e30,
        ..Ray::default()
    }
}

/// Makes `count` rays by `make`, which gets each one's number, on all cores. The same seed gives the same rays.
pub fn many(count: usize, seed: u64, make: impl Fn(&mut Random, usize) -> Ray + Sync) -> Vec<Ray> {
    let mut rays = vec![Ray::default(); count];
    rays.par_chunks_mut(BATCH).enumerate().for_each(|(batch, rays)| {
        let mut random = Random::new(seed << 32 | batch as u64);
        for (k, ray) in rays.iter_mut().enumerate() {
            *ray = make(&mut random, batch * BATCH + k);
        }
    });
    rays
}

/// Neighbouring rays that share a kind and start and end near each other: devices take several rays in step, and a
/// processor pays for each as much as for all.
const BUNDLE: usize = 8;

fn kind(k: usize) -> usize {
    k / BUNDLE % 8
}

/// Whether the `k`-th ray of [`of_every_kind`] is aimed at a corner or an edge, or along an axis.
pub fn is_aimed(k: usize) -> bool {
    (4..7).contains(&kind(k))
}

/// Rays through and past a scene: anywhere, towards points of triangles from near and far, their corners and edges, along
/// the axes, and segments from one surface to another.
pub fn of_every_kind(world: &World, count: usize, seed: u64) -> Vec<Ray> {
    let reach = if world.reach() > 0.0 { world.reach() } else { 1.0 };
    let triangles = world.triangles();
    many(count, seed, |random, k| {
        let mut shared = Random::new(seed << 32 | 1 << 31 | (k / BUNDLE) as u64);
        let anywhere = 1.5 * reach * (shared.point() + 0.05 * random.point());
        if kind(k) == 0 || triangles == 0 {
            return ray(anywhere, (shared.direction() + 0.1 * random.point()).normalize());
        }
        let corners = world.triangle((shared.below(triangles) + k % BUNDLE) % triangles);
        let target = within(random, corners);
        let made = match kind(k) {
            1 => ray(anywhere, target - anywhere),
            2 => {
                let near = target + reach * 10f64.powf(-6.0 * shared.unit()) * random.direction();
                ray(near, (target - near).normalize_or(DVec3::X))
            }
            3 => {
                let t_min = 0.5 * random.unit() as f32;
                Ray { t_min, t_max: 0.5 + random.unit() as f32, ..ray(anywhere, target - anywhere) }
            }
            4 => ray(anywhere, (corners[0] - anywhere).normalize()),
            5 => ray(anywhere, corners[0].lerp(corners[1], random.unit()) - anywhere),
            6 => {
                // Onto a point, a corner's plane or a corner, along an axis: box planes and zeros in the direction.
                let axis = shared.below(3);
                let mut origin = target;
                for other in (0..3).filter(|&other| other != axis) {
                    if random.unit() < 0.4 {
                        origin[other] = corners[random.below(3)][other];
                    }
                }
                origin[axis] = anywhere[axis];
                let mut direction = DVec3::ZERO;
                direction[axis] = if random.unit() < 0.8 { target[axis] - anywhere[axis] } else { 1.0 };
                ray(origin, direction)
            }
            _ => {
                let other = world.triangle((shared.below(triangles) + k % BUNDLE) % triangles);
                let to = within(random, other) - target;
                Ray { t_max: 0.98, ..ray(target + 0.01 * to, to) }
            }
        };
        // One without direction, as between a point and itself, shall be a ray all the same.
        if made.direction == [0.0; 3] { Ray { direction: [1.0, 0.0, 0.0], ..made } } else { made }
    })
}
