//! Selects statements by name.

use crate::error::UnknownStatement;
use crate::statement::Statement;

/// Number of names that are suggested for an unknown one.
const OFFERED: usize = 4;

/// The statements of the names, in their own order; all if no name is given. A name also selects
/// all statements that begin with it and a hyphen.
///
/// # Errors
/// [`UnknownStatement`] if a name selects none.
pub fn select(all: Vec<Statement>, names: &[String]) -> Result<Vec<Statement>, UnknownStatement> {
    let is_of = |statement: &Statement, name: &str| {
        let rest = statement.name.strip_prefix(name);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    };
    if let Some(name) = names.iter().find(|n| !all.iter().any(|s| is_of(s, n))) {
        return Err(UnknownStatement {
            name: name.clone(),
            near: nearest(&all, name),
        });
    }
    Ok(all
        .into_iter()
        .filter(|s| names.is_empty() || names.iter().any(|name| is_of(s, name)))
        .collect())
}

/// The names nearest to an unknown one.
fn nearest(all: &[Statement], name: &str) -> Vec<&'static str> {
    let mut names: Vec<&str> = all.iter().map(|s| s.name).collect();
    // A part of a name counts as nearest.
    names.sort_by_key(|known| {
        let part = !name.is_empty() && known.contains(name);
        (!part, distance(known, name))
    });
    names.truncate(OFFERED);
    names
}

/// Number of letters to change, insert or delete between two words (Levenshtein).
pub fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let changed = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}
