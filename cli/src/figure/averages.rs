//! Figures that compare averages of the same shapes: by weights, by the mean, by the material, the
//! void, the mismatch weight and the number of shapes.

use fe_grid::ScalarField;
use hyperelastic::LameModuli;
use levelset::Contour;
use shape_average::{AverageParams, AverageResult, Mean};
use shapespace_report::table::{Cell, Table};

use super::scene::{Scene, distance, outline};
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;

/// The columns for every average.
pub(super) const USUAL: [&str; 5] = [
    "elastic energy",
    "mismatch",
    "mean Dice",
    "least det",
    "certified",
];

/// The cells of [`USUAL`]: mean elastic energy and mean mismatch of the shapes, mean overlap, and the
/// certificate of the worst deformation.
pub(super) fn usual<const D: usize>(result: &AverageResult<D>) -> Vec<Cell> {
    let n = result.dice.len() as f64;
    let mean = |terms: &[f64]| terms.iter().sum::<f64>() / n;
    let certified = if result.certificate.certified {
        "yes"
    } else {
        "no"
    };
    vec![
        mean(&result.energy.elastic).into(),
        mean(&result.energy.mismatch).into(),
        result.mean_dice().into(),
        result.certificate.min_det.into(),
        certified.into(),
    ]
}

/// Columns before and after [`USUAL`].
pub(super) fn columns(first: &[&'static str], last: &[&'static str]) -> Vec<&'static str> {
    [first, &USUAL, last].concat()
}

/// `--weights` from one shape to the next, and within the triangle of the first three.
pub(super) fn weights<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    const SIDE: usize = 5;
    let shapes = scene.n_shapes().min(3);
    let first = &scene.distances[..shapes];
    let names = ["first weight", "second weight", "third weight"];
    let mut table = Table::new(columns(&names[..shapes], &["distance to the first shape"]));
    let mut tiles = Tiles::new(&scene.grid(), SIDE);
    let first_outline = levelset::contour(&first[0], 0.0, levelset::BoxEdge::Closed)
        .map_err(shape_average::AverageError::from)?;
    let mut in_row = 0;
    let mut length = 1;
    for weights in crate::average::weights_between(shapes, SIDE) {
        let words: Vec<String> = weights.iter().map(|w| format!("{w:.2}")).collect();
        let label = words.join(" ");
        let result = scene.average_of(&format!("weights {label}"), first, &[], |params| {
            params.weights = Some(weights.clone());
        })?;
        tiles.average(&label, &result);
        in_row += 1;
        if shapes == 3 && in_row == length {
            tiles.end_row();
            (in_row, length) = (0, length + 1);
        }
        let mut row: Vec<Cell> = weights.iter().map(|w| (*w).into()).collect();
        row.extend(usual(&result));
        row.push(distance(&outline(&result)?, &first_outline)?.into());
        table.row(row);
    }
    Ok(Sheet {
        title: "Weighted averages",
        text:
            "The average moves from one shape to the next with the weights; where one has all the \
               weight it is that shape, and the others are deformed onto it."
                .into(),
        table,
        picture: tiles.draw(),
    })
}

/// Mean and median of shapes whose last fifth is of another kind, beside the mean of the others.
pub(super) fn median<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let n = scene.n_shapes();
    let clean = n - (n / 5).max(1);
    let alone = scene.average_of(
        &format!("mean of the first {clean}"),
        &scene.distances[..clean],
        &[],
        // A mismatch of one shape costs what it costs among all.
        |params| params.mismatch_weight *= clean as f64 / n as f64,
    )?;
    let mean = scene.average("mean of all", |_| ())?;
    let median = scene.average("median of all", |params| {
        params.mean = Mean::Median;
    })?;
    let truth = outline(&alone)?;
    let mut table = Table::new(columns(&["average"], &["distance to the clean mean"]));
    let mut tiles = Tiles::new(&scene.grid(), 4);
    tiles.shapes("shapes", &scene.distances, 0.0);
    for (label, result) in [
        (format!("mean of the first {clean}"), &alone),
        ("mean of all".to_owned(), &mean),
        ("median of all".to_owned(), &median),
    ] {
        tiles.average(&label, result);
        let mut row = vec![label.into()];
        row.extend(usual(result));
        row.push(distance(&outline(result)?, &truth)?.into());
        table.row(row);
    }
    Ok(Sheet {
        title: "Mean and median with outliers",
        text: format!(
            "The last {} of {n} shapes are taken for outliers. The median is less moved by them from \
             the mean of the others.",
            n - clean
        ),
        table,
        picture: tiles.draw(),
    })
}

/// Averages of one change after another, beside the shapes.
fn compared<const D: usize>(
    scene: &Scene<'_, D>,
    what: &'static str,
    cases: &[(String, Cell)],
    change: impl Fn(usize, &mut AverageParams),
) -> Result<(Table, Tiles<D>, Vec<AverageResult<D>>), CliError> {
    let mut table = Table::new(columns(&[what], &["distance to the last"]));
    let mut tiles = Tiles::new(&scene.grid(), (cases.len() + 1).min(5));
    tiles.shapes("shapes", &scene.distances, 0.0);
    let mut results = Vec::new();
    for (k, (label, _)) in cases.iter().enumerate() {
        let result = scene.average(label, |params| change(k, params))?;
        tiles.average(label, &result);
        results.push(result);
    }
    let outlines: Result<Vec<Contour<D>>, _> = results.iter().map(outline).collect();
    let outlines = outlines?;
    for ((result, (_, cell)), own) in results.iter().zip(cases).zip(&outlines) {
        let mut row = vec![cell.clone()];
        row.extend(usual(result));
        row.push(distance(own, &outlines[outlines.len() - 1])?.into());
        table.row(row);
    }
    Ok((table, tiles, results))
}

/// From a soft void to one as stiff as the object.
pub(super) fn elastic_domain<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let stiffness = [1e-4, 1e-2, 1e-1, 1.0];
    let cases = stiffness.map(|delta| (format!("void {delta:.0e}"), delta.into()));
    let (table, tiles, _) = compared(scene, "void stiffness", &cases, |k, params| {
        params.void_stiffness = stiffness[k];
    })?;
    Ok(Sheet {
        title: "Choice of the elastic domain",
        text: "With a soft void the object alone is elastic, and its parts move freely; with a void as \
               stiff as the object the whole box is one elastic body, in which neighbouring parts hold \
               each other, and the average keeps more of what is common in place."
            .into(),
        table,
        picture: tiles.draw(),
    })
}

/// A material that keeps lengths, and one that keeps volumes.
pub(super) fn materials() -> [(&'static str, LameModuli); 3] {
    let moduli = |mu, lambda| LameModuli { lambda, mu };
    [
        ("lengths, mu/lambda = 10", moduli(1.0, 0.1)),
        ("both, mu/lambda = 1", moduli(1.0, 1.0)),
        ("volumes, mu/lambda = 0.1", moduli(0.1, 1.0)),
    ]
}

/// Length stiffness against volume stiffness.
pub(super) fn stiffness<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let materials = materials();
    let cases = materials.map(|(name, _)| (name.to_owned(), name.into()));
    let (mut table, mut tiles, results) =
        compared(scene, "material keeps", &cases, |k, params| {
            params.law.moduli = materials[k].1;
        })?;
    let outlines: Result<Vec<Contour<D>>, _> = results.iter().map(outline).collect();
    let outlines = outlines?;
    let pairs: Vec<_> = outlines
        .iter()
        .enumerate()
        .map(|(k, contour)| (contour, crate::picture::colour(k)))
        .collect();
    tiles.outlines("all three", &pairs);
    let volume = |field: &ScalarField<f64, D>, level| -> Result<f64, CliError> {
        let outline = levelset::contour(field, level, levelset::BoxEdge::Closed);
        let moments = outline.and_then(|outline| levelset::Moments::of_contour(&outline));
        Ok(moments.map_err(shape_average::AverageError::from)?.volume)
    };
    let inputs: Result<Vec<f64>, CliError> =
        scene.distances.iter().map(|d| volume(d, 0.0)).collect();
    let inputs = inputs?;
    let mean = inputs.iter().sum::<f64>() / inputs.len() as f64;
    let volumes: Result<Vec<f64>, CliError> = results
        .iter()
        .map(|result| volume(&result.average_indicator, 0.5))
        .collect();
    let shares = volumes?.into_iter().map(|volume| (volume / mean).into());
    table.column("volume over the mean of the shapes", shares);
    Ok(Sheet {
        title: "Length stiffness against volume stiffness",
        text: "Where the shear modulus is large a material keeps lengths; where the first Lame modulus \
               is large it keeps areas or volumes, and lengths change easily."
            .into(),
        table,
        picture: tiles.draw(),
    })
}

/// From small to large weights of the mismatch.
pub(super) fn mismatch_weight<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let weights = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
    let length = scene.params.resolved_length_weight();
    let cases = weights.map(|w| (format!("weight {w}"), w.into()));
    let (table, tiles, _) = compared(scene, "mismatch weight", &cases, |k, params| {
        params.mismatch_weight = weights[k];
        params.length_weight = Some(length);
    })?;
    Ok(Sheet {
        title: "Weight of the mismatch",
        text:
            "The larger the weight, the smaller the mismatch of the deformed shapes; the elastic \
               energy increases to that of exact deformations. The weight of the length is fixed."
                .into(),
        table,
        picture: tiles.draw(),
    })
}

/// Averages of the first 2, 4, 8, ... shapes.
pub(super) fn adding_shapes<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let n = scene.n_shapes();
    let mut counts: Vec<usize> = std::iter::successors(Some(2), |k| Some(2 * k))
        .take_while(|&k| k < n)
        .collect();
    counts.push(n);
    let mut tiles = Tiles::new(&scene.grid(), (counts.len() + 1).min(4));
    tiles.shapes("shapes", &scene.distances, 0.0);
    let mut outlines = Vec::new();
    let mut cells = Vec::new();
    for &count in &counts {
        let shapes = &scene.distances[..count];
        let result = scene.average_of(&format!("{count} shapes"), shapes, &[], |_| ())?;
        tiles.average(&format!("{count} shapes"), &result);
        outlines.push(outline(&result)?);
        cells.push(usual(&result));
    }
    let mut table = Table::new(columns(&["shapes"], &["distance to the last"]));
    for ((count, usual), own) in counts.iter().zip(cells).zip(&outlines) {
        let mut row = vec![Cell::from(*count)];
        row.extend(usual);
        row.push(distance(own, &outlines[outlines.len() - 1])?.into());
        table.row(row);
    }
    Ok(Sheet {
        title: "Averages of an increasing number of shapes",
        text: "On the whole, the influence of a further shape decreases with the number of shapes."
            .into(),
        table,
        picture: tiles.draw(),
    })
}
