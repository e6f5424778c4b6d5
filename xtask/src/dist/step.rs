//! Steps of a release, how they ended, and programs that they run.

use std::fmt;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

/// How a step ended.
#[derive(Debug)]
pub enum Step {
    /// As it should, with what was found or written.
    Done(String),
    /// It could not be tried here, for a reason.
    LeftOut(String),
    /// What is wrong.
    Failed(String),
}

/// All steps with their names.
#[derive(Debug, Default)]
pub struct Steps(Vec<(String, Step)>);

impl Steps {
    pub fn add(&mut self, name: &str, step: Step) {
        self.0.push((name.into(), step));
    }

    pub fn has_failed(&self) -> bool {
        let failed = |step: &Step| matches!(step, Step::Failed(_));
        self.0.iter().any(|(_, step)| failed(step))
    }
}

/// The list with a box for each step.
impl fmt::Display for Steps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, step) in &self.0 {
            let (mark, text) = match step {
                Step::Done(text) => ("[x]", text),
                Step::LeftOut(text) => ("[ ]", text),
                Step::Failed(text) => ("[!]", text),
            };
            writeln!(f, "{mark} {name}: {text}")?;
        }
        Ok(())
    }
}

/// How a program ended.
pub enum Ran {
    Well,
    /// What went wrong.
    Badly(String),
    NotInstalled,
}

/// Runs a program, whose output is shown.
pub fn shown(program: &str, arguments: &[&str], folder: &Path) -> Ran {
    println!("\n$ {program} {}", arguments.join(" "));
    let status = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .status();
    match status {
        Ok(status) if status.success() => Ran::Well,
        Ok(status) => Ran::Badly(format!("`{program} {}`: {status}", arguments.join(" "))),
        Err(error) if error.kind() == ErrorKind::NotFound => Ran::NotInstalled,
        Err(error) => Ran::Badly(format!("{program}: {error}")),
    }
}

/// Whether a program is installed, by a command that only prints its version.
pub fn is_installed(program: &str, arguments: &[&str]) -> bool {
    let output = Command::new(program).args(arguments).output();
    output.is_ok_and(|output| output.status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_shows_what_failed() {
        let mut steps = Steps::default();
        steps.add("one", Step::Done("well".into()));
        steps.add("two", Step::LeftOut("no program".into()));
        assert!(!steps.has_failed());
        steps.add("three", Step::Failed("wrong".into()));
        assert!(steps.has_failed());
        let list = steps.to_string();
        assert_eq!(
            list,
            "[x] one: well\n[ ] two: no program\n[!] three: wrong\n"
        );
    }
}
