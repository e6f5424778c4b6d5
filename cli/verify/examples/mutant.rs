//! Checks statements with one error built into the crates.
//!
//! `mutant [--quick] [--broken] [--mutant NAME] [STATEMENT…]` prints a line for every statement, with
//! tabs between: its name, its verdict, its seconds, the numbers of the figures that fail with commas
//! between, and the figure that decided with what was measured. `mutant --figures` prints all figures of
//! all statements, `mutant --list` the errors: name, crate, claiming statement, description.

use fe_grid::mutants::{Mutant, switch};
use shapespace_verify::{Effort, Ingredient, NoJournal, Setting, experiments, run, select};
use std::process::ExitCode;

fn main() -> ExitCode {
    let (mut names, mut figures) = (Vec::new(), false);
    let mut setting = Setting {
        effort: Effort::Full,
        ingredient: Ingredient::Sound,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--list" => {
                list();
                return ExitCode::SUCCESS;
            }
            "--figures" => figures = true,
            "--quick" => setting.effort = Effort::Quick,
            "--broken" => setting.ingredient = Ingredient::Broken,
            "--mutant" => {
                let name = arguments.next().unwrap_or_default();
                let Some(mutant) = Mutant::named(&name) else {
                    eprintln!("there is no error of the name {name}; --list lists them");
                    return ExitCode::from(2);
                };
                switch(Some(mutant));
            }
            _ => names.push(argument),
        }
    }
    let statements = match select(experiments::all(), &names) {
        Ok(statements) => statements,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    // One at a time: an error may end the experiment of another statement, too.
    for statement in statements {
        match run(&[statement], setting, &NoJournal) {
            Ok(record) => {
                for found in &record.statements {
                    let name = found.name;
                    if figures {
                        for figure in &found.figures {
                            println!("{name}\t{}\t{}", figure.observable, figure.measured);
                        }
                        continue;
                    }
                    let numbers = found.figures.iter().enumerate();
                    let failing: Vec<String> = numbers
                        .filter(|(_, figure)| !figure.holds)
                        .map(|(number, _)| number.to_string())
                        .collect();
                    println!(
                        "{name}\t{}\t{:.2}\t{}\t{}\t{}",
                        found.decided.word(),
                        found.seconds,
                        failing.join(","),
                        found.observable,
                        found.measured
                    );
                }
            }
            Err(error) => println!("{}\tfailed\t0\t\t{error}\t", statement.name),
        }
    }
    ExitCode::SUCCESS
}

fn list() {
    for mutant in Mutant::ALL {
        println!(
            "{}\t{}\t{}\t{}",
            mutant.name(),
            mutant.in_crate(),
            mutant.claimed_by(),
            mutant.error()
        );
    }
}
