//! Figures that compare averages of the same shapes: by weights, by the mean, by the material, the
//! void, the mismatch weight and the number of shapes.

use fe_grid::ScalarField;
use hyperelastic::LameModuli;
use levelset::{BoxEdge, Contour, contour, enclosed_volume};
use shape_average::{AverageParams, AverageResult, Mean};
use shapespace_report::table::Cell;

use super::scene::{Scene, distance, outline};
use super::sheet::{Comparison, Sheet};
use crate::average::weights_between;
use crate::error::CliError;
use shapespace_picture::colour;

/// Numbers of shapes before those that are doubled.
const FEW: [usize; 4] = [2, 4, 5, 6];

/// `--weights` from one shape to the next, and within the triangle of the first three.
pub(super) fn weights<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    const SIDE: usize = 5;
    let shapes = scene.n_shapes().min(3);
    let inputs = &scene.distances[..shapes];
    let names = ["first weight", "second weight", "third weight"];
    let last = ["distance to the first shape"];
    let mut compared = Comparison::new(&scene.grid(), SIDE, &names[..shapes], &last);
    let first = contour(&inputs[0], 0.0, BoxEdge::Closed)?;
    let mut in_row = 0;
    let mut length = 1;
    for weights in weights_between(shapes, SIDE) {
        let words: Vec<String> = weights.iter().map(|w| format!("{w:.2}")).collect();
        let label = words.join(" ");
        let result = scene.average_of(&format!("weights {label}"), inputs, &[], |params| {
            params.weights = Some(weights.clone());
        })?;
        let cells: Vec<Cell> = weights.iter().map(|w| (*w).into()).collect();
        compared.add(
            &label,
            cells,
            &result,
            [distance(&outline(&result)?, &first)?],
        );
        in_row += 1;
        if shapes == 3 && in_row == length {
            compared.tiles.end_row();
            (in_row, length) = (0, length + 1);
        }
    }
    Ok(compared.sheet(
        "Weighted averages",
        "The average moves from one shape to the next with the weights; where one has all the \
         weight it is that shape, and the others are deformed onto it.",
    ))
}

/// Mean and median of shapes whose last fifth are outliers, beside the mean of the others.
pub(super) fn median<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let n = scene.n_shapes();
    let clean = n - (n / 5).max(1);
    let mean_of_clean = format!("mean of the first {clean}");
    // The mismatch of one shape has the same weight as among all.
    let alone = scene.average_of(&mean_of_clean, &scene.distances[..clean], &[], |params| {
        params.mismatch_weight *= clean as f64 / n as f64;
    })?;
    let mean = scene.average("mean of all", |_| ())?;
    let median = scene.average("median of all", |params| params.mean = Mean::Median)?;
    let truth = outline(&alone)?;
    let last = ["distance to the clean mean"];
    let mut compared = Comparison::new(&scene.grid(), 4, &["average"], &last);
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    for (label, result) in [
        (mean_of_clean.as_str(), &alone),
        ("mean of all", &mean),
        ("median of all", &median),
    ] {
        compared.add(
            label,
            [label],
            result,
            [distance(&outline(result)?, &truth)?],
        );
    }
    Ok(compared.sheet(
        "Mean and median with outliers",
        format!(
            "The last {} of {n} shapes are outliers. They move the median less from the mean of the \
             others than the mean.",
            n - clean
        ),
    ))
}

/// Averages for several parameters, beside the shapes.
fn compare<const D: usize>(
    scene: &Scene<'_, D>,
    what: &'static str,
    cases: &[(String, Cell)],
    change: impl Fn(usize, &mut AverageParams),
) -> Result<(Comparison<D>, Vec<AverageResult<D>>), CliError> {
    let columns = (cases.len() + 1).min(5);
    let mut compared = Comparison::new(&scene.grid(), columns, &[what], &["distance to the last"]);
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    let average = |(k, (label, _)): (usize, &(String, Cell))| {
        scene.average(label, |params| change(k, params))
    };
    let results = cases.iter().enumerate().map(average);
    let results = results.collect::<Result<Vec<_>, _>>()?;
    let outlines = outlines(&results)?;
    for (((label, cell), result), own) in cases.iter().zip(&results).zip(&outlines) {
        let apart = distance(own, &outlines[outlines.len() - 1])?;
        compared.add(label, [cell.clone()], result, [apart]);
    }
    Ok((compared, results))
}

fn outlines<const D: usize>(results: &[AverageResult<D>]) -> Result<Vec<Contour<D>>, CliError> {
    results.iter().map(|result| Ok(outline(result)?)).collect()
}

/// From a soft void to one as stiff as the object.
pub(super) fn elastic_domain<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let stiffness = [1e-4, 1e-2, 1e-1, 1.0];
    let cases = stiffness.map(|delta| (format!("void {delta:.0e}"), delta.into()));
    let (compared, _) = compare(scene, "void stiffness", &cases, |k, params| {
        params.void_stiffness = stiffness[k];
    })?;
    Ok(compared.sheet(
        "Choice of the elastic domain",
        "With a soft void the object alone is elastic, and its parts move freely; with a void as \
         stiff as the object the whole box is one elastic body, in which neighbouring parts hold \
         each other, and the average keeps more of what is common in place.",
    ))
}

/// Materials that keep lengths, lengths and volumes alike, and volumes.
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
    let (mut compared, results) = compare(scene, "material keeps", &cases, |k, params| {
        params.law.moduli = materials[k].1;
    })?;
    let outlines = outlines(&results)?;
    let pairs: Vec<_> = outlines.iter().zip((0..).map(colour)).collect();
    compared.tiles.outlines("all three", &pairs);
    let volume = |field: &ScalarField<f64, D>, level| -> Result<f64, CliError> {
        let outline = contour(field, level, BoxEdge::Closed);
        let volume = outline.and_then(|outline| enclosed_volume(&outline));
        Ok(volume?)
    };
    let inputs = scene.distances.iter().map(|shape| volume(shape, 0.0));
    let inputs = inputs.collect::<Result<Vec<f64>, _>>()?;
    let mean = inputs.iter().sum::<f64>() / inputs.len() as f64;
    let volumes = results.iter().map(|r| volume(&r.average_indicator, 0.5));
    let volumes = volumes.collect::<Result<Vec<f64>, _>>()?;
    let shares = volumes.into_iter().map(|volume| (volume / mean).into());
    compared
        .table
        .column("volume over the mean of the shapes", shares);
    Ok(compared.sheet(
        "Length stiffness against volume stiffness",
        "Where the shear modulus is large a material keeps lengths; where the first Lame modulus is \
         large it keeps areas or volumes, and lengths change easily. The ratios of the first and the last are \
         those of the factors of lengths and of volumes in the two averages of a moving figure in the lecture \
         notes, (a1, a2, a3) = (10^7, 0, 10^6) and (10^5, 0, 10^6).",
    ))
}

/// From small to large weights of the mismatch.
pub(super) fn mismatch_weight<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let weights = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
    let length = scene.params.resolved_length_weight();
    let cases = weights.map(|w| (format!("weight {w}"), w.into()));
    let (compared, _) = compare(scene, "mismatch weight", &cases, |k, params| {
        params.mismatch_weight = weights[k];
        params.length_weight = Some(length);
    })?;
    Ok(compared.sheet(
        "Weight of the mismatch",
        "The larger the weight, the smaller the mismatch of the deformed shapes; the elastic energy \
         increases to that of exact deformations. The weight of the length is fixed.",
    ))
}

/// Averages of the first 2, 4, 5, 6, 8, 16 shapes, and so on by doubling.
pub(super) fn adding_shapes<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let n = scene.n_shapes();
    let doubled = std::iter::successors(Some(8), |k| Some(2 * k));
    let all = FEW.into_iter().chain(doubled);
    let mut counts: Vec<usize> = all.take_while(|&k| k < n).collect();
    counts.push(n);
    let columns = (counts.len() + 1).min(4);
    let last = ["distance to the last"];
    let mut compared = Comparison::new(&scene.grid(), columns, &["shapes"], &last);
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    let average = |&count: &usize| {
        let shapes = &scene.distances[..count];
        scene.average_of(&format!("{count} shapes"), shapes, &[], |_| ())
    };
    let results = counts.iter().map(average).collect::<Result<Vec<_>, _>>()?;
    let outlines = outlines(&results)?;
    for ((count, result), own) in counts.iter().zip(&results).zip(&outlines) {
        let apart = distance(own, &outlines[outlines.len() - 1])?;
        compared.add(&format!("{count} shapes"), [*count], result, [apart]);
    }
    Ok(compared.sheet(
        "Averages of an increasing number of shapes",
        "On the whole, the influence of a further shape decreases with the number of shapes.",
    ))
}
