//! Built-in shapes of figures without input files.

use std::path::Path;

use fe_grid::Grid;
use shapespace_generate::{
    Bar, Blob, Cross, Ellipsoid, Family, Implicit, Letter, Outline, Pen, Placed, Star, area_share,
    family, letter, letters,
};

use super::FigureName;
use shapespace_input::Image;

type Drawn = (String, Box<dyn Implicit<2>>);

/// The shapes of a figure as images with this number of nodes per side, with paths in a folder.
pub(super) fn images(figure: FigureName, nodes: usize, folder: &Path) -> Vec<Image<2>> {
    let grid = Grid::<2>::cube(nodes);
    shapes(figure)
        .iter()
        .map(|(name, shape)| drawn_image(name, shape.as_ref(), grid, folder))
        .collect()
}

/// A built-in shape as an image, with a path in a folder.
pub(crate) fn drawn_image(
    name: &str,
    shape: &dyn Implicit<2>,
    grid: Grid<2>,
    folder: &Path,
) -> Image<2> {
    Image {
        values: area_share(&Placed::centred(shape), grid).into_vec().into(),
        size: grid.nodes_per_axis(),
        spacing: [1.0; 2],
        origin: [0.0; 2],
        path: folder.join(format!("{name}.npy")),
        affine: None,
        direction: None,
        plain_array: true,
        outline: None,
        remark: None,
    }
}

/// The numbers of built-in shapes that are compared with each other, in their order.
pub(super) fn groups(figure: FigureName) -> Vec<usize> {
    match figure {
        FigureName::Related => vec![2, 2, 5],
        FigureName::Fluids => vec![2, 2, 2],
        _ => vec![shapes(figure).len()],
    }
}

fn bar(angle: f64) -> Box<dyn Implicit<2>> {
    Box::new(Bar::new(0.6, 0.12, angle))
}

/// A block with a pin on its upper side, at a share of its length.
fn pinned(place: f64) -> Box<dyn Implicit<2>> {
    let (left, right) = (place - 0.0625, place + 0.0625);
    let corners = [
        [0.0, 0.16],
        [left, 0.16],
        [left, 0.0],
        [right, 0.0],
        [right, 0.16],
        [1.0, 0.16],
        [1.0, 0.44],
        [0.0, 0.44],
    ];
    Box::new(Outline::new(vec![Pen::polygon(&corners)], 0.64))
}

fn cross(bend: [f64; 2]) -> Box<dyn Implicit<2>> {
    Box::new(Cross {
        arm: 0.33,
        width: 0.11,
        bend,
    })
}

fn drawn_letter(which: Letter) -> Drawn {
    let name = format!("letter_{which:?}").to_lowercase();
    (name, Box::new(letter(which)))
}

fn shapes(figure: FigureName) -> Vec<Drawn> {
    let named = |kind: &str, shapes: Vec<Box<dyn Implicit<2>>>| -> Vec<Drawn> {
        let numbered = shapes.into_iter().enumerate();
        numbered
            .map(|(k, shape)| (format!("{kind}_{k:03}"), shape))
            .collect()
    };
    match figure {
        FigureName::Median => {
            // Spread evenly about the middle, where mean and median of the bars alone agree.
            let angles = [138.0, 142.0, 146.0, 150.0, 150.0, 154.0, 158.0, 162.0];
            let mut shapes: Vec<Box<dyn Implicit<2>>> = angles.map(bar).into();
            shapes.push(Box::new(Ellipsoid { radii: [0.2; 2] }));
            shapes.push(Box::new(Star {
                pins: 5,
                radius: 0.17,
                reach: 0.3,
                width: 0.07,
                first_pin: 0.0,
            }));
            named("shape", shapes)
        }
        FigureName::ForceBalance => {
            let thick = |angle| -> Box<dyn Implicit<2>> { Box::new(Bar::new(0.62, 0.22, angle)) };
            named("bar", vec![thick(180.0), thick(130.0)])
        }
        FigureName::MismatchWeight | FigureName::InverseModel => {
            named("bar", vec![bar(180.0), bar(118.0)])
        }
        FigureName::Weights | FigureName::ElasticDomain | FigureName::Steps => {
            let letters = letters().into_iter();
            letters.map(|member| (member.name, member.shape)).collect()
        }
        FigureName::Stiffness => named(
            "shape",
            vec![
                // Not crossed: such shapes have other averages, in which one is turned onto the other.
                Box::new(Ellipsoid { radii: [0.34, 0.1] }),
                Box::new(Ellipsoid {
                    radii: [0.26, 0.16],
                }),
                Box::new(Ellipsoid { radii: [0.2, 0.23] }),
            ],
        ),
        FigureName::AddingShapes => {
            let blob = |k: u64| -> Box<dyn Implicit<2>> { Box::new(Blob::<2>::new(0.24, 0.3, k)) };
            named("blob", (1..=20).map(blob).collect())
        }
        FigureName::LargeBends => named("cross", vec![cross([51.0, 51.0]), cross([-51.0, -51.0])]),
        FigureName::MissingParts => named("bar", vec![bar(180.0), bar(160.0), bar(150.0)]),
        FigureName::Components => super::components::bars(),
        FigureName::Pins => named("pin", vec![pinned(0.25), pinned(0.75)]),
        FigureName::Modes => {
            let bends = [[20.0, 12.5], [20.0, -12.5], [-20.0, 12.5], [-20.0, -12.5]];
            named("cross", bends.map(cross).into())
        }
        FigureName::Related => {
            let hands = family::<2>(Family::Hands, 0)
                .unwrap_or_default()
                .into_iter();
            let mut all = named("bar", vec![bar(180.0), bar(118.0)]);
            all.extend(named("pin", vec![pinned(0.25), pinned(0.75)]));
            all.extend(hands.map(|member| (member.name, member.shape)));
            all
        }
        FigureName::Fluids => {
            let mut all = named("bar", vec![bar(180.0), bar(118.0)]);
            all.extend([Letter::B, Letter::SerifB, Letter::M, Letter::O].map(drawn_letter));
            all
        }
        FigureName::Minima => {
            let ellipse =
                |radii: [f64; 2]| -> Box<dyn Implicit<2>> { Box::new(Ellipsoid { radii }) };
            named("ellipse", vec![ellipse([0.35, 0.2]), ellipse([0.2, 0.35])])
        }
    }
}
