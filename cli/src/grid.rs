//! Numbers of nodes on the command line, and whether a grid of so many can be made coarser.

use std::fmt;
use std::str::FromStr;

use clap::ValueEnum;
use fe_grid::Grid;
use serde::de::{Error, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::CliError;

/// Fewest nodes a side.
const FEWEST: usize = 9;
/// Most nodes of the coarsest grid of a hierarchy along each side of a cube, in 2D and 3D: minimisations
/// start there, from far away.
const COARSEST: [usize; 2] = [33, 17];
/// Most nodes a side of a cube, in 2D and 3D. Longer boxes have as many nodes at most as such a cube.
const MOST: [usize; 2] = [4097, 513];
/// Most cells along a side, in those of the largest cube.
const LONGEST: usize = 8;

/// Numbers of nodes: `129` along every side of a cube, or `129x65` along the axes of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nodes {
    /// Along every side.
    Cube(usize),
    /// Along two axes, `x` first.
    Flat([usize; 2]),
    /// Along three axes, `x` first.
    Solid([usize; 3]),
}

impl Nodes {
    /// The nodes along the axes in `D` dimensions; none for a cube.
    fn axes<const D: usize>(self) -> Result<Option<[usize; D]>, CliError> {
        let axes = match &self {
            Self::Cube(_) => return Ok(None),
            Self::Flat(axes) => &axes[..],
            Self::Solid(axes) => &axes[..],
        };
        match axes.try_into() {
            Ok(axes) => Ok(Some(axes)),
            Err(_) => Err(wrong(
                self,
                format!("the shapes are {D}D: give {D} numbers, or one for a cube"),
            )),
        }
    }

    fn of_cells<const D: usize>(cells: [usize; D]) -> Self {
        let nodes = cells.map(|c| c + 1);
        match nodes[..] {
            [x, y] if x != y => Self::Flat([x, y]),
            [x, y, z] if x != y || y != z => Self::Solid([x, y, z]),
            _ => Self::Cube(nodes[0]),
        }
    }
}

impl fmt::Display for Nodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cube(n) => write!(f, "{n}"),
            Self::Flat([x, y]) => write!(f, "{x}x{y}"),
            Self::Solid([x, y, z]) => write!(f, "{x}x{y}x{z}"),
        }
    }
}

/// What [`Nodes`] look like.
const FORM: &str = "a number of nodes, or one for each axis, as 129x65 or 129x65x65";

impl FromStr for Nodes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split(['x', 'X', '\u{d7}']).map(|n| n.trim().parse());
        let numbers: Result<Vec<usize>, _> = numbers.collect();
        let numbers = numbers.map_err(|_| format!("{FORM}, is needed"))?;
        Self::of_numbers(&numbers).ok_or_else(|| format!("{FORM}, is needed"))
    }
}

impl Nodes {
    fn of_numbers(numbers: &[usize]) -> Option<Self> {
        match *numbers {
            [n] => Some(Self::Cube(n)),
            [x, y] => Some(Self::Flat([x, y])),
            [x, y, z] => Some(Self::Solid([x, y, z])),
            _ => None,
        }
    }
}

impl Serialize for Nodes {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Cube(n) => n.serialize(out),
            axes => out.collect_str(axes),
        }
    }
}

impl<'de> Deserialize<'de> for Nodes {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Reader;

        impl<'de> Visitor<'de> for Reader {
            type Value = Nodes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(FORM)
            }

            fn visit_u64<E: Error>(self, n: u64) -> Result<Nodes, E> {
                let n = usize::try_from(n);
                n.map(Nodes::Cube)
                    .map_err(|_| E::invalid_value(Unexpected::Other("a large number"), &self))
            }

            fn visit_i64<E: Error>(self, n: i64) -> Result<Nodes, E> {
                let n = u64::try_from(n);
                n.map_err(|_| E::invalid_value(Unexpected::Other("a negative number"), &self))
                    .and_then(|n| self.visit_u64(n))
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Nodes, E> {
                let read = text.parse();
                read.map_err(|_| E::invalid_value(Unexpected::Str(text), &self))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Nodes, A::Error> {
                let mut numbers = Vec::new();
                while let Some(n) = list.next_element()? {
                    numbers.push(n);
                }
                Nodes::of_numbers(&numbers)
                    .ok_or_else(|| A::Error::invalid_length(numbers.len(), &self))
            }
        }

        from.deserialize_any(Reader)
    }
}

/// The box of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sides {
    /// A square or a cube.
    #[default]
    Cube,
    /// The box around the shapes, with as much room on all sides as the cube has along their longest
    /// side.
    Fit,
}

/// Numbers of nodes of a grid: along every side of a cube, or along the axes of a box whose longest side
/// is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Counts<const D: usize> {
    Cube(usize),
    Box(Grid<D>),
}

/// The numbers of nodes that are asked for, as usual without.
///
/// # Errors
/// [`CliError::Option`] for numbers that are too small or too large, or of a grid that cannot be made
/// coarser, with the nearest that work.
pub(crate) fn counts<const D: usize>(asked: Option<Nodes>) -> Result<Counts<D>, CliError> {
    let usual = if D == 2 { 129 } else { 65 };
    match asked.unwrap_or(Nodes::Cube(usual)) {
        Nodes::Cube(nodes) => check_nodes::<D>(nodes).map(|()| Counts::Cube(nodes)),
        nodes => {
            let Some(axes) = nodes.axes()? else {
                return Err(wrong(nodes, FORM.into()));
            };
            let cells = axes.map(|n: usize| n.saturating_sub(1));
            check_cells(cells, nodes)?;
            let longest = cells.into_iter().fold(1, usize::max);
            let grid = Grid::with_nodes(axes, (longest as f64).recip());
            Ok(Counts::Box(
                grid.map_err(|error| wrong(nodes, error.to_string()))?,
            ))
        }
    }
}

/// Checks the number of nodes along every side of a cube, or along the longest side of an image.
///
/// # Errors
/// As [`counts`].
pub(crate) fn check_nodes<const D: usize>(nodes: usize) -> Result<(), CliError> {
    check_cells([nodes.saturating_sub(1); D], Nodes::Cube(nodes))
}

fn check_cells<const D: usize>(cells: [usize; D], nodes: Nodes) -> Result<(), CliError> {
    if is_allowed(cells) {
        return Ok(());
    }
    let most = MOST[usize::from(D == 3)];
    let rule = format!(
        "a grid needs m 2^L + 1 nodes along all sides, from {FEWEST} to {most} a side of a cube: halving all \
         numbers of cells has to lead to a grid of at most {} nodes a side of a cube, or as many in all",
        COARSEST[usize::from(D == 3)]
    );
    Err(wrong(
        nodes,
        format!("{rule}; try --grid {}", Nodes::of_cells(nearest(cells))),
    ))
}

fn wrong(nodes: Nodes, remedy: String) -> CliError {
    CliError::Option {
        option: "--grid",
        value: nodes.to_string(),
        remedy,
    }
}

/// Whether there are enough cells, not too many, and few after all halvings that are possible.
pub(crate) fn is_allowed<const D: usize>(cells: [usize; D]) -> bool {
    let which = usize::from(D == 3);
    let nodes = |cells: [usize; D]| cells.iter().map(|c| c + 1).fold(1, usize::saturating_mul);
    let longest = LONGEST * (MOST[which] - 1);
    if !cells.iter().all(|c| (FEWEST - 1..=longest).contains(c)) {
        return false;
    }
    let halvings = cells.iter().map(|c| c.trailing_zeros()).min();
    let coarsest = cells.map(|c| c >> halvings.unwrap_or(0));
    nodes(cells) <= MOST[which].pow(D as u32) && nodes(coarsest) <= COARSEST[which].pow(D as u32)
}

/// The nearest numbers of cells that are allowed.
fn nearest<const D: usize>(cells: [usize; D]) -> [usize; D] {
    let most = MOST[usize::from(D == 3)] - 1;
    let cells = cells.map(|c| c.clamp(FEWEST - 1, most));
    let rounded = |level: u32| {
        let unit = 1usize << level;
        cells.map(|c| ((c + unit / 2) / unit * unit).max(unit))
    };
    let levels = 0..most.ilog2();
    let found = levels.map(rounded).find(|cells| is_allowed(*cells));
    found.unwrap_or([most; D])
}

/// The grid `129x65` in words, `129` for a cube.
pub(crate) fn in_words<const D: usize>(grid: &Grid<D>) -> String {
    Nodes::of_cells(grid.cells_per_axis()).to_string()
}

/// The number of nodes along the longest side.
pub(crate) fn longest<const D: usize>(grid: &Grid<D>) -> usize {
    grid.nodes_per_axis().into_iter().fold(0, usize::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hint<const D: usize>(text: &str) -> Option<String> {
        match counts::<D>(Some(text.parse().unwrap())) {
            Ok(_) => None,
            Err(CliError::Option { remedy, .. }) => {
                Some(remedy.rsplit(' ').next().unwrap_or_default().to_owned())
            }
            Err(other) => panic!("{other:?}"),
        }
    }

    #[test]
    fn numbers_that_cannot_be_halved_are_refused_with_the_nearest_that_can() {
        for right in ["9", "65", "513", "97", "101", "129x65", "401x65"] {
            assert_eq!(hint::<2>(right), None, "{right}");
        }
        for (wrong, near) in [
            ("0", "9"),
            ("5", "9"),
            ("64", "65"),
            ("100", "101"),
            ("9999", "4097"),
            ("400x60", "401x57"),
            ("129x4", "129x9"),
        ] {
            assert_eq!(hint::<2>(wrong).as_deref(), Some(near), "{wrong}");
        }
        for right in ["65", "401x65x65", "65x33x33", "17x9x9", "97"] {
            assert_eq!(hint::<3>(right), None, "{right}");
        }
        for (wrong, near) in [("400x60x60", "401x57x57"), ("600", "513"), ("70", "73")] {
            assert_eq!(hint::<3>(wrong).as_deref(), Some(near), "{wrong}");
        }
        assert!(counts::<3>(Some(Nodes::Flat([65, 33]))).is_err());
        assert!(counts::<2>(Some(Nodes::Solid([65, 33, 33]))).is_err());
    }

    #[test]
    fn every_hint_is_allowed() {
        for x in 1..300 {
            for y in [1, 7, 60, 127, 300] {
                assert!(is_allowed(nearest([x, y])), "{x} {y}");
                assert!(is_allowed(nearest([x, y, 45])), "{x} {y}");
            }
        }
    }

    #[test]
    fn nodes_are_written_as_they_are_read() {
        for text in ["129", "\"129x65\"", "\"9x17x33\""] {
            let read: Nodes = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&read).unwrap(), text);
        }
        let list: Nodes = serde_json::from_str("[9, 17]").unwrap();
        assert_eq!(list, "9x17".parse().unwrap());
        for text in ["-1", "\"9x\"", "\"1x2x3x4\"", "[]", "1.5", "true"] {
            assert!(serde_json::from_str::<Nodes>(text).is_err(), "{text}");
        }
    }
}
