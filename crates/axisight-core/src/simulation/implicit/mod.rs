//! L-stable methods for stiff plants, with exact Jacobians from dual numbers.

mod jacobian;
mod linear;
mod radau_iia;
mod rosenbrock;

use super::method::{Effort, Interval, MAX_SUBSTEPS, Method, Stepper};
use super::torque_path::{Line, SampleTorque};
use crate::robot::{EffectSetting, Parameter, Plant, PlantError, RobotDescription};
use crate::scalar::Scalar;
use jacobian::JacobianPlant;
use nalgebra::DMatrix;
use radau_iia::RadauIia;
use rosenbrock::Rosenbrock;

/// What an integrator needs of an implicit solver.
pub(super) trait Implicit<S: Scalar>: Send {
    /// Advance `x` over a sample; false if the error bound cannot be met.
    fn advance(
        &mut self,
        method: Method,
        interval: &Interval<'_, S>,
        x: &mut [S],
        torque: &mut SampleTorque<'_, S>,
        effort: &mut Effort,
    ) -> bool;
}

impl Stepper<f64> {
    /// Scratch for the plant of `robot` with `overrides` and `settings`, any method.
    ///
    /// # Errors
    /// [`PlantError`] as for the plant itself.
    pub fn with_jacobian(
        plant: &Plant<f64>,
        robot: &RobotDescription,
        overrides: &[(Parameter, f64)],
        settings: &[EffectSetting<f64>],
    ) -> Result<Self, PlantError> {
        let mut stepper = Self::new(plant);
        stepper.implicit = Some(Box::new(Solver {
            slopes: Slopes::new(plant, JacobianPlant::new(robot, overrides, settings)?),
            radau: RadauIia::new(plant.n_states()),
            rosenbrock: Rosenbrock::new(plant.n_states()),
            fraction: 1.0,
        }));
        Ok(stepper)
    }
}

/// Right-hand side and Jacobian of one plant along a step.
struct Slopes {
    jacobian: JacobianPlant,
    scratch: crate::robot::DynamicsScratch<f64>,
    applied: Vec<f64>,
}

impl Slopes {
    fn new(plant: &Plant<f64>, jacobian: JacobianPlant) -> Self {
        Self {
            jacobian,
            scratch: plant.scratch(),
            applied: vec![0.0; plant.axes.len()],
        }
    }

    /// `df/dx` at the start of the step, and the change of `f` with the torque over the step.
    fn jacobian_at(
        &mut self,
        step: &Step<'_>,
        x: &[f64],
        jacobian: &mut DMatrix<f64>,
        along: &mut [f64],
    ) {
        let start: Vec<f64> = step.lines.iter().map(|l| l.at(0.0)).collect();
        let rise: Vec<f64> = step.lines.iter().map(Line::rise).collect();
        let command = step.interval.command;
        self.jacobian
            .evaluate(x, &start, &rise, command, jacobian, along);
    }

    /// `dx = f(x)` at fraction `at` of the step.
    fn evaluate(&mut self, step: &Step<'_>, at: f64, x: &[f64], dx: &mut [f64]) {
        for (a, line) in self.applied.iter_mut().zip(step.lines) {
            *a = line.at(at);
        }
        step.interval.plant.derivative(
            x,
            &self.applied,
            step.interval.command,
            &mut self.scratch,
            dx,
        );
    }
}

/// A step to try: the sample's data, its length [s] and the torque over it.
struct Step<'a> {
    interval: &'a Interval<'a, f64>,
    length: f64,
    lines: &'a [Line<f64>],
    /// Bound on the local error, relative to each state.
    tolerance: f64,
    /// Bound on what an inner iteration leaves of it.
    iteration_tolerance: f64,
}

/// Share of the tolerance that an inner iteration may leave.
const ITERATION_SHARE: f64 = 1e-2;

/// What became of a step.
enum Trial {
    /// Local error in units of the tolerance; at most one means accepted.
    Error(f64),
    /// The inner iteration failed: a shorter step, or a new Jacobian, is needed.
    NoConvergence,
}

/// A one-step method with its own memory.
trait OneStep {
    /// Order of the error estimate plus one: the step grows with `error^(-1/order)`.
    const ORDER: f64;
    /// Try a step from `x`, which is replaced if the error is at most one.
    fn attempt(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &mut [f64],
        effort: &mut Effort,
    ) -> Trial;
    /// Forget the Jacobian.
    fn refresh(&mut self);
    /// Whether the Jacobian was made at the present state.
    fn is_fresh(&self) -> bool;
}

struct Solver {
    slopes: Slopes,
    radau: RadauIia,
    rosenbrock: Rosenbrock,
    /// Proposed step as a share of the sample, kept from sample to sample.
    fraction: f64,
}

impl Implicit<f64> for Solver {
    fn advance(
        &mut self,
        method: Method,
        interval: &Interval<'_, f64>,
        x: &mut [f64],
        torque: &mut SampleTorque<'_, f64>,
        effort: &mut Effort,
    ) -> bool {
        let Self {
            slopes,
            radau,
            rosenbrock,
            fraction,
        } = self;
        match method {
            Method::RadauIia { tolerance } => {
                cover(radau, tolerance, slopes, interval, x, torque, effort, fraction)
            }
            Method::Rosenbrock { tolerance } => {
                cover(rosenbrock, tolerance, slopes, interval, x, torque, effort, fraction)
            }
            _ => false,
        }
    }
}

/// Cover one sample with steps whose local error stays below `tolerance`.
#[allow(clippy::too_many_arguments)] // the parts of one solver, borrowed apart
fn cover<M: OneStep>(
    method: &mut M,
    tolerance: f64,
    slopes: &mut Slopes,
    interval: &Interval<'_, f64>,
    x: &mut [f64],
    torque: &mut SampleTorque<'_, f64>,
    effort: &mut Effort,
    fraction: &mut f64,
) -> bool {
    let smallest = 1.0 / MAX_SUBSTEPS as f64;
    let mut from: f64 = 0.0;
    while from < 1.0 {
        // A last step much shorter than the others would need a factorization of its own.
        let left = ((1.0 - from) / *fraction).ceil().max(1.0);
        let to = if left <= 1.0 {
            1.0
        } else {
            from + (1.0 - from) / left
        };
        let step = Step {
            interval,
            length: (to - from) * interval.sample_time,
            lines: torque.span(from, to),
            tolerance,
            iteration_tolerance: ITERATION_SHARE * tolerance,
        };
        match method.attempt(&step, slopes, x, effort) {
            Trial::Error(error) if error <= 1.0 => {
                effort.steps += 1;
                torque.accept();
                let grown = 0.9 * error.max(1e-9).powf(-1.0 / M::ORDER);
                // Small changes are not worth a factorization.
                if grown > 1.5 {
                    *fraction = ((to - from) * grown.min(5.0)).min(1.0);
                }
                from = to;
            }
            Trial::Error(error) if error.is_finite() => {
                effort.rejections += 1;
                let shrunk = 0.9 * error.powf(-1.0 / M::ORDER);
                *fraction = (to - from) * shrunk.clamp(0.1, 0.8);
                method.refresh();
            }
            Trial::Error(_) => return false,
            Trial::NoConvergence => {
                effort.rejections += 1;
                if method.is_fresh() {
                    *fraction = 0.5 * (to - from);
                }
                method.refresh();
            }
        }
        if *fraction < smallest {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{equilibrium, read_robot};
    use crate::simulation::torque_path::{TorqueBuffers, TorquePath};

    const PRESET: &str = include_str!("../../../../../python/axisight/presets/irb6600_like.toml");

    /// State after a fall of 20 ms under a lagging torque in `n` equal steps.
    fn fall<M: OneStep>(make: impl Fn(usize) -> M, n: usize) -> Vec<f64> {
        let robot = read_robot(PRESET).expect("preset");
        let settings = [EffectSetting {
            name: "actuator_bandwidth".to_owned(),
            axis: Some(0),
            parameters: vec![3e-3],
        }];
        let plant = Plant::<f64>::new(&robot, &[], &settings).expect("plant");
        let rest = equilibrium(&plant, &robot.operating_point).expect("rest");
        let mut x = plant.state_at_rest(&rest.motor_angle, &rest.joint_angle);
        let command = [0.0; 3];
        let interval = Interval {
            plant: &plant,
            command: &command,
            sample_time: 0.02,
        };
        let dual = JacobianPlant::new(&robot, &[], &settings).expect("dual plant");
        let mut slopes = Slopes::new(&plant, dual);
        let mut method = make(x.len());
        let mut effort = Effort::default();
        let mut paths: Vec<_> = plant
            .axes
            .iter()
            .zip(&rest.motor_torque)
            .map(|(axis, u)| TorquePath::new(axis, *u, interval.sample_time))
            .collect();
        let mut buffers = TorqueBuffers::new(3);
        let mut torque = SampleTorque::new(&mut paths, &command, &mut buffers);
        for i in 0..n {
            let step = Step {
                interval: &interval,
                length: interval.sample_time / n as f64,
                lines: torque.span(i as f64 / n as f64, (i + 1) as f64 / n as f64),
                tolerance: 1e9,
                iteration_tolerance: 1e-13,
            };
            method.refresh();
            let trial = method.attempt(&step, &mut slopes, &mut x, &mut effort);
            assert!(matches!(trial, Trial::Error(e) if e <= 1.0));
            torque.accept();
        }
        x
    }

    fn observed_order<M: OneStep>(make: impl Fn(usize) -> M) -> f64 {
        // The straight torque lines of the path differ between step lengths by order 3 in the
        // torque, a smooth change whose effect on the state is of higher order than the
        // methods'; the reference is this method's own limit.
        let exact = fall(&make, 320);
        let error = |n: usize| {
            let x = fall(&make, n);
            let pairs = x.iter().zip(&exact);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        (error(20) / error(40)).log2()
    }

    /// The step is 1 ms and 0.5 ms against a fastest mode of 155 Hz: the next error term is
    /// smaller by about w h = 0.5, which may move the order by as much.
    #[test]
    fn observed_orders() {
        let radau = observed_order(RadauIia::new);
        assert!((radau - 5.0).abs() < 0.5, "Radau IIA: {radau}");
        let rodas = observed_order(Rosenbrock::new);
        assert!((rodas - 4.0).abs() < 0.5, "RODAS: {rodas}");
    }
}
