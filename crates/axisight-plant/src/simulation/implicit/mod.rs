//! L-stable methods for stiff plants, with exact Jacobians from dual numbers.

mod jacobian;
mod linear;
mod radau_iia;
mod rosenbrock;

use super::method::{Effort, Interval, Method, Stepper};
use super::torque_path::{Line, SampleTorque};
use crate::plant::{Plant, Seeded};
use axisight_scalar::Scalar;
use jacobian::JacobianPlant;
use nalgebra::DMatrix;
use radau_iia::RadauIia;
use rosenbrock::Rosenbrock;

/// Interface between an integrator and an implicit solver.
pub(super) trait Implicit<S: Scalar>: Send {
    /// Advance `x` over a sample. Returns false if the error bound cannot be met.
    fn advance(
        &mut self,
        method: Method,
        interval: &Interval<'_, S>,
        x: &mut [S],
        torque: &mut SampleTorque<'_, S>,
        effort: &mut Effort,
    ) -> bool;
}

impl<S: Scalar> Stepper<S> {
    /// A stepper for `plant` and any method; `plain` and `seeded` are the same plant over plain and
    /// over dual numbers.
    ///
    /// Implicit methods integrate one run without derivatives. For all other scalars, use
    /// [`Stepper::new`].
    pub fn with_jacobian(plant: &Plant<S>, plain: Plant<f64>, seeded: Plant<Seeded>) -> Self {
        let mut stepper = Self::new(plant);
        if S::LANES == 1 && S::PARTIALS == 0 {
            stepper.implicit = Some(Box::new(Solver::new(plain, seeded)));
        }
        stepper
    }
}

/// Right-hand side and Jacobian of one plant along a step.
struct Slopes {
    plant: Plant<f64>,
    jacobian: JacobianPlant,
    scratch: crate::robot::DynamicsScratch<f64>,
    applied: Vec<f64>,
}

impl Slopes {
    fn new(plant: Plant<f64>, seeded: Plant<Seeded>) -> Self {
        Self {
            jacobian: JacobianPlant::new(seeded),
            scratch: plant.scratch(),
            applied: vec![0.0; plant.axes.len()],
            plant,
        }
    }

    /// Compute `df/dx` at the start of the step, and the change of `f` due to the torque over the
    /// step.
    fn jacobian_at(
        &mut self,
        step: &Step<'_>,
        x: &[f64],
        jacobian: &mut DMatrix<f64>,
        along: &mut [f64],
    ) {
        let start: Vec<f64> = step.lines.iter().map(|l| l.at(0.0)).collect();
        let rise: Vec<f64> = step.lines.iter().map(Line::rise).collect();
        self.jacobian
            .evaluate(x, &start, &rise, step.command, jacobian, along);
    }

    /// Compute `dx = f(x)` at the fraction `at` of the step.
    fn evaluate(&mut self, step: &Step<'_>, at: f64, x: &[f64], dx: &mut [f64]) {
        for (a, line) in self.applied.iter_mut().zip(step.lines) {
            *a = line.at(at);
        }
        self.plant
            .derivative(x, &self.applied, step.command, &mut self.scratch, dx);
    }
}

/// A step to try: the length [s], the command of the sample and the torque over the step.
struct Step<'a> {
    command: &'a [f64],
    length: f64,
    lines: &'a [Line<f64>],
    /// Bound on the local error, relative to each state.
    tolerance: f64,
    /// Bound on the remaining error of an inner iteration, relative to each state.
    iteration_tolerance: f64,
}

/// Share of the tolerance that an inner iteration may leave.
const ITERATION_SHARE: f64 = 1e-2;
/// Smallest achievable error of an iteration, relative to the state.
const ROUNDING: f64 = 1e-13;
/// Largest number of steps and attempts in one sample.
const MOST_STEPS: u64 = 20_000;
/// Shortest step as a share of the sample. A reversal of stiff bristles needs 1e-6.
const SHORTEST: f64 = 1e-12;

/// Result of a step.
enum Trial {
    /// Local error in units of the tolerance. The step is accepted if it is at most one.
    Error(f64),
    /// The inner iteration failed. A shorter step or a new Jacobian is needed.
    NoConvergence,
}

/// A one-step method with its own memory.
trait OneStep {
    /// Order of the error estimate plus one: the step grows with `error^(-1/order)`.
    const ORDER: f64;
    /// Try a step from `x`. Replaces `x` if the error is at most one.
    fn attempt(
        &mut self,
        step: &Step<'_>,
        slopes: &mut Slopes,
        x: &mut [f64],
        effort: &mut Effort,
    ) -> Trial;
    /// Discard the Jacobian.
    fn refresh(&mut self);
    /// Whether the Jacobian belongs to the present state.
    fn is_fresh(&self) -> bool;
}

struct Solver {
    slopes: Slopes,
    radau: RadauIia,
    rosenbrock: Rosenbrock,
    steps: StepSize,
}

/// Step-size control that persists from sample to sample.
struct StepSize {
    /// Proposed step as a share of the sample.
    fraction: f64,
    x: Vec<f64>,
    command: Vec<f64>,
    lines: Vec<Line<f64>>,
}

impl Solver {
    fn new(plant: Plant<f64>, seeded: Plant<Seeded>) -> Self {
        let slopes = Slopes::new(plant, seeded);
        let n = slopes.plant.n_states();
        Self {
            slopes,
            radau: RadauIia::new(n),
            rosenbrock: Rosenbrock::new(n),
            steps: StepSize {
                fraction: 1.0,
                x: vec![0.0; n],
                command: Vec::new(),
                lines: Vec::new(),
            },
        }
    }
}

impl<S: Scalar> Implicit<S> for Solver {
    fn advance(
        &mut self,
        method: Method,
        interval: &Interval<'_, S>,
        x: &mut [S],
        torque: &mut SampleTorque<'_, S>,
        effort: &mut Effort,
    ) -> bool {
        let Self {
            slopes,
            radau,
            rosenbrock,
            steps,
        } = self;
        for (own, x) in steps.x.iter_mut().zip(&*x) {
            *own = x.lane(0);
        }
        let met = match method {
            Method::RadauIia { tolerance } => {
                steps.cover(radau, tolerance, slopes, interval, torque, effort)
            }
            Method::Rosenbrock { tolerance } => {
                steps.cover(rosenbrock, tolerance, slopes, interval, torque, effort)
            }
            _ => false,
        };
        for (x, own) in x.iter_mut().zip(&steps.x) {
            *x = S::constant(*own);
        }
        met
    }
}

impl StepSize {
    /// Cover one sample with steps whose local error stays below `tolerance`.
    fn cover<S: Scalar, M: OneStep>(
        &mut self,
        method: &mut M,
        tolerance: f64,
        slopes: &mut Slopes,
        interval: &Interval<'_, S>,
        torque: &mut SampleTorque<'_, S>,
        effort: &mut Effort,
    ) -> bool {
        let budget = effort.steps + effort.rejections + MOST_STEPS;
        self.command.clear();
        self.command
            .extend(interval.command.iter().map(|u| u.lane(0)));
        let mut from: f64 = 0.0;
        while from < 1.0 {
            let to = self.end(from);
            self.lines.clear();
            self.lines
                .extend(torque.span(from, to).iter().map(Line::first_lane));
            let step = Step {
                command: &self.command,
                length: (to - from) * interval.sample_time,
                lines: &self.lines,
                tolerance,
                iteration_tolerance: (ITERATION_SHARE * tolerance).max(ROUNDING),
            };
            match method.attempt(&step, slopes, &mut self.x, effort) {
                Trial::Error(error) if error <= 1.0 => {
                    effort.steps += 1;
                    torque.accept();
                    let grown = 0.9 * error.max(1e-9).powf(-1.0 / M::ORDER);
                    // A small change of the step is not worth a factorization.
                    if grown > 1.5 {
                        self.fraction = ((to - from) * grown.min(5.0)).min(1.0);
                    }
                    from = to;
                }
                Trial::Error(error) => {
                    effort.rejections += 1;
                    let wanted = 0.9 * error.powf(-1.0 / M::ORDER);
                    // An error of NaN shrinks the step most.
                    let shrunk = if wanted > 0.1 { wanted.min(0.8) } else { 0.1 };
                    self.fraction = (to - from) * shrunk;
                    method.refresh();
                }
                Trial::NoConvergence => {
                    effort.rejections += 1;
                    if method.is_fresh() {
                        self.fraction = 0.5 * (to - from);
                    }
                    method.refresh();
                }
            }
            let spent = effort.steps + effort.rejections >= budget;
            if spent || self.fraction < SHORTEST {
                return false;
            }
        }
        true
    }

    /// End of the step that starts at `from`. The rest of the sample is cut in equal parts, because
    /// a short last step would need its own factorization.
    fn end(&self, from: f64) -> f64 {
        let parts = ((1.0 - from) / self.fraction).ceil();
        if parts <= 1.0 {
            1.0
        } else {
            from + (1.0 - from) / parts
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::equilibrium;
    use crate::robot::{Compliance, Controller, Drive, Joint, Link, Motion, RobotDescription};
    use crate::simulation::{TorqueBuffers, TorquePath};

    /// A loaded gear with its fastest mode at 70 Hz, and a swinging link behind it.
    fn robot() -> RobotDescription {
        let joint = |name: &str, stiffness, drive: Option<Drive>, mass| Joint {
            name: name.to_owned(),
            parent: drive.is_none().then_some(0),
            motion: Motion::Revolute,
            origin: [0.0, 0.0, 0.5],
            axis: [0.0, 1.0, 0.0],
            compliance: Some(Compliance {
                stiffness,
                damping: stiffness * 2e-4,
            }),
            link: Some(Link {
                mass,
                com: [0.5, 0.0, 0.1],
                inertia: [1.0, 5.0, 5.0, 0.0, 0.0, 0.0],
            }),
            drive,
        };
        let drive = Drive {
            gear_ratio: 0.01,
            motor_inertia: 0.01,
            viscous_friction: 0.02,
        };
        RobotDescription {
            name: "falling".to_owned(),
            gravity: [0.0, 0.0, -9.81],
            floating_base: None,
            sample_time: 0.02,
            joints: vec![
                joint("driven", 2e6, Some(drive), 50.0),
                joint("swaying", 4e5, None, 20.0),
            ],
            controller: Controller::None,
            position_noise_std: 0.0,
            operating_point: vec![0.3],
            accelerometers: Vec::new(),
            effects: Vec::new(),
            tolerances: Vec::new(),
        }
    }

    fn plant<S: Scalar>() -> Plant<S> {
        Plant::with_kernels(&robot(), &[], Vec::new()).expect("plant")
    }

    /// State after a fall of 20 ms without torque in `n` equal steps.
    fn fall<M: OneStep>(make: impl Fn(usize) -> M, n: usize) -> Vec<f64> {
        let plant = plant::<f64>();
        let rest = equilibrium(&plant, &robot().operating_point).expect("rest");
        let mut x = plant.state_at_rest(&rest);
        let command = [0.0];
        let duration = 0.02;
        let mut slopes = Slopes::new(plant.clone(), self::plant());
        let mut method = make(x.len());
        let mut effort = Effort::default();
        let mut paths: Vec<_> = plant
            .axes
            .iter()
            .zip(&rest.motor_torque)
            .map(|(axis, u)| TorquePath::new(axis, *u, duration))
            .collect();
        let mut buffers = TorqueBuffers::new(1);
        let mut torque = SampleTorque::new(&mut paths, &command, &[0.0], &mut buffers);
        for i in 0..n {
            let step = Step {
                command: &command,
                length: duration / n as f64,
                lines: torque.part(i, n),
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
        // The reference is the limit of the same method.
        let exact = fall(&make, 320);
        let error = |n: usize| {
            let x = fall(&make, n);
            let pairs = x.iter().zip(&exact);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        (error(20) / error(40)).log2()
    }

    /// With steps of 1 ms and 0.5 ms and a mode of 70 Hz, the next error term is smaller by about w
    /// h = 0.2 to 0.4, and may change the order by as much.
    #[test]
    fn observed_orders() {
        let radau = observed_order(RadauIia::new);
        assert!((radau - 5.0).abs() < 0.5, "Radau IIA: {radau}");
        let rodas = observed_order(Rosenbrock::new);
        eprintln!("Ro {rodas}");
        assert!((rodas - 4.0).abs() < 0.5, "RODAS: {rodas}");
    }
}
