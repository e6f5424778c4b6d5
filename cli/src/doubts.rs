//! Doubts in `result.json`, on the terminal and in the report.

use std::collections::{BTreeMap, HashMap, HashSet};

use levelset::verdict::worst;
use levelset::{Cause, Doubt, Limit};
use serde::{Deserialize, Serialize};

use crate::numbers::plural;

/// Doubts of one cause that are listed on the terminal and in the report.
const LISTED: usize = 6;

/// A doubt with the name of its shape and a remedy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DoubtRecord {
    /// As in tables and pictures; missing where the doubt is about the result as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shape: Option<String>,
    /// The component of the shape, such as `label 3`; missing where the doubt is about all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    component: Option<String>,
    what: Cause,
    /// Missing if it is not a finite number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    figure: Option<f64>,
    limit: f64,
    remedy: String,
}

/// What is left out of the remedies of shapes that are aligned, or cannot be.
const ALIGNMENT: &str = "--align rigid, ";

/// What is left out of the remedies of paths of level sets.
const LEVEL_SETS: [&str; 2] = [", or --form level-sets", " or --form level-sets"];

/// What is left out of the remedies of commands that compare no minima.
const STARTS: &str = ", or --starts 4 to compare other minima";

/// Commands that minimise.
const MINIMISING: &[&str] = &[
    "average",
    "geodesic",
    "length",
    "metric",
    "extend",
    "transport",
    "distances",
    "segment",
    "pca",
    "figure",
];
/// Commands that place shapes in a box.
const PLACING: &[&str] = &[
    "average",
    "geodesic",
    "length",
    "metric",
    "distances",
    "figure",
];

/// The options that remedies name, with the commands that have them.
pub(crate) const OPTIONS: [(&str, &[&str]); 18] = [
    (
        "--align",
        &[
            "average",
            "geodesic",
            "length",
            "metric",
            "distances",
            "score",
            "figure",
        ],
    ),
    ("--at-rest", &["pca"]),
    ("--box", PLACING),
    ("--classes", &["segment", "distances"]),
    ("--contrast", &["average", "segment"]),
    ("--detours", &["distances"]),
    ("--domain", &["geodesic", "length", "distances"]),
    ("--form", &["geodesic", "length", "distances"]),
    (
        "--grid",
        &[
            "average",
            "geodesic",
            "length",
            "metric",
            "distances",
            "segment",
            "figure",
        ],
    ),
    (
        "--invert",
        &[
            "average",
            "geodesic",
            "length",
            "metric",
            "transport",
            "distances",
            "score",
            "figure",
        ],
    ),
    ("--max-iterations", MINIMISING),
    (
        "--mismatch-weight",
        &["average", "geodesic", "length", "distances"],
    ),
    ("--object", &["segment"]),
    ("--starts", &["average", "geodesic"]),
    ("--threshold", &["segment"]),
    ("--tolerance", MINIMISING),
    ("--void-stiffness", PLACING),
    ("--weights", &["average"]),
];

/// Commands that read the result of another one, or compute the same as it.
const RELATED: [(&str, &str, bool); 9] = [
    ("pca", "average", true),
    ("score", "average", true),
    ("synthesize", "average", true),
    ("compare", "average", true),
    ("warp", "average", true),
    ("extend", "geodesic", true),
    ("transport", "geodesic", true),
    ("distances", "geodesic", false),
    ("length", "geodesic", false),
];

/// The options in a text, but for those of commands in backticks.
pub(crate) fn options_in(text: &str) -> Vec<&str> {
    let outside = text.split('`').step_by(2);
    let words = outside.flat_map(|part| part.split(|c: char| c != '-' && !c.is_ascii_lowercase()));
    words.filter(|word| word.starts_with("--")).collect()
}

impl DoubtRecord {
    /// The doubt about a shape of scores, which smaller ones do not have.
    pub fn of_scores(mut self) -> Self {
        if matches!(
            self.what,
            Cause::Determinant | Cause::Topology | Cause::OutsideBox
        ) {
            self.remedy =
                "use smaller scores: so far from the average the modes describe no shape".into();
        }
        self
    }

    /// The doubt about a result of this command: the remedy says which options are those of another one.
    pub fn of_command(mut self, command: &str) -> Self {
        // Those that name the command say it themselves.
        if self.remedy.contains(&format!("`{command}")) {
            return self;
        }
        let related = RELATED.iter().find(|(name, ..)| *name == command);
        let mut others: BTreeMap<&[&str], Vec<&str>> = BTreeMap::new();
        for option in options_in(&self.remedy) {
            let known = OPTIONS.iter().find(|(name, _)| *name == option);
            let Some((name, commands)) = known.filter(|(_, all)| !all.contains(&command)) else {
                continue;
            };
            let related = related.filter(|(_, other, _)| commands.contains(other));
            let other = match (related, commands) {
                (Some((_, other, _)), _) => std::slice::from_ref(other),
                (None, [_, _]) => commands,
                (None, _) => &commands[..1.min(commands.len())],
            };
            others.entry(other).or_default().push(name);
        }
        for (other, options) in others {
            let plural = if options.len() > 1 {
                "are options"
            } else {
                "is an option"
            };
            let reads = related.is_some_and(|(_, name, reads)| *other == [*name] && *reads);
            let source = if reads {
                ", whose result is read here"
            } else {
                ""
            };
            let names = options.join(" and ");
            let other = other.join("` and `");
            let note = format!("; {names} {plural} of `{other}`{source}");
            self.remedy += &note;
        }
        self
    }

    /// The doubt about a path of level sets, of which these are no remedy.
    pub fn of_level_sets(mut self) -> Self {
        for other in LEVEL_SETS {
            self.remedy = self.remedy.replace(other, "");
        }
        self
    }

    /// The doubt where no other minima are looked for.
    pub fn of_one_start(mut self) -> Self {
        self.remedy = self.remedy.replace(STARTS, "");
        self
    }

    /// The doubt where an alignment is no remedy.
    pub fn of_aligned(mut self) -> Self {
        self.remedy = self.remedy.replace(ALIGNMENT, "");
        self
    }
}

/// Doubts about shapes of these names: the worst of every cause and shape, by cause.
pub(crate) fn named<'a>(
    doubts: &[Doubt],
    names: impl IntoIterator<Item = &'a str>,
) -> Vec<DoubtRecord> {
    named_by_label(doubts, names, &[])
}

/// The same of shapes whose components have these labels.
pub(crate) fn named_by_label<'a>(
    doubts: &[Doubt],
    names: impl IntoIterator<Item = &'a str>,
    labels: &[i64],
) -> Vec<DoubtRecord> {
    let component = |doubt: &Doubt| Some(format!("label {}", labels.get(doubt.component?)?));
    let names: Vec<&str> = names.into_iter().collect();
    let record = |doubt: Doubt| DoubtRecord {
        shape: doubt
            .shape
            .and_then(|shape| Some((*names.get(shape)?).into())),
        component: component(&doubt),
        what: doubt.cause,
        figure: Some(doubt.figure).filter(|figure| figure.is_finite()),
        limit: doubt.limit,
        remedy: doubt.cause.criterion().remedy.into(),
    };
    worst(doubts.iter().copied())
        .into_iter()
        .map(record)
        .collect()
}

/// The doubts about inputs whose files equal earlier ones, by their checksums, as far as these are known.
pub(crate) fn of_repeated<'a>(sums: impl IntoIterator<Item = Option<&'a str>>) -> Vec<Doubt> {
    let mut known: HashMap<&str, usize> = HashMap::new();
    let mut doubts = Vec::new();
    for (shape, sum) in sums.into_iter().enumerate() {
        let Some(sum) = sum else { continue };
        let earlier = known.entry(sum).or_default();
        let doubt = Doubt::check(Cause::Repeated, *earlier as f64);
        doubts.extend(doubt.map(|doubt| doubt.about(shape)));
        *earlier += 1;
    }
    doubts
}

/// The doubt about a result that is computed from one with these doubts.
pub(crate) fn of_source(doubts: &[DoubtRecord]) -> Option<Doubt> {
    Doubt::check(Cause::Source, doubts.len() as f64)
}

/// The doubts of one cause in words.
pub(crate) struct Grouped {
    pub sentences: Vec<String>,
    pub remedy: String,
}

/// The doubts in words, by cause; of every cause the first. Those of a file that is given twice are said once.
pub(crate) fn grouped(doubts: &[DoubtRecord]) -> Vec<Grouped> {
    let groups = doubts.chunk_by(|a, b| a.what == b.what).map(|same| {
        // Cohorts have many doubts.
        let (mut sentences, mut said) = (Vec::new(), HashSet::new());
        for doubt in same {
            let text = sentence(doubt);
            if said.insert(text.clone()) || doubt.shape.is_none() {
                sentences.push(text);
            }
        }
        let all = sentences.len();
        sentences.truncate(LISTED);
        if all > LISTED {
            sentences.push(and_others(all - LISTED));
        }
        Grouped {
            sentences,
            remedy: same[0].remedy.clone(),
        }
    });
    groups.collect()
}

/// The doubts in words, with the remedy after all of one cause.
pub(crate) fn in_words(doubts: &[DoubtRecord]) -> Vec<String> {
    let mut lines = Vec::new();
    for same in grouped(doubts) {
        lines.extend(same.sentences);
        lines.push(format!("remedy: {}", same.remedy));
    }
    lines
}

fn sentence(doubt: &DoubtRecord) -> String {
    let criterion = doubt.what.criterion();
    let about: Vec<&str> = [&doubt.shape, &doubt.component]
        .into_iter()
        .filter_map(|name| name.as_deref())
        .collect();
    let about = match about.len() {
        0 => String::new(),
        _ => format!("{}: ", about.join(", ")),
    };
    let bound = match criterion.limit {
        Limit::AtLeast(_) => "at least",
        Limit::AtMost(_) => "at most",
    };
    let figure = doubt.figure.map(|figure| beside(figure, doubt.limit));
    let figure = figure.unwrap_or_else(|| "unknown".into());
    let (what, limit) = (criterion.figure, number(doubt.limit));
    format!("{about}{what}: {figure}, sound is {bound} {limit}")
}

/// What is left out of a list on the terminal.
pub(crate) fn and_others(count: usize) -> String {
    format!("and {count} other{}, see result.json", plural(count))
}

/// A number with as many digits as tell it from its limit.
fn beside(value: f64, limit: f64) -> String {
    let text = number(value);
    if text != number(limit) {
        return text;
    }
    let longer = (3..16).map(|digits| format!("{value:.digits$}"));
    let mut longer = longer.filter(|text| text.parse() != Ok(limit));
    longer.next().unwrap_or(text)
}

/// A number with three significant digits.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e6 {
        format!("{value:.0}")
    } else if (0.01..1e6).contains(&value.abs()) {
        format!("{value:.3}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubts_of_one_cause_have_one_remedy() {
        let overlap = |shape, dice| {
            let doubt = Doubt::check(Cause::Overlap, dice).unwrap();
            doubt.about(shape)
        };
        let whole = Doubt::check(Cause::NotConverged, 2.0).unwrap();
        let doubts = named(&[whole, overlap(0, 0.9), overlap(1, 0.5)], ["a", "b"]);
        let text = in_words(&doubts);
        assert_eq!(text.len(), 5, "{text:?}");
        assert!(
            text[0].ends_with("converged: 2, sound is at most 0"),
            "{}",
            text[0]
        );
        assert!(text[2].starts_with("a: Dice"), "{}", text[2]);
        assert!(
            text[3].ends_with("average: 0.500, sound is at least 0.960"),
            "{}",
            text[3]
        );
        assert!(text[4].starts_with("remedy: use"), "{}", text[4]);
        let twice = named(&[overlap(0, 0.9), overlap(1, 0.9)], ["a", "a"]);
        assert_eq!(in_words(&twice).len(), 2);
    }

    #[test]
    fn a_figure_is_told_from_its_limit() {
        let doubt = Doubt::check(Cause::PathBoundary, 0.500_31).unwrap();
        let text = in_words(&named(&[doubt], []));
        assert!(
            text[0].ends_with(": 0.5003, sound is at most 0.500"),
            "{}",
            text[0]
        );
        let doubt = Doubt::check(Cause::Determinant, 0.00199).unwrap();
        let text = in_words(&named(&[doubt], []));
        assert!(
            text[0].ends_with(": 0.00199, sound is at least 2.0e-3"),
            "{}",
            text[0]
        );
    }

    #[test]
    fn shapes_that_are_aligned_are_not_to_be_aligned() {
        let causes = [Cause::Overlap, Cause::Determinant, Cause::PathEnd];
        let doubts = causes.map(|cause| Doubt::check(cause, f64::NAN).unwrap());
        for doubt in named(&doubts, []) {
            assert!(doubt.remedy.contains("--align rigid"), "{}", doubt.remedy);
            let remedy = doubt.of_aligned().remedy;
            assert!(!remedy.contains("align"), "{remedy}");
            assert!(remedy.starts_with("use a "), "{remedy}");
        }
    }

    #[test]
    fn level_sets_are_no_remedy_of_themselves() {
        for cause in [Cause::PathEnd, Cause::PathBoundary, Cause::HiddenPart] {
            let doubt = Doubt::check(cause, f64::NAN).unwrap();
            let doubt = named(&[doubt], []).pop().unwrap();
            assert!(doubt.remedy.contains("level-sets"), "{}", doubt.remedy);
            let remedy = doubt.of_level_sets().remedy;
            assert!(!remedy.contains("level-sets"), "{remedy}");
            assert!(
                !remedy.trim().is_empty() && !remedy.ends_with(','),
                "{remedy}"
            );
        }
    }

    #[test]
    fn options_of_other_commands_are_named() {
        let remedy = |cause: Cause, command: &str| {
            let doubt = Doubt::check(cause, f64::NAN).unwrap();
            named(&[doubt], [])
                .pop()
                .unwrap()
                .of_command(command)
                .remedy
        };
        let text = remedy(Cause::Overlap, "score");
        let note =
            "; --grid and --mismatch-weight are options of `average`, whose result is read here";
        assert!(text.ends_with(note), "{text}");
        let text = remedy(Cause::NeedlessContacts, "distances");
        assert!(
            text.ends_with("; --starts is an option of `geodesic`"),
            "{text}"
        );
        let text = remedy(Cause::StressBalance, "pca");
        assert!(text.ends_with("`pca --variation displacement`"), "{text}");
        assert!(!remedy(Cause::Overlap, "average").contains(';'));
        let doubt = Doubt::check(Cause::Turned, 0.0).unwrap();
        let doubt = named(&[doubt], []).pop().unwrap();
        assert!(doubt.remedy.contains("--starts 4"), "{}", doubt.remedy);
        assert_eq!(
            doubt.of_one_start().remedy,
            "use --align rigid if positions do not matter"
        );
    }

    #[test]
    fn repeated_inputs_are_named() {
        let sums = [Some("a"), None, Some("b"), Some("a"), None, Some("a")];
        let found = of_repeated(sums)
            .into_iter()
            .map(|doubt| (doubt.shape, doubt.figure));
        let found: Vec<_> = found.collect();
        assert_eq!(found, [(Some(3), 1.0), (Some(5), 2.0)]);
    }

    #[test]
    fn one_other_is_not_several() {
        assert_eq!(and_others(1), "and 1 other, see result.json");
        assert_eq!(and_others(2), "and 2 others, see result.json");
    }

    #[test]
    fn doubts_about_components_name_the_label() {
        let doubt = Doubt::check(Cause::Overlap, 0.5).unwrap().about(1);
        let doubts = [doubt.within(1), doubt];
        let text = in_words(&named_by_label(&doubts, ["a", "b"], &[3, 17]));
        assert!(text[0].starts_with("b: Dice"), "{}", text[0]);
        assert!(text[1].starts_with("b, label 17: Dice"), "{}", text[1]);
    }

    #[test]
    fn long_lists_are_cut_and_unknown_figures_are_named() {
        let doubt = Doubt::check(Cause::Overlap, f64::NAN).unwrap();
        let doubts: Vec<Doubt> = (0..LISTED + 3).map(|shape| doubt.about(shape)).collect();
        let doubts = named(&doubts, []);
        assert_eq!(doubts[0].figure, None);
        let text = in_words(&doubts);
        assert_eq!(text.len(), LISTED + 2);
        assert!(text[0].contains("unknown"), "{}", text[0]);
        assert_eq!(text[LISTED], "and 3 others, see result.json");
    }

    #[test]
    fn small_and_large_numbers_are_readable() {
        let found = [0.0, 3.0, 0.9612, 0.001, -0.25, 2.5e7].map(number);
        assert_eq!(found, ["0", "3", "0.961", "1.0e-3", "-0.250", "2.5e7"]);
    }
}
