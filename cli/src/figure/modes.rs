//! Modes by both inner products, with and without the stress in the average, of both materials.

use fe_grid::VectorField;
use fe_grid::minimise::Silent;
use levelset::Contour;
use shape_average::{AverageParams, AverageResult};
use shape_pca::{Average, Compound, Metric, ModeSpace, Pca, PcaParams};
use shapespace_report::table::{Cell, Table};

use super::averages::materials;
use super::scene::{Scene, outline};
use super::sheet::{Comparison, Sheet, Tiles};
use crate::error::CliError;
use shapespace_picture::{INK, deviation, mix};

/// Shapes of a mode, to both sides of the average.
pub(super) const COLUMNS: usize = 5;
/// How far they go, in standard deviations.
pub(super) const AMPLITUDE: f64 = 2.0;
/// Modes drawn of every analysis.
pub(super) const MODES: usize = 2;

/// A kind of analysis.
pub(super) struct Kind {
    name: &'static str,
    metric: Metric,
    prestressed: bool,
}

/// The usual kind first.
pub(super) const KINDS: [Kind; 3] = [
    Kind {
        name: "L2",
        metric: Metric::L2,
        prestressed: true,
    },
    Kind {
        name: "Hessian",
        metric: Metric::Hessian,
        prestressed: true,
    },
    Kind {
        name: "L2, at rest",
        metric: Metric::L2,
        prestressed: false,
    },
];

/// The mode of shapes whose parts stand at different places.
pub(super) fn pins<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let mut params = scene.params.clone();
    let result = scene.average("average", |own| {
        balanced(own);
        params = own.clone();
    })?;
    stage(scene, &KINDS[0]);
    let pca = analyse(&result, &params, &KINDS[0])?;
    let (first, last) = (
        ["first eigenvalue", "second ratio"],
        ["balance", "definite"],
    );
    let mut compared = Comparison::new(&scene.grid(), COLUMNS, &first, &last);
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    let second = pca.ratios().get(1).copied().unwrap_or(0.0);
    let definite = if pca.definite() { "yes" } else { "no" };
    let last: [Cell; 2] = [pca.balance.into(), definite.into()];
    compared.add("average", [pca.modes.eigenvalues[0], second], &result, last);
    let tiles = &mut compared.tiles;
    tiles.end_row();
    draw(tiles, KINDS[0].name, &outline(&result)?, &pca, &[]);
    Ok(compared.sheet(
        "Pins at different places",
        "The average has a low pin at either place, and in its mode one of them grows while the \
         other shrinks: the two pins are not identified with each other.",
    ))
}

/// Parameters for which the stresses balance: no length carries a part of them.
pub(super) fn balanced(params: &mut AverageParams) {
    params.length_weight = Some(1e-5 * params.mismatch_weight);
    params.tolerance = params.tolerance.min(2e-4);
    params.max_iterations = params.max_iterations.max(1000);
}

/// Analyses of the same shapes.
pub(super) fn modes<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let mut table = Table::new([
        "material keeps",
        "analysis",
        "first eigenvalue",
        "second ratio",
        "third ratio",
        "balance",
        "definite",
    ]);
    let mut tiles = Tiles::new(&scene.grid(), COLUMNS);
    // Modes are drawn with the signs that those of the first analysis have.
    let mut first: Vec<VectorField<f64, D>> = Vec::new();
    for (k, (material, moduli)) in materials().into_iter().enumerate() {
        let mut params = scene.params.clone();
        let result = scene.average(material, |own| {
            own.law.moduli = moduli;
            balanced(own);
            params = own.clone();
        })?;
        let boundary = outline(&result)?;
        // All kinds of analysis of the usual material, one of each of the others.
        let kinds = if k == 1 { &KINDS[..] } else { &KINDS[..1] };
        for kind in kinds {
            stage(scene, kind);
            let pca = analyse(&result, &params, kind)?;
            let label = format!("{}, {}", kind.name, short(material));
            if first.is_empty() {
                first.clone_from(&pca.space.fields);
            }
            draw(&mut tiles, &label, &boundary, &pca, &first);
            let ratios = pca.ratios();
            let ratio = |i: usize| ratios.get(i).copied().unwrap_or(0.0);
            let definite = if pca.definite() { "yes" } else { "no" };
            table.row([
                Cell::from(material),
                kind.name.into(),
                pca.modes.eigenvalues[0].into(),
                ratio(1).into(),
                ratio(2).into(),
                pca.balance.into(),
                definite.into(),
            ]);
        }
    }
    Ok(Sheet {
        title: "Modes of variation",
        text: format!(
            "The first {MODES} modes up to {AMPLITUDE} standard deviations to both sides of the \
             average: by the inner product of L2 and by that of the second variation, about the \
             stressed average and about the average at rest, and of materials that keep lengths or \
             volumes."
        ),
        table,
        picture: tiles.draw(),
    })
}

/// The quantity that a material preserves, in a word or two.
fn short(material: &str) -> &str {
    material.split(',').next().unwrap_or(material)
}

fn stage<const D: usize>(scene: &Scene<'_, D>, kind: &Kind) {
    let stage = format!("modes by {}", kind.name);
    scene.session.progress.stage(stage);
}

/// The modes of an average by one kind of analysis.
pub(super) fn analyse<const D: usize>(
    result: &AverageResult<D>,
    params: &AverageParams,
    kind: &Kind,
) -> Result<Pca<D>, CliError> {
    let average = Average::of_result(result, params)?;
    let own = PcaParams {
        law: params.law,
        void_stiffness: params.void_stiffness,
        metric: kind.metric,
        at_rest: !kind.prestressed,
        ..PcaParams::default()
    };
    let compound = Compound::new(&average, &own)?;
    Ok(Pca::new(&average, &compound, usize::MAX, &mut Silent)?)
}

/// Draws the first modes of an analysis, each a row of shapes from one side of the average to the other. `tile`
/// draws one of them: of the number of its mode, its place in the row, the share of [`AMPLITUDE`] there, and what
/// moves boundaries so. Modes are drawn with these signs; missing ones are positive.
pub(super) fn draw_rows<const D: usize>(
    tiles: &mut Tiles<D>,
    space: &ModeSpace<D>,
    signs: &[f64],
    tile: impl Fn(&mut Tiles<D>, (usize, usize, f64), &dyn Fn(&Contour<D>) -> Contour<D>),
) {
    for j in 0..space.eigenvalues.len().min(MODES) {
        let sign = signs.get(j).copied().unwrap_or(1.0);
        for i in 0..COLUMNS {
            let share = 2.0 * i as f64 / (COLUMNS - 1) as f64 - 1.0;
            let factor = -sign * share * AMPLITUDE * space.eigenvalues[j].sqrt();
            let moved = |part: &Contour<D>| part.displaced(&space.fields[j], factor);
            tile(tiles, (j, i, share), &moved);
        }
        tiles.end_row();
    }
}

/// The first modes, each with the sign that it has in another analysis.
fn draw<const D: usize>(
    tiles: &mut Tiles<D>,
    label: &str,
    boundary: &Contour<D>,
    pca: &Pca<D>,
    like: &[VectorField<f64, D>],
) {
    let space = &pca.space;
    let sign = |(field, like): (&VectorField<f64, D>, &VectorField<f64, D>)| {
        let both = |p: &[f64; D]| -> f64 {
            let pairs = field.sample(*p).into_iter().zip(like.sample(*p));
            pairs.map(|(a, b)| a * b).sum()
        };
        f64::signum(boundary.points().iter().map(both).sum())
    };
    let signs: Vec<f64> = space
        .fields
        .iter()
        .zip(like)
        .take(MODES)
        .map(sign)
        .collect();
    draw_rows(tiles, space, &signs, |tiles, (j, i, share), moved| {
        let words = if i == 0 {
            format!("{label}, mode {}", j + 1)
        } else {
            String::new()
        };
        let pale = mix([1.0; 3], INK, 0.25);
        let shapes = [(boundary, pale), (&moved(boundary), deviation(share))];
        tiles.outlines(&words, &shapes);
    });
}
