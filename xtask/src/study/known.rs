//! Averages with a known result.

use std::f64::consts::PI;

use fe_grid::ScalarField;
use fe_grid::minimise::Silent;
use levelset::Moments;
use shape_average::{AverageParams, AverageResult, average};

use super::angle::{indicator, inner_angle};
use super::{Section, shapes};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

const GRIDS: [usize; 2] = [65, 129];

/// All averages with known results.
pub fn section() -> Outcome<Section> {
    let mut table = Table::new(["shapes", "grid", "figure", "asked", "found", "seconds"]);
    for nodes in GRIDS {
        bars(&mut table, nodes)?;
    }
    for nodes in GRIDS {
        disks(&mut table, nodes)?;
    }
    for nodes in GRIDS {
        identical(&mut table, nodes)?;
    }
    for nodes in GRIDS {
        turned(&mut table, nodes)?;
    }
    Ok(Section {
        title: "Averages whose result is known",
        text: "Bars of .6 x .12 with inner angles of 180 and 118 degrees, disks of radius .2 and \
               .3. The angle is that between the principal axes of the two arms; for a bar of \
               known angle its error is at most half a degree on 65 x 65 nodes.",
        table,
        chart: None,
    })
}

fn run(shapes: &[ScalarField<f64, 2>], weights: Option<Vec<f64>>) -> Outcome<AverageResult<2>> {
    let params = AverageParams {
        weights,
        ..AverageParams::default()
    };
    Ok(average(shapes, &params, &mut Silent)?)
}

/// Writes rows that share their first two cells.
struct Rows<'a> {
    table: &'a mut Table,
    shapes: String,
    nodes: usize,
    seconds: f64,
}

impl Rows<'_> {
    fn near(&mut self, figure: &str, found: f64, asked: f64, tolerance: f64, digits: usize) {
        self.row(
            figure,
            format!("{asked:.digits$} ± {tolerance}"),
            format!("{found:.digits$}"),
            (found - asked).abs() <= tolerance,
        );
    }

    fn row(&mut self, figure: &str, asked: String, found: String, good: bool) {
        self.table.row([
            self.shapes.clone(),
            format!("{}²", self.nodes),
            figure.into(),
            asked,
            checked(found, good),
            format!("{:.2}", self.seconds),
        ]);
    }
}

fn bars(table: &mut Table, nodes: usize) -> Outcome<()> {
    let bars = shapes::bars(nodes)?;
    let cases = [
        ([0.5, 0.5], 147.0),
        ([0.25, 0.75], 132.0),
        ([0.75, 0.25], 163.0),
    ];
    for (weights, asked) in cases {
        let result = run(&bars, Some(weights.to_vec()))?;
        let mut rows = Rows {
            table,
            shapes: format!("bars, weights {} and {}", weights[0], weights[1]),
            nodes,
            seconds: result.seconds,
        };
        let angle = inner_angle(&result.average_indicator);
        rows.near("angle of the average", angle, asked, 4.0, 1);
        for (name, pushed) in ["straight", "bent"].iter().zip(&result.pushed) {
            let figure = format!("angle of the {name} bar's image");
            rows.near(&figure, inner_angle(&indicator(pushed)), angle, 3.0, 1);
        }
    }
    Ok(())
}

fn disks(table: &mut Table, nodes: usize) -> Outcome<()> {
    let disks = [shapes::disk(0.2, nodes)?, shapes::disk(0.3, nodes)?];
    let result = run(&disks, None)?;
    let radius = (Moments::of_density(&result.average_indicator)?.volume / PI).sqrt();
    let mut rows = Rows {
        table,
        shapes: "disks".into(),
        nodes,
        seconds: result.seconds,
    };
    rows.near("radius of the average", radius, 0.24975, 0.0015, 5);
    Ok(())
}

fn identical(table: &mut Table, nodes: usize) -> Outcome<()> {
    let shape = shapes::bar(118.0, 10.0, nodes)?;
    let result = run(&vec![shape.clone(); 3], None)?;
    let largest = |inside_only: bool| {
        let mut largest = 0.0f64;
        for u in &result.displacements {
            for (i, &d) in shape.as_slice().iter().enumerate() {
                if d >= 0.0 || !inside_only {
                    largest = u.at(i).iter().fold(largest, |a, x| a.max(x.abs()));
                }
            }
        }
        largest
    };
    let mut rows = Rows {
        table,
        shapes: "three times the bent bar".into(),
        nodes,
        seconds: result.seconds,
    };
    let figures = [("in the bar", true), ("anywhere, the void included", false)];
    for (place, inside_only) in figures {
        let found = largest(inside_only);
        let figure = format!("largest displacement {place}");
        rows.row(
            &figure,
            "< 1e-3".into(),
            format!("{found:.1e}"),
            found < 1e-3,
        );
    }
    Ok(())
}

fn turned(table: &mut Table, nodes: usize) -> Outcome<()> {
    let energy = |turn: f64| -> Outcome<(f64, f64)> {
        let bars = [
            shapes::bar(180.0, 0.0, nodes)?,
            shapes::bar(118.0, turn, nodes)?,
        ];
        let result = run(&shapes::aligned(&bars)?, None)?;
        Ok((result.energy.elastic.iter().sum(), result.seconds))
    };
    let (straight, _) = energy(0.0)?;
    let (turned, seconds) = energy(60.0)?;
    let mut rows = Rows {
        table,
        shapes: "bars, the bent one turned by 60°, aligned".into(),
        nodes,
        seconds,
    };
    let change = turned / straight - 1.0;
    rows.row(
        "elastic energy against that without the turn",
        "within 2 %".into(),
        format!("{:+.2} %", 100.0 * change),
        change.abs() < 0.02,
    );
    Ok(())
}
