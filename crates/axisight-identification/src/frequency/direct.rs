//! Responses by one linear solution per line. This is slower than by poles, but valid for any
//! robot.

use super::columns::Columns;
use super::hold::{Hold, point};
use super::second_order::{SecondOrder, SecondOrderDerivative};
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// The response at `frequency_hz` and its derivatives; `None` if the inertia matrix is not positive
/// definite.
pub(super) fn evaluate(
    model: &SecondOrder,
    derivatives: &[SecondOrderDerivative],
    frequency_hz: &[f64],
    hold: Hold,
) -> Option<Columns> {
    match hold {
        Hold::Continuous => continuous(model, derivatives, frequency_hz),
        Hold::ZeroOrder(step) => sampled(model, derivatives, frequency_hz, step),
    }
}

fn complex(m: &DMatrix<f64>) -> DMatrix<C> {
    m.map(|x| C::new(x, 0.0))
}

fn continuous(
    model: &SecondOrder,
    derivatives: &[SecondOrderDerivative],
    frequency_hz: &[f64],
) -> Option<Columns> {
    let impedance = |mass: &DMatrix<f64>, damping: &DMatrix<f64>, stiffness: &DMatrix<f64>, w| {
        let real: DMatrix<f64> = stiffness - mass * (w * w);
        real.zip_map(damping, |k, d| C::new(k, w * d))
    };
    let input = complex(&model.input);
    let mut out = Columns::zeros(model.input.ncols(), frequency_hz.len(), derivatives.len());
    for (line, f) in frequency_hz.iter().enumerate() {
        let w = std::f64::consts::TAU * f;
        let z = impedance(&model.mass, &model.damping, &model.stiffness, w);
        let motion = z.lu().solve(&input)?;
        out.set(line, 0, &(input.transpose() * &motion));
        for (p, d) in derivatives.iter().enumerate() {
            let dz = impedance(&d.mass, &d.damping, &d.stiffness, w);
            out.set(line, p + 1, &(-(motion.transpose() * (dz * &motion))));
        }
    }
    Some(out)
}

/// `[A B; 0 0] T`, in coordinates in which the inertia matrix is the identity.
struct Held {
    joint: DMatrix<f64>,
    derivatives: Vec<DMatrix<f64>>,
    output: DMatrix<f64>,
}

fn held(model: &SecondOrder, derivatives: &[SecondOrderDerivative], step: f64) -> Option<Held> {
    let (n, m) = (model.mass.nrows(), model.input.ncols());
    let factor = model.mass.clone().cholesky()?.l();
    let whiten = |x: &DMatrix<f64>| -> Option<DMatrix<f64>> {
        let half = factor.solve_lower_triangular(x)?;
        factor.solve_lower_triangular(&half.transpose())
    };
    let (k, d) = (whiten(&model.stiffness)?, whiten(&model.damping)?);
    let e = factor.solve_lower_triangular(&model.input)?;
    let size = 2 * n + m;
    // Rows of the accelerations only, because the rows of the displacements do not change.
    let assemble = |k: DMatrix<f64>, d: DMatrix<f64>, e: DMatrix<f64>| {
        let mut joint = DMatrix::zeros(size, size);
        joint.view_mut((n, 0), (n, n)).copy_from(&(k * -step));
        joint.view_mut((n, n), (n, n)).copy_from(&(d * -step));
        joint.view_mut((n, 2 * n), (n, m)).copy_from(&(e * step));
        joint
    };
    let changes = derivatives.iter().map(|change| {
        let mass = whiten(&change.mass)?;
        let stiffness = whiten(&change.stiffness)? - &mass * &k;
        let damping = whiten(&change.damping)? - &mass * &d;
        Some(assemble(stiffness, damping, -(&mass * &e)))
    });
    let changes = changes.collect::<Option<Vec<_>>>()?;
    let mut joint = assemble(k, d, e.clone());
    joint.view_mut((0, n), (n, n)).fill_diagonal(step);
    let mut output = DMatrix::zeros(m, 2 * n);
    output.view_mut((0, 0), (m, n)).copy_from(&e.transpose());
    Some(Held {
        joint,
        derivatives: changes,
        output,
    })
}

fn sampled(
    model: &SecondOrder,
    derivatives: &[SecondOrderDerivative],
    frequency_hz: &[f64],
    step: f64,
) -> Option<Columns> {
    let Held {
        joint,
        derivatives,
        output,
    } = held(model, derivatives, step)?;
    let (m, nx, size) = (output.nrows(), output.ncols(), joint.nrows());
    let discrete = joint.clone().exp();
    // The upper right corner of exp [J dJ; 0 J] is the derivative of exp J.
    let changes: Vec<DMatrix<C>> = derivatives
        .iter()
        .map(|change| {
            let mut both = DMatrix::zeros(2 * size, 2 * size);
            both.view_mut((0, 0), (size, size)).copy_from(&joint);
            both.view_mut((size, size), (size, size)).copy_from(&joint);
            both.view_mut((0, size), (size, size)).copy_from(change);
            complex(&both.exp().view((0, size), (size, size)).into_owned())
        })
        .collect();
    let shift =
        complex(&discrete.view((0, 0), (nx, nx)).into_owned()) - DMatrix::<C>::identity(nx, nx);
    let input = complex(&discrete.view((0, nx), (nx, m)).into_owned());
    let output = complex(&output);
    let mut out = Columns::zeros(m, frequency_hz.len(), derivatives.len());
    for (line, f) in frequency_hz.iter().enumerate() {
        let at = point(*f, Hold::ZeroOrder(step));
        let resolvent = DMatrix::from_diagonal_element(nx, nx, at) - &shift;
        let into = resolvent.clone().lu().solve(&input)?;
        out.set(line, 0, &(&output * &into));
        if changes.is_empty() {
            continue;
        }
        let from = resolvent
            .transpose()
            .lu()
            .solve(&output.transpose())?
            .transpose();
        for (p, change) in changes.iter().enumerate() {
            let moved = change.view((0, 0), (nx, nx)) * &into + change.view((0, nx), (nx, m));
            out.set(line, p + 1, &(&from * moved));
        }
    }
    Some(out)
}
