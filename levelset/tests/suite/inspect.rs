//! Inspection of single shapes: contact with the border, specks, thin parts, narrow gaps.

use fe_grid::{Field, Grid};
use levelset::inspect::{border_share, narrow_gap_share, specks, thin_share};
use levelset::{BoxEdge, Contour, contour};
use proptest::prelude::*;

use crate::common::{ball, noise};

/// Signed distances of a bar along the first axis, of this thickness in spacings, with rounded
/// ends: the same along all other axes. It is centred `shift` spacings beside a node.
fn bar<const D: usize>(grid: Grid<D>, thickness: f64, shift: f64) -> Field<f64, D, 1> {
    let h = grid.spacing();
    let [from, to] = [0.3, 0.7];
    Field::from_fn(grid, |x| {
        let beyond = (from - x[0]).max(x[0] - to).max(0.0);
        let across = (1..D)
            .map(|k| (x[k] - 0.5 - shift * h).powi(2))
            .sum::<f64>();
        [0.5 * thickness * h - beyond.hypot(across.sqrt())]
    })
}

fn flipped<const D: usize>(field: &Field<f64, D, 1>, axis: usize) -> Field<f64, D, 1> {
    let grid = *field.grid();
    let last = grid.nodes_per_axis()[axis] - 1;
    let values = (0..grid.n_nodes()).map(|index| {
        let mut node = grid.node(index);
        node[axis] = last - node[axis];
        field.as_slice()[grid.node_index(node)]
    });
    Field::from_vec(grid, values.collect()).unwrap()
}

fn bars_are_thin_below_three_cells<const D: usize>(nodes: usize, shift: f64) {
    let share = |thickness| thin_share(&bar(Grid::<D>::cube(nodes), thickness, shift));
    for thickness in [1.5, 2.0, 2.5, 2.9] {
        assert_eq!(share(thickness), 1.0, "{thickness}");
    }
    // The nodes next to the axis are up to half the diagonal of the other axes away from it: some
    // of the bar remains, less than is doubtful.
    let limit = if D == 2 { 4.5 } else { 5.5 };
    for (thickness, most) in [(limit, 0.05), (limit + 1.0, 0.01), (8.0, 0.01)] {
        let share = share(thickness);
        assert!(share < most, "{thickness}: {share}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn the_width_of_bars_decides(shift in -0.5f64..0.5) {
        bars_are_thin_below_three_cells::<2>(65, shift);
        bars_are_thin_below_three_cells::<3>(33, shift);
    }

    #[test]
    fn reflections_change_nothing(seed in any::<u64>()) {
        let flat = noise([9, 12], seed);
        let solid = noise([6, 7, 8], seed);
        for axis in 0..3 {
            if axis < 2 {
                let other = flipped(&flat, axis);
                prop_assert_eq!(border_share(&flat, 0.0), border_share(&other, 0.0));
                prop_assert_eq!(specks(&flat, 0.2), specks(&other, 0.2));
            }
            let other = flipped(&solid, axis);
            prop_assert_eq!(border_share(&solid, 0.0), border_share(&other, 0.0));
            prop_assert_eq!(specks(&solid, 0.3), specks(&other, 0.3));
        }
    }
}

#[test]
fn a_thin_limb_is_a_share_of_its_shape() {
    let grid = Grid::<2>::cube(129);
    let h = grid.spacing();
    let shape = |width: f64| {
        let field = Field::from_fn(grid, move |[x, y]| {
            let body = 0.2 - (x - 0.35).hypot(y - 0.5);
            let limb = (0.5 * width * h - (y - 0.5).abs())
                .min(0.85 - x)
                .min(x - 0.35);
            [body.max(limb)]
        });
        levelset::signed_distance(&field, 0.0).unwrap()
    };
    let thick = thin_share(&shape(6.0));
    assert!(thick < 0.003, "{thick}");
    // Two and a half cells by .3 beside a disk, up to the fillet at the disk.
    let limb = 2.5 * h * 0.3;
    let exact = limb / (limb + std::f64::consts::PI * 0.04);
    let thin = thin_share(&shape(2.5));
    // Nodes are counted: three rows for two and a half cells.
    assert!((0.8..1.25).contains(&(thin / exact)), "{thin} {exact}");
}

#[test]
fn thick_shapes_with_corners_are_resolved() {
    let flat = Field::<f64, 2, 1>::from_fn(Grid::cube(65), |[x, y]| {
        [0.2 - (x - 0.5).abs().max((y - 0.5).abs())]
    });
    let share = thin_share(&levelset::signed_distance(&flat, 0.0).unwrap());
    assert!(share < 0.01, "{share}");
    let solid = Field::<f64, 3, 1>::from_fn(Grid::cube(33), |x| {
        [0.2 - x.iter().map(|t| (t - 0.5).abs()).fold(0.0, f64::max)]
    });
    let share = thin_share(&levelset::signed_distance(&solid, 0.0).unwrap());
    assert!(share < 0.03, "{share}");
    assert_eq!(thin_share(&ball(Grid::<2>::cube(65), 0.3)), 0.0);
    assert_eq!(thin_share(&ball(Grid::<3>::cube(33), 0.3)), 0.0);
    let nothing = Field::<f64, 2, 1>::from_fn(Grid::cube(9), |_| [-1.0]);
    assert_eq!(thin_share(&nothing), 0.0);
}

/// Two blocks beside each other, the long sides of which face each other across a gap, by their corners
/// only.
fn blocks(gap: f64) -> Contour<2> {
    let block = |low: f64, high: f64| {
        let points = vec![[low, 0.3], [high, 0.3], [high, 0.7], [low, 0.7]];
        Contour::new(points, vec![[0, 1], [1, 2], [2, 3], [3, 0]]).unwrap()
    };
    block(0.2, 0.5 - 0.5 * gap).joined(&block(0.5 + 0.5 * gap, 0.8))
}

proptest! {
    #[test]
    fn a_gap_counts_with_the_sides_that_face_each_other(gap in 0.001..0.06_f64, width in 0.01..0.04_f64) {
        prop_assume!((gap - width).abs() > 1e-6);
        let share = narrow_gap_share(&blocks(gap), width).unwrap();
        let perimeter = 2.0 * (0.6 - gap + 0.8);
        let exact = if gap < width { 0.8 / perimeter } else { 0.0 };
        // Pieces are up to a width long, and those at the four ends may face the next side.
        let ends = 4.0 * width / perimeter;
        prop_assert!(share <= exact + 1e-12 && share >= exact - ends, "{share} {exact}");
    }
}

#[test]
fn gaps_are_those_of_the_outside_in_space_too() {
    // Two plates, three cells thick, with a gap of 1.6 cells, as a grid draws them.
    let grid = Grid::<3>::cube(33);
    let h = grid.spacing();
    let plates = Field::from_fn(grid, |[x, y, z]| {
        let across = 1.5 * h - ((x - 0.5).abs() - 2.3 * h).abs();
        [across.min(0.3 - (y - 0.5).abs()).min(0.3 - (z - 0.5).abs())]
    });
    let plates = contour(&plates, 0.0, BoxEdge::Closed).unwrap();
    let share = |width: f64| narrow_gap_share(&plates, width * h).unwrap();
    // Two of four large faces; four rims are each three cells high.
    let exact = 2.0 * 0.36 / (4.0 * 0.36 + 8.0 * 0.6 * 3.0 * h);
    let found = share(2.0) / exact;
    // Half a width from the rims, 8 % of the faces, the rim may be nearer than the other side.
    assert!(found > 0.92 && found < 1.02, "{found}");
    assert_eq!(share(1.5), 0.0);
}

#[test]
fn the_border_is_counted_by_nodes() {
    let grid = Grid::<2>::with_nodes([5, 4], 1.0).unwrap();
    let left = Field::<f64, 2, 1>::from_fn(grid, |[x, _]| [0.5 - x]);
    // One column of four among the fourteen nodes of the border.
    assert_eq!(border_share(&left, 0.0), 4.0 / 14.0);
    let ball = ball(Grid::<3>::cube(17), 0.3);
    assert_eq!(border_share(&ball, 0.0), 0.0);
    let mut outside = ball;
    outside.as_mut_slice().iter_mut().for_each(|u| *u = -*u);
    assert_eq!(border_share(&outside, 0.0), 1.0);
}

#[test]
fn specks_are_small_and_apart() {
    let grid = Grid::<2>::with_nodes([40, 40], 1.0).unwrap();
    let disk = |extra: &[[usize; 2]]| {
        let mut field = Field::<f64, 2, 1>::from_fn(grid, |[x, y]| {
            [f64::from(u8::from((x - 18.0).hypot(y - 18.0) < 10.0))]
        });
        for node in extra {
            field.as_mut_slice()[grid.node_index(*node)] = 1.0;
        }
        specks(&field, 0.5)
    };
    assert_eq!(disk(&[]), 0);
    assert_eq!(disk(&[[35, 35]]), 1);
    assert_eq!(disk(&[[35, 35], [36, 36], [2, 3]]), 2);
    // It touches the disk by a corner: (18 + 6, 18 + 7) lies inside, (25, 26) does not.
    assert_eq!(disk(&[[25, 26]]), 0);
    // A sixth of the size of the disk: an object of its own.
    let pair = Field::<f64, 2, 1>::from_fn(grid, |[x, y]| {
        [(10.0 - (x - 15.0).hypot(y - 15.0)).max(4.0 - (x - 32.0).hypot(y - 32.0))]
    });
    assert_eq!(specks(&pair, 0.0), 0);
}
