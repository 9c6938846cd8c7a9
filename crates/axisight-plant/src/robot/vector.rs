//! Three-vectors, rotations and inertias over any scalar.

use axisight_scalar::Scalar;
use std::array::from_fn;
use std::ops::{Add, AddAssign, Sub};

/// A vector in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Vec3<S>(pub [S; 3]);

impl<S: Scalar> Vec3<S> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([S::zero(); 3])
    }
    /// A constant vector.
    #[inline(always)]
    pub fn constant(x: [f64; 3]) -> Self {
        Self(x.map(S::constant))
    }
    /// Inner product.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> S {
        let (a, b) = (&self.0, &other.0);
        a[0].fma(b[0], a[1].fma(b[1], a[2] * b[2]))
    }
    /// Inner product plus a number.
    #[inline(always)]
    pub fn dot_add(&self, other: &Self, sum: S) -> S {
        let (a, b) = (&self.0, &other.0);
        a[0].fma(b[0], a[1].fma(b[1], a[2].fma(b[2], sum)))
    }
    /// Cross product.
    #[inline(always)]
    #[must_use]
    pub fn cross(&self, other: &Self) -> Self {
        let (a, b) = (&self.0, &other.0);
        Self([
            a[1].fma(b[2], -(a[2] * b[1])),
            a[2].fma(b[0], -(a[0] * b[2])),
            a[0].fma(b[1], -(a[1] * b[0])),
        ])
    }
    /// Cross product plus a vector.
    #[inline(always)]
    #[must_use]
    pub fn cross_add(&self, other: &Self, sum: &Self) -> Self {
        let (a, b, c) = (&self.0, &other.0, &sum.0);
        Self([
            a[1].fma(b[2], (-a[2]).fma(b[1], c[0])),
            a[2].fma(b[0], (-a[0]).fma(b[2], c[1])),
            a[0].fma(b[1], (-a[1]).fma(b[0], c[2])),
        ])
    }
    /// Product with a scalar.
    #[inline(always)]
    #[must_use]
    pub fn scale(&self, s: S) -> Self {
        let [x, y, z] = self.0;
        Self([x * s, y * s, z * s])
    }
    /// `s * self + sum`.
    #[inline(always)]
    #[must_use]
    pub fn scale_add(&self, s: S, sum: &Self) -> Self {
        let ([x, y, z], c) = (self.0, &sum.0);
        Self([x.fma(s, c[0]), y.fma(s, c[1]), z.fma(s, c[2])])
    }
    /// `sum - s * self`.
    #[inline(always)]
    #[must_use]
    pub fn scale_sub(&self, s: S, sum: &Self) -> Self {
        let ([x, y, z], c) = (self.0, &sum.0);
        Self([(-x).fma(s, c[0]), (-y).fma(s, c[1]), (-z).fma(s, c[2])])
    }
    /// The opposite vector.
    #[inline(always)]
    #[must_use]
    pub fn negate(&self) -> Self {
        let [x, y, z] = self.0;
        Self([-x, -y, -z])
    }
}

impl<S: Scalar> Add for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }
}
impl<S: Scalar> AddAssign for Vec3<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<S: Scalar> Sub for Vec3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
    }
}

/// A 3x3 matrix by rows.
#[derive(Debug, Clone, Copy)]
pub struct Mat3<S>(pub [[S; 3]; 3]);

impl<S: Scalar> Mat3<S> {
    /// The identity.
    pub fn identity() -> Self {
        Self(from_fn(|i| {
            from_fn(|j| S::constant(if i == j { 1.0 } else { 0.0 }))
        }))
    }
    /// The symmetric matrix with entries xx yy zz xy xz yz.
    #[inline(always)]
    pub fn symmetric(m: &[S; 6]) -> Self {
        Self([[m[0], m[3], m[4]], [m[3], m[1], m[5]], [m[4], m[5], m[2]]])
    }
    /// Matrix times vector.
    #[inline(always)]
    pub fn apply(&self, v: &Vec3<S>) -> Vec3<S> {
        let [x, y, z] = self.0;
        Vec3([Vec3(x).dot(v), Vec3(y).dot(v), Vec3(z).dot(v)])
    }
    /// Product of two matrices.
    #[must_use]
    pub fn times(&self, other: &[[S; 3]; 3]) -> Self {
        let column = |j: usize| Vec3(from_fn(|k| other[k][j]));
        Self(from_fn(|i| from_fn(|j| Vec3(self.0[i]).dot(&column(j)))))
    }
    /// Matrix times a constant vector. Zero entries cost nothing.
    #[inline(always)]
    pub fn apply_constant(&self, v: &[f64; 3]) -> Vec3<S> {
        let mut out = Vec3::zero();
        for (j, &x) in v.iter().enumerate() {
            if x == 0.0 {
                continue;
            }
            for i in 0..3 {
                out.0[i] += self.0[i][j] * x;
            }
        }
        out
    }
}

/// The rotation about a constant unit axis by the angle with sine `s` and cosine `c` (Rodrigues).
#[inline(always)]
pub fn rotation<S: Scalar>(axis: &[f64; 3], s: S, c: S) -> [[S; 3]; 3] {
    let t = S::one() - c;
    let [x, y, z] = *axis;
    [
        [c + t * (x * x), t * (x * y) - s * z, t * (x * z) + s * y],
        [t * (x * y) + s * z, c + t * (y * y), t * (y * z) - s * x],
        [t * (x * z) - s * y, t * (y * z) + s * x, c + t * (z * z)],
    ]
}

/// `R I R^T` for a symmetric inertia stored as xx yy zz xy xz yz.
#[inline(always)]
pub fn rotate_inertia<S: Scalar>(r: &Mat3<S>, inertia: &[S; 6]) -> [S; 6] {
    let m = Mat3::symmetric(inertia);
    // Rows of R I.
    let [x, y, z] = r.0;
    let ri = [m.apply(&Vec3(x)), m.apply(&Vec3(y)), m.apply(&Vec3(z))];
    let entry = |i: usize, j: usize| ri[i].dot(&Vec3(r.0[j]));
    [
        entry(0, 0),
        entry(1, 1),
        entry(2, 2),
        entry(0, 1),
        entry(0, 2),
        entry(1, 2),
    ]
}

/// Move the reference point of a second moment by `-d`, so that bodies appear shifted by `d`.
/// `first` and `mass` are the moments about the old point.
#[inline(always)]
pub fn shift_inertia<S: Scalar>(second: &mut [S; 6], d: &Vec3<S>, first: &Vec3<S>, mass: S) {
    // With h = first + m d / 2 the second moment grows by 2 (d.h) 1 - (d h^T + h d^T).
    let h = d.scale_add(mass * 0.5, first);
    let twice = |i: usize| d.0[i] * h.0[i] * 2.0;
    let (xx, yy, zz) = (twice(0), twice(1), twice(2));
    second[0] += yy + zz;
    second[1] += xx + zz;
    second[2] += xx + yy;
    let mixed = |i: usize, j: usize| (-d.0[i]).fma(h.0[j], -(d.0[j] * h.0[i]));
    second[3] += mixed(0, 1);
    second[4] += mixed(0, 2);
    second[5] += mixed(1, 2);
}
