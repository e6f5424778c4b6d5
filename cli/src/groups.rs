//! The groups of the shapes of a result, and their covariates: a table, or the folders or names of files.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Serialize;
use shape_pca::groups::{GroupError, Groups, is_constant};
use shapespace_input::files::read_text;

use crate::distances::{Classes, NAMED, class_column, is_hint, table_reader};
use crate::error::CliError;
use crate::numbers::plural;
use crate::shapes::FileIndex;

/// The groups and covariates of shapes.
#[derive(Clone, Debug)]
pub(crate) struct Labelled {
    /// In the order of their first shapes in the table.
    pub names: Vec<String>,
    pub groups: Groups,
    pub covariates: Vec<Covariate>,
    /// Columns that are no covariates.
    pub left_out: Vec<LeftOut>,
    /// Lines of other shapes.
    pub ignored: usize,
}

impl Labelled {
    /// The name of a shape's group.
    pub fn name_of(&self, shape: usize) -> &str {
        &self.names[self.groups.labels()[shape]]
    }

    /// What `result.json` says of the groups, with their mean scores by their numbers, where they are known.
    pub fn record<'a>(
        &'a self,
        mean_scores: impl Fn(usize) -> Option<&'a [f64]>,
    ) -> GroupsRecord<'a> {
        let sizes = self.groups.sizes().iter().enumerate();
        let shapes = 0..self.groups.labels().len();
        GroupsRecord {
            groups: sizes
                .map(|(group, &n_shapes)| GroupRecord {
                    name: &self.names[group],
                    n_shapes,
                    mean_scores: mean_scores(group),
                })
                .collect(),
            group_of_shape: shapes.map(|shape| self.name_of(shape)).collect(),
            ignored_lines: self.ignored,
        }
    }
}

/// The groups of shapes in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct GroupsRecord<'a> {
    pub groups: Vec<GroupRecord<'a>>,
    /// The name of every shape's group.
    group_of_shape: Vec<&'a str>,
    /// Lines of the table of other shapes.
    ignored_lines: usize,
}

/// A group in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct GroupRecord<'a> {
    pub name: &'a str,
    pub n_shapes: usize,
    /// Its mean scores.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_scores: Option<&'a [f64]>,
}

/// A number for every shape.
#[derive(Clone, Debug)]
pub(crate) struct Covariate {
    pub name: String,
    pub values: Vec<f64>,
}

/// A line of the table.
#[derive(Clone, Debug)]
struct Line {
    /// Its number.
    at: u64,
    cells: Vec<String>,
}

/// Why a constant column is no covariate.
const EQUAL: &str = "all its values are equal, or nearly so";
/// How the reason ends where a number has a comma.
const COMMA: &str = "has a comma: write decimal points, and no separators of thousands";

/// Numbers of covariates are below this, so that their squares are numbers, too.
const MOST: f64 = 1e100;

/// A column that is no covariate.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LeftOut {
    pub name: String,
    pub reason: String,
}

/// What is asked for.
pub(crate) struct Wanted<'a> {
    /// The table, or one of [`NAMED`].
    pub groups: &'a Path,
    /// The column of the groups; otherwise `group` or `class`.
    pub column: Option<&'a str>,
    /// The columns of the covariates; of none, every other column of numbers.
    pub covariates: &'a [String],
}

/// The files that an option for groups names.
pub(crate) fn file(groups: &mut PathBuf) -> Option<&mut PathBuf> {
    let named = NAMED.map(Path::new).contains(&&**groups);
    Some(groups).filter(|_| !named)
}

/// The names and files of the shapes of a result.
pub(crate) struct Known<'a> {
    pub names: &'a [String],
    pub files: &'a [PathBuf],
}

/// The options for columns.
const COLUMN: &str = "--column";
const COVARIATES: &str = "--covariates";

/// Most names in a message.
const LISTED: usize = 5;

/// Reads the table for the shapes of a result.
///
/// # Errors
/// [`CliError::Config`] for a table that cannot be used, with the line.
pub(crate) fn read(wanted: &Wanted<'_>, known: &Known<'_>) -> Result<Labelled, CliError> {
    let path = wanted.groups;
    if NAMED.map(Path::new).contains(&path) {
        return by_file(wanted, known);
    }
    let wrong = |line: u64, message: String, remedy: &str| CliError::Config {
        path: path.into(),
        line: usize::try_from(line).unwrap_or(0),
        message,
        remedy: remedy.into(),
    };
    let text = read_text(path).map_err(|error| {
        let remedy = match error.kind() {
            ErrorKind::InvalidData => "save it as a CSV file with the encoding UTF-8",
            _ => "give a CSV file with a header and a line for every shape",
        };
        wrong(0, format!("it cannot be read: {error}"), remedy)
    })?;
    let mut reader = table_reader(&text, true);
    let place = |error: &csv::Error| error.position().map_or(0, csv::Position::line);
    let unreadable = |error: csv::Error| {
        let remedy = "save it as a CSV file with the encoding UTF-8";
        wrong(place(&error), error.to_string(), remedy)
    };
    let header: Vec<String> = reader
        .headers()
        .map_err(unreadable)?
        .iter()
        .map(String::from)
        .collect();
    check_header(&header).map_err(|(message, remedy)| wrong(1, message, remedy))?;
    let columns = header.join(", ");
    let column = |name: &str, option: &str| {
        let place = |fits: &dyn Fn(&String) -> bool| header.iter().skip(1).position(fits);
        let found = place(&|column| column == name);
        let found = found.or_else(|| place(&|column| column.eq_ignore_ascii_case(name)));
        let message = format!("it has no column '{name}' after the first");
        let remedy = format!("its columns are {columns}: name one with {option}");
        found
            .map(|at| at + 1)
            .ok_or_else(|| wrong(1, message, &remedy))
    };
    let of_group = match wanted.column {
        Some(name) => column(name, COLUMN)?,
        None => class_column(&header).map_or_else(|| column("group", COLUMN), Ok)?,
    };
    let mut lines: Vec<Option<Line>> = vec![None; known.names.len()];
    let finder = Finder::new(known);
    let mut ignored = 0;
    for line in reader.records() {
        let line = line.map_err(unreadable)?;
        let cells: Vec<String> = line.iter().map(String::from).collect();
        if cells.iter().all(String::is_empty) {
            continue;
        }
        let at = line.position().map_or(0, csv::Position::line);
        if cells.len() != header.len() {
            let (found, count) = (cells.len(), header.len());
            let s = plural(found);
            let message = format!("it has {found} cell{s}, and the header {count}");
            let remedy = "give every line as many cells as the header, separated by commas";
            return Err(wrong(at, message, remedy));
        }
        let shape = match finder.find(&cells[0]) {
            [] => {
                ignored += 1;
                continue;
            }
            [shape] => *shape,
            several => {
                let names = several.iter().map(|&i| &*known.names[i]);
                let names = names.collect::<Vec<_>>().join("' and '");
                let message = format!("'{}' may be '{names}'", cells[0]);
                return Err(wrong(at, message, "give more of its path"));
            }
        };
        if lines[shape].is_some() {
            let message = format!("'{}' stands in two lines", known.names[shape]);
            return Err(wrong(at, message, "keep one of them"));
        }
        if cells[of_group].is_empty() {
            let message = format!("'{}' has no group", cells[0]);
            return Err(wrong(at, message, "name its group"));
        }
        lines[shape] = Some(Line { at, cells });
    }
    let missing: Vec<&str> = (0..lines.len())
        .filter(|&i| lines[i].is_none())
        .map(|i| &*known.names[i])
        .collect();
    if !missing.is_empty() {
        let shown = missing
            .iter()
            .take(LISTED)
            .copied()
            .collect::<Vec<_>>()
            .join("', '");
        let more = if missing.len() > LISTED { ", …" } else { "" };
        let count = missing.len();
        let s = plural(count);
        let message = format!("it has no line for {count} shape{s} of the result: '{shown}'{more}");
        let remedy =
            "name every shape in the first column, by its file or by its name in the result";
        return Err(wrong(0, message, remedy));
    }
    let lines: Vec<Line> = lines.into_iter().flatten().collect();
    let classes = Classes::numbered(lines.iter().map(|line| line.cells[of_group].clone()));
    let groups = Groups::new(classes.of_input).map_err(|error: GroupError| {
        let remedy = "name two groups or more, and two shapes in one of them";
        wrong(0, format!("column '{}': {error}", header[of_group]), remedy)
    })?;
    let numbers = |at: usize| -> Result<Vec<f64>, (usize, String)> {
        let cells = lines.iter().map(|line| &*line.cells[at]).enumerate();
        cells
            .map(|(shape, cell)| {
                number(cell, &known.names[shape]).map_err(|reason| (shape, reason))
            })
            .collect()
    };
    let (mut covariates, mut left_out) = (Vec::new(), Vec::new());
    if wanted.covariates.is_empty() {
        for at in (1..header.len()).filter(|&at| at != of_group) {
            let name = header[at].clone();
            match numbers(at) {
                // A constant says nothing; asked for, it is an error.
                Ok(values) if is_constant(&values) => {
                    let reason = EQUAL.into();
                    left_out.push(LeftOut { name, reason });
                }
                Ok(values) => covariates.push(Covariate { name, values }),
                Err((_, reason)) => {
                    let is_number = |line: &Line| line.cells[at].parse::<f64>().is_ok();
                    let none = !reason.ends_with(COMMA) && !lines.iter().any(is_number);
                    let reason = if none {
                        "it has no numbers".into()
                    } else {
                        reason
                    };
                    left_out.push(LeftOut { name, reason });
                }
            }
        }
    }
    for (i, name) in wanted.covariates.iter().enumerate() {
        let at = column(name, COVARIATES)?;
        let same = |other: &String| column(other, COVARIATES).is_ok_and(|other| other == at);
        if wanted.covariates[..i].iter().any(same) {
            let message = format!("the covariate '{name}' is asked for twice");
            return Err(wrong(1, message, "name every covariate once"));
        }
        if at == of_group {
            let message = format!("'{name}' is the column of the groups");
            return Err(wrong(1, message, "leave it out of --covariates"));
        }
        let values = numbers(at).map_err(|(shape, reason)| {
            let message = format!("covariate '{name}': {reason}");
            let remedy = "a covariate needs a number for every shape of the result";
            wrong(lines[shape].at, message, remedy)
        })?;
        if is_constant(&values) {
            let message = format!("covariate '{name}': {EQUAL}");
            return Err(wrong(0, message, "leave it out of --covariates"));
        }
        covariates.push(Covariate {
            name: name.clone(),
            values,
        });
    }
    Ok(Labelled {
        names: classes.names,
        groups,
        covariates,
        left_out,
        ignored,
    })
}

/// The groups by the folders or names of files.
fn by_file(wanted: &Wanted<'_>, known: &Known<'_>) -> Result<Labelled, CliError> {
    let unfit = |reason: String| CliError::Option {
        option: "--groups",
        value: wanted.groups.display().to_string(),
        remedy: format!("{reason}; give a CSV file instead"),
    };
    let covariate = wanted.covariates.first().map(|name| &**name);
    if let Some(name) = wanted.column.or(covariate) {
        return Err(unfit(format!(
            "there is no column '{name}' without a table"
        )));
    }
    let classes =
        Classes::of(wanted.groups, known.files).map_err(|error| unfit(error.to_string()))?;
    Ok(Labelled {
        groups: Groups::new(classes.of_input).map_err(|error| unfit(error.to_string()))?,
        names: classes.names,
        covariates: Vec::new(),
        left_out: Vec::new(),
        ignored: 0,
    })
}

/// Checks the names of the columns; otherwise a message and a remedy.
fn check_header(header: &[String]) -> Result<(), (String, &'static str)> {
    if header.iter().all(String::is_empty) {
        let remedy = "give a CSV file with a header and a line for every shape";
        return Err(("it is empty".into(), remedy));
    }
    if is_hint(&header[0]) {
        let message = format!("'{}' is no header but a hint for spreadsheets", header[0]);
        return Err((message, "leave this line out"));
    }
    let mut others = header.iter().enumerate().skip(1);
    let twice = others.find(|(i, name)| !name.is_empty() && header[1..*i].contains(name));
    match twice {
        Some((_, name)) => {
            let message = format!("it has two columns '{name}'");
            Err((message, "rename one of them, or leave it out"))
        }
        None => Ok(()),
    }
}

/// The number in a cell of a shape; otherwise why there is none.
fn number(cell: &str, shape: &str) -> Result<f64, String> {
    match cell.parse::<f64>() {
        Ok(x) if x.abs() < MOST => Ok(x),
        Ok(x) if x.is_finite() => Err(format!("'{cell}' of '{shape}' is too large")),
        Ok(_) => Err(format!("'{cell}' of '{shape}' is not a finite number")),
        Err(_) if cell.contains(',') && cell.replace(',', "").parse::<f64>().is_ok() => {
            Err(format!("'{cell}' of '{shape}' {COMMA}"))
        }
        Err(_) if cell.is_empty() => Err(format!("the cell of '{shape}' is empty")),
        Err(_) => Err(format!("'{cell}' of '{shape}' is not a number")),
    }
}

/// Shapes by the cells of a table.
struct Finder<'a> {
    names: HashMap<&'a str, Vec<usize>>,
    files: FileIndex,
}

impl<'a> Finder<'a> {
    fn new(known: &Known<'a>) -> Self {
        let mut names: HashMap<&str, Vec<usize>> = HashMap::new();
        for (i, name) in known.names.iter().enumerate() {
            names.entry(name).or_default().push(i);
        }
        Self {
            names,
            files: FileIndex::new(known.files),
        }
    }

    /// The shapes of this name: their name in the result, their file or the end of its path, or the name of their
    /// file without extension.
    fn find(&self, name: &str) -> &[usize] {
        match self.names.get(name) {
            Some(found) => found,
            None => self.files.find(name).files,
        }
    }
}
