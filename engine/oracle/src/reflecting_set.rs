//! Which facets reflect one direction into a cone about another: the conic of Jakob et al. 2014 in the slope plane.
//!
//! Facet m reflects i to within gamma of o exactly when 2 (i.m)(o.m) - i.o >= cos(gamma), that is when m' C m <= 0 for
//!
//! ```text
//! C = (i.o + cos gamma) I - (i o' + o i') = -2 S hh' + 2 (1 - S) qq' + k xx'
//! S = sin^2(gamma/2)   k = 2 (|i+o|^2/4 - S)   h ~ i + o   q ~ i - o   x ~ i x o
//! ```
//!
//! The facets must also face both directions. While k > 0 that only chooses between the two nappes of the cone; when
//! k <= 0 every facet that faces both directions reflects i into the cone, and the set is a wedge. Either is convex, so
//! each ray from the origin of the slope plane meets it in one interval. Writing C by its eigenvectors keeps every
//! digit at any gamma; assembled entry by entry it loses them all below a tenth of a degree.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

/// The facets that reflect one direction into a cone about another, as a convex set of the slope plane, where m is
/// parallel to (x, y, 1).
pub(crate) enum ReflectingSet {
    /// A nappe of a cone cut by the slope plane: an ellipse, or a branch of a parabola or hyperbola.
    Conic(Conic),
    /// All facets that face both directions.
    Wedge {
        /// The one direction.
        i: DVec3,
        /// The other.
        o: DVec3,
    },
}

/// Where a ray from the origin of the slope plane lies within the set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    /// Squared distance at which it begins.
    pub begin_squared: f64,
    /// How much the squared distance grows to its end; may be infinite.
    pub width_squared: f64,
}

/// What angles about the origin of the slope plane a set covers.
pub(crate) enum Span {
    /// All of them; the angles listed, ascending over one turn, are where the boundary turns fastest.
    Turn(Vec<f64>),
    /// Those within `half_width` of `middle`; the set's boundary is tangent to both outermost rays.
    Sector {
        /// The sector's middle.
        middle: f64,
        /// Half its opening, below pi / 2.
        half_width: f64,
    },
}

impl ReflectingSet {
    /// The set for unit `i` and `o` and a cone of half-angle `gamma_radians` in (0, pi].
    pub fn new(i: DVec3, o: DVec3, gamma_radians: f64) -> Self {
        let s = (gamma_radians / 2.0).sin().powi(2);
        let (sum, difference) = (i + o, i - o);
        let k = 2.0 * (sum.length_squared() / 4.0 - s);
        if k <= 0.0 {
            return Self::Wedge { i, o };
        }
        let h = sum.normalize();
        // At i = o any axes serve: k and 2 (1 - S) are then equal.
        let q = if difference.length_squared() > 1e-24 {
            (difference - h * h.dot(difference)).normalize()
        } else {
            h.any_orthonormal_vector()
        };
        let axes = [(h, -2.0 * s), (q, 2.0 * (1.0 - s)), (q.cross(h), k)];
        Self::Conic(Conic { axes })
    }

    /// Where the ray from the origin along the unit vector `u` lies in the set.
    pub fn along(&self, u: DVec2) -> Option<Interval> {
        match self {
            Self::Conic(conic) => conic.along(u),
            Self::Wedge { i, o } => {
                let (mut begin, mut end) = (0.0_f64, f64::INFINITY);
                for side in [i, o] {
                    // side.z + r side.u > 0
                    let slope = side.truncate().dot(u);
                    if slope < 0.0 {
                        end = end.min(-side.z / slope);
                    } else if side.z < 0.0 {
                        begin = begin.max(-side.z / slope);
                    }
                }
                (end > begin)
                    .then_some(Interval { begin_squared: begin * begin, width_squared: (end - begin) * (end + begin) })
            }
        }
    }

    /// The angles it covers.
    pub fn span(&self) -> Span {
        match self {
            Self::Conic(conic) => conic.span(),
            Self::Wedge { i, o } => {
                let crossing = i.z * o.truncate() - o.z * i.truncate();
                let mut angles: Vec<f64> = [i.truncate(), o.truncate(), crossing]
                    .into_iter()
                    .filter(|v| v.length_squared() > 0.0)
                    .flat_map(|v| [v.perp().to_angle(), (-v.perp()).to_angle()])
                    .collect();
                angles.sort_by(f64::total_cmp);
                Span::Turn(one_turn(angles))
            }
        }
    }
}

/// The quadratic form C by its orthonormal eigenvectors and eigenvalues; the first is h, the axis of the nappe.
pub(crate) struct Conic {
    axes: [(DVec3, f64); 3],
}

impl Conic {
    fn form(&self, a: DVec3, b: DVec3) -> f64 {
        self.axes.iter().map(|(axis, value)| value * axis.dot(a) * axis.dot(b)).sum()
    }

    /// Minus the adjugate of C on the slope plane's normal directions: its value at u turned by a right angle is the
    /// discriminant of C on the ray along u. As (matrix entries xx, xy, yy in u, determinant).
    fn discriminant(&self) -> ([f64; 3], f64) {
        let [(h, a), (q, b), (x, c)] = self.axes;
        let mut entries = [0.0; 3];
        for (axis, cofactor) in [(h, b * c), (q, a * c), (x, a * b)] {
            let v = axis.truncate().perp();
            for (entry, product) in entries.iter_mut().zip([v.x * v.x, v.x * v.y, v.y * v.y]) {
                *entry -= cofactor * product;
            }
        }
        (entries, a * b * c * self.form(DVec3::Z, DVec3::Z))
    }

    fn along(&self, u: DVec2) -> Option<Interval> {
        let direction = u.extend(0.0);
        // C on the points (r u, 1) is a r^2 + 2 b r + c.
        let (a, b, c) =
            (self.form(direction, direction), self.form(direction, DVec3::Z), self.form(DVec3::Z, DVec3::Z));
        let [(h, value_h), (q, value_q), (x, value_x)] = self.axes;
        let across = u.perp();
        // b^2 - a c from the cofactors: it is small against both products when the cone is narrow.
        let discriminant = -(value_q * value_x * h.truncate().dot(across).powi(2)
            + value_h * value_x * q.truncate().dot(across).powi(2)
            + value_h * value_q * x.truncate().dot(across).powi(2));
        if discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        let sum = if b <= 0.0 { root - b } else { -root - b };
        let h_along = h.truncate().dot(u);
        let (begin, end) = if a > 0.0 {
            let (r0, r1) = (sum / a, c / sum);
            let (begin, end) = if r0 <= r1 { (r0, r1) } else { (r1, r0) };
            if h.z - b / a * h_along <= 0.0 {
                return None;
            }
            (begin, end)
        } else {
            let (r0, r1) = (sum / -a.abs(), c / sum);
            if h_along > 0.0 { (r0.max(r1), f64::INFINITY) } else { (f64::NEG_INFINITY, r0.min(r1)) }
        };
        if end.is_nan() || begin.is_nan() || end <= 0.0 {
            return None;
        }
        Some(if begin > 0.0 {
            let length = if a > 0.0 { 2.0 * root / a } else { f64::INFINITY };
            Interval { begin_squared: begin * begin, width_squared: length * (end + begin) }
        } else {
            Interval { begin_squared: 0.0, width_squared: end * end }
        })
    }

    fn span(&self) -> Span {
        let ([xx, xy, yy], determinant) = self.discriminant();
        let (mean, half_difference) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
        let spread = half_difference.hypot(xy);
        // The direction of the largest discriminant.
        let axis = xy.atan2(half_difference) / 2.0;
        if determinant >= 0.0 {
            return Span::Turn(one_turn((0..8).map(|k| axis + f64::from(k) * PI / 4.0 - PI).collect()));
        }
        // Of the eigenvalues, of opposite sign, the one without cancellation first.
        let (positive, negative) = if mean > 0.0 {
            let positive = mean + spread;
            (positive, determinant / positive)
        } else {
            let negative = mean - spread;
            (determinant / negative, negative)
        };
        let half_width = (positive / -negative).sqrt().atan().min(FRAC_PI_2);
        let forward = self.along(DVec2::from_angle(axis)).is_some();
        Span::Sector { middle: if forward { axis } else { axis + PI }, half_width }
    }
}

/// Angles completed to a full turn: the first again, one turn on.
fn one_turn(mut angles: Vec<f64>) -> Vec<f64> {
    let first = angles.first().copied().unwrap_or(-PI);
    angles.insert(0, first);
    angles.push(first + 2.0 * PI);
    angles
}
