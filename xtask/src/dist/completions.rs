//! Completions of shells, and manual pages of the program and of every subcommand.

use std::io;

use clap::{Command, CommandFactory};
use clap_complete::{Shell, generate};
use clap_mangen::Man;
use shapespace::args::Cli;

use super::archive::Contents;

const NAME: &str = "shapespace";

/// The shells, with the names under which they look for completions.
const SHELLS: [(Shell, &str); 4] = [
    (Shell::Bash, "shapespace.bash"),
    (Shell::Zsh, "_shapespace"),
    (Shell::Fish, "shapespace.fish"),
    (Shell::PowerShell, "_shapespace.ps1"),
];

/// Adds the completions of all shells.
pub fn add_completions(contents: &mut Contents) {
    for (shell, name) in SHELLS {
        let mut bytes = Vec::new();
        generate(shell, &mut Cli::command(), NAME, &mut bytes);
        contents.add(format!("completions/{name}"), bytes);
    }
}

/// Adds a page for the program, and one for every subcommand.
///
/// # Errors
/// Those of rendering.
pub fn add_manual(contents: &mut Contents) -> io::Result<()> {
    let mut program = Cli::command().disable_help_subcommand(true);
    // Subcommands get their whole names, as in `shapespace average`.
    program.build();
    for (name, page) in pages(&program) {
        let mut bytes = Vec::new();
        Man::new(page).render(&mut bytes)?;
        contents.add(format!("man/man1/{name}.1"), bytes);
    }
    Ok(())
}

/// The names of the pages, and what they are about.
fn pages(program: &Command) -> Vec<(String, Command)> {
    let mut pages = vec![(NAME.to_owned(), program.clone())];
    for command in program.get_subcommands().filter(|c| !c.is_hide_set()) {
        let name = format!("{NAME}-{}", command.get_name());
        let version = program.get_version().unwrap_or_default().to_owned();
        let page = command.clone().name(name.clone()).version(version);
        pages.push((name, page));
    }
    pages
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subcommand_has_a_page() {
        let mut program = Cli::command().disable_help_subcommand(true);
        program.build();
        let names: Vec<String> = pages(&program).into_iter().map(|(name, _)| name).collect();
        assert!(names.contains(&"shapespace".into()) && names.len() > 15);
        assert!(names.contains(&"shapespace-average".into()), "{names:?}");
        let mut page = Vec::new();
        let (_, average) = pages(&program)
            .into_iter()
            .find(|(name, _)| name == "shapespace-average")
            .unwrap();
        Man::new(average).render(&mut page).unwrap();
        let page = String::from_utf8(page).unwrap();
        assert!(
            page.contains("mismatch\\-weight") && page.contains(".TH"),
            "{page}"
        );
        assert!(page.contains("Exit codes: 0 sound"), "{page}");
    }

    #[test]
    fn completions_know_the_subcommands() {
        for (shell, _) in SHELLS {
            let mut bytes = Vec::new();
            generate(shell, &mut Cli::command(), NAME, &mut bytes);
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                text.contains("synthesize") && text.contains("grid"),
                "{shell}"
            );
        }
    }
}
