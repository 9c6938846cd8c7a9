//! Sines and cosines of many multiples of one angle.
//!
//! One sine and cosine of the motor angle give `z = e^{i phi}`; whole orders are products
//! `z^{a+b} = z^a z^b` or `z^{a-b} = z^a conj(z^b)` along an addition-subtraction chain
//! built once. Errors add up along the chain: with 3e-16 for `z` and 1.5e-16 relative per
//! product, order `n` is good to about `n * 5e-16` (4e-14 for 72), whatever the
//! angle; the sine of the rounded product `n phi` is off by `1e-16 n phi`.

use crate::scalar::Scalar;

/// `powers[next] = powers[left] * powers[right]`, the right one conjugated or not.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Product {
    left: usize,
    right: usize,
    conjugate: bool,
}

/// One harmonic: the power it uses, `n`, and the amplitudes of cosine and sine.
#[derive(Debug, Clone, Copy)]
struct Term {
    power: usize,
    order: f64,
    cosine: f64,
    sine: f64,
}

/// Value and slope over the motor angle of a sum of harmonics.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave<S> {
    pub(super) value: S,
    pub(super) slope: S,
}

/// What repeats with the motor angle of one axis, at one angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ripple<S> {
    /// Torque ripple [Nm].
    pub(super) constant: Wave<S>,
    /// Torque ripple per commanded torque [1].
    pub(super) proportional: Wave<S>,
    /// Error of the resolver [rad].
    pub(super) resolver: Wave<S>,
}

/// Ripple tables of one axis over one shared chain.
#[derive(Debug, Clone)]
pub(super) struct Waves {
    chain: Vec<Product>,
    /// Orders that are not whole, evaluated directly, stored after the chain.
    direct: Vec<f64>,
    constant: Vec<Term>,
    proportional: Vec<Term>,
    resolver: Vec<Term>,
}

impl Waves {
    /// From triples `[n, c, s]` of torque ripple [Nm], of torque ripple per commanded
    /// torque [1] and of resolver ripple [rad]; a term of order zero is switched off.
    pub(super) fn new(constant: &[f64], proportional: &[f64], resolver: &[f64]) -> Self {
        let tables = [constant, proportional, resolver];
        let orders = || {
            let triples = tables.iter().flat_map(|t| t.chunks_exact(3));
            triples.filter(|t| is_on(t)).map(|t| t[0])
        };
        let whole: Vec<u32> = orders().filter_map(whole_order).collect();
        let (powers, chain) = addition_chain(&whole);
        let mut direct: Vec<f64> = Vec::new();
        for order in orders().filter(|n| whole_order(*n).is_none()) {
            #[allow(clippy::float_cmp)] // the same number given twice
            if !direct.iter().any(|d| *d == order) {
                direct.push(order);
            }
        }
        let mut values: Vec<f64> = powers.iter().map(|n| f64::from(*n)).collect();
        values.extend(&direct);
        let terms = |table: &[f64]| -> Vec<Term> {
            let on = table.chunks_exact(3).filter(|t| is_on(t));
            #[allow(clippy::float_cmp)] // looked up, not computed
            let found = on.filter_map(|t| {
                let power = values.iter().position(|v| *v == t[0])?;
                Some(Term {
                    power,
                    order: t[0],
                    cosine: t[1],
                    sine: t[2],
                })
            });
            found.collect()
        };
        Self {
            constant: terms(constant),
            proportional: terms(proportional),
            resolver: terms(resolver),
            chain,
            direct,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.constant.is_empty() && self.proportional.is_empty() && self.resolver.is_empty()
    }

    pub(super) fn acts_on_torque(&self) -> bool {
        !(self.constant.is_empty() && self.proportional.is_empty())
    }

    /// Scratch numbers [`Waves::evaluate`] needs.
    pub(super) fn scratch(&self) -> usize {
        1 + self.chain.len() + self.direct.len()
    }

    /// Arithmetic operations of one evaluation: 33 per sine and cosine pair, 4 per
    /// product, 4 per term.
    pub(super) fn operations(&self) -> usize {
        let terms = self.constant.len() + self.proportional.len() + self.resolver.len();
        let pairs = if terms == 0 { 0 } else { 1 + self.direct.len() };
        33 * pairs + 4 * self.chain.len() + 4 * terms
    }

    /// All sums at `angle` [rad].
    #[inline(always)]
    pub(super) fn evaluate<S: Scalar>(&self, angle: S, powers: &mut [[S; 2]]) -> Ripple<S> {
        let (sine, cosine) = angle.sin_cos();
        powers[0] = [cosine, sine];
        for (i, product) in self.chain.iter().enumerate() {
            let ([a, b], [c, d]) = (powers[product.left], powers[product.right]);
            let (bd, bc) = (b * d, b * c);
            powers[i + 1] = if product.conjugate {
                [a.fma(c, bd), bc - a * d]
            } else {
                [a.fma(c, -bd), a.fma(d, bc)]
            };
        }
        let direct = powers.iter_mut().skip(1 + self.chain.len());
        for (power, order) in direct.zip(&self.direct) {
            let (sine, cosine) = (angle * *order).sin_cos();
            *power = [cosine, sine];
        }
        Ripple {
            constant: sum(&self.constant, powers),
            proportional: sum(&self.proportional, powers),
            resolver: sum(&self.resolver, powers),
        }
    }
}

#[inline(always)]
fn sum<S: Scalar>(terms: &[Term], powers: &[[S; 2]]) -> Wave<S> {
    let (mut value, mut slope) = (S::zero(), S::zero());
    for term in terms {
        let [c, s] = powers[term.power];
        value = c.fma(S::constant(term.cosine), value);
        value = s.fma(S::constant(term.sine), value);
        slope = c.fma(S::constant(term.order * term.sine), slope);
        slope = s.fma(S::constant(-term.order * term.cosine), slope);
    }
    Wave { value, slope }
}

impl<S: Scalar> Wave<S> {
    /// At an angle `by` further on [rad], to first order.
    #[inline(always)]
    fn moved(self, by: S) -> Self {
        Self {
            value: self.slope.fma(by, self.value),
            slope: self.slope,
        }
    }
}

impl<S: Scalar> Ripple<S> {
    /// At an angle `by` further on [rad], to first order.
    #[inline(always)]
    pub(super) fn moved(self, by: S) -> Self {
        Self {
            constant: self.constant.moved(by),
            proportional: self.proportional.moved(by),
            resolver: self.resolver.moved(by),
        }
    }

    /// Torque ripple under the commanded torque `command` [Nm].
    #[inline(always)]
    pub(super) fn torque(&self, command: S) -> Wave<S> {
        Wave {
            value: self.proportional.value.fma(command, self.constant.value),
            slope: self.proportional.slope.fma(command, self.constant.slope),
        }
    }
}

fn is_on(triple: &[f64]) -> bool {
    triple.first().is_some_and(|n| *n != 0.0)
}

/// `order` as a whole number, if it is one.
fn whole_order(order: f64) -> Option<u32> {
    // Orders are bounded by 500 in the effect table.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let whole = order as u32;
    #[allow(clippy::float_cmp)]
    (whole > 0 && f64::from(whole) == order).then_some(whole)
}

/// Exponents reached from 1, in order, and the products that reach all but the first;
/// the shorter of two greedy searches.
fn addition_chain(targets: &[u32]) -> (Vec<u32>, Vec<Product>) {
    let (small, large) = (greedy_chain(targets, false), greedy_chain(targets, true));
    if small.0.len() <= large.0.len() {
        small
    } else {
        large
    }
}

/// Adds targets one product away; failing that, the exponent that brings most targets one
/// product away (the largest or smallest of equals); failing that, the one nearest to the
/// smallest target, which always gets nearer because 1 is among the exponents.
fn greedy_chain(targets: &[u32], prefer_large: bool) -> (Vec<u32>, Vec<Product>) {
    let (mut reached, mut products) = (vec![1_u32], Vec::new());
    loop {
        let open = || targets.iter().copied().filter(|t| !reached.contains(t));
        let Some(nearest) = open().min() else {
            return (reached, products);
        };
        let candidates = one_product_away(&reached);
        let target = candidates.iter().find(|(n, _)| targets.contains(n));
        let gain = |n: u32| {
            let mut further = reached.clone();
            further.push(n);
            let next = one_product_away(&further);
            open().filter(|t| next.iter().any(|(m, _)| m == t)).count()
        };
        let chosen = target.or_else(|| {
            let side = |n: u32| {
                if prefer_large {
                    i64::from(n)
                } else {
                    -i64::from(n)
                }
            };
            let useful = candidates.iter().filter(|(n, _)| gain(*n) > 0);
            let best = useful.max_by_key(|(n, _)| (gain(*n), side(*n)));
            best.or_else(|| candidates.iter().min_by_key(|(n, _)| n.abs_diff(nearest)))
        });
        let Some((n, product)) = chosen else {
            return (reached, products);
        };
        products.push(*product);
        reached.push(*n);
    }
}

fn one_product_away(reached: &[u32]) -> Vec<(u32, Product)> {
    let mut out = Vec::new();
    for (left, a) in reached.iter().enumerate() {
        for (right, b) in reached.iter().enumerate() {
            if right <= left {
                out.push((
                    a + b,
                    Product {
                        left,
                        right,
                        conjugate: false,
                    },
                ));
            }
            if a > b {
                out.push((
                    a - b,
                    Product {
                        left,
                        right,
                        conjugate: true,
                    },
                ));
            }
        }
    }
    out.retain(|(n, _)| !reached.contains(n));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Lanes;

    /// Orders and triples of the thesis, Table 8.1.
    const TABLE: [u32; 8] = [2, 3, 10, 12, 18, 36, 48, 72];

    fn triples(orders: &[f64]) -> Vec<f64> {
        orders.iter().flat_map(|n| [*n, 0.3, -0.7]).collect()
    }

    /// Each product must lead to its exponent, and every target must be reached.
    #[test]
    fn chains_reach_their_targets() {
        let sets: [&[u32]; 5] = [&TABLE, &[1], &[499, 500], &[7, 131], &[]];
        for targets in sets {
            let (reached, products) = addition_chain(targets);
            assert_eq!(reached.len(), products.len() + 1);
            for (i, p) in products.iter().enumerate() {
                let (a, b) = (reached[p.left], reached[p.right]);
                assert!(p.left <= i && p.right <= i);
                assert_eq!(reached[i + 1], if p.conjugate { a - b } else { a + b });
            }
            for t in targets {
                assert!(reached.contains(t), "{t}");
            }
        }
        assert!(addition_chain(&TABLE).1.len() <= 9);
    }

    /// `n * 5e-16` is 3.6e-14 for 72; the reference adds the rounding of `n phi`, 2.5e-14.
    #[test]
    fn powers_match_the_standard_library() {
        for order in TABLE {
            let n = f64::from(order);
            let all: Vec<f64> = TABLE.iter().map(|n| f64::from(*n)).collect();
            let mut table = triples(&all);
            for t in table.chunks_exact_mut(3) {
                if t[0] != n {
                    (t[1], t[2]) = (0.0, 0.0);
                }
            }
            let waves = Waves::new(&table, &[], &[]);
            let mut powers = vec![[0.0; 2]; waves.scratch()];
            for i in -3000..3000 {
                let angle = f64::from(i) * std::f64::consts::PI / 3000.0;
                let got = waves.evaluate(angle, &mut powers).constant;
                let (s, c) = (n * angle).sin_cos();
                assert!(
                    (got.value - (0.3 * c - 0.7 * s)).abs() < 1e-13,
                    "{n} {angle}"
                );
                assert!(
                    (got.slope / n - (-0.3 * s - 0.7 * c)).abs() < 1e-13,
                    "{n} {angle}"
                );
            }
        }
    }

    #[test]
    fn fractional_and_absent_orders() {
        let waves = Waves::new(&[2.5, 0.3, -0.7, 0.0, 9.0, 9.0], &[], &triples(&[3.0, 2.5]));
        let angle = Lanes([0.4, -1.3, 2.0, 17.0]);
        let mut powers = vec![[Lanes([0.0; 4]); 2]; waves.scratch()];
        let got = waves.evaluate(angle, &mut powers);
        for lane in 0..4 {
            let wave = |n: f64| {
                let (s, c) = (n * angle.0[lane]).sin_cos();
                0.3 * c - 0.7 * s
            };
            assert!((got.constant.value.0[lane] - wave(2.5)).abs() < 1e-14);
            let resolver = wave(3.0) + wave(2.5);
            assert!((got.resolver.value.0[lane] - resolver).abs() < 1e-14);
            assert!(got.proportional.value.0[lane].abs() <= 0.0);
        }
        assert!(waves.acts_on_torque() && !waves.is_empty());
        assert!(Waves::new(&[], &[], &[]).is_empty());
    }
}
