//! Frequency responses of a linearized robot with derivatives, all lines at once.

use super::columns::Columns;
use super::direct;
use super::hold::{Hold, Pole, point};
use super::modal::{Coefficients, Modal};
use super::second_order::{SecondOrder, SecondOrderDerivative};
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Response from motor torque to motor angle [rad/Nm], and its derivatives.
///
/// Returns `None` if the inertia matrix is not positive definite. Values are not finite on a pole.
pub fn evaluate(
    model: &SecondOrder,
    derivatives: &[SecondOrderDerivative],
    frequency_hz: &[f64],
    hold: Hold,
) -> Option<Columns> {
    match Modal::new(model, hold) {
        Some(modal) => Some(by_poles(&modal, derivatives, frequency_hz, hold)),
        None => direct::evaluate(model, derivatives, frequency_hz, hold),
    }
}

fn by_poles(
    modal: &Modal,
    derivatives: &[SecondOrderDerivative],
    frequency_hz: &[f64],
    hold: Hold,
) -> Columns {
    let n_axes = modal.n_axes();
    let n_elements = n_axes * (n_axes + 1) / 2;
    let with_slopes = !derivatives.is_empty();
    let basis = basis(modal, frequency_hz, hold, with_slopes);
    let mut all = vec![modal.response()];
    all.extend(derivatives.iter().map(|d| modal.derivative(d)));
    let mut coefficients = DMatrix::zeros(basis.ncols(), all.len() * n_elements);
    for (p, found) in all.iter().enumerate() {
        fill(
            &mut coefficients,
            p * n_elements,
            n_elements,
            modal,
            found,
            with_slopes,
        );
    }
    let mut out = Columns {
        n_axes,
        n_lines: frequency_hz.len(),
        data: basis * coefficients,
    };
    if with_slopes {
        add_pairs(&mut out, modal, &all, frequency_hz, hold);
    }
    out
}

/// Columns for real coefficients: `g` for a real pole, `g + h` and `i (g - h)` for a pair, where
/// `h` belongs to the conjugate. The same columns of the slopes follow.
fn basis(modal: &Modal, frequency_hz: &[f64], hold: Hold, with_slopes: bool) -> DMatrix<f64> {
    let (n, n_poles) = (frequency_hz.len(), modal.poles.len());
    let points: Vec<C> = frequency_hz.iter().map(|f| point(*f, hold)).collect();
    let mut out = DMatrix::zeros(2 * n, n_poles * (1 + usize::from(with_slopes)));
    let mut column = 0;
    for place in &modal.places {
        let pole = modal.poles[place.index];
        let mirrored: Option<Pole> = place.conjugate.then(|| pole.conjugate());
        for (line, at) in points.iter().enumerate() {
            let mut put = |column: usize, (g, slope): (C, C)| {
                (out[(line, column)], out[(n + line, column)]) = (g.re, g.im);
                if with_slopes {
                    let column = column + n_poles;
                    (out[(line, column)], out[(n + line, column)]) = (slope.re, slope.im);
                }
            };
            let (g, slope) = pole.evaluate(*at);
            let Some(mirrored) = &mirrored else {
                put(column, (g, slope));
                continue;
            };
            let (h, other) = mirrored.evaluate(*at);
            let i = C::new(0.0, 1.0);
            put(column, (g + h, slope + other));
            put(column + 1, ((g - h) * i, (slope - other) * i));
        }
        column += 1 + usize::from(place.conjugate);
    }
    out
}

fn fill(
    out: &mut DMatrix<f64>,
    first: usize,
    n_elements: usize,
    modal: &Modal,
    found: &Coefficients,
    with_slopes: bool,
) {
    let sets = [&found.residue, &found.double];
    let mut row = 0;
    for values in sets.iter().take(1 + usize::from(with_slopes)) {
        for (place, values) in modal.places.iter().zip(values.chunks(n_elements)) {
            for (element, value) in values.iter().enumerate() {
                out[(row, first + element)] = value.re;
                if place.conjugate {
                    out[(row + 1, first + element)] = value.im;
                }
            }
            row += 1 + usize::from(place.conjugate);
        }
    }
}

fn add_pairs(
    out: &mut Columns,
    modal: &Modal,
    all: &[Coefficients],
    frequency_hz: &[f64],
    hold: Hold,
) {
    let n = frequency_hz.len();
    let n_elements = modal.n_axes() * (modal.n_axes() + 1) / 2;
    for (number, (j, k)) in modal.close.iter().enumerate() {
        let (a, b) = (&modal.poles[*j], &modal.poles[*k]);
        for (line, f) in frequency_hz.iter().enumerate() {
            let value = a.divided_difference(b, point(*f, hold), hold);
            for (p, found) in all.iter().enumerate() {
                for element in 0..n_elements {
                    let term = found.pair[number * n_elements + element] * value;
                    out.data[(line, p * n_elements + element)] += term.re;
                    out.data[(n + line, p * n_elements + element)] += term.im;
                }
            }
        }
    }
}
