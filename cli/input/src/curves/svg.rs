//! The filled shapes of an SVG drawing: `path`, `polygon`, `polyline`, `rect`, `circle` and `ellipse`, with the
//! transforms of the elements around them. Each is filled by its own rule, as all are painted over each other.

use kurbo::{Affine, BezPath, Circle, Ellipse, PathEl, Point, Rect, Shape};
use roxmltree::{Document, Node};

use super::{Curves, LONGEST, MOST_POINTS};
use crate::winding::Fill;

/// Curves are replaced by segments to within this share of the drawing's diagonal.
const TOLERANCE: f64 = 1e-4;
/// The largest coordinate.
const LARGEST: f64 = 1e30;
/// No path may have more arcs.
const MOST_ARCS: usize = 1 << 15;
/// Elements that are not drawn where they stand.
const HIDDEN: [&str; 7] = [
    "defs", "clipPath", "mask", "symbol", "pattern", "marker", "metadata",
];

pub(super) fn decode(bytes: &[u8]) -> Result<Vec<(Curves, Fill)>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text in UTF-8")?;
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..roxmltree::ParsingOptions::default()
    };
    let document =
        Document::parse_with_options(text, options).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err("it has no svg element".into());
    }
    let mut paths = Vec::new();
    for node in root.descendants().filter(Node::is_element) {
        let Some(path) = path_of(node)? else { continue };
        if node.ancestors().any(is_hidden) {
            continue;
        }
        paths.push((transform(node)? * path, fill(node)));
    }
    if paths.is_empty() {
        return Err("it has no path, polygon, rect, circle or ellipse".into());
    }
    let around = paths
        .iter()
        .map(|(path, _)| path.bounding_box())
        .reduce(|a, b| a.union(b));
    let diagonal = around.map_or(0.0, |b| b.width().hypot(b.height()));
    // Lines are divided by products of several coordinates, which overflow.
    let largest = around.map_or(0.0, |b| {
        [b.x0, b.y0, b.x1, b.y1]
            .map(f64::abs)
            .into_iter()
            .fold(0.0, f64::max)
    });
    if !diagonal.is_finite() || largest > LARGEST {
        return Err(format!(
            "its coordinates are not finite, or larger than {LARGEST:e}"
        ));
    }
    let mut parts = Vec::new();
    let mut count = 0;
    for (path, rule) in &paths {
        let mut curves = Curves::new();
        kurbo::flatten(path, (TOLERANCE * diagonal).max(1e-12), |element| {
            count += 1;
            match element {
                PathEl::MoveTo(p) => curves.push(vec![[p.x, p.y]]),
                PathEl::LineTo(p) if count <= MOST_POINTS => {
                    if let Some(curve) = curves.last_mut() {
                        curve.push([p.x, p.y]);
                    }
                }
                // A path goes on from where the last curve began.
                _ => {}
            }
        });
        // A last command that only moves draws nothing.
        curves.retain(|curve| curve.len() > 1);
        parts.push((curves, *rule));
    }
    if count > MOST_POINTS {
        return Err(format!("it has more than {MOST_POINTS} points"));
    }
    parts.retain(|(curves, _)| !curves.is_empty());
    Ok(parts)
}

/// The path of an element; `None` for an element that draws none.
fn path_of(node: Node<'_, '_>) -> Result<Option<BezPath>, String> {
    let number = |name: &str| -> Result<f64, String> {
        let Some(text) = node.attribute(name) else {
            return Ok(0.0);
        };
        let digits = text.trim().trim_end_matches("px");
        let number = digits.parse::<f64>().ok().filter(|x| x.abs() <= LONGEST);
        number
            .ok_or_else(|| format!("'{name}' of a shape is not a number of pixels up to {LONGEST}"))
    };
    let middle = || -> Result<Point, String> { Ok(Point::new(number("cx")?, number("cy")?)) };
    // Exact shapes become curves that are as accurate as the segments.
    let accuracy = |size: f64| (0.1 * TOLERANCE * size.abs()).max(1e-12);
    Ok(match node.tag_name().name() {
        "path" => {
            let Some(data) = node.attribute("d") else {
                return Ok(None);
            };
            check_numbers(data)?;
            let path = BezPath::from_svg(data);
            Some(path.map_err(|error| format!("a path cannot be read: {error}"))?)
        }
        "polygon" | "polyline" => {
            let text = node.attribute("points").unwrap_or_default();
            let words = text.split(|c: char| c == ',' || c.is_ascii_whitespace());
            let numbers: Result<Vec<f64>, _> = words
                .filter(|word| !word.is_empty())
                .map(str::parse)
                .collect();
            let numbers = numbers.map_err(|_| "a polygon has points that are no numbers")?;
            let mut path = BezPath::new();
            for (i, [x, y]) in numbers.as_chunks().0.iter().enumerate() {
                if i == 0 {
                    path.move_to((*x, *y));
                } else {
                    path.line_to((*x, *y));
                }
            }
            (!path.is_empty()).then_some(path)
        }
        "rect" => {
            let corner = Point::new(number("x")?, number("y")?);
            let size = (number("width")?, number("height")?);
            Some(Rect::from_origin_size(corner, size).to_path(1.0))
        }
        "circle" => {
            let radius = number("r")?;
            Some(Circle::new(middle()?, radius).to_path(accuracy(radius)))
        }
        "ellipse" => {
            let radii = (number("rx")?, number("ry")?);
            let smaller = radii.0.abs().min(radii.1.abs());
            Some(Ellipse::new(middle()?, radii, 0.0).to_path(accuracy(smaller)))
        }
        _ => None,
    })
}

/// Rejects path data with numbers and arcs that would become more curves than there is room for: an arc is as
/// many as the sixth root of its radius.
fn check_numbers(data: &str) -> Result<(), String> {
    let bytes = data.as_bytes();
    if bytes.iter().filter(|b| matches!(b, b'a' | b'A')).count() > MOST_ARCS {
        return Err(format!("a path has more than {MOST_ARCS} arcs"));
    }
    let mut start = 0;
    while start < bytes.len() {
        let end = start + number_length(&bytes[start..]);
        let number = data.get(start..end).and_then(|text| text.parse().ok());
        if number.is_some_and(|x: f64| x.abs() > LONGEST) {
            return Err(format!("a path has a number beyond {LONGEST}"));
        }
        start = end.max(start + 1);
    }
    Ok(())
}

/// Length of the number that begins here. Flags of arcs may stand before another number without a blank,
/// and count as digits of it.
fn number_length(bytes: &[u8]) -> usize {
    let digits = |from: usize| {
        let rest = bytes.get(from..).unwrap_or_default();
        from + rest.iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let sign = |from: usize| from + usize::from(matches!(bytes.get(from), Some(b'+' | b'-')));
    let mut end = digits(sign(0));
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = sign(end + 1);
        if digits(exponent) > exponent {
            end = digits(exponent);
        }
    }
    end
}

fn is_hidden(node: Node<'_, '_>) -> bool {
    HIDDEN.contains(&node.tag_name().name()) || property(node, "display") == Some("none")
}

/// A property of an element, as an attribute or in its style.
fn property<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    let styles = node.attribute("style").unwrap_or_default().split(';');
    let mut pairs = styles.filter_map(|style| style.split_once(':'));
    let style = pairs.find(|(key, _)| key.trim() == name);
    style
        .map(|(_, value)| value.trim())
        .or_else(|| node.attribute(name))
}

/// The fill rule of an element, or of the nearest around it that states one.
fn fill(node: Node<'_, '_>) -> Fill {
    let stated = node
        .ancestors()
        .find_map(|node| property(node, "fill-rule"));
    if stated == Some("evenodd") {
        Fill::EvenOdd
    } else {
        Fill::NonZero
    }
}

/// From an element to the drawing.
fn transform(node: Node<'_, '_>) -> Result<Affine, String> {
    let mut all = Affine::IDENTITY;
    for node in node.ancestors() {
        if let Some(text) = node.attribute("transform") {
            all = parsed_transform(text)? * all;
        }
    }
    Ok(all)
}

fn parsed_transform(text: &str) -> Result<Affine, String> {
    let unknown = || {
        let shown: String = text.chars().take(40).collect();
        format!("the transform '{shown}' is unknown")
    };
    let mut all = Affine::IDENTITY;
    for step in text.split(')') {
        let step = step.trim_start_matches(|c: char| c == ',' || c.is_ascii_whitespace());
        if step.is_empty() {
            continue;
        }
        let (name, numbers) = step.split_once('(').ok_or_else(unknown)?;
        let numbers = numbers.split(|c: char| c == ',' || c.is_ascii_whitespace());
        let numbers: Result<Vec<f64>, _> = numbers
            .filter(|word| !word.is_empty())
            .map(str::parse)
            .collect();
        let numbers = numbers.map_err(|_| unknown())?;
        let step = match (name.trim(), &numbers[..]) {
            ("matrix", &[a, b, c, d, e, f]) => Affine::new([a, b, c, d, e, f]),
            ("translate", &[x]) => Affine::translate((x, 0.0)),
            ("translate", &[x, y]) => Affine::translate((x, y)),
            ("scale", &[s]) => Affine::scale(s),
            ("scale", &[x, y]) => Affine::scale_non_uniform(x, y),
            ("rotate", &[angle]) => Affine::rotate(angle.to_radians()),
            ("rotate", &[angle, x, y]) => {
                Affine::rotate_about(angle.to_radians(), Point::new(x, y))
            }
            ("skewX", &[angle]) => Affine::skew(angle.to_radians().tan(), 0.0),
            ("skewY", &[angle]) => Affine::skew(0.0, angle.to_radians().tan()),
            _ => return Err(unknown()),
        };
        all *= step;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(text: &str) -> f64 {
        let parts = decode(text.as_bytes()).unwrap();
        let twice = |curve: &Vec<[f64; 2]>| -> f64 {
            let next = curve.iter().cycle().skip(1);
            curve
                .iter()
                .zip(next)
                .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
                .sum()
        };
        let curves = parts.iter().flat_map(|(curves, _)| curves);
        0.5 * curves.map(twice).sum::<f64>()
    }

    #[test]
    fn shapes_and_transforms_have_their_areas() {
        let drawn = |inner: &str| {
            let open = "<svg xmlns='http://www.w3.org/2000/svg'>";
            area(&format!("{open}{inner}</svg>"))
        };
        let pi = std::f64::consts::PI;
        // Segments lie inside of a circle by up to a ten-thousandth of its diagonal.
        let close = |found: f64, expected: f64| {
            assert!(
                (found.abs() / expected - 1.0).abs() < 1e-3,
                "{found} {expected}"
            );
        };
        close(drawn("<circle cx='5' cy='5' r='2'/>"), 4.0 * pi);
        close(drawn("<ellipse rx='5' ry='2'/>"), 10.0 * pi);
        close(drawn("<path d='M0 0h4v3h-4z m1 1h1v1h-1z'/>"), 13.0);
        close(drawn("<path d='M-3 0 A3 3 0 0 1 3 0z'/>"), 4.5 * pi);
        close(drawn("<polygon points='0,0 4,0 4,3'/>"), 6.0);
        let group = "<g transform='translate(3 4) scale(2)'><rect width='3' height='2' \
                     transform='rotate(30),skewX(20)'/></g>";
        close(drawn(group), 24.0);
        let hidden = "<rect width='3' height='2'/><defs><circle r='9'/></defs>\
                      <g style='display: none'><circle r='9'/></g>";
        close(drawn(hidden), 6.0);
    }

    #[test]
    fn what_draws_nothing_is_refused() {
        let reason = |text: &str| decode(text.as_bytes()).unwrap_err();
        assert!(reason("<svg/>").contains("no path"));
        assert!(reason("<html/>").contains("no svg"));
        assert!(reason("<svg><path d='M 0 q'/></svg>").contains("cannot be read"));
        assert!(reason("<svg><rect width='1cm' height='2'/></svg>").contains("width"));
        assert!(reason("<svg><rect transform='turn(3)'/></svg>").contains("turn"));
        for wide in [
            "<path d='M0 0a2 1 3 1 0 25e60 3z'/>",
            "<path d='M0 0h9999999999z'/>",
        ] {
            assert!(reason(&format!("<svg>{wide}</svg>")).contains("beyond"));
        }
        for wide in ["<circle r='inf'/>", "<ellipse rx='1e300' ry='1'/>"] {
            assert!(reason(&format!("<svg>{wide}</svg>")).contains("pixels up to"));
        }
        let arcs = "a1 1 0 0 1 1 1".repeat(MOST_ARCS + 1);
        assert!(reason(&format!("<svg><path d='M0 0{arcs}z'/></svg>")).contains("arcs"));
    }
}
