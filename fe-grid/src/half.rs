//! Numbers of 16 bits, for data of which two or three digits suffice, such as those of a preconditioner.

/// The upper half of a number in single precision: of the same range, with a rounding error of at most
/// `2^-8` of the number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Half(u16);

impl Half {
    /// The nearest one, half way the even one.
    #[inline(always)]
    pub fn of(x: f32) -> Self {
        let bits = x.to_bits();
        let even = bits >> 16 & 1;
        let rounded = bits.wrapping_add(0x7fff + even);
        // The mantissa of a NaN may end in the half that is dropped.
        Self(if x.is_nan() {
            0x7fc0
        } else {
            (rounded >> 16) as u16
        })
    }

    /// The number, exactly.
    #[inline(always)]
    pub fn to_single(self) -> f32 {
        f32::from_bits(u32::from(self.0) << 16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_nearest() {
        let exact = [
            0.0,
            -1.0,
            1.5,
            2f32.powi(-100),
            -2f32.powi(100),
            f32::INFINITY,
        ];
        for x in exact {
            assert_eq!(Half::of(x).to_single(), x);
        }
        assert!(Half::of(f32::NAN).to_single().is_nan());
        assert!(Half::of(f32::from_bits(0x7f80_0001)).to_single().is_nan());
        // Half way between two halves, and a little beyond it.
        let spacing = 2f32.powi(-7);
        assert_eq!(Half::of(1.0 + 0.5 * spacing).to_single(), 1.0);
        assert_eq!(Half::of(1.0 + 0.51 * spacing).to_single(), 1.0 + spacing);
        assert_eq!(
            Half::of(1.0 + 1.5 * spacing).to_single(),
            1.0 + 2.0 * spacing
        );
    }
}
