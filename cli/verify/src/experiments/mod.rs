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
