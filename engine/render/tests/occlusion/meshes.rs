//! Meshes beside those of the hierarchy's own tests.

use crate::shapes::{Mesh, Random};
use glam::{DQuat, DVec3};

/// Both as one mesh.
pub fn joined(mut mesh: Mesh, other: Mesh) -> Mesh {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(other.positions);
    mesh.indices.extend(other.indices.iter().map(|vertex| vertex + base));
    mesh
}

/// Triangles of like size at random places in the cube of half extent 1, neighbours near each other: lavapipe's own
/// hierarchy is only as good as the order of the triangles.
pub fn soup(count: usize, size: f64, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut places: Vec<DVec3> = (0..count).map(|_| random.point()).collect();
    // Along Morton's curve: the bits of the three coordinates in turn.
    places.sort_by_cached_key(|place| {
        let cell = ((*place + DVec3::ONE) * 512.0).as_uvec3().to_array();
        (0..10).fold(0u32, |key, bit| (0..3).fold(key, |key, axis| key | (cell[axis] >> bit & 1) << (3 * bit + axis)))
    });
    Mesh::soup(places.into_iter().map(|place| [(); 3].map(|()| place + size * random.point())))
}

/// Closed boxes inside each other, each smaller by a fifth and turned a little against the one around it.
pub fn nested_boxes(count: u32) -> Mesh {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.1);
    let mut mesh = Mesh::default();
    for depth in 0..count {
        // Every other box stands along the axes, so that rays along them graze its sides.
        let turn = if depth % 2 == 0 { DQuat::IDENTITY } else { turn };
        mesh = joined(mesh, cube().map(|corner| 0.8f64.powi(depth as i32) * (turn * corner)));
    }
    mesh
}

/// The cube of half extent 1, closed.
pub fn cube() -> Mesh {
    let positions = (0..8).map(|corner| [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let indices = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
    Mesh { positions: positions.collect(), indices: indices.collect() }
}

/// A square of so many squares a side in the plane z = 0, between -1 and 1.
pub fn grid(side: u32) -> Mesh {
    let place = |k: u32| 2.0 * k as f32 / side as f32 - 1.0;
    let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| [place(x), place(y), 0.0])).collect();
    let square = |x: u32, y: u32| {
        let [a, b] = [y * (side + 1) + x, (y + 1) * (side + 1) + x];
        [a, a + 1, b + 1, a, b + 1, b]
    };
    let indices = (0..side).flat_map(|y| (0..side).flat_map(move |x| square(x, y))).collect();
    Mesh { positions, indices }
}

/// Triangles whose corners are one point, or on a line, between ordinary ones.
pub fn without_area(count: usize) -> Mesh {
    let mut random = Random::new(23);
    Mesh::soup((0..count).map(|k| {
        let (a, b) = (random.point(), random.point());
        match k % 4 {
            0 => [a, a, a],
            1 => [a, b, b],
            2 => [a, b, (a + b) / 2.0],
            _ => [a, a + 0.3 * random.point(), a + 0.3 * random.point()],
        }
    }))
}

/// Triangles of all sizes and places between 1e-4 and 1e6.
pub fn of_all_sizes(count: usize) -> Mesh {
    let mut random = Random::new(29);
    Mesh::soup((0..count).map(|_| {
        let size = 10f64.powf(random.between(-4.0, 6.0));
        let place = size * random.direction();
        [(); 3].map(|()| place + 0.5 * size * random.point())
    }))
}

/// Triangles in one plane that lie over each other, askew to the axes.
pub fn in_one_plane(count: usize) -> Mesh {
    let mut random = Random::new(31);
    let [u, v] = [DVec3::new(0.6, 0.48, 0.64), DVec3::new(-0.8, 0.36, 0.48)];
    Mesh::soup((0..count).map(|_| {
        [(); 3].map(|()| random.between(-1.0, 1.0) * u + random.between(-1.0, 1.0) * v + DVec3::new(0.1, 0.2, 0.3))
    }))
}
