//! Sines and cosines of many multiples of one angle.
//!
//! One sine and cosine of the motor angle give `z = e^{i phi}`. Whole orders are products
//! `z^{a+b} = z^a z^b` or `z^{a-b} = z^a conj(z^b)` along an addition-subtraction chain, which is
//! built once.
//!
//! Errors add up along the chain. With 3e-16 for `z` and a relative 1.5e-16 per product, order `n`
//! has an error of about `n * 5e-16` (4e-14 for 72) at any angle. The sine of the rounded product
//! `n phi` has an error of `1e-16 n phi`.

use axisight_scalar::Scalar;
use std::collections::{BTreeMap, HashSet};

/// The product `powers[next] = powers[left] * powers[right]`, with the right factor conjugated or
/// not.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Product {
    left: usize,
    right: usize,
    conjugate: bool,
}

/// One harmonic: its power, and the weights of cosine and sine.
#[derive(Debug, Clone, Copy)]
struct Term {
    power: usize,
    value: [f64; 2],
    slope: [f64; 2],
}

impl Term {
    /// A harmonic, or `None` for an order of zero, which switches it off.
    fn new(order: f64, cosine: f64, sine: f64, powers: &[f64]) -> Option<Self> {
        #[allow(clippy::float_cmp)] // looked up, not computed
        let power = powers.iter().position(|v| *v == order)?;
        Some(Self {
            power,
            value: [cosine, sine],
            slope: [order * sine, -order * cosine],
        })
    }
}

/// Value of a sum of harmonics, and its slope over the motor angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave<S> {
    pub(super) value: S,
    pub(super) slope: S,
}

/// Periodic errors of one axis at one motor angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ripple<S> {
    /// Torque ripple [Nm].
    pub(super) constant: Wave<S>,
    /// Torque ripple per commanded torque [1].
    pub(super) proportional: Wave<S>,
    /// Error of the resolver [rad].
    pub(super) resolver: Wave<S>,
}

/// Ripple parameters of one axis, as triples `[n, c, s]`; an order `n` of zero is switched off.
#[derive(Debug, Clone, Default)]
pub(super) struct RippleTable {
    /// Torque ripple [Nm].
    pub(super) constant: Vec<f64>,
    /// Torque ripple per commanded torque [1].
    pub(super) proportional: Vec<f64>,
    /// Resolver ripple [rad].
    pub(super) resolver: Vec<f64>,
}

impl RippleTable {
    fn orders(&self) -> impl Iterator<Item = f64> {
        let tables = [&self.constant, &self.proportional, &self.resolver];
        let triples = tables.into_iter().flat_map(|t| t.chunks_exact(3));
        triples.map(|t| t[0]).filter(|n| *n != 0.0)
    }
}

/// Harmonics of one axis.
#[derive(Debug, Clone)]
struct Terms {
    constant: Vec<Term>,
    proportional: Vec<Term>,
    resolver: Vec<Term>,
}

/// Ripple of all axes over one chain.
///
/// Axes mostly have the same orders, and evaluating them side by side hides the latency of the
/// products.
#[derive(Debug, Clone)]
pub(super) struct Waves {
    chain: Vec<Product>,
    /// Orders that are not whole. They are evaluated directly and stored after the chain.
    direct: Vec<f64>,
    axes: Vec<Terms>,
    /// Highest order.
    pub(super) highest: f64,
}

impl Waves {
    pub(super) fn new(tables: &[RippleTable]) -> Self {
        let orders = || tables.iter().flat_map(RippleTable::orders);
        let whole: Vec<u32> = orders().filter_map(whole_order).collect();
        let (powers, chain) = addition_chain(&whole);
        let mut direct: Vec<f64> = Vec::new();
        for order in orders().filter(|n| whole_order(*n).is_none()) {
            if !direct.contains(&order) {
                direct.push(order);
            }
        }
        let mut values: Vec<f64> = powers.iter().map(|n| f64::from(*n)).collect();
        values.extend(&direct);
        let terms = |table: &[f64]| -> Vec<Term> {
            let term = |t: &[f64]| Term::new(t[0], t[1], t[2], &values);
            table.chunks_exact(3).filter_map(term).collect()
        };
        let axes = tables.iter().map(|table| Terms {
            constant: terms(&table.constant),
            proportional: terms(&table.proportional),
            resolver: terms(&table.resolver),
        });
        Self {
            axes: axes.collect(),
            highest: orders().fold(0.0, f64::max),
            chain,
            direct,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        !self.act_on_torque() && self.axes.iter().all(|a| a.resolver.is_empty())
    }

    pub(super) fn act_on_torque(&self) -> bool {
        let acts = |a: &Terms| !(a.constant.is_empty() && a.proportional.is_empty());
        self.axes.iter().any(acts)
    }

    /// Number of scratch entries that [`Waves::evaluate`] needs.
    pub(super) fn scratch(&self) -> usize {
        (1 + self.chain.len() + self.direct.len()) * self.axes.len()
    }

    /// Arithmetic operations of one evaluation: 33 per pair of sine and cosine, 4 per product, 4
    /// per term.
    pub(super) fn operations(&self) -> usize {
        if self.is_empty() {
            return 0;
        }
        let per_axis = 33 * (1 + self.direct.len()) + 4 * self.chain.len();
        let terms = |a: &Terms| a.constant.len() + a.proportional.len() + a.resolver.len();
        let all: usize = self.axes.iter().map(terms).sum();
        self.axes.len() * per_axis + 4 * all
    }

    /// Evaluate all sums at the motor angles `angles` [rad], one per axis.
    #[inline(always)]
    pub(super) fn evaluate<S: Scalar>(
        &self,
        angles: &[S],
        powers: &mut [[S; 2]],
        out: &mut [Ripple<S>],
    ) {
        let m = self.axes.len();
        for (power, angle) in powers.iter_mut().zip(angles) {
            let (sine, cosine) = angle.sin_cos();
            *power = [cosine, sine];
        }
        for (i, product) in self.chain.iter().enumerate() {
            let (done, next) = powers.split_at_mut((i + 1) * m);
            let left = done[product.left * m..].iter();
            let right = done[product.right * m..].iter();
            let pairs = left.zip(right).zip(&mut next[..m]);
            if product.conjugate {
                for (([a, b], [c, d]), power) in pairs {
                    *power = [a.fma(*c, *b * *d), b.fma(*c, -(*a * *d))];
                }
            } else {
                for (([a, b], [c, d]), power) in pairs {
                    *power = [a.fma(*c, -(*b * *d)), a.fma(*d, *b * *c)];
                }
            }
        }
        let direct = powers.chunks_exact_mut(m).skip(1 + self.chain.len());
        for (row, order) in direct.zip(&self.direct) {
            for (power, angle) in row.iter_mut().zip(angles) {
                let (sine, cosine) = (*angle * *order).sin_cos();
                *power = [cosine, sine];
            }
        }
        for (axis, (terms, out)) in self.axes.iter().zip(out).enumerate() {
            *out = Ripple {
                constant: sum(&terms.constant, powers, m, axis),
                proportional: sum(&terms.proportional, powers, m, axis),
                resolver: sum(&terms.resolver, powers, m, axis),
            };
        }
    }
}

#[inline(always)]
fn sum<S: Scalar>(terms: &[Term], powers: &[[S; 2]], m: usize, axis: usize) -> Wave<S> {
    let (mut value, mut slope) = (S::zero(), S::zero());
    for term in terms {
        let [c, s] = powers[term.power * m + axis];
        value = c.fma(S::constant(term.value[0]), value);
        value = s.fma(S::constant(term.value[1]), value);
        slope = c.fma(S::constant(term.slope[0]), slope);
        slope = s.fma(S::constant(term.slope[1]), slope);
    }
    Wave { value, slope }
}

impl<S: Scalar> Wave<S> {
    /// The wave at an angle that is larger by `by` [rad], to first order.
    #[inline(always)]
    fn moved(self, by: S) -> Self {
        Self {
            value: self.slope.fma(by, self.value),
            slope: self.slope,
        }
    }
}

impl<S: Scalar> Ripple<S> {
    /// No ripple.
    pub(super) fn zero() -> Self {
        let none = Wave {
            value: S::zero(),
            slope: S::zero(),
        };
        Self {
            constant: none,
            proportional: none,
            resolver: none,
        }
    }

    /// The ripple at an angle that is larger by `by` [rad], to first order.
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

/// `order` as a whole number, if it is one.
fn whole_order(order: f64) -> Option<u32> {
    // The cast is safe: the effect table limits orders to 500.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let whole = order as u32;
    #[allow(clippy::float_cmp)]
    (whole > 0 && f64::from(whole) == order).then_some(whole)
}

/// Exponents reached from 1, in order, and the products that give all but the first. It is the
/// shorter result of two greedy searches.
fn addition_chain(targets: &[u32]) -> (Vec<u32>, Vec<Product>) {
    let (small, large) = (greedy_chain(targets, false), greedy_chain(targets, true));
    if small.0.len() <= large.0.len() {
        small
    } else {
        large
    }
}

/// One greedy search. Each round adds the first exponent of this list that exists:
///
/// * a target that is one product away;
/// * the exponent that brings the most targets one product away (of equals, the largest or the
///   smallest);
/// * the exponent nearest to the smallest target. It always gets nearer, because 1 is among the
///   exponents.
fn greedy_chain(targets: &[u32], prefer_large: bool) -> (Vec<u32>, Vec<Product>) {
    let (mut reached, mut products) = (vec![1_u32], Vec::new());
    loop {
        let open = || targets.iter().copied().filter(|t| !reached.contains(t));
        let Some(nearest) = open().min() else {
            return (reached, products);
        };
        let candidates = one_product_away(&reached);
        let is_reached: HashSet<u32> = reached.iter().copied().collect();
        let target = candidates.iter().find(|(n, _)| targets.contains(n));
        // Number of targets that `n` and a reached exponent would give.
        let known = |n: u32| is_reached.contains(&n);
        let gain = |n: u32| {
            let away = |t: u32| t == 2 * n || known(t.abs_diff(n)) || known(t + n);
            open().filter(|t| away(*t)).count()
        };
        let chosen = target.or_else(|| {
            let side = |n: u32| {
                if prefer_large {
                    i64::from(n)
                } else {
                    -i64::from(n)
                }
            };
            let useful = candidates.iter().map(|c| (gain(*c.0), c));
            let best = useful
                .filter(|(gain, _)| *gain > 0)
                .max_by_key(|(gain, c)| (*gain, side(*c.0)));
            let nearer = || candidates.iter().min_by_key(|(n, _)| n.abs_diff(nearest));
            best.map(|(_, c)| c).or_else(nearer)
        });
        let Some((n, product)) = chosen else {
            return (reached, products);
        };
        products.push(*product);
        reached.push(*n);
    }
}

/// Exponents that are one product away, each once, in order.
fn one_product_away(reached: &[u32]) -> BTreeMap<u32, Product> {
    let mut out = BTreeMap::new();
    for (left, a) in reached.iter().enumerate() {
        for (right, b) in reached.iter().enumerate() {
            let mut offer = |n: u32, conjugate: bool| {
                out.entry(n).or_insert(Product {
                    left,
                    right,
                    conjugate,
                });
            };
            if right <= left {
                offer(a + b, false);
            }
            if a > b {
                offer(a - b, true);
            }
        }
    }
    for n in reached {
        out.remove(n);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use axisight_scalar::Lanes;

    /// Orders of the thesis, Table 8.1.
    const TABLE: [u32; 8] = [2, 3, 10, 12, 18, 36, 48, 72];

    /// Each product gives its exponent, and every target is reached.
    #[test]
    fn chains_reach_their_targets() {
        let many: Vec<u32> = (1..60).map(|i| i * i % 499 + 1).collect();
        let sets: [&[u32]; 6] = [&TABLE, &[1], &[499, 500], &[7, 131], &[], &many];
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

    /// Ripple of the second of two axes.
    fn wave_at<S: Scalar>(waves: &Waves, angle: S) -> Ripple<S> {
        let mut powers = vec![[S::zero(); 2]; waves.scratch()];
        let mut out = [Ripple::zero(); 2];
        waves.evaluate(&[S::zero(), angle], &mut powers, &mut out);
        out[1]
    }

    /// The error is `n * 5e-16`, 3.6e-14 for 72. The rounding of `n phi` in the reference adds
    /// 2.5e-14.
    #[test]
    fn powers_match_the_standard_library() {
        for order in TABLE {
            let n = f64::from(order);
            // All orders are in the chain, but only one has an amplitude.
            let one = |m: &u32| [f64::from(*m), 0.3, -0.7].map(|v| v * f64::from(*m == order));
            let mut constant: Vec<f64> = TABLE.iter().flat_map(one).collect();
            for (triple, m) in constant.chunks_exact_mut(3).zip(TABLE) {
                triple[0] = f64::from(m);
            }
            let table = RippleTable {
                constant,
                ..RippleTable::default()
            };
            let waves = Waves::new(&[RippleTable::default(), table]);
            for i in -1000..1000 {
                let angle = f64::from(i) * std::f64::consts::PI / 1000.0;
                let got = wave_at(&waves, angle).constant;
                let (s, c) = (n * angle).sin_cos();
                let (value, slope) = (0.3 * c - 0.7 * s, -0.3 * s - 0.7 * c);
                assert!((got.value - value).abs() < 1e-13, "{n} {angle}");
                assert!((got.slope / n - slope).abs() < 1e-13, "{n} {angle}");
            }
        }
    }

    #[test]
    fn fractional_and_absent_orders() {
        let table = RippleTable {
            constant: vec![2.5, 0.3, -0.7, 0.0, 9.0, 9.0],
            proportional: Vec::new(),
            resolver: vec![3.0, 0.3, -0.7, 2.5, 0.3, -0.7],
        };
        let angle = Lanes([0.4, -1.3, 2.0, 17.0]);
        let waves = Waves::new(&[RippleTable::default(), table]);
        let got = wave_at(&waves, angle);
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
        assert!(Waves::new(&[RippleTable::default()]).is_empty());
    }
}
