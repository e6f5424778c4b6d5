//! The names and the texts of all statements.

use shapespace_verify::experiments::all;
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
