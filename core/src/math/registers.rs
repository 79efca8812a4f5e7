//! Vector registers of the processor: which of them the kernels use, and a cap on their width.
//!
//! Sums in wide registers are added in another order than one by one, so the last digits of results depend on the
//! width. The environment variable [`VARIABLE`] caps the width: one machine can then show what another one computes.
//! The width of NEON exists on x86 for tests alone. Release builds omit it, since kernels of one width are a fifth of
//! the core's build.

use crate::error::{Error, Result};
use pulp::{Simd, WithSimd};
use std::sync::OnceLock;

/// Name of the environment variable that caps the width of registers.
///
/// The library reads the variable once, at the first kernel, and takes a value that names no width for no cap.
/// The program `snaprod` refuses such a value ([`Width::from_environment`]).
pub const VARIABLE: &str = "SNAPROD_REGISTERS";

/// Width of the registers that kernels are compiled for, from the narrowest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    /// One number. Planar motions and viscoelastic rods in space then use sequential methods instead of eightfold
    /// ones; ends of rods keep their methods.
    Scalar,
    /// Two numbers, and products that are rounded together with a sum: NEON, which every aarch64 has.
    Two,
    /// Four numbers: AVX2 with FMA.
    Avx2,
    /// Eight numbers: AVX-512.
    Avx512,
}

impl Width {
    /// All widths of this build, from the narrowest; [`Width::Two`] needs debug assertions on x86.
    pub const ALL: &[Self] = if cfg!(all(target_arch = "x86_64", not(debug_assertions))) {
        &[Self::Scalar, Self::Avx2, Self::Avx512]
    } else {
        &[Self::Scalar, Self::Two, Self::Avx2, Self::Avx512]
    };

    /// Word for the width in [`VARIABLE`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Two => "two",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Cap that [`VARIABLE`] asks for; `None` if the variable is unset or empty.
    ///
    /// # Errors
    /// A domain error that names the variable, its value and the words allowed.
    pub fn from_environment() -> Result<Option<Self>> {
        let Some(value) = std::env::var_os(VARIABLE).filter(|value| !value.is_empty()) else {
            return Ok(None);
        };
        let named = Self::ALL.iter().find(|width| value == width.name());
        named.copied().map(Some).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|width| width.name()).collect();
            Error::domain(format!(
                "the environment variable {VARIABLE} is {value:?}: set one of {}, or unset it",
                names.join(", ")
            ))
        })
    }

    /// Width in use: the widest that the processor has and the cap allows.
    pub fn in_use() -> Self {
        Registers::in_use().map_or(Self::Scalar, Registers::width)
    }
}

/// Registers for two numbers or more, which serve the kernels for eight places at once.
#[derive(Debug, Clone, Copy)]
pub enum Registers {
    /// [`Width::Avx512`].
    #[cfg(target_arch = "x86_64")]
    Avx512(pulp::x86::V4),
    /// [`Width::Avx2`].
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// [`Width::Two`], made of AVX2 and FMA: for tests of what aarch64 computes.
    #[cfg(all(target_arch = "x86_64", debug_assertions))]
    Two(pulp::x86::V3_128b),
    /// Registers of other processors: NEON on aarch64.
    #[cfg(not(target_arch = "x86_64"))]
    Two(pulp::Arch),
}

impl Registers {
    /// The widest registers that the processor has and the cap allows.
    ///
    /// `None` on an x86 processor without AVX2, or under the cap `scalar`.
    #[inline]
    pub fn in_use() -> Option<Self> {
        static CHOSEN: OnceLock<Option<Registers>> = OnceLock::new();
        *CHOSEN.get_or_init(|| {
            let cap = Width::from_environment().ok().flatten();
            let cap = cap.unwrap_or(Width::Avx512);
            let mut all = Self::of_processor().into_iter().flatten();
            all.find(|registers| registers.width() <= cap)
        })
    }

    /// Registers of this processor, from the widest.
    fn of_processor() -> impl IntoIterator<Item = Option<Self>> {
        #[cfg(target_arch = "x86_64")]
        {
            use pulp::x86::{V3, V4};
            [
                V4::try_new().map(Self::Avx512),
                V3::try_new().map(Self::Avx2),
                #[cfg(debug_assertions)]
                V3::try_new().map(|simd| Self::Two(pulp::x86::V3_128b(simd))),
            ]
        }
        #[cfg(not(target_arch = "x86_64"))]
        [Some(Self::Two(pulp::Arch::new()))]
    }

    fn width(self) -> Width {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Width::Avx512,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Width::Avx2,
            #[cfg(any(not(target_arch = "x86_64"), debug_assertions))]
            Self::Two(_) => Width::Two,
        }
    }

    /// Result of `work`, compiled for the registers. All functions that `work` calls must be inlined; closures are
    /// not.
    #[inline(always)]
    pub fn work<W: WithSimd>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => Simd::vectorize(simd, work),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => Simd::vectorize(simd, work),
            #[cfg(all(target_arch = "x86_64", debug_assertions))]
            Self::Two(simd) => Simd::vectorize(simd, work),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Two(arch) => arch.dispatch(work),
        }
    }

    /// Result of `work`, compiled for registers of up to four numbers.
    #[inline(always)]
    pub(crate) fn work_in_four<W: WithSimd>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => Simd::vectorize(*simd, work),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => Simd::vectorize(simd, work),
            #[cfg(all(target_arch = "x86_64", debug_assertions))]
            Self::Two(simd) => Simd::vectorize(simd, work),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Two(arch) => arch.dispatch(work),
        }
    }
}

/// Result of `work`, compiled for the registers in use, or for one number at a time.
#[inline(always)]
pub fn wide<W: WithSimd>(work: W) -> W::Output {
    match Registers::in_use() {
        Some(registers) => registers.work(work),
        None => Simd::vectorize(pulp::Scalar::new(), work),
    }
}
