//! Linearization about an operating point, with exact derivatives.

use super::axis::Axis;
use super::build::PlantError;
use super::equations::Plant;
use super::equilibrium::{Equilibrium, EquilibriumError, equilibrium};
use axisight_scalar::{Dual, Scalar};
use nalgebra::DMatrix;

/// Seeds per pass. Eight partials fill two vector registers.
pub(crate) const WIDTH: usize = 8;
/// A number with derivatives along [`WIDTH`] states.
pub type Seeded = Dual<f64, WIDTH>;
type D = Seeded;

/// Linear model `x' = A x + B u`, `phi = C x` about an equilibrium, with states
/// `[phi, q, phi', q']`.
///
/// `u` is the torque that the drives deliver. Effects of the torque path (gain, delay, lag) come
/// before it and are not in `B`.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// State matrix, `(n_states, n_states)`.
    pub a: DMatrix<f64>,
    /// Input matrix from motor torque [Nm], `(n_states, n_axes)`.
    pub b: DMatrix<f64>,
    /// Output matrix to motor angle [rad], `(n_axes, n_states)`.
    pub c: DMatrix<f64>,
    /// Readings of the accelerometers, `f = f0 + C_f (x - x0) + D_f (u - u0)`.
    pub specific_force: LinearReadings,
    /// Operating point of the linearization.
    pub equilibrium: Equilibrium<f64>,
}

/// Linear readings of accelerometers about an equilibrium.
#[derive(Debug, Clone)]
pub struct LinearReadings {
    /// Readings at rest [m/s^2].
    pub rest: Vec<f64>,
    /// Derivatives along the states, `(n_readings, n_states)`.
    pub c: DMatrix<f64>,
    /// Derivatives along the motor torques [m/s^2 per Nm], `(n_readings, n_axes)`; not zero only
    /// with rigid gears.
    pub d: DMatrix<f64>,
}

/// Reason why a robot cannot be linearized.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearizationError {
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// No equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
}

/// Linearize a plant at rest with the driven joints at `driven` [rad].
///
/// `plain` and `seeded` are the same plant over plain and over dual numbers.
///
/// # Errors
/// [`LinearizationError`] if the plant does not settle.
pub fn linearize(
    plain: &Plant<f64>,
    plant: &Plant<Seeded>,
    driven: &[f64],
) -> Result<Linearization, LinearizationError> {
    let rest = equilibrium(plain, driven)?;
    let x0 = plain.state_at_rest(&rest);
    let (nx, nu) = (plant.n_states(), plant.axes.len());
    let applied: Vec<f64> = plain
        .axes
        .iter()
        .zip(&rest.motor_torque)
        .map(|(axis, u)| axis.kernels.iter().fold(*u, |t, k| k.drive(t)))
        .collect();
    let mut jacobian = DMatrix::zeros(nx, nx + nu);
    let mut readings = DMatrix::zeros(plant.n_readings(), nx + nu);
    let mut read = vec![D::zero(); plant.n_readings()];
    let mut scratch = plant.scratch();
    let mut dx = vec![D::zero(); nx];
    for first in (0..nx + nu).step_by(WIDTH) {
        let seed = |values: &[f64], offset: usize| -> Vec<D> {
            let lifted = values.iter().enumerate().map(|(i, v)| {
                let column = offset + i;
                let inside = (first..first + WIDTH).contains(&column);
                let constant = D::constant(*v);
                if inside {
                    constant.seeded(column - first)
                } else {
                    constant
                }
            });
            lifted.collect()
        };
        let (x, tau, command) = (
            seed(&x0, 0),
            seed(&applied, nx),
            seed(&rest.motor_torque, nx),
        );
        plant.derivative(&x, &tau, &command, &mut scratch, &mut dx);
        for column in first..(first + WIDTH).min(nx + nu) {
            for (row, d) in dx.iter().enumerate() {
                jacobian[(row, column)] = d.partials[column - first];
            }
        }
        if read.is_empty() {
            continue;
        }
        plant.specific_force(&x, &dx, &mut read);
        for column in first..(first + WIDTH).min(nx + nu) {
            for (row, f) in read.iter().enumerate() {
                readings[(row, column)] = f.partials[column - first];
            }
        }
    }
    let mut c = DMatrix::zeros(nu, nx);
    for (row, axis) in plant.axes.iter().enumerate() {
        match plain.motor_slot(row) {
            Some(slot) => c[(row, slot)] = 1.0,
            None => c[(row, plant.n_motors() + axis.joint)] = 1.0 / axis.ratio,
        }
    }
    Ok(Linearization {
        a: jacobian.columns(0, nx).into_owned(),
        b: jacobian.columns(nx, nu).into_owned(),
        c,
        specific_force: LinearReadings {
            rest: read.iter().map(|f| f.lane(0)).collect(),
            c: readings.columns(0, nx).into_owned(),
            d: readings.columns(nx, nu).into_owned(),
        },
        equilibrium: rest,
    })
}

/// The fastest decay of the speed of a motor near standstill [1/s], with all angles zero.
///
/// It is the largest `-d(acceleration)/d(speed)`. Dry friction that changes its sign within a small
/// speed makes it large, which limits the steps of explicit methods.
pub fn fastest_decay(plant: &Plant<Seeded>) -> f64 {
    let mut scratch = plant.scratch();
    let torque = vec![D::zero(); plant.axes.len()];
    let mut dx = vec![D::zero(); plant.n_states()];
    let rate_of = |axis: &Axis<D>| {
        let slot = axis.gear.as_ref().map(|gear| gear.slot);
        plant.n_angles() + slot.unwrap_or(plant.n_motors() + axis.joint)
    };
    let rates: Vec<usize> = plant.axes.iter().map(rate_of).collect();
    let mut fastest = 0.0;
    for rates in rates.chunks(WIDTH) {
        let mut x = vec![D::zero(); plant.n_states()];
        for (seed, rate) in rates.iter().enumerate() {
            x[*rate] = D::zero().seeded(seed);
        }
        plant.derivative(&x, &torque, &torque, &mut scratch, &mut dx);
        let decays = rates
            .iter()
            .enumerate()
            .map(|(seed, rate)| -dx[*rate].partials[seed]);
        fastest = decays.fold(fastest, f64::max);
    }
    fastest
}
