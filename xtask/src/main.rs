//! Development tasks: `cargo xtask NAME`.

mod tidy;

use std::process::ExitCode;

/// The tasks, one file each.
const TASKS: &str = "tasks:
  tidy   check the rules that no compiler checks";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("tidy") => tidy::run(),
        Some(other) => {
            eprintln!("there is no task {other}\n{TASKS}");
            ExitCode::from(2)
        }
        None => {
            eprintln!("{TASKS}");
            ExitCode::from(2)
        }
    }
}
