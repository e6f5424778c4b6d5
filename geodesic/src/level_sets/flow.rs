//! Initial path: the shape flows to the other one by steepest descent of their mismatch.
//!
//! In every step the mismatch between the present shape `{u > 0}` and the end shape exerts a force
//! on the boundary; a viscous fluid, with low viscosity outside the shape, responds with the
//! velocity `v`:
//!
//! ```text
//! int kappa(u) (lambda tr e[v] tr e[w] + 2 mu e[v] : e[w]) + m v . w = -<d mismatch, w>.
//! ```
//!
//! The shape moves by a step that is short enough to avoid folding, and its level set is
//! reinitialised as a signed distance; parts of the boundary closer than a cell merge. The topology
//! thus changes without further measures. Divided into pieces of equal length, the flow is an
//! initial path.
//!
//! The flow is the steepest descent of the mismatch in the metric of the shape space itself.

use super::state::{PathState, compose};
use crate::cells::continued;
use crate::error::GeodesicError;
use crate::metric::{ElasticForm, corotational};
use crate::mismatch::{ComposedMismatch, HeavisideMismatch, Visibility};
use crate::params::GeodesicParams;
use crate::shape::{ShapeOnGrid, union_of};
use fe_grid::composition::Interpolant;
use fe_grid::minimise::{Control, Observer};
use fe_grid::multigrid::MultigridParams;
use fe_grid::{
    Assembly, CgParams, CgScratch, Data, Field, Grid, InverseDeformation, LinearOperator,
    ScalarField, conjugate_gradient, vector,
};
use hyperelastic::{Corotational, CorotationalMultigrid, CorotationalOperator, FoldBarrier};
use levelset::{Arctan, Compact, LevelsetError, Step, signed_distance};

/// Longest step, in cells.
const LONGEST_STEP: f64 = 1.5;
/// Largest strain of a step.
const LARGEST_STRAIN: f64 = 0.25;
/// Steps shorter than this, in cells, end the flow.
const SHORTEST_STEP: f64 = 0.02;
/// Widths of the mismatch's step function, in cells, from first to last.
const WIDTHS: [f64; 4] = [3.0, 1.5, 0.75, 0.5];
/// Mass `m` of the fluid relative to its shear modulus, which damps the motion where no force acts.
const MASS: f64 = 3.0;
/// Maximal number of steps for every width.
const MOST_STEPS: usize = 150;

/// The shapes of a flow.
#[derive(Clone, Debug)]
pub(crate) struct Flow<const D: usize> {
    /// Signed distances of the components, beginning with the start shape.
    pub shapes: Vec<Vec<ScalarField<f64, D>>>,
    /// The motions between them: displacements of every shape onto the next.
    pub motions: Vec<Field<f64, D, D>>,
    /// Lengths of the motions between them.
    pub lengths: Vec<f64>,
}

/// Computes the flow of one shape to another, for wide and then narrower steps of the mismatch;
/// both are signed distances of the same number of components on one grid. Where the end shape is
/// not known, no force acts.
pub(crate) fn flow<const D: usize>(
    start: &[ScalarField<f64, D>],
    end: &ShapeOnGrid<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Flow<D>, GeodesicError> {
    let grid = *start[0].grid();
    let h = grid.spacing();
    let indicator = Step::Compact(Compact::new(params.indicator_cells * h)?);
    let mut shapes = vec![start.to_vec()];
    let (mut lengths, mut motions) = (Vec::new(), Vec::new());
    let mut current = start.to_vec();
    'widths: for width in WIDTHS {
        let step = Arctan::new(width * h)?;
        let mut reached = mismatch_of(&current, end, step);
        for _ in 0..MOST_STEPS {
            if observer.between() == Control::Cancel {
                break 'widths;
            }
            let form = ElasticForm {
                moduli: params.law.moduli,
                indicator,
                step,
                stiffness: 1.0,
                void_stiffness: Corotational::<D>::LEAST_VOID_STIFFNESS,
                barrier: FoldBarrier {
                    weight: 0.0,
                    onset: 1.0,
                },
                mismatch_weight: 0.0,
                composed: &[],
                carried: &[],
                attraction: 0.0,
            };
            let force = force(&current, end, step)?;
            let fluid = Fluid::new(grid, &form, union_of(&current).as_slice())?;
            let velocity = fluid.answer(&force)?;
            let limit = longest(&grid, &velocity);
            let mut factor = limit;
            let mut moved = None;
            while factor * vector::max_abs(&velocity) > SHORTEST_STEP * h {
                let step_taken: Vec<f64> = velocity.iter().map(|v| factor * v).collect();
                let displacement = Field::from_vec(grid, step_taken)?;
                if let Some(next) = advance(&current, &displacement)? {
                    let value = mismatch_of(&next, end, step);
                    if value < reached {
                        moved = Some((next, displacement, value));
                        break;
                    }
                }
                factor *= 0.5;
            }
            let Some((next, displacement, value)) = moved else {
                break;
            };
            let fall = reached - value;
            reached = value;
            lengths.push(fluid.length(displacement.as_slice()));
            motions.push(displacement);
            shapes.push(next.clone());
            current = next;
            if fall < 1e-4 * reached {
                break;
            }
        }
    }
    Ok(Flow {
        shapes,
        motions,
        lengths,
    })
}

fn mismatch_of<const D: usize>(
    current: &[ScalarField<f64, D>],
    end: &ShapeOnGrid<D>,
    step: Arctan,
) -> f64 {
    let weight = end.weight.as_ref().map(ScalarField::as_slice);
    let pairs = current.iter().zip(&end.components);
    let total: f64 = pairs
        .map(|(u, v)| {
            let nodes = u.as_slice().iter().zip(v.as_slice()).enumerate();
            nodes
                .map(|(node, (&u, &v))| {
                    let difference: f64 = step.value(u) - step.value(v);
                    // A surplus over what has to be covered does not count.
                    if end.only_covered && difference > 0.0 {
                        return 0.0;
                    }
                    difference * difference * weight.map_or(1.0, |w| w[node])
                })
                .sum::<f64>()
        })
        .sum();
    total * current[0].grid().cell_volume()
}

/// Computes the derivative of the mismatch with respect to a motion of the fluid, at rest: on the
/// present boundary, and on that of the end shape.
fn force<const D: usize>(
    current: &[ScalarField<f64, D>],
    end: &ShapeOnGrid<D>,
    step: Arctan,
) -> Result<Vec<f64>, GeodesicError> {
    let grid = *current[0].grid();
    let rest = vec![0.0; D * grid.n_nodes()];
    let mut total = vec![0.0; rest.len()];
    // The weight belongs to the end shape, and is used as a weight of the point for both.
    let visibility = Visibility {
        start: end
            .weight
            .as_ref()
            .map(|weight| Interpolant::new(grid, weight.as_slice())),
        ..Visibility::default()
    };
    let covered = |sides| if end.only_covered { sides } else { [1.0; 2] };
    for (now, then) in current.iter().zip(&end.components) {
        for (moving, other, sign, sides) in [
            (then, now, 1.0, covered([0.0, 1.0])),
            (now, then, -1.0, covered([1.0, 0.0])),
        ] {
            let law = ComposedMismatch {
                density: HeavisideMismatch { step },
                other: continued(moving),
                visibility: Visibility {
                    sides,
                    ..visibility
                },
            };
            let coefficients = [other.as_slice()];
            let data = Data {
                coefficients: &coefficients,
                cells: &[],
            };
            Assembly::new(grid, &law, data).value_and_gradient_add(&rest, sign, &mut total)?;
        }
    }
    Ok(total)
}

/// The fluid of one state.
struct Fluid<const D: usize> {
    operator: CorotationalOperator<D>,
    cycle: CorotationalMultigrid<D>,
}

impl<const D: usize> Fluid<D> {
    fn new(
        grid: Grid<D>,
        form: &ElasticForm<'_, D>,
        level_set: &[f64],
    ) -> Result<Self, GeodesicError> {
        let rest = vec![0.0; D * grid.n_nodes()];
        let (law, mut cells) = corotational(&grid, form, level_set, &rest);
        for i in 0..D {
            cells[Corotational::<D>::mass_entry(i, i)].fill((MASS * form.moduli.mu) as f32);
        }
        let exact = cells
            .iter()
            .map(|c| c.iter().map(|&x| f64::from(x)).collect())
            .collect();
        let params = MultigridParams::default();
        Ok(Self {
            operator: CorotationalOperator::new(grid, law, exact),
            cycle: CorotationalMultigrid::new(grid, law, cells, params)?,
        })
    }

    /// Computes the velocity that corresponds to a force.
    fn answer(&self, force: &[f64]) -> Result<Vec<f64>, GeodesicError> {
        let mut velocity = vec![0.0; force.len()];
        let against: Vec<f64> = force.iter().map(|f| -f).collect();
        let params = CgParams {
            relative_tolerance: 1e-3,
            max_iterations: 60,
            ..CgParams::default()
        };
        let mut scratch = CgScratch::default();
        conjugate_gradient(
            &self.operator,
            &self.cycle,
            &against,
            &mut velocity,
            &params,
            &mut scratch,
        )?;
        Ok(velocity)
    }

    /// Returns the length of a small motion: the square root of its energy.
    fn length(&self, displacement: &[f64]) -> f64 {
        let mut image = vec![0.0; displacement.len()];
        self.operator.apply_into(displacement, &mut image);
        (0.5 * vector::dot(displacement, &image)).max(0.0).sqrt()
    }
}

/// The longest step along a velocity that moves nothing farther than [`LONGEST_STEP`] and strains
/// nothing by more than [`LARGEST_STRAIN`].
fn longest<const D: usize>(grid: &Grid<D>, velocity: &[f64]) -> f64 {
    let h = grid.spacing();
    let n = grid.n_nodes();
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut strain = 0.0f64;
    for component in velocity.chunks_exact(n) {
        for index in 0..n {
            let node = grid.node(index);
            for k in 0..D {
                if node[k] + 1 < nodes[k] {
                    let slope = (component[index + strides[k]] - component[index]).abs() / h;
                    strain = strain.max(slope);
                }
            }
        }
    }
    let speed = vector::max_abs(velocity);
    (LARGEST_STRAIN / strain.max(1e-300)).min(LONGEST_STEP * h / speed.max(1e-300))
}

/// Returns the shape moved by a displacement, as signed distances; `None` if a component vanishes.
fn advance<const D: usize>(
    current: &[ScalarField<f64, D>],
    displacement: &Field<f64, D, D>,
) -> Result<Option<Vec<ScalarField<f64, D>>>, GeodesicError> {
    let extent = displacement.grid().extent();
    let far = -extent.iter().fold(0.0f64, |a, &b| a.max(b));
    let inverse = InverseDeformation::new(displacement);
    let moved: Result<Vec<_>, _> = current
        .iter()
        .map(|u| signed_distance(&inverse.push_forward(u, far), 0.0))
        .collect();
    match moved {
        Ok(moved) => Ok(Some(moved)),
        Err(LevelsetError::EmptyObject { .. } | LevelsetError::FullObject { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

impl<const D: usize> Flow<D> {
    /// Divides the flow into a path with steps of about equal length; its last shape is the last
    /// one of the flow.
    pub fn cut(&self, steps: usize) -> PathState<D> {
        let total: f64 = self.lengths.iter().sum();
        let mut along = vec![0.0];
        for length in &self.lengths {
            along.push(along[along.len() - 1] + length);
        }
        let cuts: Vec<usize> = (0..=steps)
            .map(|k| {
                let wanted = total * k as f64 / steps as f64;
                let distance = |i: &usize| (along[*i] - wanted).abs();
                (0..along.len())
                    .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                    .unwrap_or(0)
            })
            .collect();
        PathState {
            shapes: cuts.iter().map(|&i| self.shapes[i].clone()).collect(),
            displacements: cuts
                .windows(2)
                .map(|cut| compose(self.shapes[0][0].grid(), &self.motions[cut[0]..cut[1]]))
                .collect(),
        }
    }
}
