//! How wrong a driver may be where it inverts a placement in f32.
//!
//! Mesa's lavapipe (25.0.7) does so by Gaussian elimination with the largest element of a column as pivot, on the transposed
//! placement: its translation competes for the pivots. Of a mere translation by a few thousand units the inverse has up to
//! 1e-5 beside its diagonal, 180 times what f32 rounds by, where the exact inverse has zeros.

use crate::truth::{PLACING, U};
use glam::{DAffine3, DMat3};

/// A row of the placement, and beside it the row of the identity that becomes the inverse's.
type Row = [f32; 8];

/// What elimination in f32 makes each coefficient of the inverse wrong by, in [`PLACING`] times [`U`]; twice that, as
/// operations in another order round otherwise.
pub fn inverse_error(scene_from_local: DAffine3) -> DMat3 {
    let exact = scene_from_local.inverse().matrix3;
    let found = eliminated(scene_from_local);
    let error = |column: usize| {
        std::array::from_fn(|row| 2.0 * (f64::from(found[column][row]) - exact.col(column)[row]).abs() / (PLACING * U))
    };
    DMat3::from_cols_array_2d(&[error(0), error(1), error(2)])
}

/// The columns of the inverse.
fn eliminated(scene_from_local: DAffine3) -> [[f32; 3]; 3] {
    let mut rows: [Row; 4] = [[0.0; 8]; 4];
    for (k, row) in rows.iter_mut().enumerate() {
        // Transposed: the columns of the placement are its rows.
        let column = if k < 3 { scene_from_local.matrix3.col(k) } else { scene_from_local.translation };
        row[..3].copy_from_slice(&column.as_vec3().to_array());
        row[3] = if k < 3 { 0.0 } else { 1.0 };
        row[4 + k] = 1.0;
    }
    for pivot in 0..3 {
        for k in (pivot + 1..4).rev() {
            if rows[k][pivot].abs() > rows[k - 1][pivot].abs() {
                rows.swap(k, k - 1);
            }
        }
        let above = rows[pivot];
        for row in &mut rows[pivot + 1..] {
            let factor = row[pivot] / above[pivot];
            (pivot + 1..8).for_each(|k| row[k] -= factor * above[k]);
        }
    }
    for pivot in (0..4).rev() {
        let below = rows;
        for (k, of) in below.iter().enumerate().skip(pivot + 1) {
            let factor = rows[pivot][k];
            (4..8).for_each(|column| rows[pivot][column] -= factor * of[column]);
        }
        let scale = 1.0 / rows[pivot][pivot];
        rows[pivot][4..].iter_mut().for_each(|value| *value *= scale);
    }
    std::array::from_fn(|column| std::array::from_fn(|row| rows[column][4 + row]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    #[test]
    fn elimination_finds_the_inverse_and_loses_digits_beside_large_translations() {
        let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
        let scale = DVec3::new(0.5, -2.0, 1.5);
        let place = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::new(0.3, 0.2, -0.4));
        assert!(inverse_error(place).to_cols_array().into_iter().all(|error| error < 2.0));
        let far = DAffine3::from_translation(DVec3::new(-2733.4375, 1555.0625, 3687.6875));
        let worst = inverse_error(far).to_cols_array().into_iter().fold(0.0, f64::max);
        assert!((0.1..50.0).contains(&worst), "{worst}");
    }
}
