//! Instruction sets.

use std::sync::OnceLock;

/// The instruction set that the kernels run on. All give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// One number at a time, on any machine.
    Scalar,
    /// 256-bit vectors with fused multiply-add (AVX2).
    Wide256,
    /// 512-bit vectors (AVX-512), or the widest that the machine has.
    Widest,
}

impl SimdLevel {
    /// The level in use: the widest, unless the environment variable `SHAPESPACE_SIMD` is set to
    /// `scalar` or `256`.
    pub fn active() -> Self {
        static LEVEL: OnceLock<SimdLevel> = OnceLock::new();
        *LEVEL.get_or_init(|| match std::env::var("SHAPESPACE_SIMD").as_deref() {
            Ok("scalar") => Self::Scalar,
            Ok("256") => Self::Wide256,
            _ => Self::Widest,
        })
    }
}
