//! Number types for chains: plain numbers, and numbers with eight derivatives in vector registers.

use axisight_scalar::{DualNumber, Lanes, Register, Scalar};

/// Number of parameters that one pass differentiates.
pub(super) const LANES: usize = 8;

/// A value and its derivatives along eight seeds, in registers `V`.
pub(super) type Jet<V> = DualNumber<f64, V>;

/// Derivatives in registers that every processor has.
pub(super) type PlainLanes = Lanes<LANES>;

/// A scalar with a counterpart that every processor supports. Rare steps are compiled for the
/// counterpart only.
pub(super) trait Number: Scalar {
    /// The counterpart.
    type Plain: Scalar;
    /// Convert to the counterpart.
    fn plain(self) -> Self::Plain;
    /// Convert from the counterpart.
    fn from_plain(x: Self::Plain) -> Self;
}

impl Number for f64 {
    type Plain = f64;
    #[inline(always)]
    fn plain(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_plain(x: f64) -> Self {
        x
    }
}

impl<V: Register> Number for Jet<V> {
    type Plain = Jet<PlainLanes>;
    #[inline(always)]
    fn plain(self) -> Self::Plain {
        Jet {
            value: self.value,
            partials: Lanes(stored(self.partials)),
        }
    }
    #[inline(always)]
    fn from_plain(x: Self::Plain) -> Self {
        Self {
            value: x.value,
            partials: V::load(&x.partials.0),
        }
    }
}

/// The derivatives as an array.
#[inline(always)]
pub(super) fn stored<V: Register>(partials: V) -> [f64; LANES] {
    let mut out = [0.0; LANES];
    partials.store(&mut out);
    out
}
