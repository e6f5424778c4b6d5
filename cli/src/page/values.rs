//! Values of a record by their places in it.

use serde_json::Value;
use shapespace_report::table::Cell;

/// The values at a place such as `/energy/total` or `/dice/*`; a star stands for all items of a
/// list. Missing ones of these are `None`.
pub(super) fn at<'a>(record: &'a Value, place: &str) -> Vec<Option<&'a Value>> {
    let mut found = vec![Some(record)];
    for key in place.split('/').skip(1) {
        found = if key == "*" {
            found.into_iter().flat_map(items).collect()
        } else {
            let inner = found.into_iter().map(|value| value?.get(key));
            inner.collect()
        };
    }
    found
}

fn items(value: Option<&Value>) -> Vec<Option<&Value>> {
    match value {
        Some(Value::Array(items)) => items.iter().map(Some).collect(),
        _ => Vec::new(),
    }
}

/// The only value at a place.
pub(super) fn one<'a>(record: &'a Value, place: &str) -> Option<&'a Value> {
    at(record, place).into_iter().next()?
}

/// The text at a place; empty where there is none.
pub(super) fn text<'a>(record: &'a Value, place: &str) -> &'a str {
    one(record, place)
        .and_then(Value::as_str)
        .unwrap_or_default()
}

/// The points at a place, in the plane.
pub(super) fn points(record: &Value, place: &str) -> Vec<[f64; 2]> {
    let point = |value: Option<&Value>| {
        let value = value?;
        Some([value.get(0)?.as_f64()?, value.get(1)?.as_f64()?])
    };
    at(record, place).into_iter().filter_map(point).collect()
}

/// A number, a text, yes and no, or a list of these, for a table.
pub(super) fn cell(value: &Value) -> Option<Cell> {
    match value {
        Value::Number(number) => number.as_f64().map(Cell::Number),
        Value::String(text) => Some(text.as_str().into()),
        Value::Bool(met) => Some(if *met { "yes" } else { "no" }.into()),
        Value::Array(items) => {
            let items = items.iter().map(|item| Some(cell(item)?.short()));
            let items: Option<Vec<String>> = items.collect();
            Some(items?.join(", ").into())
        }
        _ => None,
    }
}

/// Lengths along axes, such as `33 x 33`.
pub(super) fn sides(value: Option<&Value>) -> String {
    let sides = value.and_then(Value::as_array).into_iter().flatten();
    let sides: Vec<String> = sides.map(Value::to_string).collect();
    sides.join(" x ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn stars_stand_for_all_items() {
        let record = json!({"a": {"b": 1}, "l": [{"x": 1}, {}, {"x": [3, 4]}]});
        assert_eq!(one(&record, "/a/b"), Some(&json!(1)));
        assert_eq!(one(&record, "/a/c"), None);
        let found = at(&record, "/l/*/x");
        assert_eq!(found, [Some(&json!(1)), None, Some(&json!([3, 4]))]);
        assert!(at(&record, "/none/*").is_empty());
        assert_eq!(sides(found[2]), "3 x 4");
        let plane = json!({"p": [[1, 2.5], [1], [3, 4]]});
        assert_eq!(points(&plane, "/p/*"), [[1.0, 2.5], [3.0, 4.0]]);
    }
}
