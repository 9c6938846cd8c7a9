//! Multivariable frequency responses `G = Y V` with `U V = 1`, and their noise, line by line.
//!
//! There are three choices of `V`:
//!
//! * `V = U^-1`: Wernholt (2004), (3.52), after averaging over periods (3.53).
//! * The pseudo-inverse of `U`, if there are more experiments than inputs.
//! * `V = R^+ (U R^+)^-1`: the joint input-output estimate with the references `R`.
//!
//! For all of them, the error is to first order `dG = (dY - G dU) V`: vec(dG) = (V^T kron I) vec(dY
//! - G dU).

use super::flag::LineFlag;
use axisight_numerics::PseudoInverse;
use nalgebra::Complex;

type C = Complex<f64>;

/// Smallest ratio of the singular values that counts as full rank. Rounding leaves 1e-15 of a
/// dependent experiment, and simulated records raise this a hundredfold.
const SMALLEST_RATIO: f64 = 1e-12;

/// Amplitudes below this share of the largest amplitude at any line are rounding of the DFT.
const SMALLEST_AMPLITUDE: f64 = 1e-12;

/// Condition number above which a line is flagged.
const LARGE_CONDITION: f64 = 1e3;

/// Layout of the channels of the spectra.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Number of experiments.
    pub experiments: usize,
    /// Number of periods of each experiment.
    pub periods: usize,
    /// Number of lines.
    pub lines: usize,
    /// Number of inputs, the first channels.
    pub inputs: usize,
    /// Number of outputs, the next channels.
    pub outputs: usize,
    /// Number of references, the last channels: as many as inputs, or zero.
    pub references: usize,
}

impl Layout {
    fn channels(&self) -> usize {
        self.inputs + self.outputs + self.references
    }

    fn at(&self, experiment: usize, period: usize, line: usize) -> usize {
        ((experiment * self.periods + period) * self.lines + line) * self.channels()
    }
}

/// Estimates over `(line, output, input)`, NaN where unknown.
#[derive(Debug, Clone, Default)]
pub struct Multivariable {
    /// Frequency responses `G`.
    pub response: Vec<C>,
    /// Variance from the scatter of the periods.
    pub noise_variance: Vec<f64>,
    /// Complex degrees of freedom of `noise_variance`, by Satterthwaite's formula.
    pub noise_freedom: Vec<f64>,
    /// Variance from the residual `Y - G U` of more experiments than inputs.
    pub residual_variance: Vec<f64>,
    /// Condition number of U with rows scaled to unit norm, by line.
    pub condition: Vec<f64>,
    /// Flags by line.
    pub flag: Vec<i8>,
}

/// Estimate the responses from `spectra`, laid out as `(experiment, period, line, channel)`.
///
/// There must be at least as many experiments as inputs. `factor` multiplies the outputs, line by
/// line.
pub fn multivariable(spectra: &[C], layout: Layout, factor: &[C]) -> Multivariable {
    let mut line_of = Line::new(layout);
    let size = layout.lines * layout.outputs * layout.inputs;
    let mut out = Multivariable::default();
    out.response.reserve(size);
    let largest = largest_amplitudes(spectra, layout);
    for (line, factor) in factor.iter().enumerate().take(layout.lines) {
        line_of.load(spectra, line, *factor);
        let flag = line_of.solve(&largest);
        out.flag.push(flag as i8);
        line_of.store(flag, &mut out);
    }
    out
}

/// Largest norm over the experiments of each input at any line.
fn largest_amplitudes(spectra: &[C], layout: Layout) -> Vec<f64> {
    let mut largest = vec![0.0; layout.inputs];
    for line in 0..layout.lines {
        for (input, largest) in largest.iter_mut().enumerate() {
            let power: f64 = (0..layout.experiments)
                .map(|e| spectra[layout.at(e, 0, line) + input].norm_sqr())
                .sum();
            *largest = f64::max(*largest, power.sqrt());
        }
    }
    largest
}

/// Spectra and intermediate results of one line.
struct Line {
    layout: Layout,
    /// Spectra of the periods, `(experiment, period, channel)`, without references.
    periods: Vec<C>,
    /// Averages over the periods, `(channel, experiment)`.
    average: Vec<C>,
    solver: PseudoInverse,
    square: PseudoInverse,
    right: Vec<C>,
    scratch: Vec<C>,
    response: Vec<C>,
    /// `Y - G U` of one output in one experiment, by period.
    residual: Vec<C>,
    /// Variance of the average of `Y - G U`, `(output, experiment)`.
    error: Vec<f64>,
    condition: f64,
}

impl Line {
    fn new(layout: Layout) -> Self {
        let (m, e) = (layout.inputs, layout.experiments);
        let zeros = |n: usize| vec![C::default(); n];
        Self {
            layout,
            periods: zeros(e * layout.periods * layout.channels()),
            average: zeros(layout.channels() * e),
            solver: PseudoInverse::new(m, e),
            square: PseudoInverse::new(m, m),
            right: zeros(e * m),
            scratch: zeros(e * m + 2 * m * m),
            response: zeros(layout.outputs * m),
            residual: zeros(layout.periods),
            error: vec![0.0; layout.outputs * e],
            condition: f64::NAN,
        }
    }

    fn load(&mut self, spectra: &[C], line: usize, factor: C) {
        let layout = self.layout;
        let (m, channels) = (layout.inputs, layout.channels());
        let outputs = m..m + layout.outputs;
        for e in 0..layout.experiments {
            for channel in 0..channels {
                let gain = if outputs.contains(&channel) {
                    factor
                } else {
                    C::new(1.0, 0.0)
                };
                let mut sum = C::default();
                for p in 0..layout.periods {
                    let value = spectra[layout.at(e, p, line) + channel] * gain;
                    self.periods[(e * layout.periods + p) * channels + channel] = value;
                    sum += value;
                }
                let average = sum / layout.periods as f64;
                self.average[channel * layout.experiments + e] = average;
            }
        }
    }

    /// Compute V, G and the condition number.
    fn solve(&mut self, largest: &[f64]) -> LineFlag {
        let layout = self.layout;
        let (m, e) = (layout.inputs, layout.experiments);
        let input = &self.average[..m * e];
        self.condition = f64::NAN;
        for (row, largest) in input.chunks_exact(e).zip(largest) {
            let norm = row.iter().map(Complex::norm_sqr).sum::<f64>().sqrt();
            if norm <= SMALLEST_AMPLITUDE * largest {
                return LineFlag::NoExcitation;
            }
        }
        let (smallest, biggest) = self.solver.compute(input, &mut self.right);
        if !(smallest > SMALLEST_RATIO * biggest && biggest.is_finite()) {
            return LineFlag::RankDeficient;
        }
        self.condition = biggest / smallest;
        if layout.references > 0 && !self.through_reference() {
            return LineFlag::RankDeficient;
        }
        for i in 0..layout.outputs {
            let y = &self.average[(m + i) * e..(m + i + 1) * e];
            for j in 0..m {
                self.response[i * m + j] = (0..e).map(|k| y[k] * self.right[k * m + j]).sum();
            }
        }
        if self.condition > LARGE_CONDITION || smallest * smallest < 4.0 * self.input_noise() {
            return LineFlag::IllConditioned;
        }
        LineFlag::Good
    }

    /// Compute `V = R^+ (U R^+)^-1`; returns false if the references are not independent.
    fn through_reference(&mut self) -> bool {
        let layout = self.layout;
        let (m, e) = (layout.inputs, layout.experiments);
        let start = (m + layout.outputs) * e;
        let (by_reference, rest) = self.scratch.split_at_mut(e * m);
        let (loops, inverse) = rest.split_at_mut(m * m);
        let full = |(smallest, biggest): (f64, f64)| {
            smallest > SMALLEST_RATIO * biggest && biggest.is_finite()
        };
        if !full(
            self.solver
                .compute(&self.average[start..start + m * e], by_reference),
        ) {
            return false;
        }
        for i in 0..m {
            let u = &self.average[i * e..(i + 1) * e];
            for j in 0..m {
                loops[i * m + j] = (0..e).map(|k| u[k] * by_reference[k * m + j]).sum();
            }
        }
        if !full(self.square.compute(loops, inverse)) {
            return false;
        }
        for k in 0..e {
            for j in 0..m {
                let products = (0..m).map(|i| by_reference[k * m + i] * inverse[i * m + j]);
                self.right[k * m + j] = products.sum();
            }
        }
        true
    }

    /// Mean square of the noise of U along one direction, with the scaling of `solver`.
    fn input_noise(&self) -> f64 {
        let layout = self.layout;
        let (m, e, periods, channels) = (
            layout.inputs,
            layout.experiments,
            layout.periods,
            layout.channels(),
        );
        if periods < 2 {
            return 0.0;
        }
        let mut total = 0.0;
        for i in 0..m {
            let (mut scatter, mut power) = (0.0, 0.0);
            for k in 0..e {
                let average = self.average[i * e + k];
                power += average.norm_sqr();
                scatter += (0..periods)
                    .map(|p| self.periods[(k * periods + p) * channels + i] - average)
                    .map(|d| d.norm_sqr())
                    .sum::<f64>();
            }
            total += scatter / power;
        }
        total / (periods * (periods - 1) * m) as f64
    }

    /// Compute the variance of the mean of `Y - G U` by experiment, from the scatter of its
    /// periods.
    fn period_scatter(&mut self) {
        let layout = self.layout;
        let (m, e, periods, channels) = (
            layout.inputs,
            layout.experiments,
            layout.periods,
            layout.channels(),
        );
        let residual = &mut self.residual;
        for i in 0..layout.outputs {
            let row = &self.response[i * m..(i + 1) * m];
            for k in 0..e {
                let own = &self.periods[k * periods * channels..][..periods * channels];
                let mut sum = C::default();
                for (left, own) in residual.iter_mut().zip(own.chunks_exact(channels)) {
                    let mut value = own[m + i];
                    for (g, u) in row.iter().zip(own) {
                        value -= g * u;
                    }
                    *left = value;
                    sum += value;
                }
                let mean = sum / periods as f64;
                let mut scatter = 0.0;
                for left in residual.iter() {
                    scatter += (left - mean).norm_sqr();
                }
                self.error[i * e + k] = scatter / (periods * (periods - 1)) as f64;
            }
        }
    }

    /// Residual variance of `Y - G U`, for more experiments than inputs.
    fn misfit(&self, i: usize) -> f64 {
        let (m, e) = (self.layout.inputs, self.layout.experiments);
        let square = |k: usize| {
            let product: C = (0..m)
                .map(|j| self.response[i * m + j] * self.average[j * e + k])
                .sum();
            (self.average[(m + i) * e + k] - product).norm_sqr()
        };
        (0..e).map(square).sum::<f64>() / (e - m) as f64
    }

    fn store(&mut self, flag: LineFlag, out: &mut Multivariable) {
        let layout = self.layout;
        let (m, e, periods) = (layout.inputs, layout.experiments, layout.periods);
        out.condition.push(self.condition);
        if matches!(flag, LineFlag::RankDeficient | LineFlag::NoExcitation) {
            let size = layout.outputs * m;
            out.response
                .extend(std::iter::repeat_n(C::new(f64::NAN, f64::NAN), size));
            for list in [
                &mut out.noise_variance,
                &mut out.noise_freedom,
                &mut out.residual_variance,
            ] {
                list.extend(std::iter::repeat_n(f64::NAN, size));
            }
            return;
        }
        out.response.extend_from_slice(&self.response);
        if periods > 1 {
            self.period_scatter();
        }
        for i in 0..layout.outputs {
            let misfit = if e > m { self.misfit(i) } else { f64::NAN };
            for j in 0..m {
                let weight = |k: usize| self.right[k * m + j].norm_sqr();
                let weights: f64 = (0..e).map(weight).sum();
                out.residual_variance.push(misfit * weights);
                if periods < 2 {
                    out.noise_variance.push(f64::NAN);
                    out.noise_freedom.push(f64::NAN);
                    continue;
                }
                let share = |k: usize| self.error[i * e + k] * weight(k);
                let sum: f64 = (0..e).map(share).sum();
                let squares: f64 = (0..e).map(|k| share(k).powi(2)).sum();
                out.noise_variance.push(sum);
                let freedom = (periods - 1) as f64 * sum * sum / squares;
                out.noise_freedom.push(if freedom.is_finite() {
                    freedom
                } else {
                    f64::NAN
                });
            }
        }
    }
}
