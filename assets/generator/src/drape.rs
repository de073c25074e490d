//! Cloth that falls over a post and comes to rest: springs without mass matrices, stepped in a fixed order.
//!
//! Extended position-based dynamics with small steps (Macklin, Storey, Lu, Terdiman, Chentanez, Jeschke, Mueller 2019,
//! "Small Steps in Physics Simulation"): one pass over the constraints a step. Only +, -, *, / and square roots are
//! used, so the folds are the same on every machine although they grow out of the smallest differences.

use glam::{DVec2, DVec3};

use crate::maths::noise2;

/// A square of cloth, its threads along the grid.
pub struct Cloth {
    /// Particles along a side.
    pub side: usize,
    /// Distance of two neighbours at rest, metres.
    pub spacing: f64,
    /// Metres, row by row.
    pub positions: Vec<DVec3>,
}

/// An upright post on the ground, rounded off to a half sphere at its top.
#[derive(Clone, Copy)]
pub struct Post {
    /// Where it stands, x and z, metres.
    pub foot: DVec2,
    /// Metres, of the shaft and of the half sphere.
    pub radius: f64,
    /// Height of the half sphere's centre, metres.
    pub shoulder: f64,
}

struct Link {
    a: usize,
    b: usize,
    rest: f64,
    compliance: f64,
}

impl Cloth {
    /// Lets a cloth of `length` metres, turned by `turn` (a unit vector along its rows) and spread out level over the
    /// highest post's top, fall for `seconds`.
    pub fn fallen(side: usize, length: f64, turn: DVec2, posts: &[Post], seconds: f64) -> Self {
        let top = posts.iter().map(|post| post.shoulder + post.radius).fold(0.0, f64::max);
        let spacing = length / (side - 1) as f64;
        let mut positions = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let p = DVec2::new(column as f64, row as f64) * spacing - DVec2::splat(length / 2.0);
                let p = turn * p.x + turn.perp() * p.y;
                // A breath of unevenness decides which way each fold goes.
                let lift = 0.004 * noise2(p * 3.1, 11);
                positions.push(DVec3::new(p.x, top + 0.006 + lift, p.y));
            }
        }
        let mut cloth = Self { side, spacing, positions };
        cloth.fall(posts, seconds);
        cloth
    }

    fn links(&self) -> Vec<Link> {
        let mut links = Vec::new();
        let side = self.side as isize;
        // Thread, thread, bias, bias, and bending over two cells: compliance in metres per newton at unit mass.
        for (dx, dy, compliance) in
            [(1, 0, 1e-8), (0, 1, 1e-8), (1, 1, 4e-6), (-1, 1, 4e-6), (2, 0, 3e-3), (0, 2, 3e-3)]
        {
            for y in 0..side {
                for x in 0..side {
                    let (u, v) = (x + dx, y + dy);
                    if (0..side).contains(&u) && (0..side).contains(&v) {
                        let rest = self.spacing * ((dx * dx + dy * dy) as f64).sqrt();
                        let index = |x: isize, y: isize| (y * side + x) as usize;
                        links.push(Link { a: index(x, y), b: index(u, v), rest, compliance });
                    }
                }
            }
        }
        links
    }

    fn fall(&mut self, posts: &[Post], seconds: f64) {
        let step = 1.0 / 900.0;
        let links = self.links();
        let mut velocities = vec![DVec3::ZERO; self.positions.len()];
        let mut before = self.positions.clone();
        for _ in 0..(seconds / step) as usize {
            for ((position, velocity), old) in self.positions.iter_mut().zip(&mut velocities).zip(&mut before) {
                *velocity -= DVec3::Y * (9.81 * step);
                // Air: the cloth comes to rest within the time that it is given.
                *velocity *= 1.0 - 2.2 * step;
                *old = *position;
                *position += *velocity * step;
            }
            for link in &links {
                let apart = self.positions[link.b] - self.positions[link.a];
                let length = apart.length();
                if length > 0.0 {
                    let give = (length - link.rest) / (2.0 + link.compliance / (step * step));
                    let pull = apart * (give / length);
                    self.positions[link.a] += pull;
                    self.positions[link.b] -= pull;
                }
            }
            for (position, old) in self.positions.iter_mut().zip(&before) {
                *position = posts.iter().fold(*position, |position, post| post.outside(position, *old));
                *position = above_ground(*position, *old);
            }
            for ((position, velocity), old) in self.positions.iter().zip(&mut velocities).zip(&before) {
                *velocity = (*position - *old) / step;
            }
        }
    }

    /// The surface at `s` along the rows and `t` along the columns, 0 to 1: the uniform cubic B-spline over the
    /// particles, whose curvature is continuous. Particles are mirrored outward beyond the edges.
    pub fn surface(&self, s: f64, t: f64) -> DVec3 {
        let last = self.side - 1;
        let (i, x) = cell(s, last);
        let (j, y) = cell(t, last);
        let (wx, wy) = (weights(x), weights(y));
        let along_row = |row: usize| {
            let at = |column: isize| extended(column, last, |c| self.positions[row * self.side + c]);
            (0..4).map(|k| at(i as isize + k as isize - 1) * wx[k]).sum::<DVec3>()
        };
        (0..4).map(|k| extended(j as isize + k as isize - 1, last, along_row) * wy[k]).sum()
    }
}

/// How far the threads' middle stays away from what the cloth lies on, metres.
const CLEARANCE: f64 = 0.005;

impl Post {
    /// Pushes a point out of the post and holds back its slide along it.
    fn outside(&self, point: DVec3, before: DVec3) -> DVec3 {
        let centre = DVec3::new(self.foot.x, self.shoulder.min(point.y), self.foot.y);
        let out = point - centre;
        let distance = out.length();
        let reach = self.radius + CLEARANCE;
        if distance >= reach {
            return point;
        }
        let normal = if distance > 0.0 { out / distance } else { DVec3::X };
        let pushed = centre + normal * reach;
        let slide = pushed - before;
        pushed - (slide - normal * slide.dot(normal)) * 0.35
    }
}

fn above_ground(point: DVec3, before: DVec3) -> DVec3 {
    if point.y >= CLEARANCE {
        return point;
    }
    let slide = point - before;
    DVec3::new(point.x - 0.5 * slide.x, CLEARANCE, point.z - 0.5 * slide.z)
}

/// The cell of a parameter and the place in it.
fn cell(parameter: f64, cells: usize) -> (usize, f64) {
    let x = parameter * cells as f64;
    let i = (x as usize).min(cells - 1);
    (i, x - i as f64)
}

/// Weights of the four control points about a place in a cell, for the uniform cubic B-spline.
fn weights(x: f64) -> [f64; 4] {
    let y = 1.0 - x;
    let inner = |x: f64| (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0;
    [y * y * y / 6.0, inner(x), inner(y), x * x * x / 6.0]
}

/// A sequence continued beyond its ends by reflection in its end points.
fn extended(index: isize, last: usize, at: impl Fn(usize) -> DVec3) -> DVec3 {
    if index < 0 {
        at(0) * 2.0 - at((-index) as usize)
    } else if index as usize > last {
        at(last) * 2.0 - at(2 * last - index as usize)
    } else {
        at(index as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fallen_cloth_keeps_its_threads_and_stays_outside_the_post() {
        let post = Post { foot: DVec2::new(0.05, 0.0), radius: 0.2, shoulder: 0.4 };
        let cloth = Cloth::fallen(25, 0.9, DVec2::X, &[post], 1.0);
        let mut worst = 0.0_f64;
        for row in 0..cloth.side {
            for column in 1..cloth.side {
                let here = cloth.positions[row * cloth.side + column];
                let stretch = here.distance(cloth.positions[row * cloth.side + column - 1]) / cloth.spacing - 1.0;
                worst = worst.max(stretch);
            }
        }
        assert!(worst < 0.08, "a thread is stretched by {worst}");
        for p in &cloth.positions {
            let out = p.distance(DVec3::new(0.05, p.y.min(post.shoulder), 0.0));
            assert!(p.y >= 0.0 && out > post.radius, "{p} is inside");
        }
        assert!(cloth.positions.iter().map(|p| p.y).fold(1.0, f64::min) < 0.35, "it has not fallen");
    }

    #[test]
    fn the_spline_through_level_particles_is_the_level_square() {
        let side = 5;
        let positions = (0..25).map(|i| DVec3::new((i % 5) as f64, 2.0, (i / 5) as f64)).collect();
        let cloth = Cloth { side, spacing: 1.0, positions };
        for (s, t) in [(0.0, 0.0), (0.3, 0.9), (1.0, 1.0), (0.5, 0.125)] {
            assert!(cloth.surface(s, t).distance(DVec3::new(4.0 * s, 2.0, 4.0 * t)) < 1e-12);
        }
    }
}
