//! Error bars of quantities computed on several grids, by Richardson extrapolation.

use std::fmt::{Display, Formatter};

use serde::{Deserialize, Serialize};

/// Smallest observed order that is believed: the differences of a quantity on grids of spacing `h`, `2 h`
/// and `4 h` must at least shrink by the root of two.
const LEAST_ORDER: f64 = 0.5;
/// Largest observed order that is believed: that of multilinear elements, and half as much again. Larger
/// ones are those of differences that vanish by chance.
const LARGEST_ORDER: f64 = 3.0;

/// How an order of convergence was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OrderFrom {
    /// Observed: `log2((q_4h - q_2h) / (q_2h - q_h))`.
    ThreeGrids,
    /// Assumed, since there are two grids only.
    TwoGrids,
    /// Assumed, since the differences of three grids do not shrink as those of any order between 0.5 and
    /// 3; the error is then the largest difference.
    NotAsymptotic,
}

/// A quantity `q` with an estimate of its error.
///
/// With `q_h = q + c h^p` the error of `q_h` is `|q_2h - q_h| / (2^p - 1)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorBar {
    /// The value on the finest grid.
    pub value: f64,
    /// The estimate of its error.
    pub error: f64,
    /// The order of convergence.
    pub order: f64,
    /// Where the order comes from.
    pub order_from: OrderFrom,
    /// The values on all grids, the finest first; the spacing doubles from each to the next.
    pub values: Vec<f64>,
}

impl ErrorBar {
    /// Returns the error bar of a quantity from its values on grids of spacings `h`, `2 h`, `4 h`, of which
    /// the last may be missing, and any others are not used; `None` of fewer than two values.
    ///
    /// ```
    /// use shapespace_report::error_bar::{ErrorBar, OrderFrom};
    /// let bar = ErrorBar::of(&[1.01, 1.04, 1.16], 1.0).unwrap();
    /// assert_eq!(bar.order_from, OrderFrom::ThreeGrids);
    /// assert!((bar.order - 2.0).abs() < 1e-9 && (bar.error - 0.01).abs() < 1e-9);
    /// ```
    pub fn of(values: &[f64], assumed_order: f64) -> Option<Self> {
        let [fine, middle, coarser @ ..] = values else {
            return None;
        };
        let step = middle - fine;
        let bar = |error: f64, order, order_from| Self {
            value: *fine,
            error: error.abs(),
            order,
            order_from,
            values: values.to_vec(),
        };
        let assumed = step / (assumed_order.exp2() - 1.0);
        let Some(coarse) = coarser.first() else {
            return Some(bar(assumed, assumed_order, OrderFrom::TwoGrids));
        };
        let earlier = coarse - middle;
        let order = (earlier / step).log2();
        if (LEAST_ORDER..=LARGEST_ORDER).contains(&order) {
            let error = step / (order.exp2() - 1.0);
            return Some(bar(error, order, OrderFrom::ThreeGrids));
        }
        let error = step.abs().max(earlier.abs()).max(assumed.abs());
        Some(bar(error, assumed_order, OrderFrom::NotAsymptotic))
    }

    /// Returns the value extrapolated to spacing zero; that of the finest grid without an order.
    pub fn limit(&self) -> f64 {
        match (self.order_from, self.values.as_slice()) {
            (OrderFrom::ThreeGrids | OrderFrom::TwoGrids, [fine, middle, ..]) => {
                fine + (fine - middle) / (self.order.exp2() - 1.0)
            }
            _ => self.value,
        }
    }
}

/// The value with its error and the origin of its order.
impl Display for ErrorBar {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let (value, error, order) = (self.value, self.error, self.order);
        write!(f, "{value:.4e} ± {error:.1e} (")?;
        match self.order_from {
            OrderFrom::ThreeGrids => write!(f, "observed order {order:.1})"),
            OrderFrom::TwoGrids => write!(f, "assumed order {order:.0})"),
            OrderFrom::NotAsymptotic => write!(f, "no order: the largest difference)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A power of the spacing is found exactly: limit, error and order.
        #[test]
        fn a_power_is_extrapolated(limit in -2.0..2.0f64, factor in 0.01..1.0f64, order in 0.6..2.9f64) {
            let value = |h: f64| limit + factor * h.powf(order);
            let bar = ErrorBar::of(&[value(1.0), value(2.0), value(4.0)], 1.0).unwrap();
            prop_assert_eq!(bar.order_from, OrderFrom::ThreeGrids);
            prop_assert!((bar.order - order).abs() < 1e-9);
            prop_assert!((bar.limit() - limit).abs() < 1e-9);
            prop_assert!((bar.error - factor).abs() < 1e-9);
            // Of two grids with the order known.
            let bar = ErrorBar::of(&[value(1.0), value(2.0)], order).unwrap();
            prop_assert_eq!(bar.order_from, OrderFrom::TwoGrids);
            prop_assert!((bar.limit() - limit).abs() < 1e-9 && (bar.error - factor).abs() < 1e-9);
        }

        /// Whatever the values, errors are not negative, and values without an order have large ones.
        #[test]
        fn values_of_no_order_have_the_largest_difference(a in -1.0..1.0f64, b in -1.0..1.0f64, c in -1.0..1.0f64) {
            let bar = ErrorBar::of(&[a, b, c], 1.0).unwrap();
            prop_assert!(bar.error >= 0.0 && bar.value == a);
            if bar.order_from == OrderFrom::NotAsymptotic {
                prop_assert!(bar.error >= (c - b).abs().max((b - a).abs()));
                prop_assert_eq!(bar.limit(), a);
            }
        }
    }

    #[test]
    fn one_value_has_no_error_bar_and_equal_values_have_a_small_one() {
        assert_eq!(ErrorBar::of(&[1.0], 1.0), None);
        let bar = ErrorBar::of(&[1.0; 3], 1.0).unwrap();
        assert_eq!((bar.error, bar.order_from), (0.0, OrderFrom::NotAsymptotic));
    }
}
