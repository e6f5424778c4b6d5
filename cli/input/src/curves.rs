//! Outlines as inputs: closed curves in CSV tables and SVG drawings.
//!
//! Coordinates are those of pictures: y points down. Curves are closed; what lies inside an odd number
//! of the curves of a table is the object, and what lies inside of any shape of a drawing by its fill rule.

mod svg;
mod table;

use levelset::Contour;

use super::filled::Filled;
use super::winding::Fill;

/// No outline may have more points than this.
const MOST_POINTS: usize = 1 << 20;
/// Coordinates beyond this are damage.
const LONGEST: f64 = 1e9;

/// Closed curves; the first point is not repeated.
type Curves = Vec<Vec<[f64; 2]>>;

/// Whether files with this extension, in small letters, hold outlines.
pub(crate) fn is_outline(extension: &str) -> bool {
    matches!(extension, "csv" | "svg")
}

/// The closed curves of a file with this extension, with what they enclose; the name of the format for
/// a reason why there are none.
pub(crate) fn decode(bytes: &[u8], extension: &str) -> Result<Filled<2>, (&'static str, String)> {
    let (format, read) = if extension == "svg" {
        ("SVG", svg::decode(bytes))
    } else {
        let table = table::decode(bytes);
        ("CSV", table.map(|curves| vec![(curves, Fill::EvenOdd)]))
    };
    let closed = |parts: Vec<(Curves, Fill)>| {
        let mut before = 0;
        let parts = parts.into_iter().map(|(curves, fill)| {
            let first = before;
            before += curves.len();
            Ok::<_, String>((closed(curves, first)?, fill))
        });
        let parts: Result<Vec<_>, String> = parts.collect();
        Filled::of_parts(parts?).ok_or_else(|| "it has no closed curve".to_owned())
    };
    read.and_then(closed).map_err(|reason| (format, reason))
}

/// The contour of some curves, of which the first has this number.
fn closed(curves: Curves, first_number: usize) -> Result<Contour<2>, String> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut segments = Vec::new();
    for (number, mut curve) in (first_number..).zip(curves) {
        curve.dedup();
        while curve.len() > 1 && curve.first() == curve.last() {
            curve.pop();
        }
        if curve.len() < 3 {
            let found = curve.len();
            return Err(format!(
                "curve {number} has {found} different points, not three"
            ));
        }
        if let Some(p) = curve.iter().find(|p| !p.iter().all(|x| x.abs() <= LONGEST)) {
            return Err(format!("a point of curve {number} lies at {p:?}"));
        }
        let (first, n) = (points.len(), curve.len());
        if first + n > MOST_POINTS {
            return Err(format!("it has more than {MOST_POINTS} points"));
        }
        let corner = |i: usize| (first + i % n) as u32;
        segments.extend((0..n).map(|i| [corner(i), corner(i + 1)]));
        points.extend(curve);
    }
    if segments.is_empty() {
        return Err("it has no closed curve".into());
    }
    Contour::new(points, segments).map_err(|error| error.to_string())
}
