//! What names select, and what is offered for an unknown one.

use shapespace_verify::experiments;
use shapespace_verify::select::{distance, select};

#[test]
fn names_and_themes_select() {
    let all = experiments::all();
    let one = select(all.clone(), &["dissipation-balls-2d".to_owned()]).unwrap();
    assert_eq!(one.len(), 1);
    let theme = select(all.clone(), &["dissipation".to_owned()]).unwrap();
    assert!(theme.len() > 2);
    assert_eq!(select(all.clone(), &[]).unwrap().len(), all.len());
    // A part of a word is no theme.
    assert!(select(all, &["dissip".to_owned()]).is_err());
}

#[test]
fn an_unknown_name_is_told_its_neighbours() {
    let error = select(experiments::all(), &["disipation-bals-2d".to_owned()]).unwrap_err();
    assert!(error.near.contains(&"dissipation-balls-2d"), "{error}");
    assert_eq!(distance("kitten", "sitting"), 3);
}
