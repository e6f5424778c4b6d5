//! The statements, by theme: one file each.

mod averages;
mod balls;
mod calculus;
mod constrained;
mod discretisation;
mod dissipation;
mod existence;
mod fields;
mod finite;
mod forms;
mod interpolation;
mod laws;
mod lengths;
mod level;
mod linear;
mod mechanics;
mod metric;
mod minima;
mod misprints;
mod modes;
mod objects;
mod phases;
mod terms;
mod theorems;
mod tube;

use crate::statement::Statement;

/// All statements.
pub fn all() -> Vec<Statement> {
    [
        balls::STATEMENTS,
        dissipation::STATEMENTS,
        metric::STATEMENTS,
        tube::STATEMENTS,
        level::STATEMENTS,
        terms::STATEMENTS,
        forms::STATEMENTS,
        lengths::STATEMENTS,
        finite::STATEMENTS,
        calculus::STATEMENTS,
        laws::STATEMENTS,
        mechanics::STATEMENTS,
        existence::STATEMENTS,
        constrained::STATEMENTS,
        averages::STATEMENTS,
        minima::STATEMENTS,
        fields::STATEMENTS,
        theorems::STATEMENTS,
        phases::STATEMENTS,
        linear::STATEMENTS,
        objects::STATEMENTS,
        modes::STATEMENTS,
        discretisation::STATEMENTS,
        interpolation::STATEMENTS,
        misprints::STATEMENTS,
    ]
    .concat()
}

/// The powers of two between two numbers.
fn doubling(first: usize, last: usize) -> Vec<usize> {
    std::iter::successors(Some(first), |n| Some(2 * n))
        .take_while(|n| *n <= last)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_theirs_alone_and_spelled_as_files_can_be() {
        let all = all();
        let names: BTreeSet<_> = all.iter().map(|s| s.name).collect();
        assert_eq!(names.len(), all.len());
        for s in &all {
            let spelled = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(s.name.chars().all(spelled), "{}", s.name);
            for text in [s.reference, s.claim, s.broken] {
                assert!(
                    !text.is_empty() && !text.ends_with('.'),
                    "{}: {text}",
                    s.name
                );
            }
        }
    }
}
