//! Curves in tables: a point a line.
//!
//! Columns are separated by commas, semicolons, tabs or spaces. A first line of names says which are `x`
//! and `y`, and which tells curves apart (`piece`, `curve`, `id`, `contour` or `ring`); without it, the
//! first two are x and y. A blank line begins another curve, too. Lines that begin with `#` are remarks.

use super::Curves;

const CURVE_NAMES: [&str; 5] = ["piece", "curve", "id", "contour", "ring"];

/// Where the columns are.
struct Columns {
    x: usize,
    y: usize,
    curve: Option<usize>,
}

pub(super) fn decode(bytes: &[u8]) -> Result<Curves, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text in UTF-8")?;
    let text = text.trim_start_matches('\u{feff}');
    let mut columns: Option<Columns> = None;
    let mut curves: Curves = Vec::new();
    let mut current = String::new();
    let mut fresh = true;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.starts_with('#') {
            continue;
        }
        if line.is_empty() {
            fresh = true;
            continue;
        }
        let words = split(line);
        let at = |reason: &str| format!("line {}: {reason}", number + 1);
        let Some(columns) = &columns else {
            if words.iter().all(|word| word.parse::<f64>().is_err()) {
                columns = Some(named(&words).ok_or_else(|| at("no columns are named x and y"))?);
                continue;
            }
            if words.len() > 2 {
                return Err(at("more than two columns need a line with their names"));
            }
            let point = [0, 1].map(|k| number_of(&words, k));
            let [Some(x), Some(y)] = point else {
                return Err(at("it does not begin with two numbers"));
            };
            curves.push(vec![[x, y]]);
            fresh = false;
            columns = Some(Columns {
                x: 0,
                y: 1,
                curve: None,
            });
            continue;
        };
        let (x, y) = (number_of(&words, columns.x), number_of(&words, columns.y));
        let point = x.zip(y).map(|(x, y)| [x, y]);
        let point = point.ok_or_else(|| at("x or y is not a number"))?;
        if let Some(column) = columns.curve {
            let name = words.get(column).copied().unwrap_or_default();
            fresh |= name != current;
            current = name.into();
        }
        match curves.last_mut() {
            Some(curve) if !fresh => curve.push(point),
            _ => curves.push(vec![point]),
        }
        fresh = false;
    }
    Ok(curves)
}

fn split(line: &str) -> Vec<&str> {
    let separator = [',', ';', '\t'].into_iter().find(|c| line.contains(*c));
    match separator {
        Some(separator) => line.split(separator).map(str::trim).collect(),
        None => line.split_whitespace().collect(),
    }
}

fn number_of(words: &[&str], column: usize) -> Option<f64> {
    words.get(column)?.parse().ok()
}

/// The columns of a line of names, if there are x and y.
fn named(words: &[&str]) -> Option<Columns> {
    let names: Vec<String> = words
        .iter()
        .map(|word| word.trim_matches('"').to_lowercase())
        .collect();
    // Units may follow: x_px, x [mm].
    let first = |name: &str| {
        name.split(|c: char| !c.is_alphanumeric())
            .next()
            .map(str::to_owned)
    };
    let names: Vec<String> = names.iter().filter_map(|name| first(name)).collect();
    let place = |name: &str| names.iter().position(|other| other == name);
    let curve = CURVE_NAMES.iter().find_map(|name| place(name));
    let both = place("x").zip(place("y"));
    both.map(|(x, y)| Columns { x, y, curve })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_end_at_blank_lines_and_where_their_name_changes() {
        let two = [vec![[0., 1.], [2., 3.]], vec![[4., 5.]]];
        let read = |text: &str| decode(text.as_bytes());
        assert_eq!(read("0,1\n2,3\n\n\n4,5\n").unwrap(), two);
        assert_eq!(read("# made by\nX;Y\n0;1\n2;3\n\n4;5").unwrap(), two);
        let named = "piece,x,y\na,0,1\na,2,3\nb,4,5\n";
        assert_eq!(read(named).unwrap(), two);
        assert_eq!(read("y\tid\tx\n1\t7\t0\n3\t7\t2\n5\t8\t4").unwrap(), two);
        assert_eq!(read("x_px,y (px)\n0,1\n2,3\n\n4,5").unwrap(), two);
        assert_eq!(read(" 0 1\n 2  3\n\n4 5").unwrap(), two);
        assert!(read("0,1,2\n").unwrap_err().contains("names"));
        assert!(read("a,b\n1,2").unwrap_err().contains("x and y"));
        assert!(read("0,1\n2\n").unwrap_err().contains("line 2"));
    }
}
