//! Eight derivatives in one register of 512 bits, on processors that have them.
//!
//! As in the core: the package is compiled for 256 bits, everything here is inlined into
//! functions with `#[target_feature(enable = "avx512f")]`, entered only where [`available`].

use super::jet::Partials;
use super::problem::LANES;
use std::arch::x86_64::{
    __m512d, _mm512_add_pd, _mm512_fmadd_pd, _mm512_loadu_pd, _mm512_mul_pd, _mm512_set1_pd,
    _mm512_setzero_pd, _mm512_storeu_pd, _mm512_sub_pd,
};
use std::ops::{Add, Mul, Neg, Sub};

/// Whether the processor has such registers.
pub(super) fn available() -> bool {
    is_x86_feature_detected!("avx512f")
}

/// Eight doubles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wide(__m512d);

/// An expression of instructions that only functions behind [`available`] reach.
macro_rules! instructions {
    ($e:expr) => {{
        // SAFETY: the instructions exist, see the head of this file; arrays have eight entries,
        // and the unaligned instructions take any address.
        #[allow(unsafe_code)]
        unsafe {
            $e
        }
    }};
}

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Wide {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                Self(instructions!($instruction(self.0, b.0)))
            }
        }
    };
}
operator!(Add, add, _mm512_add_pd);
operator!(Sub, sub, _mm512_sub_pd);
operator!(Mul, mul, _mm512_mul_pd);

impl Neg for Wide {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(instructions!(_mm512_sub_pd(_mm512_setzero_pd(), self.0)))
    }
}

impl Partials for Wide {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(instructions!(_mm512_set1_pd(x)))
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self(instructions!(_mm512_fmadd_pd(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn load(from: &[f64; LANES]) -> Self {
        Self(instructions!(_mm512_loadu_pd(from.as_ptr())))
    }
    #[inline(always)]
    fn store(self) -> [f64; LANES] {
        let mut out = [0.0; LANES];
        instructions!(_mm512_storeu_pd(out.as_mut_ptr(), self.0));
        out
    }
}
