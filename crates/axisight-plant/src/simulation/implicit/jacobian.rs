//! Exact Jacobian of the plant by dual numbers.

use crate::plant::{Plant, Seeded as D, WIDTH};
use crate::robot::DynamicsScratch;
use axisight_scalar::Scalar;
use nalgebra::DMatrix;

/// The plant over dual numbers.
pub(super) struct JacobianPlant {
    plant: Plant<D>,
    scratch: DynamicsScratch<D>,
    x: Vec<D>,
    applied: Vec<D>,
    command: Vec<D>,
    dx: Vec<D>,
}

impl JacobianPlant {
    pub(super) fn new(plant: Plant<D>) -> Self {
        Self {
            scratch: plant.scratch(),
            x: vec![D::zero(); plant.n_states()],
            applied: vec![D::zero(); plant.axes.len()],
            command: vec![D::zero(); plant.axes.len()],
            dx: vec![D::zero(); plant.n_states()],
            plant,
        }
    }

    /// Compute `df/dx` at state `x`, and `df/ds` for delivered torques that change by `rise` per
    /// unit of `s`.
    pub(super) fn evaluate(
        &mut self,
        x: &[f64],
        applied: &[f64],
        rise: &[f64],
        command: &[f64],
        out: &mut DMatrix<f64>,
        along: &mut [f64],
    ) {
        let n = x.len();
        for (c, u) in self.command.iter_mut().zip(command) {
            *c = D::constant(*u);
        }
        // One more seed than states, for the change of the torque over the step.
        for first in (0..=n).step_by(WIDTH) {
            for (i, (seeded, x)) in self.x.iter_mut().zip(x).enumerate() {
                *seeded = D::constant(*x);
                if (first..first + WIDTH).contains(&i) {
                    *seeded = seeded.seeded(i - first);
                }
            }
            for ((a, u), r) in self.applied.iter_mut().zip(applied).zip(rise) {
                *a = D::constant(*u);
                if let Some(partial) = a.partials.get_mut(n - first) {
                    *partial = *r;
                }
            }
            self.plant.derivative(
                &self.x,
                &self.applied,
                &self.command,
                &mut self.scratch,
                &mut self.dx,
            );
            for (row, d) in self.dx.iter().enumerate() {
                for (offset, partial) in d.partials.iter().enumerate() {
                    match first + offset {
                        column if column < n => out[(row, column)] = *partial,
                        column if column == n => along[row] = *partial,
                        _ => {}
                    }
                }
            }
        }
    }
}
