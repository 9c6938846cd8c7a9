//! Runs of one data set: simulation, or prediction with the innovations form (3.33).

use super::chain::{Chain, State};
use super::data::AxisSet;
use super::error::AxisError;
use super::layout::{AxisModel, Hold, Output};
use super::motion::{Motion, Ramp};
use super::numbers::Number;
use std::sync::atomic::{AtomicBool, Ordering};

/// Motor speed [rad/s] above which a run has diverged.
const LARGEST_SPEED: f64 = 1e6;

/// Number of samples between two checks of the cancel flag.
const LOOK: usize = 4096;

/// A simulated or predicted run.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Output of the model, one value per sample.
    pub output: Vec<f64>,
    /// Motor angle, deflections and speeds, row-major `(sample, state)`.
    pub states: Vec<f64>,
}

/// A run of one data set.
pub(super) struct Predictor<'a, S: Number, const N: usize> {
    model: &'a AxisModel,
    motion: Motion<S, N>,
    start: State<S, N>,
    gains: Option<State<S, N>>,
}

impl<'a, S: Number, const N: usize> Predictor<'a, S, N> {
    /// A run of data set `set`; `value` gives each parameter by its place.
    #[inline(always)]
    pub fn new(
        model: &'a AxisModel,
        theta: &[f64],
        set: usize,
        value: impl Fn(usize) -> S,
        predicts: bool,
    ) -> Self {
        let layout = model.layout();
        let plain = Chain::new(model, |i| theta.get(i).copied().unwrap_or(0.0));
        let gain = |i: usize| {
            if i == 0 {
                S::zero()
            } else {
                value(layout.gain(i - 1))
            }
        };
        Self {
            model,
            motion: Motion::new(
                Chain::new(model, &value),
                Chain::new(model, |i| value(i).plain()),
                plain,
            ),
            start: State::new(|i| value(layout.start(set) + i)),
            gains: predicts.then(|| State::new(gain)),
        }
    }

    /// Run through the samples. `visit` receives the sample number, the state and the predicted
    /// output.
    #[inline(always)]
    pub fn run<const EXTENDED: bool>(
        &self,
        data: &AxisSet,
        cancel: &AtomicBool,
        mut visit: impl FnMut(usize, &State<S, N>, S),
    ) -> Result<(), AxisError> {
        let n = data.torque.len();
        let h = data.sample_time / self.model.substeps as f64;
        let mut x = self.start;
        let mut last_place = x.place[0];
        for k in 0..n {
            let output = match self.model.output {
                Output::Velocity => x.speed[0],
                Output::Position => x.place[0],
                Output::VelocityDifference => (x.place[0] - last_place) * (1.0 / data.sample_time),
            };
            let speed = x.speed[0].lane(0).abs();
            if speed.is_nan() || speed >= LARGEST_SPEED {
                return Err(AxisError::Diverged {
                    set: data.number,
                    sample: k,
                });
            }
            if k % LOOK == 0 && cancel.load(Ordering::Relaxed) {
                return Err(AxisError::Cancelled);
            }
            visit(k, &x, output);
            last_place = x.place[0];
            let torque = data.torque[k];
            let next = data.torque.get(k + 1).copied().unwrap_or(torque);
            let slope = match self.model.hold {
                Hold::Zero => 0.0,
                Hold::First => (next - torque) / data.sample_time,
            };
            for j in 0..self.model.substeps {
                let torque = slope.mul_add(j as f64 * h, torque);
                x = self.motion.step::<EXTENDED>(&x, Ramp { torque, slope }, h);
            }
            if let (Some(gains), Some(measured)) = (&self.gains, data.output.get(k)) {
                // x(k+1) = f(x(k), u(k)) + K (y(k) - yhat(k))
                x = x.shifted(gains, -(output - *measured));
            }
        }
        Ok(())
    }
}
