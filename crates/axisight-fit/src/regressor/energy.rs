//! The energy of a chain or tree, linear in the same parameters (thesis (4.3)).

use super::chain::LINK_PARAMETERS;
use super::evaluate::{LANES, Lane, Regressor};
use super::{RegressorError, check_rows};
use axisight_plant::robot::Vec3;
use axisight_scalar::Scalar;
use rayon::prelude::*;

const TASK: usize = 256;

impl Regressor {
    /// Kinetic plus potential energy of the links per unit of each link parameter, row-major
    /// `(n_samples, 10 n_links)`.
    ///
    /// `q` and `v` have the shape `(n_samples, n_joints)`.
    ///
    /// # Errors
    /// [`RegressorError`] if an array has the wrong size or is not finite.
    pub fn energy(&self, q: &[f64], v: &[f64]) -> Result<Vec<f64>, RegressorError> {
        let n = self.n_joints();
        let n_samples = q.len() / n;
        check_rows("q", q, n_samples, n)?;
        check_rows("v", v, n_samples, n)?;
        let width = self.links().len() * LINK_PARAMETERS;
        let mut out = vec![0.0; n_samples * width];
        if width == 0 {
            return Ok(out);
        }
        out.par_chunks_mut(TASK * width)
            .enumerate()
            .for_each(|(task, out)| {
                let mut values = vec![Lane::zero(); width];
                for (group, out) in out.chunks_mut(LANES * width).enumerate() {
                    let first = task * TASK + group * LANES;
                    self.energy_of(q, v, first, &mut values);
                    for (column, value) in values.iter().enumerate() {
                        let places = out[column..].iter_mut().step_by(width);
                        for (place, x) in places.zip(value.0) {
                            *place = x;
                        }
                    }
                }
            });
        Ok(out)
    }

    fn energy_of(&self, q: &[f64], v: &[f64], first: usize, out: &mut [Lane]) {
        let n = self.n_joints();
        let last = (q.len() / n).saturating_sub(1);
        let lanes =
            |x: &[f64], j: usize| Lane::from_lanes(|lane| x[(first + lane).min(last) * n + j]);
        let base = Reached {
            rate: Vec3::zero(),
            speed: Vec3::zero(),
            gravity: Vec3::constant(self.geometry.gravity),
            fall: Lane::zero(),
        };
        let Reached {
            mut rate,
            mut speed,
            mut gravity,
            mut fall,
        } = base;
        let tree = self.geometry.tree.as_ref();
        let mut forks = vec![base; tree.map_or(0, |_| n)];
        let mut blocks = out.chunks_exact_mut(LINK_PARAMETERS);
        for (j, segment) in self.geometry.segments.iter().enumerate() {
            if tree.is_some() && !segment.follows(j) {
                Reached {
                    rate,
                    speed,
                    gravity,
                    fall,
                } = segment.parent.map_or(base, |parent| forks[parent]);
            }
            let position = lanes(q, j);
            let (turn, offset) = (segment.turn(position), segment.offset(position));
            let (own_turn, own_shift) = segment.unit();
            fall = gravity.dot_add(&offset, fall);
            gravity = turn.apply(&gravity);
            speed = turn.apply(&rate.cross_add(&offset, &speed));
            rate = turn.apply(&rate);
            let at = lanes(v, j);
            rate = own_turn.scale_add(at, &rate);
            speed = own_shift.scale_add(at, &speed);
            if tree.is_some_and(|tree| tree.is_fork[j]) {
                forks[j] = Reached {
                    rate,
                    speed,
                    gravity,
                    fall,
                };
            }
            if !self.links().contains(&j) {
                continue;
            }
            let Some(block) = blocks.next() else { return };
            let first_moment = speed.cross(&rate) - gravity;
            let w = rate.0;
            let values = [
                speed.dot(&speed) * 0.5 - fall,
                first_moment.0[0],
                first_moment.0[1],
                first_moment.0[2],
                w[0].square() * 0.5,
                w[1].square() * 0.5,
                w[2].square() * 0.5,
                w[0] * w[1],
                w[0] * w[2],
                w[1] * w[2],
            ];
            block.copy_from_slice(&values);
        }
    }
}

/// What the sweep outwards knows of a link, in its axes.
#[derive(Debug, Clone, Copy)]
struct Reached {
    rate: Vec3<Lane>,
    speed: Vec3<Lane>,
    gravity: Vec3<Lane>,
    /// Work of gravity per mass between the base and the link's origin.
    fall: Lane,
}
