//! Poles and residues of a linearized robot, and their derivatives.
//!
//! With `Z(s) = s^2 M + s D + K`, the response is
//! `G(s) = E^T Z(s)^-1 E = sum_k l_k r_k^T / (s - lambda_k)`. A change `dZ` of the matrices gives
//! `-sum_jk l_j (y_j^T dZ(s) u_k) r_k^T / ((s - lambda_j) (s - lambda_k))`, which partial fractions
//! turn into single and double poles.
//!
//! A line therefore costs one evaluation per pole, whatever the number of parameters. All else is a
//! matrix product over all lines. Pairs of poles that are too close for partial fractions keep
//! their product.

use super::hold::{Hold, Pole};
use super::second_order::{SecondOrder, SecondOrderDerivative};
use axisight_numerics::eigen;
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Largest condition number of the eigenvectors. Above it, more than half of the digits are lost.
const LARGEST_CONDITION: f64 = 1e7;
/// Pairs of poles closer than this share of the fastest frequency keep their product.
const CLOSE: f64 = 1e-5;

/// A real pole, or a pole that also represents its conjugate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) index: usize,
    pub(super) conjugate: bool,
}

/// Poles, mode shapes `u` and left vectors `y` with `Z(s)^-1 = sum_k u_k y_k^T / (s - lambda_k)`.
pub(super) struct Modal {
    pub(super) poles: Vec<Pole>,
    /// One pole of each conjugate pair, and the real poles.
    pub(super) places: Vec<Place>,
    /// Pairs `j < k` of poles too close together for partial fractions.
    pub(super) close: Vec<(usize, usize)>,
    /// The matrices `[Re u, Im u]` and `[Re y, Im y]^T`.
    right_parts: DMatrix<f64>,
    left_parts: DMatrix<f64>,
    /// The matrices `E^T u` and `E^T y`, `(axes, poles)`.
    output: DMatrix<C>,
    input: DMatrix<C>,
}

/// Coefficients of `sum_k residue_k g_k + double_k g_k' + sum_pairs pair g_jk`. Each covers the
/// elements `(a, b)`, `a <= b`, of a symmetric response.
pub(super) struct Coefficients {
    /// Coefficients of `g_k`, `(places, elements)`.
    pub(super) residue: Vec<C>,
    /// Coefficients of the slopes `g_k'`, `(places, elements)`.
    pub(super) double: Vec<C>,
    /// Coefficients of the close pairs, `(pairs, elements)`.
    pub(super) pair: Vec<C>,
}

impl Modal {
    /// The modes of `model`, or `None` if the poles do not separate: nearly defective, or not
    /// finite.
    pub(super) fn new(model: &SecondOrder, hold: Hold) -> Option<Self> {
        let n = model.mass.nrows();
        let factor = model.mass.clone().cholesky()?.l();
        let whiten = |m: &DMatrix<f64>| -> Option<DMatrix<f64>> {
            let half = factor.solve_lower_triangular(m)?;
            factor.solve_lower_triangular(&half.transpose())
        };
        let (stiffness, damping) = (whiten(&model.stiffness)?, whiten(&model.damping)?);
        // In time units of the fastest mode, displacements and rates have similar sizes.
        let pace = stiffness.amax().sqrt().max(damping.amax());
        if !(pace > 0.0 && pace.is_finite()) {
            return None;
        }
        let state = DMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, _) => f64::from(u8::from(i + n == j)),
            (false, true) => -stiffness[(i - n, j)] / (pace * pace),
            (false, false) => -damping[(i - n, j - n)] / pace,
        });
        let (poles, mut shape) = eigen(&state)?;
        let places = places(&poles)?;
        for mut column in shape.column_iter_mut() {
            let size = column.norm();
            column /= C::new(size, 0.0);
        }
        let inverse = shape.clone().try_inverse()?;
        let condition = shape.norm() * inverse.norm();
        if condition.is_nan() || condition >= LARGEST_CONDITION {
            return None;
        }
        // Back to the coordinates of the model: p = L^-T p'' for motions, L^-1 for forces.
        let lift = |m: DMatrix<C>| -> Option<DMatrix<C>> {
            let back = factor.transpose();
            let re = back.solve_upper_triangular(&m.map(|x| x.re))?;
            let im = back.solve_upper_triangular(&m.map(|x| x.im))?;
            Some(re.zip_map(&im, C::new))
        };
        let right = lift(shape.rows(0, n).into_owned())?;
        let left = lift(inverse.columns(n, n).transpose() / C::new(pace, 0.0))?;
        let port = model.input.transpose().map(|x| C::new(x, 0.0));
        let close = pairs(2 * n).filter(|(j, k)| (poles[*j] - poles[*k]).norm() < CLOSE);
        Some(Self {
            close: close.collect(),
            poles: poles.iter().map(|p| Pole::new(p * pace, hold)).collect(),
            places,
            output: &port * &right,
            input: &port * &left,
            right_parts: parts(&right),
            left_parts: parts(&left).transpose(),
        })
    }

    pub(super) fn n_axes(&self) -> usize {
        self.output.nrows()
    }

    /// Add `factor` times the upper elements of `a b^T`.
    fn add_outer(&self, out: &mut [C], a: &[C], b: &[C], factor: C) {
        let mut slots = out.iter_mut();
        for i in 0..self.n_axes() {
            let scaled = a[i] * factor;
            for (b, slot) in b[i..].iter().zip(&mut slots) {
                *slot += scaled * b;
            }
        }
    }

    /// Coefficients of the response itself.
    pub(super) fn response(&self) -> Coefficients {
        let n_elements = self.n_axes() * (self.n_axes() + 1) / 2;
        let mut out = self.empty();
        for (place, residue) in self.places.iter().zip(out.residue.chunks_mut(n_elements)) {
            let k = place.index;
            let (l, r) = (column(&self.output, k), column(&self.input, k));
            self.add_outer(residue, l, r, C::new(1.0, 0.0));
        }
        out
    }

    fn empty(&self) -> Coefficients {
        let n_elements = self.n_axes() * (self.n_axes() + 1) / 2;
        let zeros = |count: usize| vec![C::default(); count * n_elements];
        Coefficients {
            residue: zeros(self.places.len()),
            double: zeros(self.places.len()),
            pair: zeros(self.close.len()),
        }
    }

    /// Coefficients of a derivative of the response.
    pub(super) fn derivative(&self, change: &SecondOrderDerivative) -> Coefficients {
        let (m, n_elements) = (self.n_axes(), self.n_axes() * (self.n_axes() + 1) / 2);
        let mut out = self.empty();
        let moved = Moved::new(self, change);
        let minus = C::new(-1.0, 0.0);
        for (slot, place) in self.places.iter().enumerate() {
            let k = place.index;
            let own = self.poles[k].value;
            let (l, r) = (column(&self.output, k), column(&self.input, k));
            let mut towards_output = vec![C::default(); m];
            let mut towards_input = vec![C::default(); m];
            for j in (0..self.poles.len()).filter(|j| *j != k && !self.are_close(*j, k)) {
                let apart = 1.0 / (own - self.poles[j].value);
                let (into, from) = moved.couple(j, k, own);
                add_scaled(&mut towards_output, column(&self.output, j), into * apart);
                add_scaled(&mut towards_input, column(&self.input, j), from * apart);
            }
            let (value, slope) = moved.own(k, own);
            add_scaled(&mut towards_output, l, slope * 0.5);
            add_scaled(&mut towards_input, r, slope * 0.5);
            let residue = &mut out.residue[slot * n_elements..][..n_elements];
            self.add_outer(residue, &towards_output, r, minus);
            self.add_outer(residue, l, &towards_input, minus);
            let double = &mut out.double[slot * n_elements..][..n_elements];
            self.add_outer(double, l, r, -value);
        }
        self.add_close(&moved, &mut out);
        out
    }

    fn are_close(&self, j: usize, k: usize) -> bool {
        self.close.contains(&(j.min(k), j.max(k)))
    }

    /// Add the terms of close pairs.
    ///
    /// With `n2 s^2 + n1 s + n0 = N(s)`, the quotient `N / ((s - a)(s - b))` has three terms:
    /// `(N(a) + N(b)) / 2` over the product, `(n2 (a + b) + n1) / 2` over each single pole, and a
    /// constant. The constants cancel in the sum.
    fn add_close(&self, moved: &Moved, out: &mut Coefficients) {
        let n_elements = self.n_axes() * (self.n_axes() + 1) / 2;
        for (number, (a, b)) in self.close.iter().enumerate() {
            for (j, k) in [(*a, *b), (*b, *a)] {
                let (l, r) = (column(&self.output, j), column(&self.input, k));
                let poles = [*a, *b].map(|k| self.poles[k].value);
                let [stiffness, damping, mass] = moved.polynomial(j, k);
                let at = poles.map(|s| stiffness + (damping + mass * s) * s);
                let pair = &mut out.pair[number * n_elements..][..n_elements];
                self.add_outer(pair, l, r, (at[0] + at[1]) * -0.5);
                let left_over = mass * (poles[0] + poles[1]) + damping;
                for pole in [*a, *b] {
                    if let Some(slot) = self.places.iter().position(|p| p.index == pole) {
                        let residue = &mut out.residue[slot * n_elements..][..n_elements];
                        self.add_outer(residue, l, r, left_over * -0.5);
                    }
                }
            }
        }
    }
}

/// `dM`, `dD`, `dK` in modal coordinates.
struct Moved {
    /// `y_j^T dX u_k` for `dK`, `dD`, `dM`; `None` if the matrix does not change.
    parts: [Option<DMatrix<C>>; 3],
}

impl Moved {
    fn new(modal: &Modal, change: &SecondOrderDerivative) -> Self {
        let n = modal.poles.len();
        // Real products, with real and imaginary parts side by side.
        let seen = |matrix: &DMatrix<f64>| {
            if matrix.iter().all(|x| *x == 0.0) {
                return None;
            }
            let all = &modal.left_parts * (matrix * &modal.right_parts);
            Some(DMatrix::from_fn(n, n, |j, k| {
                let re = all[(j, k)] - all[(n + j, n + k)];
                C::new(re, all[(j, n + k)] + all[(n + j, k)])
            }))
        };
        let parts = [
            seen(&change.stiffness),
            seen(&change.damping),
            seen(&change.mass),
        ];
        Self { parts }
    }

    /// `y_j^T dZ(s) u_k` as a polynomial in `s`, constant first.
    fn polynomial(&self, j: usize, k: usize) -> [C; 3] {
        [0, 1, 2].map(|i: usize| self.parts[i].as_ref().map_or(C::default(), |p| p[(j, k)]))
    }

    /// The products `y_j^T dZ(s) u_k` and `y_k^T dZ(s) u_j`.
    fn couple(&self, j: usize, k: usize, s: C) -> (C, C) {
        let (mut into, mut from, mut power) = (C::default(), C::default(), C::new(1.0, 0.0));
        for part in &self.parts {
            if let Some(part) = part {
                into += part[(j, k)] * power;
                from += part[(k, j)] * power;
            }
            power *= s;
        }
        (into, from)
    }

    /// The product `y_k^T dZ(s) u_k` and its slope over `s`.
    fn own(&self, k: usize, s: C) -> (C, C) {
        let [stiffness, damping, mass] = self.polynomial(k, k);
        (
            stiffness + (damping + mass * s) * s,
            damping + mass * s * 2.0,
        )
    }
}

fn column(matrix: &DMatrix<C>, k: usize) -> &[C] {
    let rows = matrix.nrows();
    &matrix.as_slice()[k * rows..(k + 1) * rows]
}

fn add_scaled(sum: &mut [C], x: &[C], factor: C) {
    for (sum, x) in sum.iter_mut().zip(x) {
        *sum += x * factor;
    }
}

/// Real and imaginary parts side by side.
fn parts(matrix: &DMatrix<C>) -> DMatrix<f64> {
    let n = matrix.ncols();
    DMatrix::from_fn(matrix.nrows(), 2 * n, |i, k| {
        if k < n {
            matrix[(i, k)].re
        } else {
            matrix[(i, k - n)].im
        }
    })
}

fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |j| (j + 1..n).map(move |k| (j, k)))
}

/// Real poles and one pole of each pair; `None` if a conjugate is missing.
fn places(poles: &[C]) -> Option<Vec<Place>> {
    let upper = poles.iter().filter(|p| p.im > 0.0).count();
    let lower = poles.iter().filter(|p| p.im < 0.0).count();
    if upper != lower || poles.iter().any(|p| !p.re.is_finite() || !p.im.is_finite()) {
        return None;
    }
    let all = poles.iter().enumerate().filter(|(_, p)| p.im >= 0.0);
    Some(
        all.map(|(index, p)| Place {
            index,
            conjugate: p.im > 0.0,
        })
        .collect(),
    )
}
