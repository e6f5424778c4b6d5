//! `cargo xtask kills`: kills every long command at random moments, and compares what the same command gives
//! afterwards with an undisturbed run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use crate::tidy::root;

const HELP: &str = "cargo xtask kills [--moments N] [--program PATH] [CASE...]

Runs small cases of every command that stores checkpoints. Each is killed (SIGKILL) at N random moments (50),
and after each run again to its end; arrays, tables of energies and result.json must be those of an
undisturbed run, but for times and memory. Builds the program in release mode unless PATH names one.";

/// Shapes that the cases use.
const SHAPES: [(&str, &str); 9] = [
    ("a.npy", "cross --grid 33 --angle 10,20"),
    ("b.npy", "cross --grid 33 --angle 15,5"),
    ("c.npy", "cross --grid 33 --angle 25,15"),
    ("straight.png", "bar --grid 65"),
    ("folded.png", "bar --angle 160 --grid 65"),
    ("raised.png", "bar --angle 170 --grid 65"),
    (
        "grey1.npy",
        "disk --radius .2 --grid 33 --contrast .6 --noise .03",
    ),
    (
        "grey2.npy",
        "disk --radius .26 --grid 33 --contrast .6 --noise .03",
    ),
    ("disk.npy", "disk --radius .24 --grid 33"),
];

/// Results that the cases use.
const RESULTS: [&str; 3] = [
    "average a.npy b.npy c.npy --grid 65 -o average",
    "geodesic straight.png folded.png --grid 33 -K 3 -o path",
    "pca average -o modes",
];

/// The cases, without output and checkpoints.
const CASES: [(&str, &str); 18] = [
    (
        "average",
        "average a.npy b.npy c.npy --grid 65 --align none --tolerance 2e-3",
    ),
    (
        "median",
        "average a.npy b.npy c.npy --grid 65 --align none --tolerance 2e-3 --mean median",
    ),
    (
        "weighted",
        "average a.npy b.npy c.npy --grid 65 --align none --weights 0.25,0.75,0",
    ),
    (
        "spilled",
        "average a.npy b.npy c.npy --grid 65 --align none --tolerance 2e-3 --memory 2MiB",
    ),
    (
        "descent",
        "average a.npy b.npy c.npy --grid 65 --align none --tolerance 2e-3 --solver descent",
    ),
    (
        "sweep",
        "average a.npy b.npy --sweep 4 --grid 33 --align none",
    ),
    ("joint", "average --joint grey1.npy grey2.npy --grid 33"),
    (
        "lagrangian",
        "geodesic straight.png folded.png --grid 33 -K 3",
    ),
    (
        "starts",
        "geodesic straight.png folded.png --grid 33 -K 3 --starts 3",
    ),
    (
        "level-sets",
        "geodesic straight.png folded.png --grid 33 -K 2 --form level-sets",
    ),
    ("distances", "distances a.npy b.npy disk.npy --grid 33 -K 2"),
    ("pca", "pca average"),
    ("extend", "extend path --steps 3"),
    ("transport", "transport path raised.png --steps 2"),
    ("metric", "metric a.npy --mode 2 --grid 65"),
    (
        "synthesize",
        "synthesize modes --scores=2,1 --nonlinear --load-steps 4",
    ),
    ("segment", "segment grey1.npy grey2.npy --grid 129"),
    ("verify", "verify laws level --quick"),
];

/// Keys of records with times, memory and what depends on them.
const TIMES: [&str; 3] = ["seconds", "peak_memory_bytes", "record_sha256"];

/// Runs the task.
pub fn run(arguments: &[String]) -> ExitCode {
    let (mut moments, mut program, mut names) = (50, None, Vec::new());
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match (argument.as_str(), argument.starts_with('-')) {
            ("--help", _) => {
                println!("{HELP}");
                return ExitCode::SUCCESS;
            }
            ("--moments", _) => match rest.next().and_then(|text| text.parse().ok()) {
                Some(number) => moments = number,
                None => return refused("--moments needs a number"),
            },
            ("--program", _) => program = rest.next().map(PathBuf::from),
            (option, true) => return refused(&format!("there is no option {option}")),
            (name, false) => names.push(name),
        }
    }
    if let Some(name) = names
        .iter()
        .find(|name| CASES.iter().all(|case| case.0 != **name))
    {
        return refused(&format!("there is no case {name}"));
    }
    match all(&names, moments, program) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(wrong) => {
            eprintln!("{wrong} results differ");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("cannot run the cases: {error}");
            ExitCode::FAILURE
        }
    }
}

fn refused(reason: &str) -> ExitCode {
    eprintln!("{reason}\n{HELP}");
    ExitCode::from(2)
}

/// A folder with the inputs, and the program.
struct Place {
    folder: PathBuf,
    program: PathBuf,
}

fn all(names: &[&str], moments: usize, program: Option<PathBuf>) -> io::Result<usize> {
    let program = match program {
        Some(program) => fs::canonicalize(program)?,
        None => built()?,
    };
    let folder = std::env::temp_dir().join(format!("shapespace-kills-{}", std::process::id()));
    fs::create_dir(&folder)?;
    let place = Place { folder, program };
    for (name, shape) in SHAPES {
        place.succeeded(&format!("generate {shape} -o {name}"))?;
    }
    for result in RESULTS {
        place.succeeded(result)?;
    }
    println!("| case | seconds | killed | resumed | equal | leftovers |");
    println!("|---|---|---|---|---|---|");
    let mut wrong = 0;
    for (number, (name, command)) in CASES.iter().enumerate() {
        if names.is_empty() || names.contains(name) {
            wrong += place.case(name, command, moments, number as u64)?;
        }
    }
    if wrong == 0 {
        fs::remove_dir_all(&place.folder)?;
    } else {
        eprintln!("the results are in {}", place.folder.display());
    }
    Ok(wrong)
}

/// Builds the program.
fn built() -> io::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["build", "--release", "--package", "shapespace", "--locked"])
        .current_dir(root())
        .status()?;
    if !status.success() {
        return Err(io::Error::other("the program does not compile"));
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let target = target.unwrap_or_else(|| root().join("target"));
    Ok(target.join("release/shapespace"))
}

impl Place {
    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(&self.program);
        command
            .args(arguments.split_whitespace())
            .current_dir(&self.folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    }

    /// Runs a command to its end; a doubtful result is one.
    fn succeeded(&self, arguments: &str) -> io::Result<()> {
        match self.command(arguments).status()?.code() {
            Some(0 | 3) => Ok(()),
            code => Err(io::Error::other(format!("{arguments}: {code:?}"))),
        }
    }

    /// Kills a case at random moments; returns how many of the results differ.
    fn case(&self, name: &str, command: &str, moments: usize, seed: u64) -> io::Result<usize> {
        let is_verify = command.starts_with("verify");
        let checkpoints = if is_verify || command.starts_with("distances") {
            ""
        } else {
            "--checkpoint 1e-6"
        };
        let whole = format!("{name}-whole");
        let start = Instant::now();
        self.succeeded(&format!("{command} {checkpoints} -o {whole}"))?;
        let seconds = start.elapsed().as_secs_f64();
        let expected = contents(&self.folder.join(&whole))?;
        let mut random = 0x9e37_79b9_7f4a_7c15 ^ (seed + 1);
        let (mut killed, mut resumed, mut equal, mut leftovers) = (0, 0, 0, 0);
        for moment in 0..moments {
            let output = format!("{name}-{moment}");
            let run = format!("{command} {checkpoints} -o {output}");
            let (path, partial) = (
                self.folder.join(&output),
                self.folder.join(format!("{output}.partial")),
            );
            let mut child = self.command(&run).spawn()?;
            std::thread::sleep(Duration::from_secs_f64(seconds * uniform(&mut random)));
            child.kill()?;
            killed += usize::from(child.wait()?.code().is_none());
            resumed += usize::from(partial.exists());
            if !path.exists() {
                self.succeeded(&run)?;
            }
            if contents(&path)? == expected {
                equal += 1;
                fs::remove_dir_all(&path)?;
            }
            // Killed between the renaming of the result and the end of the removal of its checkpoints.
            if partial.exists() {
                leftovers += 1;
                fs::remove_dir_all(&partial)?;
            }
        }
        println!(
            "| {name} | {seconds:.1} | {killed} | {resumed} | {equal} of {moments} | {leftovers} |"
        );
        Ok(moments - equal)
    }
}

/// A number in `[0, 1)`, by the generator of Marsaglia (2003).
fn uniform(state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 11) as f64 / (1u64 << 53) as f64
}

/// Names and contents of what must not differ: arrays as they are, records and tables without times.
fn contents(folder: &Path) -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut found = Vec::new();
    collect(folder, "", &mut found)?;
    found.sort();
    Ok(found)
}

fn collect(folder: &Path, within: &str, found: &mut Vec<(String, Vec<u8>)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{within}{}", entry.file_name().to_string_lossy());
        let path = entry.path();
        if path.is_dir() {
            collect(&path, &format!("{name}/"), found)?;
            continue;
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("npy") => found.push((name, fs::read(&path)?)),
            Some("json") if name == "result.json" => {
                found.push((name, timeless(&fs::read_to_string(&path)?).into_bytes()));
            }
            Some("csv") if name == "energy.csv" => found.push((name, fs::read(&path)?)),
            _ => {}
        }
    }
    Ok(())
}

/// The lines of a record without those of times, which have a line each, and without the name of the
/// output.
fn timeless(text: &str) -> String {
    let is_time = |line: &&str| {
        let key = line.trim_start().strip_prefix('"');
        let key = key.and_then(|rest| rest.split('"').next());
        !key.is_some_and(|key| TIMES.iter().any(|time| key.contains(time)))
    };
    let lines: Vec<&str> = text.lines().filter(is_time).collect();
    // A comma before a line that is left out.
    lines.join("\n").replace(",\n", "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_left_out_of_records() {
        let one = "{\n  \"a\": 1,\n  \"solver_seconds\": 1.5,\n  \"b\": 2,\n  \"seconds\": 2\n}";
        let other = "{\n  \"a\": 1,\n  \"solver_seconds\": 2.5,\n  \"b\": 2,\n  \"seconds\": 9\n}";
        assert_eq!(timeless(one), timeless(other));
        assert_ne!(
            timeless(one),
            timeless(&one.replace("\"b\": 2", "\"b\": 3"))
        );
    }

    #[test]
    fn moments_differ_and_are_repeatable() {
        let draw = |seed: u64| {
            let mut state = seed;
            [0; 9].map(|_| uniform(&mut state))
        };
        assert_eq!(draw(5), draw(5));
        assert!(draw(5).iter().all(|x| (0.0..1.0).contains(x)));
        assert_ne!(draw(5)[7], draw(5)[8]);
    }
}
