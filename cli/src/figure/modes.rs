//! Modes by both inner products, with and without the stress in the average, of both materials.

use fe_grid::VectorField;
use fe_grid::minimise::Silent;
use levelset::{BoxEdge, Contour, contour};
use shape_average::{AverageParams, AverageResult};
use shape_pca::{Average, Balancing, Compound, Metric, ModeSpace, Pca, PcaParams, Variation};
use shapespace_report::table::{Cell, Table};

use super::averages::materials;
use super::scene::Scene;
use super::sheet::{Sheet, Tiles};
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
    variation: Variation,
}

/// The usual kind first.
pub(super) const KINDS: [Kind; 3] = [STRESSED, HESSIAN, AT_REST];

const STRESSED: Kind = Kind {
    name: "L2",
    metric: Metric::L2,
    prestressed: true,
    variation: Variation::Stress,
};
const HESSIAN: Kind = Kind {
    name: "Hessian",
    metric: Metric::Hessian,
    ..STRESSED
};
const AT_REST: Kind = Kind {
    name: "L2, at rest",
    prestressed: false,
    ..STRESSED
};
const OF_DISPLACEMENTS: Kind = Kind {
    name: "displacements",
    variation: Variation::Displacement,
    ..STRESSED
};

/// Columns of tables for every analysis.
const USUAL: [&str; 5] = [
    "first eigenvalue",
    "second ratio",
    "third ratio",
    "imbalance",
    "definite",
];

/// The cells of [`USUAL`].
fn usual<const D: usize>(pca: &Pca<D>) -> [Cell; 5] {
    let [first, second, third] = eigenvalues(pca);
    let definite = if pca.definite() { "yes" } else { "no" };
    [
        first,
        second,
        third,
        pca.imbalance().into(),
        definite.into(),
    ]
}

/// The first eigenvalue, and the next two over it.
pub(super) fn eigenvalues<const D: usize>(pca: &Pca<D>) -> [Cell; 3] {
    let ratios = pca.ratios();
    let ratio = |i: usize| ratios.get(i).copied().unwrap_or(0.0);
    [
        pca.modes.eigenvalues[0].into(),
        ratio(1).into(),
        ratio(2).into(),
    ]
}

/// The mode of shapes whose parts stand at different places.
pub(super) fn pins<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let mut table = Table::new([&["analysis"], &USUAL[..]].concat());
    let mut tiles = Tiles::new(&scene.grid(), COLUMNS);
    let result = scene.average("average", |_| ())?;
    tiles.shapes("shapes", &scene.distances, 0.0);
    tiles.average("average", &result);
    tiles.end_row();
    let mut first = Vec::new();
    for kind in [STRESSED, AT_REST, OF_DISPLACEMENTS] {
        let (pca, boundary) = analyse(scene, &result, &scene.params, &kind)?;
        if first.is_empty() {
            first.clone_from(&pca.space.fields);
        }
        draw(&mut tiles, kind.name, &boundary, &pca, &first);
        table.row([Cell::from(kind.name)].into_iter().chain(usual(&pca)));
    }
    Ok(Sheet {
        title: "Pins at different places",
        text: "The average has a low pin at either place, and in its mode one of them grows while the other \
               shrinks: the two pins are not identified with each other. The deformations onto the average are \
               so large that the energy is not convex about it with their stresses; about the average at rest it \
               is, and displacements to the shapes need no stresses."
            .into(),
        table,
        picture: tiles.draw(),
    })
}

/// Analyses of the same shapes.
pub(super) fn modes<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let mut table = Table::new([&["material keeps", "analysis"], &USUAL[..]].concat());
    let mut tiles = Tiles::new(&scene.grid(), COLUMNS);
    // Modes are drawn with the signs that those of the first analysis have.
    let mut first: Vec<VectorField<f64, D>> = Vec::new();
    for (k, (material, moduli)) in materials().into_iter().enumerate() {
        let mut params = scene.params.clone();
        let result = scene.average(material, |own| {
            own.law.moduli = moduli;
            params = own.clone();
        })?;
        // All kinds of analysis of the usual material, one of each of the others.
        let kinds = if k == 1 { &KINDS[..] } else { &KINDS[..1] };
        for kind in kinds {
            let (pca, boundary) = analyse(scene, &result, &params, kind)?;
            let label = format!("{}, {}", kind.name, short(material));
            if first.is_empty() {
                first.clone_from(&pca.space.fields);
            }
            draw(&mut tiles, &label, &boundary, &pca, &first);
            let names = [Cell::from(material), kind.name.into()];
            table.row(names.into_iter().chain(usual(&pca)));
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

/// The modes of an average by one kind of analysis, as `shapespace pca` computes them, and the boundary of the
/// average, whose stresses have been balanced where the modes rest on them.
pub(super) fn analyse<const D: usize>(
    scene: &Scene<'_, D>,
    result: &AverageResult<D>,
    params: &AverageParams,
    kind: &Kind,
) -> Result<(Pca<D>, Contour<D>), CliError> {
    let stage = format!("modes by {}", kind.name);
    scene.session.progress.stage(stage);
    let mut average = Average::of_result(result, params)?;
    let own = PcaParams {
        law: params.law,
        void_stiffness: params.void_stiffness,
        metric: kind.metric,
        at_rest: !kind.prestressed,
        variation: kind.variation,
        ..PcaParams::default()
    };
    if kind.variation == Variation::Stress {
        let balancing = Balancing {
            min_determinant: params.min_determinant,
            ..Balancing::default()
        };
        average = balancing.balance(&average, &own, &mut Silent)?.0;
    }
    let compound = Compound::new(&average, &own)?;
    let pca = Pca::new(&average, &compound, usize::MAX, &mut Silent)?;
    scene.doubts.borrow_mut().extend(pca.doubts());
    let boundary = contour(average.object(), 0.5, BoxEdge::Closed)?;
    Ok((pca, boundary))
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
            format!("{:+.0} s.d.", share * AMPLITUDE).replace("+0 s.d.", "average")
        };
        let pale = mix([1.0; 3], INK, 0.25);
        let shapes = [(boundary, pale), (&moved(boundary), deviation(share))];
        tiles.outlines(&words, &shapes);
    });
}
