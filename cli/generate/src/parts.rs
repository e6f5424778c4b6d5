//! Shapes of several labelled parts.

use crate::implicit::Implicit;
use crate::member::Member;
use crate::solid::Bar;

/// Length and width of the bars.
const LENGTH: f64 = 0.6;
const WIDTH: f64 = 0.18;
/// Where the parts of the bars meet, along the first axis from their joint, and their angles in degrees.
const BARS: [(f64, f64); 4] = [(-0.05, 180.0), (0.05, 180.0), (-0.05, 155.0), (0.05, 155.0)];

/// The part of a bar on one side of a plane across it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    bar: Bar,
    border: f64,
    /// One for the part to the right, minus one for the left.
    sign: f64,
}

impl<const D: usize> Implicit<D> for Side {
    fn value(&self, point: [f64; D]) -> f64 {
        let inside = self.sign * (point[0] - self.border);
        self.bar.value(point).min(inside)
    }
}

/// Straight and bent bars of two parts, which meet at different places: the labels of the parts are their numbers,
/// from one.
pub fn parts<const D: usize>() -> Vec<Member<D>> {
    let bars = BARS.iter().enumerate();
    bars.map(|(k, &(border, angle))| {
        let bar = Bar::new(LENGTH, WIDTH, angle);
        let side = |sign: f64| -> Box<dyn Implicit<D>> { Box::new(Side { bar, border, sign }) };
        Member {
            name: format!("bar_{k:03}"),
            shape: Box::new(bar),
            parts: vec![side(-1.0), side(1.0)],
        }
    })
    .collect()
}
