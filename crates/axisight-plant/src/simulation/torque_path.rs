//! The path from commanded torque to the torque that the drive delivers.
//!
//! The order is: command, limit, transport delay, current-loop lag, torque constant and offset,
//! motor.
//!
//! Delay and lag make the torque vary inside a sample. Over each sub-step, the integrator receives
//! the straight line with the same mean and first moment. Velocity and position of the motor
//! inertia at the end of the step depend only on these two moments, so they are exact for any delay
//! or lag. The result is smooth in both parameters.

use super::current_loop::{CurrentLoop, Delivered, Moments};
use crate::effect::Kernel;
use crate::plant::Axis;
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Torque over a sub-step, `mean + slope (s - 1/2)` for `s` from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub struct Line<S> {
    mean: S,
    slope: S,
}

impl<S: Scalar> Line<S> {
    /// Torque at fraction `s` of the sub-step.
    #[inline(always)]
    pub fn at(&self, s: f64) -> S {
        self.mean + self.slope * (s - 0.5)
    }

    /// The line of the first lane, in plain numbers.
    pub fn first_lane(&self) -> Line<f64> {
        Line {
            mean: self.mean.lane(0),
            slope: self.slope.lane(0),
        }
    }

    /// Change of the torque over the sub-step.
    #[inline(always)]
    pub fn rise(&self) -> S {
        self.slope
    }
}

/// Torque path of one axis.
pub struct TorquePath<S> {
    kernels: Vec<Arc<dyn Kernel<S>>>,
    delay: Option<Delay<S>>,
    /// Current loops of first and second order. At most one of them is active.
    loops: [Option<CurrentLoop<S>>; 2],
    /// State of the loops at the start of the sample.
    state: States<S>,
}

/// Delivered torques of the loops of an axis, in their order.
type States<S> = [Delivered<S>; 2];

struct Delay<S> {
    /// Fraction of a sample at which the command changes.
    fraction: S,
    /// Commands that the drive still has to apply, oldest first: the one in force at the start of
    /// the sample, the one after the switch, and later ones.
    history: Vec<S>,
}

impl<S: Scalar> TorquePath<S> {
    /// Path of `axis`, settled at the command `rest`.
    pub fn new(axis: &Axis<S>, rest: S, sample_time: f64) -> Self {
        Self::through(axis.kernels.clone(), rest, sample_time)
    }

    /// The same path without its transport delay, for controllers with delayed references.
    #[must_use]
    pub fn at_once(mut self) -> Self {
        self.delay = None;
        self
    }

    /// Path through `kernels`, settled at the command `rest`.
    pub fn through(kernels: Vec<Arc<dyn Kernel<S>>>, rest: S, sample_time: f64) -> Self {
        let total = |values: Vec<S>| values.into_iter().reduce(|a, b| a + b);
        let delay = total(kernels.iter().filter_map(|k| k.delay()).collect());
        let lag = total(kernels.iter().filter_map(|k| k.lag()).collect());
        let second = kernels.iter().find_map(|k| k.current_loop());
        Self {
            delay: delay.map(|d| Delay::new(d * (1.0 / sample_time), rest)),
            loops: [
                lag.map(|t| CurrentLoop::new(t, None, sample_time)),
                second.map(|(t, damping)| CurrentLoop::new(t, Some(damping), sample_time)),
            ],
            state: [Delivered::settled(rest); 2],
            kernels,
        }
    }

    /// Add the command of a new sample. Returns it after limits and deadbands.
    pub fn push(&mut self, command: S) -> S {
        let command = self.kernels.iter().fold(command, |u, k| k.command(u));
        if let Some(delay) = &mut self.delay {
            delay.history.rotate_left(1);
            if let Some(newest) = delay.history.last_mut() {
                *newest = command;
            }
        }
        command
    }

    /// Whether the torque varies inside a sample.
    fn varies(&self) -> bool {
        self.delay.is_some() || self.loops.iter().any(Option::is_some)
    }

    fn delivered(&self, torque: S) -> S {
        self.kernels.iter().fold(torque, |t, k| k.drive(t))
    }

    /// A torque in command units, multiplied by the gain of the drive.
    fn gained(&self, torque: S) -> S {
        self.delivered(torque) - self.delivered(S::zero())
    }

    /// Torque between the fractions `from` and `to` of a sample; advances the lag state `state`.
    fn line(&self, command: S, from: f64, to: f64, state: &mut States<S>) -> Line<S> {
        let width = to - from;
        let mut zeroth = S::zero();
        let mut first = S::zero();
        for (torque, start, end) in self.pieces(command, from, to) {
            let m = self.moments(torque, start - from, end - start, state);
            zeroth += m.zeroth;
            first += m.first;
        }
        let mean = zeroth * (1.0 / width);
        // First moment about the middle of the sub-step, for a width of one.
        let tilt = first * (1.0 / (width * width)) - mean * 0.5;
        // Drive kernels are affine (gain and offset), so they commute with the moments.
        let (low, high) = (
            self.delivered(mean - tilt * 6.0),
            self.delivered(mean + tilt * 6.0),
        );
        Line {
            mean: (low + high) * 0.5,
            slope: high - low,
        }
    }

    /// The commands in force between `from` and `to` (fractions of the sample).
    fn pieces(&self, command: S, from: f64, to: f64) -> impl Iterator<Item = (S, S, S)> + use<S> {
        let (start, end) = (S::constant(from), S::constant(to));
        let pair = match &self.delay {
            None => [Some((command, start, end)), None],
            Some(delay) => {
                let (older, newer) = (delay.history[0], delay.history[1]);
                let switch = delay.fraction;
                // A switch at the very start stays in, because its derivative is needed.
                if switch.lane(0) < from {
                    [Some((newer, start, end)), None]
                } else if switch.lane(0) >= to {
                    [Some((older, start, end)), None]
                } else {
                    [Some((older, start, switch)), Some((newer, switch, end))]
                }
            }
        };
        pair.into_iter().flatten()
    }

    /// Moments over a piece of length `width` that starts at `start` in the sub-step (both in
    /// samples), with the constant command `torque`.
    ///
    /// The input of the second loop is the final torque of the first. This is exact if one of the
    /// loops is inactive, including derivatives.
    fn moments(&self, torque: S, start: S, width: S, states: &mut States<S>) -> Moments<S> {
        let mut held = torque;
        let mut sum = Moments {
            zeroth: torque * width,
            first: torque * width * (start + width * 0.5),
        };
        for (own, state) in self.loops.iter().zip(states) {
            if let Some(own) = own {
                let excess = own.excess(held, start, width, state);
                held = state.torque;
                sum.zeroth += excess.zeroth;
                sum.first += excess.first;
            }
        }
        sum
    }
}

/// Torque of all axes over one sample, span by span.
pub struct SampleTorque<'a, S> {
    paths: &'a mut [TorquePath<S>],
    buffers: &'a mut TorqueBuffers<S>,
    varies: bool,
}

/// Memory of [`SampleTorque`] that is kept from sample to sample.
pub struct TorqueBuffers<S> {
    commands: Vec<S>,
    /// Part of the commands that acts on the motors at once.
    added: Vec<S>,
    /// Torques on the motors beside those of the drives [Nm].
    pub beside: Vec<S>,
    /// Lag states at the start and at the end of the current span.
    at_start: Vec<States<S>>,
    at_end: Vec<States<S>>,
    lines: Vec<Line<S>>,
}

impl<S: Scalar> TorqueBuffers<S> {
    /// Memory for `n_axes` axes.
    pub fn new(n_axes: usize) -> Self {
        let states = vec![[Delivered::settled(S::zero()); 2]; n_axes];
        Self {
            commands: vec![S::zero(); n_axes],
            added: vec![S::zero(); n_axes],
            beside: vec![S::zero(); n_axes],
            at_start: states.clone(),
            at_end: states,
            lines: Vec::with_capacity(n_axes),
        }
    }
}

impl<'a, S: Scalar> SampleTorque<'a, S> {
    /// Take the commands of a new sample; `added` is the part of each command that is not the
    /// machine's.
    ///
    /// `added` keeps a simulation on a log. It acts on the motor at once, so that it responds to
    /// noise in the same way for every delay or lag. Through a lag it would respond more strongly,
    /// and fits would prefer wrong lags.
    ///
    /// `added` is in units of commands. In motor units, a machine with less inertia and a weaker
    /// motor would need less of it, although both machines respond alike to every command.
    pub fn new(
        paths: &'a mut [TorquePath<S>],
        commands: &[S],
        added: &[S],
        buffers: &'a mut TorqueBuffers<S>,
    ) -> Self {
        buffers.added.copy_from_slice(added);
        let told = commands.iter().zip(added);
        for ((taken, path), (u, own)) in buffers.commands.iter_mut().zip(&mut *paths).zip(told) {
            *taken = path.push(*u - *own);
        }
        let varies = paths.iter().any(TorquePath::varies);
        let mut torque = Self {
            paths,
            buffers,
            varies,
        };
        torque.rewind();
        torque.buffers.lines.clear();
        if !varies {
            let TorqueBuffers {
                commands,
                added,
                beside,
                lines,
                ..
            } = &mut *torque.buffers;
            let held = torque.paths.iter().zip(commands).zip(added);
            lines.extend(held.zip(beside).map(|(((path, u), own), beside)| Line {
                mean: path.delivered(*u) + path.gained(*own) + *beside,
                slope: S::zero(),
            }));
        }
        torque
    }

    /// Torque lines between the fractions `from` and `to` of the sample.
    pub fn span(&mut self, from: f64, to: f64) -> &[Line<S>] {
        if self.varies {
            let TorqueBuffers {
                commands,
                added,
                beside,
                at_start,
                at_end,
                lines,
            } = &mut *self.buffers;
            at_end.copy_from_slice(at_start);
            lines.clear();
            let told = commands.iter().zip(added).zip(beside);
            for ((path, ((u, own), beside)), state) in self.paths.iter().zip(told).zip(at_end) {
                let mut line = path.line(*u, from, to, state);
                line.mean += path.gained(*own) + *beside;
                lines.push(line);
            }
        }
        &self.buffers.lines
    }

    /// Torque lines of the last span.
    pub fn lines(&self) -> &[Line<S>] {
        &self.buffers.lines
    }

    /// Torque lines of the part `i` of `n` equal parts of the sample.
    pub fn part(&mut self, i: usize, n: usize) -> &[Line<S>] {
        self.span(i as f64 / n as f64, (i + 1) as f64 / n as f64)
    }

    /// Accept the current span. The next span starts at its end.
    pub fn accept(&mut self) {
        if self.varies {
            let TorqueBuffers {
                at_start, at_end, ..
            } = &mut *self.buffers;
            at_start.copy_from_slice(at_end);
        }
    }

    /// Return to the start of the sample.
    pub fn rewind(&mut self) {
        for (state, path) in self.buffers.at_start.iter_mut().zip(&*self.paths) {
            *state = path.state;
        }
    }

    /// End the sample and keep the lag states.
    pub fn finish(self) {
        for (path, state) in self.paths.iter_mut().zip(&self.buffers.at_start) {
            path.state = *state;
        }
    }
}

impl<S: Scalar> Delay<S> {
    /// A delay of `samples`, settled at the command `rest`. All lanes share its whole part.
    fn new(samples: S, rest: S) -> Self {
        // Bounds on the delay keep the count small and not negative.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let whole = samples.lane(0).max(0.0) as usize;
        Self {
            fraction: samples - whole as f64,
            history: vec![rest; whole + 2],
        }
    }
}
