//! Eight doubles in a register of 512 bits, on processors that have such registers.
//!
//! The package is compiled for 256 bits. Only functions with
//! `#[target_feature(enable = "avx512f,avx512dq")]` may use this type, and callers enter them only
//! if [`available`] returns true. Everything here is inlined into these functions.

use super::register::{EXPONENT, Register};
use nalgebra::Complex;
use std::arch::x86_64::{
    __m512d, _CMP_GT_OQ, _mm_loadu_pd, _mm_storeu_pd, _mm512_abs_pd, _mm512_add_pd, _mm512_and_pd,
    _mm512_castpd128_pd512, _mm512_castpd512_pd128, _mm512_cmp_pd_mask, _mm512_div_pd,
    _mm512_extractf64x2_pd, _mm512_fmadd_pd, _mm512_fnmadd_pd, _mm512_insertf64x2, _mm512_loadu_pd,
    _mm512_mask_blend_pd, _mm512_max_pd, _mm512_mul_pd, _mm512_set1_pd, _mm512_setzero_pd,
    _mm512_storeu_pd, _mm512_sub_pd, _mm512_unpackhi_pd, _mm512_unpacklo_pd, _mm512_xor_pd,
};
use std::ops::{Add, Mul, Neg, Sub};

type C = Complex<f64>;

/// Whether the processor has the instruction sets AVX-512F and AVX-512DQ.
pub fn available() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
}

/// Eight doubles.
#[derive(Debug, Clone, Copy)]
pub struct Wide(__m512d);

/// An expression of instructions that run only after [`available`] returned true.
macro_rules! instructions {
    ($e:expr) => {{
        // SAFETY: the processor has the instructions, see the top of this file. The lengths of
        // slices are checked before, and the unaligned instructions take any address.
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
        Self(instructions!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}

impl Register for Wide {
    const LANES: usize = 8;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(instructions!(_mm512_set1_pd(x)))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let from = &from[..8];
        Self(instructions!(_mm512_loadu_pd(from.as_ptr())))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        let to = &mut to[..8];
        instructions!(_mm512_storeu_pd(to.as_mut_ptr(), self.0));
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self(instructions!(_mm512_fmadd_pd(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn fnma(self, b: Self, c: Self) -> Self {
        Self(instructions!(_mm512_fnmadd_pd(self.0, b.0, c.0)))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self(instructions!(_mm512_div_pd(_mm512_set1_pd(1.0), self.0)))
    }
    #[inline(always)]
    fn magnitude_or(self, b: Self) -> Self {
        Self(instructions!(_mm512_max_pd(_mm512_abs_pd(self.0), b.0)))
    }
    #[inline(always)]
    fn if_positive(self, a: Self, b: Self) -> Self {
        Self(instructions!({
            let positive = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_pd());
            _mm512_mask_blend_pd(positive, b.0, a.0)
        }))
    }
    #[inline(always)]
    fn inverse_power_of_two(self) -> Self {
        let exponent = Self::splat(f64::from_bits(EXPONENT));
        Self(instructions!(_mm512_and_pd(self.0, exponent.0))).recip()
    }
    #[inline(always)]
    fn split(from: &[C], step: usize) -> (Self, Self) {
        let from = &from[..=7 * step];
        instructions!({
            let place = |l: usize| _mm_loadu_pd(from.as_ptr().add(l * step).cast());
            let even = _mm512_castpd128_pd512(place(0));
            let even = _mm512_insertf64x2::<1>(even, place(2));
            let even = _mm512_insertf64x2::<2>(even, place(4));
            let even = _mm512_insertf64x2::<3>(even, place(6));
            let odd = _mm512_castpd128_pd512(place(1));
            let odd = _mm512_insertf64x2::<1>(odd, place(3));
            let odd = _mm512_insertf64x2::<2>(odd, place(5));
            let odd = _mm512_insertf64x2::<3>(odd, place(7));
            (
                Self(_mm512_unpacklo_pd(even, odd)),
                Self(_mm512_unpackhi_pd(even, odd)),
            )
        })
    }
    #[inline(always)]
    fn join(re: Self, im: Self, to: &mut [C], step: usize) {
        let to = &mut to[..=7 * step];
        instructions!({
            let start: *mut f64 = to.as_mut_ptr().cast();
            let even = _mm512_unpacklo_pd(re.0, im.0);
            let odd = _mm512_unpackhi_pd(re.0, im.0);
            let step = 2 * step;
            _mm_storeu_pd(start, _mm512_castpd512_pd128(even));
            _mm_storeu_pd(start.add(step), _mm512_castpd512_pd128(odd));
            _mm_storeu_pd(start.add(2 * step), _mm512_extractf64x2_pd::<1>(even));
            _mm_storeu_pd(start.add(3 * step), _mm512_extractf64x2_pd::<1>(odd));
            _mm_storeu_pd(start.add(4 * step), _mm512_extractf64x2_pd::<2>(even));
            _mm_storeu_pd(start.add(5 * step), _mm512_extractf64x2_pd::<2>(odd));
            _mm_storeu_pd(start.add(6 * step), _mm512_extractf64x2_pd::<3>(even));
            _mm_storeu_pd(start.add(7 * step), _mm512_extractf64x2_pd::<3>(odd));
        });
    }
}
