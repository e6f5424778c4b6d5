//! Which figures of its record lead the report of a command, and which there are of every shape.

use serde_json::Value;
use shapespace_report::table::Cell;

use super::values::{at, cell, text};
use How::{All, Count, First, Last, Least, Mean, Most, Share, Sum};

/// How the values at a place become one figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum How {
    /// The only value.
    All,
    Count,
    First,
    Last,
    Least,
    Most,
    Mean,
    Sum,
    /// The first, in per cent.
    Share,
}

/// A figure: its name, its place in the record, and what is made of the values there.
pub(super) type Figure = (&'static str, &'static str, How);
/// A figure of every shape: its name, and the place of the values.
pub(super) type Column = (&'static str, &'static str);

/// What leads the report of a command. Figures that a record does not have are left out.
pub(super) struct Lead {
    command: &'static str,
    pub figures: &'static [Figure],
    /// The first column, of the names of the shapes.
    pub names: Column,
    pub columns: &'static [Column],
}

const INPUTS: Column = ("name", "/input/*/name");
/// Averages of many weights, and of images, which are no commands of their own.
const SWEEP: &str = "average --sweep";
const JOINT: &str = "average --joint";

const LEADS: &[Lead] = &[
    Lead {
        command: "average",
        figures: &[
            ("energy", "/energy/total", All),
            ("Dice, mean", "/mean_dice", All),
            ("Dice, least", "/dice/*", Least),
            ("components", "/components/*", Count),
            ("Dice of components, least", "/components/*/dice/*", Least),
            (
                "Hausdorff distance in input units, most",
                "/hausdorff_input_units/*/maximum",
                Most,
            ),
            ("determinant, least", "/certificate/min_det", All),
            ("without folds", "/certificate/certified", All),
            ("area in input units", "/average/area_input_units", All),
            ("volume in input units", "/average/volume_input_units", All),
            ("area in the unit box", "/average/area", All),
            ("volume in the unit box", "/average/volume", All),
            ("iterations", "/iterations", All),
        ],
        names: INPUTS,
        columns: &[
            ("weight", "/parameters/weights/*"),
            ("Dice", "/dice/*"),
            ("elastic energy", "/energy/elastic/*"),
            ("mismatch", "/energy/mismatch/*"),
            (
                "Hausdorff in input units",
                "/hausdorff_input_units/*/maximum",
            ),
            (
                "mean distance in input units",
                "/hausdorff_input_units/*/mean",
            ),
        ],
    },
    Lead {
        command: SWEEP,
        figures: &[
            ("averages", "/averages/*", Count),
            ("Dice, least", "/averages/*/dice/*", Least),
            (
                "determinant, least",
                "/averages/*/certificate/min_det",
                Least,
            ),
        ],
        names: ("weights", "/averages/*/weights"),
        columns: &[
            ("energy", "/averages/*/energy"),
            ("Dice", "/averages/*/dice"),
            ("determinant, least", "/averages/*/certificate/min_det"),
            (
                "area in input units",
                "/averages/*/average/area_input_units",
            ),
            (
                "volume in input units",
                "/averages/*/average/volume_input_units",
            ),
            ("status", "/averages/*/status"),
        ],
    },
    Lead {
        command: JOINT,
        figures: &[
            ("energy", "/energy/total", All),
            ("determinant, least", "/certificate/min_det", All),
            ("without folds", "/certificate/certified", All),
            ("overlap of the edges, least", "/edge_overlaps/*", Least),
            ("spread of the images", "/spread_before", All),
            ("spread after deformation", "/spread_after", All),
        ],
        names: INPUTS,
        columns: &[
            ("elastic energy", "/energy/shapes/elastic/*"),
            ("mismatch", "/energy/shapes/mismatch/*"),
            ("edges", "/energy/images/*/edges"),
            ("fidelity", "/energy/images/*/fidelity"),
            ("smoothness", "/energy/images/*/smoothness"),
        ],
    },
    Lead {
        command: "geodesic",
        figures: &[
            ("length", "/length", All),
            ("length in input units", "/length_input_units", All),
            ("dissipation", "/dissipation", All),
            ("steps", "/step_energies/*", Count),
            ("Dice at the end", "/dice_end", All),
            ("end reached", "/end_reached", All),
            (
                "95 % of the boundaries within, in spacings",
                "/arrival/percentile_95",
                All,
            ),
            ("merged or split parts", "/contacts/*", Count),
            ("minimal paths found", "/minima/*", Count),
            ("determinant, least", "/certificate/min_det", All),
            ("without folds", "/certificate/certified", All),
            ("first size", "/volumes/*", First),
            ("last size", "/volumes/*", Last),
            ("iterations", "/iterations", All),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "length",
        figures: &[
            ("length", "/length", All),
            ("length in input units", "/length_input_units", All),
            ("length of the geodesic", "/geodesic/length", All),
            ("length over geodesic", "/geodesic/length_ratio", All),
            ("dissipation", "/dissipation", All),
            ("steps", "/step_energies/*", Count),
            ("Dice, least", "/pieces/*/dice_end", Least),
            ("determinant, least", "/certificate/min_det", All),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "metric",
        figures: &[
            ("metric", "/metric", All),
            ("metric in input units", "/metric_input_units", All),
            ("speed, its root", "/speed", All),
            ("error by the grid", "/discretisation/error", All),
            ("change of volume", "/volume_share", Share),
            ("shear", "/shear_share", Share),
            (
                "velocity of the boundary off by",
                "/boundary_residual",
                Share,
            ),
            ("energy of the void", "/void_share", Share),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "extend",
        figures: &[
            ("length", "/length", All),
            ("steps asked for", "/steps", All),
            ("steps found", "/steps_found", All),
            ("determinant, least", "/certificate/min_det", All),
            ("first size", "/volumes/*", First),
            ("last size", "/volumes/*", Last),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "transport",
        figures: &[
            ("length of the result", "/length", All),
            ("length of the variation", "/length_variation", All),
            ("Dice of the variation", "/dice_variation", All),
            ("steps found", "/steps_found", All),
            ("determinant, least", "/certificate/min_det", All),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "distances",
        figures: &[
            ("shapes", "/input/*", Count),
            ("paths", "/paths/*", Count),
            ("new shapes", "/new_shapes", All),
            ("pairs computed", "/skipped/computed", All),
            ("largest distance", "/distances/matrix/*/*", Most),
            ("mean asymmetry", "/distances/asymmetry/mean", Share),
            ("violated triangles", "/distances/triangles/violations", All),
            ("clusters", "/clustering/clusters", All),
            ("stress of the map", "/embedding/stress", All),
            (
                "nearest neighbour in its class",
                "/distances/agreement/nearest_neighbour_accuracy",
                Share,
            ),
            (
                "adjusted Rand index",
                "/distances/agreement/adjusted_rand_index",
                All,
            ),
            (
                "most neighbours in its class",
                "/neighbours/agreement/vote",
                Share,
            ),
            ("Dice at the ends, least", "/paths/*/dice_end", Least),
            ("determinant, least", "/paths/*/min_det", Least),
        ],
        names: INPUTS,
        columns: &[("cluster", "/clustering/labels/*")],
    },
    Lead {
        command: "segment",
        figures: &[
            ("images", "/images/*", Count),
            ("mean Dice", "/mean_dice", All),
            ("energy", "/images/*/energy/total", Sum),
            ("length of the edges", "/images/*/edge_length", Sum),
            ("regions", "/images/*/regions", Sum),
            (
                "area in input units",
                "/images/*/object/area_input_units",
                Mean,
            ),
            (
                "volume in input units",
                "/images/*/object/volume_input_units",
                Mean,
            ),
        ],
        names: ("name", "/images/*/name"),
        columns: &[
            ("file", "/images/*/path"),
            ("threshold", "/images/*/object/threshold"),
            ("regions", "/images/*/regions"),
            ("area in input units", "/images/*/object/area_input_units"),
            (
                "volume in input units",
                "/images/*/object/volume_input_units",
            ),
            ("energy", "/images/*/energy/total"),
            ("Dice", "/images/*/object/dice"),
        ],
    },
    Lead {
        command: "pca",
        figures: &[
            ("shapes", "/n_shapes", All),
            ("modes", "/n_modes", All),
            (
                "variance in the first mode",
                "/quality/compactness/*",
                Share,
            ),
            ("largest eigenvalue", "/eigenvalues/*", First),
            ("positive definite", "/definite", All),
            ("imbalance of the stresses", "/imbalance", Share),
            ("Mahalanobis distance, most", "/mahalanobis/*", Most),
            ("outliers", "/outliers/*", Count),
            ("size of the average", "/object_size", All),
            ("groups", "/groups/*", Count),
        ],
        names: ("name", "/shapes/*"),
        columns: &[
            ("group", "/group_of_shape/*"),
            ("weight", "/weights/*"),
            ("Mahalanobis distance", "/mahalanobis/*"),
            ("p-value", "/p_value/*"),
            ("distance of the reconstruction", "/procrustes_distance/*"),
            ("residual, left out", "/left_out_residual/*"),
            ("p-value, left out", "/quality/left_out/*/p_value"),
        ],
    },
    Lead {
        command: "synthesize",
        figures: &[
            ("Mahalanobis distance", "/mahalanobis", All),
            ("p-value", "/p_value", All),
            ("size", "/size", All),
            ("size of the average", "/average_size", All),
            ("determinant, least", "/min_det", All),
            ("share of the load", "/load_share", Share),
        ],
        names: INPUTS,
        columns: &[],
    },
    Lead {
        command: "score",
        figures: &[
            ("shapes", "/mahalanobis/*", Count),
            ("Mahalanobis distance, most", "/mahalanobis/*", Most),
            ("p-value, least", "/p_value/*", Least),
            ("residual, most", "/residual/*", Most),
            ("Dice, least", "/dice/*", Least),
        ],
        names: INPUTS,
        columns: &[
            ("Mahalanobis distance", "/mahalanobis/*"),
            ("p-value", "/p_value/*"),
            ("residual", "/residual/*"),
            ("Dice", "/dice/*"),
        ],
    },
    Lead {
        command: "compare",
        figures: &[
            ("groups", "/groups/*", Count),
            ("shapes", "/shapes/*", Count),
            ("p-value of all modes", "/scores/p_value_overall", All),
            ("p-value of the distances", "/distances/p_value", All),
            ("variance between groups", "/scores/explained", Share),
            ("variance between groups", "/distances/explained", Share),
            ("boundary that differs", "/boundary/different_share", Share),
            (
                "balanced accuracy, left out",
                "/classification/balanced_accuracy",
                Share,
            ),
            ("p-value of it", "/classification/p_value", All),
        ],
        names: ("name", "/shapes/*"),
        columns: &[
            ("group", "/group_of_shape/*"),
            ("assigned to", "/assigned_group/*"),
        ],
    },
    Lead {
        command: "warp",
        figures: &[
            ("files", "/carried/*", Count),
            ("samples and points", "/carried/*/count", Sum),
            ("of these without an exact place", "/carried/*/inexact", Sum),
        ],
        names: ("file", "/carried/*/file"),
        columns: &[
            ("carried as", "/carried/*/result"),
            ("what", "/carried/*/what"),
            ("samples or points", "/carried/*/count"),
            ("without an exact place", "/carried/*/inexact"),
        ],
    },
];

/// What all commands have of their inputs.
const OF_INPUTS: [Column; 4] = [
    ("file", "/input/*/path"),
    ("class", "/input/*/class"),
    ("area in input units", "/input/*/area_input_units"),
    ("volume in input units", "/input/*/volume_input_units"),
];

/// What leads the report of a record; its inputs where nothing else is known.
pub(super) fn lead(record: &Value) -> &'static Lead {
    const OTHER: Lead = Lead {
        command: "",
        figures: &[],
        names: INPUTS,
        columns: &[],
    };
    let command = match text(record, "/command") {
        "average" if record.get("averages").is_some() => SWEEP,
        "average" if record.get("spread_before").is_some() => JOINT,
        other => other,
    };
    let known = LEADS.iter().find(|lead| lead.command == command);
    known.unwrap_or(&OTHER)
}

impl Lead {
    /// The columns of the table of shapes.
    pub fn columns(&self) -> impl Iterator<Item = &'static Column> {
        let inputs = if self.names == INPUTS {
            &OF_INPUTS[..]
        } else {
            &[]
        };
        inputs.iter().chain(self.columns)
    }
}

/// A figure of a record, if it has it.
pub(super) fn figure(record: &Value, (_, place, how): &Figure) -> Option<String> {
    let found: Vec<&Value> = at(record, place).into_iter().flatten().collect();
    let numbers = || found.iter().filter_map(|value| value.as_f64());
    let number = match how {
        All => return Some(cell(found.first()?)?.short()),
        Share => return Some(format!("{:.1} %", 100.0 * numbers().next()?)),
        Count => Some(found.len() as f64).filter(|count| *count > 0.0),
        First => numbers().next(),
        Last => numbers().next_back(),
        Least => numbers().reduce(f64::min),
        Most => numbers().reduce(f64::max),
        Sum => numbers().reduce(|sum, next| sum + next),
        Mean => {
            let count = numbers().count().max(1) as f64;
            numbers().reduce(|sum, next| sum + next).map(|s| s / count)
        }
    };
    Some(Cell::Number(number?).short())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn figures_are_made_of_values() {
        let record = json!({"list": [3, 1, 2], "share": 0.25, "met": true, "word": "a"});
        let of = |place, how| figure(&record, &("", place, how));
        let list = [Count, First, Last, Least, Most, Mean, Sum].map(|how| of("/list/*", how));
        let found: Vec<String> = list.into_iter().flatten().collect();
        assert_eq!(found, ["3", "3", "2", "1", "3", "2", "6"]);
        assert_eq!(of("/share", Share).as_deref(), Some("25.0 %"));
        assert_eq!(of("/met", All).as_deref(), Some("yes"));
        assert_eq!(of("/word", All).as_deref(), Some("a"));
        assert_eq!(of("/none/*", Count), None);
        assert_eq!(of("/none", All), None);
    }

    #[test]
    fn names_of_commands_are_not_repeated() {
        for (i, lead) in LEADS.iter().enumerate() {
            assert!(LEADS[..i].iter().all(|other| other.command != lead.command));
        }
    }
}
