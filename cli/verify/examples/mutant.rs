//! Checks statements with one error built into the crates.
//!
//! `mutant [--quick] [--mutant NAME] [STATEMENT…]` prints a line for every statement: its name, its
//! verdict, its seconds and the figure that decided, with tabs between. `mutant --list` prints the
//! errors: name, crate, claiming statement, description.

use fe_grid::mutants::{Mutant, switch};
use shapespace_verify::{Effort, Ingredient, Setting, experiments, run, select};
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut names = Vec::new();
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
        match run(&[statement], setting, &|_| ()) {
            Ok(record) => {
                for found in &record.statements {
                    let figure = format!("{}\t{}", found.observable, found.measured);
                    let (name, word) = (&found.name, found.decided.word());
                    println!("{name}\t{word}\t{:.2}\t{figure}", found.seconds);
                }
            }
            Err(error) => println!("{}\tfailed\t0\t{error}\t", statement.name),
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
