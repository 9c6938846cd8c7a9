//! Sums of harmonics of the motor angle, shared by the ripple effects.

use super::formulas::harmonic;
use axisight_scalar::Scalar;

/// The sum `sum_i c_i cos(n_i phi) + s_i sin(n_i phi)`.
#[derive(Debug, Clone)]
pub(super) struct Harmonics<S> {
    terms: Vec<[S; 3]>,
}

impl<S: Scalar> Harmonics<S> {
    /// A sum from triples `[n, c, s]`; a term of order zero is switched off.
    pub(super) fn new(p: &[S]) -> Self {
        let terms = p
            .chunks_exact(3)
            .filter(|t| t[0].lane(0) != 0.0)
            .map(|t| [t[0], t[1], t[2]])
            .collect();
        Self { terms }
    }

    #[inline(always)]
    pub(super) fn evaluate(&self, angle: S) -> S {
        let mut sum = S::zero();
        for [order, cosine, sine] in &self.terms {
            sum += harmonic(*order * angle, *cosine, *sine);
        }
        sum
    }
}

/// Parameter table of a harmonic effect: order, cosine and sine amplitude per term.
macro_rules! harmonic_parameters {
    ($($unit:literal $limit:literal $typical:literal $order:literal $cosine:literal $sine:literal $neutral:literal),* $(,)?) => {
        &[$(
            ParameterInfo { name: $order, unit: "1", role: Role::Shape, neutral: $neutral, lower: 0.0, upper: 500.0, typical: 1.0, prior: Prior::Uniform, sizes: "judgement: data show it by themselves", ..ParameterInfo::PLAIN },
            ParameterInfo { name: $cosine, unit: $unit, role: Role::Amplitude, neutral: 0.0, lower: -$limit, upper: $limit, typical: $typical, ..ParameterInfo::PLAIN },
            ParameterInfo { name: $sine, unit: $unit, role: Role::Amplitude, neutral: 0.0, lower: -$limit, upper: $limit, typical: $typical, ..ParameterInfo::PLAIN },
        )*]
    };
}
pub(super) use harmonic_parameters;
