//! Cycles of files that import each other.
//!
//! A file imports another if it names an item that the other defines, in a `use` or in a path of
//! its code; tests are ignored. Re-exports are followed to the file of the item, and are no imports
//! themselves. Files that can all reach each other by imports form a cycle, which is a finding,
//! except for cycles inside one small module:
//!
//! - all its files are the file of one module and those of its direct submodules, where the root of
//!   a crate, whose submodules are the parts of the crate, is no such module;
//! - without the file of the module itself, which knows its submodules and has what they share, no
//!   more than [`SMALL`] of them form a cycle.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use super::Finding;
use super::modules::{ModulePath, Tree};

/// Maximal number of files in a cycle inside a small module.
const SMALL: usize = 5;
/// Root files of crates.
const ROOTS: [&str; 2] = ["src/lib.rs", "src/main.rs"];
/// Maximal number of names that a finding lists for an import.
const SHOWN: usize = 4;

/// Modules that name items of other modules, and these items.
type Imports = BTreeMap<ModulePath, BTreeMap<ModulePath, BTreeSet<String>>>;

/// Checks the crate in a folder; `read` returns the text of a file, or `None` if there is no such
/// file.
pub fn check(folder: &Path, read: &dyn Fn(&Path) -> Option<String>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for root in ROOTS {
        let tree = Tree::read(&folder.join(root), read);
        let imports: Imports = tree
            .0
            .keys()
            .map(|module| (module.clone(), tree.named_by(module)))
            .collect();
        let modules: BTreeSet<_> = tree.0.keys().collect();
        for cycle in cycles(&imports, &modules) {
            if !is_small_module(&imports, &cycle) {
                findings.push(Finding {
                    path: tree.0[cycle[0]].file.clone(),
                    line: None,
                    message: message(&tree, &imports, &cycle),
                });
            }
        }
    }
    findings
}

/// The cycles among some modules.
fn cycles<'a>(imports: &Imports, among: &BTreeSet<&'a ModulePath>) -> Vec<Vec<&'a ModulePath>> {
    let reached: BTreeMap<_, _> = among
        .iter()
        .map(|&module| (module, reachable(imports, among, module)))
        .collect();
    let mut found = Vec::new();
    let mut done = BTreeSet::new();
    for &module in among {
        let cycle: Vec<_> = reached[module]
            .iter()
            .copied()
            .filter(|other| reached[other].contains(module))
            .collect();
        if !cycle.is_empty() && done.insert(cycle.clone()) {
            found.push(cycle);
        }
    }
    found
}

/// The modules that one module reaches by one or more imports.
fn reachable<'a>(
    imports: &Imports,
    among: &BTreeSet<&'a ModulePath>,
    from: &ModulePath,
) -> BTreeSet<&'a ModulePath> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        let named = imports[module].keys().filter_map(|next| among.get(next));
        for &next in named {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    reached
}

/// Whether a cycle stays inside one small module.
fn is_small_module(imports: &Imports, cycle: &[&ModulePath]) -> bool {
    // The shortest path is that of the module itself, or of a submodule.
    let Some(shortest) = cycle.iter().min_by_key(|path| path.len()) else {
        return true;
    };
    let itself = cycle.iter().any(|path| path.len() > shortest.len());
    let module = if itself {
        shortest.as_slice()
    } else {
        &shortest[..shortest.len().saturating_sub(1)]
    };
    let direct = |path: &ModulePath| path.split_last().is_some_and(|(_, above)| above == module);
    let inside = |path: &ModulePath| path.as_slice() == module || direct(path);
    let submodules: BTreeSet<_> = cycle.iter().copied().filter(|p| direct(p)).collect();
    !module.is_empty()
        && cycle.iter().all(|path| inside(path))
        && cycles(imports, &submodules)
            .iter()
            .all(|c| c.len() <= SMALL)
}

/// The imports of a cycle, file by file.
fn message(tree: &Tree, imports: &Imports, cycle: &[&ModulePath]) -> String {
    let mut text = format!("{} files import each other in a circle", cycle.len());
    for &from in cycle {
        for (to, names) in imports[from].iter().filter(|(to, _)| cycle.contains(to)) {
            let mut shown: Vec<&str> = names.iter().map(String::as_str).take(SHOWN).collect();
            if names.len() > SHOWN {
                shown.push("...");
            }
            // Writing into a string cannot fail.
            let _ = write!(
                text,
                "\n  {} -> {}: {}",
                tree.0[from].file.display(),
                tree.0[to].file.display(),
                shown.join(", ")
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The findings for a crate of some files.
    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let read = |path: &Path| {
            let name = path.strip_prefix("a/src").ok()?.to_str()?;
            let file = files.iter().find(|(file, _)| *file == name)?;
            Some(file.1.to_owned())
        };
        let findings = check(Path::new("a"), &read);
        findings.into_iter().map(|f| f.message).collect()
    }

    /// A crate of a module `m` and submodules with these imports.
    fn with_module(own: &str, submodules: &[&str]) -> Vec<String> {
        let names = ["s0", "s1", "s2", "s3", "s4", "s5", "s6"];
        let declared = names[..submodules.len()].join("; mod ");
        let own = format!("mod {declared};\n{own}");
        let paths: Vec<String> = names.iter().map(|name| format!("m/{name}.rs")).collect();
        let mut files = vec![("lib.rs", "mod m;"), ("m/mod.rs", own.as_str())];
        files.extend(
            paths
                .iter()
                .map(String::as_str)
                .zip(submodules.iter().copied()),
        );
        found(&files)
    }

    #[test]
    fn a_cycle_of_two_files_is_told_file_by_file() {
        let found = found(&[
            ("lib.rs", "mod a;\nmod b;\npub use a::A;"),
            ("a.rs", "use crate::b::{B, C as D};\npub struct A(B, D);"),
            (
                "b.rs",
                "pub struct B; pub struct C;\nfn f() -> usize { crate::a::A::size() }",
            ),
        ]);
        assert_eq!(
            found,
            ["2 files import each other in a circle\n  \
              a/src/a.rs -> a/src/b.rs: B, C\n  a/src/b.rs -> a/src/a.rs: size"]
        );
    }

    #[test]
    fn imports_through_the_root_lead_to_the_file_of_the_item() {
        let root = "mod a;\nmod b;\npub use a::A;\npub use b::B;";
        let b = ("b.rs", "pub struct B;");
        let a = ("a.rs", "use crate::B;\npub struct A(B);");
        assert!(found(&[("lib.rs", root), a, b]).is_empty());
        let b = ("b.rs", "use crate::{A};\npub struct B(A);");
        assert_eq!(found(&[("lib.rs", root), a, b]).len(), 1);
        // The same through globs.
        let root = "mod a;\nmod b;\npub use a::*;\npub use b::*;";
        assert_eq!(found(&[("lib.rs", root), a, b]).len(), 1);
    }

    #[test]
    fn a_chain_is_no_cycle() {
        let found = found(&[
            ("lib.rs", "pub mod a;\nmod b;\nmod c;"),
            (
                "a.rs",
                "use crate::b::B;\nuse crate::c::C;\nfn a() -> (B, C) {}",
            ),
            ("b.rs", "use super::c::C;\npub struct B(C);"),
            ("c.rs", "use std::fmt;\nuse a::b;\npub struct C;"),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn tests_comments_and_strings_import_nothing() {
        let found = found(&[
            ("lib.rs", "mod a;\nmod b;"),
            ("a.rs", "use crate::b::B;\npub struct A(B);"),
            (
                "b.rs",
                "//! See [`crate::a::A`].\npub struct B;\nconst S: &str = \"crate::a::A\";\n\
                 #[cfg(test)]\nmod tests { use crate::a::A; }",
            ),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_module_and_its_submodules_may_know_each_other() {
        // A re-export is not an import; a use in the code is.
        let shares = "use super::Shared;\npub struct X(Shared);";
        let own = "pub use s0::X;\npub struct Shared;\nfn f(x: X) {}";
        assert!(with_module(own, &[shares; 7]).is_empty());
        // But not with a file outside the module.
        let found = found(&[
            ("lib.rs", "mod m;\nmod n;"),
            ("m/mod.rs", "mod s;\nuse s::S;\npub struct M(S);"),
            ("m/s.rs", "use crate::n::N;\npub struct S(N);"),
            ("n.rs", "use crate::m::M;\npub struct N(M);"),
        ]);
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("3 files"), "{found:?}");
    }

    #[test]
    fn a_module_is_small_up_to_five_files_in_a_cycle() {
        let ring = |n: usize| {
            let files: Vec<String> = (0..n)
                .map(|k| format!("use super::s{0}::X{0};\npub struct X{k};", (k + 1) % n))
                .collect();
            with_module("", &files.iter().map(String::as_str).collect::<Vec<_>>())
        };
        assert!(ring(SMALL).is_empty());
        assert!(ring(SMALL + 1)[0].starts_with("6 files"));
    }

    #[test]
    fn a_cycle_across_folders_is_found() {
        let found = found(&[
            ("lib.rs", "mod m;"),
            ("m/mod.rs", "mod deep;\npub fn f() { deep::g() }"),
            ("m/deep/mod.rs", "mod low;\npub fn g() { low::h() }"),
            ("m/deep/low.rs", "use crate::m::f;\npub fn h() { f() }"),
        ]);
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("3 files"), "{found:?}");
    }
}
