//! `shapespace figure`: every figure, on drawn shapes and on given ones.

use crate::common::{Place, Results, draw, succeeded};
use serde_json::Value;

/// The rows of the table, column by column.
struct Table(Value);

impl Table {
    fn rows(&self) -> usize {
        self.0["rows"].as_array().unwrap().len()
    }

    fn cell(&self, row: usize, column: &str) -> &Value {
        let columns = self.0["columns"].as_array().unwrap();
        let found = columns.iter().position(|c| c == column);
        let k = found.unwrap_or_else(|| panic!("no column '{column}' in {columns:?}"));
        &self.0["rows"][row][k]
    }

    fn number(&self, row: usize, column: &str) -> f64 {
        self.cell(row, column).as_f64().unwrap()
    }
}

fn figure(place: &Place, name: &str, rest: &[&str], output: &str) -> Table {
    let mut arguments = vec!["figure", name];
    arguments.extend(rest);
    arguments.extend(["-o", output]);
    succeeded(&place.compute(&arguments));
    let results = Results::read(&place.path(output));
    assert_eq!(results.json["figure"], name);
    for file in ["figure.png", "figure.md", "table.csv"] {
        assert!(results.path(file).is_file(), "no {file}");
    }
    let table = Table(results.json["table"].clone());
    let csv = std::fs::read_to_string(results.path("table.csv")).unwrap();
    assert_eq!(csv.lines().count(), table.rows() + 1);
    for row in 0..table.rows() {
        let columns = table.0["columns"].as_array().unwrap();
        if columns.iter().any(|c| c == "certified") {
            assert_eq!(table.cell(row, "certified"), "yes");
        }
    }
    table
}

const AWAY: &str = "distance to the last";

#[test]
fn averages_are_compared_in_many_ways() {
    let place = Place::new();
    let options = ["--grid", "33", "--tolerance", "1e-2"];
    let soft = figure(&place, "elastic-domain", &options, "domain");
    assert_eq!(soft.rows(), 4);
    // A void that resists costs energy.
    assert!(soft.number(3, "elastic energy") > soft.number(0, "elastic energy"));
    let stiff = figure(&place, "stiffness", &options, "stiffness");
    assert!(stiff.number(0, AWAY) > 0.0 && stiff.number(2, AWAY) < 1e-12);
    let weight = figure(&place, "mismatch-weight", &options, "weight");
    let last = weight.rows() - 1;
    assert!(weight.number(last, "mismatch") < weight.number(0, "mismatch"));
    assert!(weight.number(last, "elastic energy") > weight.number(0, "elastic energy"));
    let more = figure(&place, "adding-shapes", &options, "more");
    assert_eq!(more.cell(more.rows() - 1, "shapes"), 20.0);
    assert!(more.number(more.rows() - 2, AWAY) < more.number(0, AWAY));
}

#[test]
fn components_are_compared_with_whole_shapes() {
    let place = Place::new();
    let table = figure(&place, "components", &["--grid", "65"], "components");
    let column = "Dice of the labels";
    // Without labels these are where they were in their shapes; half of what they miss is the most.
    let [blind, known] = [0, 1].map(|row| 1.0 - table.number(row, column));
    assert!(known < 0.5 * blind, "{known} {blind}");
    assert!(table.number(1, "elastic energy") > 3.0 * table.number(0, "elastic energy"));
    assert!(table.number(1, "second ratio") > 10.0 * table.number(0, "second ratio"));
}

#[test]
fn hidden_parts_and_inverse_laws_are_shown() {
    let place = Place::new();
    let hidden = figure(&place, "missing-parts", &["--grid", "65"], "hidden");
    let column = "distance to that of the whole";
    // A mask of what was seen leaves a fifth of the error at most; measured, a twentieth.
    assert!(hidden.number(1, column) < 0.2 * hidden.number(2, column));
    let inverse = figure(&place, "inverse-model", &["--grid", "33"], "inverse");
    // Asymptotically of order 1 in the share of the displacements.
    let order = inverse.number(inverse.rows() - 1, "order");
    assert!((order - 1.0).abs() < 0.2, "{order}");
}

#[test]
fn forces_balance_and_modes_agree() {
    let place = Place::new();
    let force = figure(&place, "force-balance", &["--grid", "33"], "force");
    assert_eq!(force.rows(), 27);
    for row in 0..force.rows() {
        let left = force.number(row, "imbalance on the boundary");
        assert!((0.0..1.0).contains(&left), "{left}");
    }
    // Of weight one, an interface that is as wide on finer grids: measured .050 to .020 from 33 to 65
    // nodes, and here from 17 to 33.
    let row = |nodes: f64, cells: f64| {
        let mut rows = 0..force.rows();
        let found = rows.find(|&r| {
            force.number(r, "nodes a side") == nodes
                && force.number(r, "interface cells") == cells
                && force.number(r, "mismatch weight") == 1.0
        });
        force.number(found.unwrap(), "imbalance on the boundary")
    };
    assert!(
        row(33.0, 4.0) < row(17.0, 2.0),
        "{} {}",
        row(33.0, 4.0),
        row(17.0, 2.0)
    );
    let pins = figure(&place, "pins", &["--grid", "33"], "pins");
    assert!(pins.number(0, "second ratio").abs() < 1e-8);
    let modes = figure(&place, "modes", &["--grid", "65"], "modes");
    // Two bends, whatever the inner product and the material.
    for row in 0..modes.rows() {
        assert!(modes.number(row, "second ratio") > 0.3);
        assert!(modes.number(row, "third ratio") < 1e-3);
    }
}

#[test]
fn figures_take_shapes_of_the_user() {
    let place = Place::new();
    for (k, radii) in ["0.3,0.2,0.2", "0.2,0.3,0.2"].iter().enumerate() {
        let shape = [
            "ellipse",
            "--radii",
            radii,
            "--dimension",
            "3",
            "--grid",
            "17",
        ];
        draw(&place, &format!("{k}.npy"), &shape);
    }
    let table = figure(
        &place,
        "weights",
        &["0.npy", "1.npy", "--grid", "17", "--tolerance", "1e-1"],
        "out",
    );
    assert_eq!(table.rows(), 5);
    // All the weight on the first shape gives that shape, up to a fraction of a spacing.
    let away = "distance to the first shape";
    assert!(table.number(0, away) < 0.01);
    assert!(table.number(4, away) > table.number(2, away));
    let run = place.run(&["figure", "median", "0.npy", "1.npy", "-o", "few"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("at least 5"));
}

/// Two disks, of which every notion has a known mean, and all are at known distances.
#[test]
fn related_notions_agree_on_disks() {
    let place = Place::new();
    for (name, radius) in [("a.npy", "0.2"), ("b.npy", "0.3")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "65"]);
    }
    let disks = ["a.npy", "b.npy", "--grid", "65", "--tolerance", "1e-4"];
    let table = figure(&place, "related", &disks, "disks");
    assert_eq!(table.rows(), 8);
    let row = |name: &str| {
        let mut rows = 0..table.rows();
        rows.find(|&row| table.cell(row, "notion") == name).unwrap()
    };
    // A mean of the radius .25 has 2 * .25^2 / (.2^2 + .3^2) of the mean area.
    for name in [
        "linear elasticity",
        "signed distances in L2",
        "smoothed Hausdorff",
        "landmarks, Procrustes",
        "landmarks, median",
        "elastic curves (SRVF)",
    ] {
        let (area, thickness) = (
            table.number(row(name), "area"),
            table.number(row(name), "thickness"),
        );
        assert!((area / 0.9615 - 1.0).abs() < 0.01, "{name}: {area}");
        assert!((thickness - 1.0).abs() < 0.07, "{name}: {thickness}");
    }
    let distance = |name: &str| table.number(row(name), "mean distance");
    assert!((distance("smoothed Hausdorff") - 0.1).abs() < 0.002);
    // Up to the noise of outlines on a grid, disks are one shape up to scalings.
    assert!(distance("landmarks, Procrustes") < 0.01);
    assert!(distance("elastic curves (SRVF)") < 0.15);
    // sqrt(2 pi (lambda + mu)) times the difference of the radii, up to the grid and few steps.
    let length = distance("elastic average, viscous paths");
    let exact = 0.1 * (4.0 * std::f64::consts::PI).sqrt();
    assert!((length / exact - 1.0).abs() < 0.03);
    // The same for linear elasticity, whose energy from R to R' is 2 pi (lambda + mu) (R' - R)^2, whichever is deformed.
    assert!((distance("linear elasticity") / exact - 1.0).abs() < 0.03);
    // The average of this program is nearer to equal areas than to equal radii, or between them.
    let area = table.number(row("elastic average, viscous paths"), "area");
    assert!((0.94..1.0).contains(&area), "{area}");
}

/// The built-in shapes are compared in their groups, and volumes are refused.
#[test]
fn related_notions_are_of_plane_shapes() {
    let place = Place::new();
    for (name, angle) in [("a.png", "180"), ("b.png", "130"), ("c.png", "100")] {
        draw(&place, name, &["bar", "--angle", angle, "--grid", "65"]);
    }
    // The shapes that it has by itself take minutes in a build for tests.
    let shapes = ["a.png", "b.png", "c.png", "--grid", "33"];
    let table = figure(&place, "related", &shapes, "drawn");
    assert_eq!(table.rows(), 8);
    for row in 0..8 {
        assert_eq!(table.cell(row, "shapes"), "a to c");
    }
    // The mean of the signed distances loses area where the bars do not overlap, the elastic average keeps it.
    assert!(table.number(3, "area") < table.number(0, "area"));
    let pairs = table.cell(0, "pairs over their mean").as_str().unwrap();
    assert_eq!(pairs.split(", ").count(), 3);
    for name in ["a.npy", "b.npy"] {
        draw(&place, name, &["disk", "--dimension", "3", "--grid", "17"]);
    }
    let run = place.run(&["figure", "related", "a.npy", "b.npy", "-o", "solid"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("plane shapes"));
}

#[test]
fn paths_of_more_steps_have_a_limit() {
    let place = Place::new();
    for (name, radius) in [("a.npy", "0.2"), ("b.npy", "0.3")] {
        draw(&place, name, &["disk", "--radius", radius, "--grid", "33"]);
    }
    let disks = ["a.npy", "b.npy", "--grid", "33"];
    let table = figure(&place, "steps", &disks, "disks");
    assert_eq!(table.rows(), 1);
    assert_eq!(table.cell(0, "arrive"), "4 of 4");
    // In closed form for infinitely many steps: sqrt(2 pi (lambda + mu)) times the difference of the radii.
    let exact = 0.1 * (4.0 * std::f64::consts::PI).sqrt();
    let limit = table.number(0, "L limit");
    assert!((limit / exact - 1.0).abs() < 0.03, "{limit} {exact}");
    let square = table.number(0, "Diss limit");
    assert!((square / exact.powi(2) - 1.0).abs() < 0.06, "{square}");
    // Disks of equal moduli have order two; the errors of few steps are seen.
    let steps = |k: usize| table.number(0, &format!("L, K = {k}"));
    assert!((steps(4) - limit).abs() > (steps(32) - limit).abs());
}

#[test]
fn fluids_that_keep_areas_have_longer_paths() {
    let place = Place::new();
    for (angle, name) in [("180", "straight.png"), ("118", "folded.png")] {
        succeeded(&place.run(&["generate", "bar", "--angle", angle, "-o", name]));
    }
    // The built-in pairs, which are drawn in docs/figures, take fifteen times as long.
    let options = ["straight.png", "folded.png", "--grid", "33"];
    let table = figure(&place, "fluids", &options, "fluids");
    assert_eq!(table.rows(), 3);
    let column = "lambda / mu";
    assert_eq!(table.cell(0, column), 0.01);
    assert_eq!(table.cell(2, column), 100.0);
    assert!(table.number(0, "length") < 0.9 * table.number(2, "length"));
    let area = "least area over the ends";
    assert!(table.number(0, area) <= table.number(2, area));
    for row in 0..3 {
        assert_ne!(table.cell(row, "verdict"), "does not arrive");
    }
}

#[test]
fn minima_of_crossed_ellipses_are_drawn() {
    let place = Place::new();
    let options = ["--grid", "33", "--tolerance", "5e-3"];
    let table = figure(&place, "minima", &options, "minima");
    // As `average --starts 4` lists them, for masks on this grid.
    assert_eq!(table.rows(), 3);
    assert!((table.number(0, "energy") - 0.9227).abs() < 1e-4);
    assert!((table.number(0, "energy") - table.number(1, "energy")).abs() < 1e-6);
    for (row, expected) in [(0, 4.2), (1, 4.2), (2, 0.727)] {
        let value = table.number(row, "least eigenvalue");
        assert!((value / expected - 1.0).abs() < 0.02, "{row}: {value}");
    }
    assert!(table.number(1, "points") > 1.0);
    assert_eq!(table.cell(1, "average"), "same");
    assert_eq!(table.cell(2, "average"), "other");
    assert_eq!(table.cell(2, "starts"), "1 (usual)");
}
