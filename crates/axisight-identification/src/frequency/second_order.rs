//! The linearized robot in second-order form, with exact derivatives.
//!
//! At rest at the joint angles `q0`, the robot obeys `M p'' + D p' + K p = E u` with
//! `p = [phi, q]`. All three matrices are symmetric. `M` contains the motor inertias and `M(q0)`;
//! `D` and `K` contain gears, springs and viscous friction; `K` also contains the gravity stiffness
//! `dg/dq`. The motor angles are `E^T p`.
//!
//! Elastic joints settle under gravity, so `q0` depends on the parameters. Its derivative follows
//! from the implicit function theorem.

use axisight_core::effects::{self, Linear};
use axisight_core::plant::{EquilibriumError, Plant, PlantError, assemble, equilibrium};
use axisight_core::robot::{Chain, EffectSetting, Motion, Parameter, RobotDescription, Vec3};
use axisight_scalar::{Dual, Scalar};
use nalgebra::{DMatrix, DVector};

/// Number of parameters that one pass differentiates.
const WIDTH: usize = 8;
type D = Dual<f64, WIDTH>;

/// The linear model `M p'' + D p' + K p = E u` with the motor angles `E^T p`.
#[derive(Debug, Clone)]
pub struct SecondOrder {
    /// `M`, symmetric positive definite.
    pub mass: DMatrix<f64>,
    /// `D`, symmetric.
    pub damping: DMatrix<f64>,
    /// `K`, symmetric.
    pub stiffness: DMatrix<f64>,
    /// `E`, `(coordinates, axes)`.
    pub input: DMatrix<f64>,
}

/// Derivatives of the matrices with respect to one parameter.
#[derive(Debug, Clone)]
pub struct SecondOrderDerivative {
    /// `dM`.
    pub mass: DMatrix<f64>,
    /// `dD`.
    pub damping: DMatrix<f64>,
    /// `dK`.
    pub stiffness: DMatrix<f64>,
}

/// Reason why a robot has no linear model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SecondOrderError {
    /// An effect has a slope at rest that does not hold in motion.
    #[error(
        "effects: expected only {expected} (the slope of others at rest is not what a moving \
         robot shows; friction under excitation is `viscous_friction` of the axis), got {got}"
    )]
    Effect {
        /// Effects that only change parameters.
        expected: String,
        /// The effect that is not one of them.
        got: String,
    },
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// No equilibrium was found.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The elastic joints are at an unstable equilibrium.
    #[error("elastic joints: expected springs stiffer than the gravity load")]
    Unstable,
    /// The inertia matrix is not positive definite.
    #[error("inertia matrix: expected a positive definite one; masses or inertias are too small")]
    Mass,
}

/// A robot with given parameters, to be linearized at any pose.
pub struct Linearizer<'a> {
    robot: &'a RobotDescription,
    motion: Vec<Motion>,
    plain: Plant<f64>,
    /// One plant for every [`WIDTH`] parameters.
    seeded: Vec<Plant<D>>,
    count: usize,
}

struct Matrices<S> {
    mass: Vec<S>,
    damping: Vec<S>,
    stiffness: Vec<S>,
}

impl<'a> Linearizer<'a> {
    /// `robot` with the parameters `values`, and derivatives with respect to `seeds`, which are
    /// indices into `values`.
    ///
    /// # Errors
    /// [`SecondOrderError`] if an effect is not linear, or the plant cannot be built.
    pub fn new(
        robot: &'a RobotDescription,
        settings: &[EffectSetting<f64>],
        values: &[(Parameter, f64)],
        seeds: &[usize],
    ) -> Result<Self, SecondOrderError> {
        let (_, all) = robot.with_all_effects(settings);
        let linear = |name| effects::info(name).is_ok_and(|i| i.linear == Linear::Parameters);
        if let Some(setting) = all.iter().find(|s| !linear(&s.name)) {
            let known = effects::EFFECTS.iter().map(|e| e.name);
            return Err(SecondOrderError::Effect {
                expected: known.filter(|n| linear(n)).collect::<Vec<_>>().join(", "),
                got: setting.label(),
            });
        }
        let lifted: Vec<EffectSetting<D>> = settings.iter().map(EffectSetting::lifted).collect();
        let seeded = seeds.chunks(WIDTH).map(|chunk| {
            let number = |(i, (parameter, value)): (usize, &(Parameter, f64))| {
                let constant = D::constant(*value);
                let seed = chunk.iter().position(|s| *s == i);
                (*parameter, seed.map_or(constant, |s| constant.seeded(s)))
            };
            let overrides: Vec<_> = values.iter().enumerate().map(number).collect();
            assemble(robot, &overrides, &lifted)
        });
        Ok(Self {
            robot,
            motion: robot.joints.iter().map(|j| j.motion).collect(),
            plain: assemble(robot, values, settings)?,
            seeded: seeded.collect::<Result<_, _>>()?,
            count: seeds.len(),
        })
    }

    /// The linear model with the driven joints at `driven` [rad], and its derivatives.
    ///
    /// # Errors
    /// [`SecondOrderError`] if the arm does not settle, or settles in an unstable equilibrium.
    pub fn at(
        &self,
        driven: &[f64],
    ) -> Result<(SecondOrder, Vec<SecondOrderDerivative>), SecondOrderError> {
        let rest = equilibrium(&self.plain, driven)?;
        let q = rest.joint_angle;
        let matrices = self.matrices(&self.plain, &q);
        let n = self.plain.n_angles();
        let square = |values: &[f64]| DMatrix::from_row_slice(n, n, values);
        let settled = self.settled_stiffness(&q)?;
        let mut derivatives = Vec::with_capacity(self.count);
        for (chunk, plant) in self.seeded.iter().enumerate() {
            let moved = settled_angles(plant, &q, &settled);
            let found = self.matrices(plant, &moved);
            let width = (self.count - chunk * WIDTH).min(WIDTH);
            let part = |values: &[D], seed: usize| {
                DMatrix::from_row_iterator(n, n, values.iter().map(|x| x.partials[seed]))
            };
            derivatives.extend((0..width).map(|seed| SecondOrderDerivative {
                mass: part(&found.mass, seed),
                damping: part(&found.damping, seed),
                stiffness: part(&found.stiffness, seed),
            }));
        }
        let model = SecondOrder {
            mass: square(&matrices.mass),
            damping: square(&matrices.damping),
            stiffness: square(&matrices.stiffness),
            input: self.input(),
        };
        Ok((model, derivatives))
    }

    fn input(&self) -> DMatrix<f64> {
        let mut input = DMatrix::zeros(self.plain.n_angles(), self.plain.axes.len());
        for (column, (slot, per_state)) in self.plain.motor_slots().iter().enumerate() {
            input[(*slot, column)] = *per_state;
        }
        input
    }

    /// Factorized stiffness `K_e + dg_e/dq_e` of the elastic joints.
    fn settled_stiffness(&self, q: &[f64]) -> Result<Settled, SecondOrderError> {
        let elastic = &self.plain.elastic;
        let n = q.len();
        let gravity = self.gravity_stiffness(&self.plain.chain, q);
        let matrix = DMatrix::from_fn(elastic.len(), elastic.len(), |i, j| {
            let spring = if i == j { elastic[i].1 } else { 0.0 };
            spring + gravity[elastic[i].0 * n + elastic[j].0]
        });
        matrix.cholesky().ok_or(SecondOrderError::Unstable)
    }

    fn matrices<S: Scalar>(&self, plant: &Plant<S>, q: &[S]) -> Matrices<S> {
        let (motors, joints, n) = (plant.n_motors(), q.len(), plant.n_angles());
        let zero = vec![S::zero(); n * n];
        let mut out = Matrices {
            mass: zero.clone(),
            damping: zero.clone(),
            stiffness: zero,
        };
        let inertia = plant.dynamics.evaluate(q, &vec![S::zero(); joints]).inertia;
        let gravity = self.gravity_stiffness(&plant.chain, q);
        for i in 0..joints {
            for j in 0..joints {
                let place = (motors + i) * n + motors + j;
                out.mass[place] = inertia[i * joints + j];
                out.stiffness[place] = gravity[i * joints + j];
            }
        }
        for (axis, (slot, up)) in plant.axes.iter().zip(plant.motor_slots()) {
            let own = slot * n + slot;
            out.mass[own] += axis.motor_inertia * (up * up);
            out.damping[own] += axis.viscous_friction * (up * up);
            let Some(gear) = &axis.gear else { continue };
            let joint = motors + axis.joint;
            let (r, cross) = (axis.ratio, slot * n + joint);
            for (matrix, value) in [
                (&mut out.stiffness, gear.stiffness),
                (&mut out.damping, gear.damping),
            ] {
                matrix[own] += value * (r * r);
                matrix[cross] += value * (-r);
                matrix[joint * n + slot] += value * (-r);
                matrix[joint * n + joint] += value;
            }
        }
        for (joint, stiffness, damping) in &plant.elastic {
            let own = (motors + joint) * (n + 1);
            out.stiffness[own] += *stiffness;
            out.damping[own] += *damping;
        }
        out
    }

    /// Gravity stiffness `dg/dq`, row-major.
    ///
    /// For a joint `i` that is `j` or carries it, the entry is `-gravity . (a_i x (a_j x s_j))`, with the axes `a` and the first
    /// moment `s_j` of all links beyond joint `j` about that joint. For a prismatic joint, `a_j`
    /// times the mass beyond it replaces `a_j x s_j`.
    fn gravity_stiffness<S: Scalar>(&self, chain: &Chain<S>, q: &[S]) -> Vec<S> {
        let n = q.len();
        let poses = chain.poses(q);
        let gravity = Vec3::<S>::constant(self.robot.gravity);
        let mut out = vec![S::zero(); n * n];
        let mut beyond = vec![(S::zero(), Vec3::<S>::zero()); n];
        for j in (0..n).rev() {
            let (mut mass, mut first) = beyond[j];
            if let Some(body) = &chain.joints[j].body {
                let com = poses[j].rotation.apply(&Vec3(body.com)) + poses[j].position;
                mass += body.mass;
                first += com.scale(body.mass);
            }
            if let Some(parent) = chain.joints[j].parent {
                beyond[parent].0 += mass;
                beyond[parent].1 += first;
            }
            let push = match self.motion[j] {
                Motion::Revolute => poses[j]
                    .axis
                    .cross(&(first - poses[j].position.scale(mass))),
                Motion::Prismatic => poses[j].axis.scale(mass),
            };
            for i in chain.path(j) {
                let still = i == j && self.motion[j] == Motion::Prismatic;
                if still || self.motion[i] == Motion::Prismatic {
                    continue;
                }
                let value = -gravity.dot(&poses[i].axis.cross(&push));
                out[i * n + j] = value;
                out[j * n + i] = value;
            }
        }
        out
    }
}

type Settled = nalgebra::Cholesky<f64, nalgebra::Dyn>;

/// Joint angles with derivatives that keep the elastic joints in equilibrium.
fn settled_angles(plant: &Plant<D>, q: &[f64], settled: &Settled) -> Vec<D> {
    let rest: Vec<D> = vec![D::zero(); q.len()];
    let mut angles: Vec<D> = q.iter().map(|x| D::constant(*x)).collect();
    let force = plant.dynamics.evaluate(&angles, &rest).bias;
    let residual: Vec<D> = plant
        .elastic
        .iter()
        .map(|(joint, stiffness, _)| force[*joint] + *stiffness * angles[*joint])
        .collect();
    for seed in 0..WIDTH {
        let slope = residual.iter().map(|r| -r.partials[seed]);
        let slope = DVector::from_iterator(residual.len(), slope);
        for ((joint, ..), x) in plant.elastic.iter().zip(settled.solve(&slope).iter()) {
            angles[*joint].partials[seed] = *x;
        }
    }
    angles
}
