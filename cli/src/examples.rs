//! Examples of every command, after the options in its help.

/// The command lines of each command, without the program.
const EXAMPLES: [(&str, &[&str]); 19] = [
    (
        "average",
        &[
            "average hands/ --grid 129 -o mean",
            "average 'scans/*.nii.gz' --label 1 --align rigid --grid 65 -o mean",
            "average --joint a.png b.png c.png -o together",
        ],
    ),
    (
        "geodesic",
        &[
            "geodesic start.png end.png -K 8 -o path",
            "geodesic a.nii.gz b.nii.gz --align rigid --grid 65 -o path",
        ],
    ),
    (
        "length",
        &["length first.png second.png third.png -K 2 -o walk"],
    ),
    (
        "metric",
        &[
            "metric shape.png --mode 2 -o metric",
            "metric shape.png larger.png -o metric",
        ],
    ),
    ("extend", &["extend path -K 4 -o beyond"]),
    (
        "transport",
        &["transport path variation.png --steps 4 -o beside"],
    ),
    (
        "distances",
        &[
            "distances 'fish/*.png' 'bone/*.png' --classes folder -o all",
            "distances new.png --against 'known/*.png' --neighbours 3 -o nearest",
        ],
    ),
    (
        "segment",
        &[
            "segment scan.png -o found",
            "segment 'cells/*.tif' --object dark --largest -o found",
        ],
    ),
    (
        "pca",
        &[
            "pca mean -o modes",
            "pca mean --groups patients.csv --column diagnosis -o modes",
            "pca mean --modes 3 --variation displacement -o modes",
        ],
    ),
    ("synthesize", &["synthesize modes --scores 2,0,-1 -o shape"]),
    ("score", &["score new.png other.png --pca modes -o scores"]),
    (
        "compare",
        &[
            "compare modes --groups patients.csv --column diagnosis --covariates age -o groups",
            "compare all --groups folder -o groups",
        ],
    ),
    (
        "warp",
        &[
            "warp mean scan.nii.gz landmarks.csv --shape 0 -o onto",
            "warp path picture.png --time 0.5 -o halfway",
            "warp modes mean/average.stl --scores 2 -o varied",
        ],
    ),
    (
        "figure",
        &[
            "figure weights -o figure",
            "figure related a.png b.png c.png -o related",
        ],
    ),
    ("verify", &["verify --quick -o checked", "verify --list"]),
    ("check", &["check mean"]),
    ("config", &["config average"]),
    ("demo", &["demo -o first"]),
    (
        "generate",
        &[
            "generate bar --angle 118 -o folded.png",
            "generate family hands -o hands",
        ],
    ),
];

/// The exit codes in short, below the examples.
const EXIT_CODES: &str = "\
Exit codes: 0 sound, 1 failed, 2 refused, 3 doubtful, 130 interrupted; see 'shapespace --help'.";

/// The examples of a command as text, and the exit codes.
pub(crate) fn examples(command: &str) -> String {
    let own = EXAMPLES.iter().find(|(name, _)| *name == command);
    let lines = own.map_or(&[][..], |(_, lines)| lines);
    let lines: Vec<String> = lines
        .iter()
        .map(|line| format!("  shapespace {line}"))
        .collect();
    format!("Examples:\n{}\n\n{EXIT_CODES}", lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use crate::args::Cli;
    use clap::{CommandFactory, Parser};

    /// The words of a command line; those in quotes are one.
    fn words(line: &str) -> Vec<String> {
        let parts = line.split('\'').enumerate();
        let words = parts.flat_map(|(i, part)| {
            let is_quoted = i % 2 == 1;
            let whole = is_quoted.then(|| vec![part.to_owned()]);
            whole.unwrap_or_else(|| part.split_whitespace().map(str::to_owned).collect())
        });
        words.collect()
    }

    #[test]
    fn every_command_shows_examples_that_it_accepts() {
        let program = Cli::command();
        for command in program.get_subcommands() {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let help = help.unwrap_or_default();
            let (help, codes) = help.split_once("\n\n").unwrap_or_default();
            assert_eq!(codes, super::EXIT_CODES, "{name}");
            let lines: Vec<&str> = help.lines().skip(1).collect();
            assert!(help.starts_with("Examples:"), "{name}");
            assert!((1..=3).contains(&lines.len()), "{name}");
            for line in lines {
                let words = words(line);
                assert_eq!(words[..2], ["shapespace", name], "{line}");
                let parsed = Cli::try_parse_from(words);
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
        }
    }
}
