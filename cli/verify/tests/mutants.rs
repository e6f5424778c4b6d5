//! Every error that is built into the crates is found by the statement that claims to find it.

use fe_grid::mutants::{Mutant, switch};
use shapespace_verify::{Effort, Ingredient, NoJournal, Setting, Statement, experiments, run};

const QUICK: Setting = Setting {
    effort: Effort::Quick,
    ingredient: Ingredient::Sound,
};

/// Whether a statement is confirmed.
fn holds(statement: Statement) -> bool {
    // An experiment that cannot be made has found the error as well.
    run(&[statement], QUICK, &NoJournal).is_ok_and(|record| record.confirmed == 1)
}

/// One test for all: the errors are switched on in the whole process. That all statements hold without
/// an error is a test of `shapespace verify`.
#[test]
fn errors_are_found_by_the_statements_that_claim_to() {
    let all = experiments::all();
    let named = |name: &str| all.iter().copied().find(|s| s.name == name);
    let missed: Vec<&str> = Mutant::ALL
        .iter()
        .filter(|mutant| {
            switch(Some(**mutant));
            let name = mutant.claimed_by();
            holds(named(name).unwrap_or_else(|| panic!("there is no statement {name}")))
        })
        .map(|mutant| mutant.name())
        .collect();
    switch(None);
    assert!(missed.is_empty(), "not found: {}", missed.join(", "));
}
