//! The difference of a moved shape from a target, and its minimisation.

use levelset::{LevelsetError, Moments, RigidMotion};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::indicator::{Indicator, Masked, Part};
use levelset::rigid_motion::{angle_between, plane_rotation};

/// Maximal number of steps of one refinement; most end after five to ten.
const MAX_STEPS: usize = 40;
/// A refinement ends when a step moves no point by more than this fraction of the spacing.
const SMALLEST_STEP: f64 = 1e-3;

/// Iterations of re-centring a partially visible shape on the visible part of its target.
const SETTLING: usize = 3;

/// A pose of a shape: a rotation about its centroid, which is placed at `centre`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose<const D: usize> {
    rotation: SMatrix<f64, D, D>,
    centre: SVector<f64, D>,
}

impl<const D: usize> Pose<D> {
    pub(super) fn angle_to(&self, other: &Self) -> f64 {
        angle_between(&self.rotation, &other.rotation)
    }
}

/// A shape to be moved onto a target.
pub(super) struct Matching<'a, const D: usize> {
    target: &'a Indicator<D>,
    shape: &'a Masked<'a, D>,
    moments: Moments<D>,
    norm_squared: f64,
}

impl<'a, const D: usize> Matching<'a, D> {
    pub(super) fn new(
        target: &'a Indicator<D>,
        shape: &'a Masked<'a, D>,
    ) -> Result<Self, LevelsetError> {
        let still = [(shape, RigidMotion::identity())];
        let own = Indicator::mean(&still, *target.nodes(), target.step)?;
        let squares = |f: &Indicator<D>| f.values().map(|v| v * v).sum::<f64>();
        Ok(Self {
            target,
            shape,
            moments: own.moments,
            norm_squared: squares(&own) + squares(target),
        })
    }

    pub(super) fn target_covariance(&self) -> SMatrix<f64, D, D> {
        self.target.moments.covariance
    }

    pub(super) fn shape_covariance(&self) -> SMatrix<f64, D, D> {
        self.moments.covariance
    }

    /// Returns the pose with a given rotation and matching centroids: that of the visible part of
    /// the shape, and that of the part of the target visible to the shape in this pose.
    pub(super) fn centred(&self, rotation: SMatrix<f64, D, D>) -> Pose<D> {
        let mut pose = Pose {
            rotation,
            centre: self.target.moments.centroid,
        };
        if self.shape.is_masked() {
            for _ in 0..SETTLING {
                pose.centre = self.visible_centroid(&pose).unwrap_or(pose.centre);
            }
        }
        pose
    }

    /// Returns the centroid of the part of the target that is visible to a shape.
    fn visible_centroid(&self, pose: &Pose<D>) -> Option<SVector<f64, D>> {
        let motion = self.motion(pose);
        let nodes = self.target.nodes();
        let (mut sum, mut total) = (SVector::zeros(), 0.0);
        for (index, target) in self.target.values().enumerate() {
            let index = index % nodes.n_nodes();
            if target > 0.0 {
                let y = nodes.position(nodes.node(index));
                let weight = target * self.shape.weight(&motion.map_back(y));
                sum += SVector::from(y) * weight;
                total += weight;
            }
        }
        (total > 0.0).then(|| sum / total)
    }

    pub(super) fn pose(&self, motion: &RigidMotion<D>) -> Pose<D> {
        Pose {
            rotation: *motion.rotation(),
            centre: motion.rotation() * self.moments.centroid + motion.translation(),
        }
    }

    pub(super) fn motion(&self, pose: &Pose<D>) -> RigidMotion<D> {
        let translation = pose.centre - pose.rotation * self.moments.centroid;
        RigidMotion::from_parts(pose.rotation, translation)
    }

    /// Returns a difference divided by the sum of both indicators' squares.
    pub(super) fn relative(&self, difference: f64) -> f64 {
        difference / self.norm_squared
    }

    /// Returns the difference of a relative mismatch.
    pub(super) fn absolute(&self, mismatch: f64) -> f64 {
        mismatch * self.norm_squared
    }

    /// Computes the sum of the squared difference of the indicators over the visible nodes.
    pub(super) fn difference(&self, pose: &Pose<D>) -> f64 {
        let mut sum = 0.0;
        let motion = self.motion(pose);
        for part in 0..self.shape.parts.len() {
            self.visit(part, &motion, |index, target, _, z, u| {
                sum += self.weight(index, z) * (self.target.step.value(u) - target).powi(2);
            });
        }
        sum
    }

    /// Calls `work` at every node where the indicator of a component of the moved shape may differ from that
    /// of the target, with the index of the node, the target's indicator, the node `y`, the point `z`
    /// of the shape that lies there, and the shape's distance `u(z)`.
    ///
    /// Where `u` is beyond the step, it stays there for some nodes of the row, by its
    /// steepness. There `u` is not evaluated, but replaced by a value on the same side, and the
    /// node is passed over if the target is on that side, too.
    fn visit(
        &self,
        part: usize,
        motion: &RigidMotion<D>,
        mut work: impl FnMut(usize, f64, &[f64; D], &[f64; D], f64),
    ) {
        let nodes = self.target.nodes();
        let Part {
            distance,
            steepness,
        } = &self.shape.parts[part];
        // From one node of a row to the next.
        let (h, turned) = (nodes.spacing(), motion.rotation().row(0));
        let row = nodes.nodes_per_axis()[0];
        let half_width = self.target.step.half_width();
        let most = steepness * h;
        let targets = self.target.parts[part].as_slice();
        for (first, targets) in targets.chunks_exact(row).enumerate() {
            let first = first * row;
            let mut y = nodes.position(nodes.node(first));
            let (begin, from) = (motion.map_back(y), y[0]);
            let (mut known, mut beyond) = (0, 0.0);
            for (i, &target) in targets.iter().enumerate() {
                let same = target == if beyond > 0.0 { 1.0 } else { 0.0 };
                if known > 0 && same {
                    known -= 1;
                    continue;
                }
                let along = h * i as f64;
                y[0] = from + along;
                let z = std::array::from_fn(|k| begin[k] + along * turned[k]);
                if known > 0 {
                    known -= 1;
                    work(first + i, target, &y, &z, beyond);
                    continue;
                }
                let u = distance.value(&z);
                // Less by far more than what rounding adds.
                let excess = (1.0 - 1e-9) * u.abs() - half_width;
                if excess > 0.0 {
                    known = (excess / most) as usize;
                    beyond = (2.0 * half_width).copysign(u);
                }
                work(first + i, target, &y, &z, u);
            }
        }
    }

    /// Returns the product of the target's visibility at a node and the shape's at a point.
    fn weight(&self, index: usize, z: &[f64; D]) -> f64 {
        self.target.weights.as_slice()[index] * self.shape.weight(z)
    }

    /// Finds the minimum near a pose by Levenberg-Marquardt steps; returns the difference and the
    /// pose.
    pub(super) fn refine(&self, start: &Pose<D>) -> (f64, Pose<D>) {
        let (mut pose, mut damping) = (*start, 1e-3);
        let mut system = self.linearise(&pose);
        let enough = SMALLEST_STEP * self.target.nodes().spacing();
        // Typical distance of the shape's points from its centroid.
        let radius = self.moments.covariance.trace().sqrt();
        for _ in 0..MAX_STEPS {
            let Some(step) = system.step(damping) else {
                break;
            };
            let trial = moved(&pose, &step);
            let tried = self.linearise(&trial);
            let shifts = step.iter().take(D).map(|s| s.abs());
            let turns = step.iter().skip(D).map(|s| s.abs() * radius);
            let size = shifts.chain(turns).fold(0.0, f64::max);
            if tried.value < system.value {
                (pose, system) = (trial, tried);
                damping = (damping / 10.0f64).max(1e-9);
            } else {
                damping *= 10.0;
            }
            if size < enough || damping > 1e6 {
                break;
            }
        }
        (system.value, pose)
    }

    /// Computes the difference and its Gauss-Newton system at a pose.
    ///
    /// With `z = R^T (y - p) + c` and `g = H'(u(z)) R grad u(z)`, the residual `H(u(z)) - I(y)`
    /// changes by `-g . dp` for a shift and by `-(g_j q_i - g_i q_j)`, `q = y - p`, for a turn
    /// from axis `i` to axis `j`. The visibility mask of the shape moves with it; the system
    /// neglects the motion of the mask's edge over the target, the difference includes it.
    fn linearise(&self, pose: &Pose<D>) -> System {
        let mut sums = Sums::<D>::zeros();
        let mut slope = [0.0; MOST_UNKNOWNS];
        let motion = self.motion(pose);
        for (part, own) in self.shape.parts.iter().enumerate() {
            self.visit(part, &motion, |index, target, y, z, u| {
                let weight = self.weight(index, z);
                let residual = self.target.step.value(u) - target;
                sums.value += weight * residual * residual;
                let rate = self.target.step.derivative(u);
                if rate == 0.0 {
                    return;
                }
                let g = pose.rotation * SVector::from(own.distance.gradient(z)) * rate;
                let q = SVector::from(*y) - pose.centre;
                for k in 0..D {
                    slope[k] = -g[k];
                }
                for (k, &(i, j)) in planes::<D>().iter().enumerate() {
                    slope[D + k] = -(g[j] * q[i] - g[i] * q[j]);
                }
                sums.add(weight, residual, &slope);
            });
        }
        sums.system()
    }
}

/// Planes of rotation: pairs of axes.
const fn planes<const D: usize>() -> &'static [(usize, usize)] {
    match D {
        2 => &[(0, 1)],
        _ => &[(0, 1), (0, 2), (1, 2)],
    }
}

/// Returns a pose after a step: shifts along the axes, then rotations in the planes.
fn moved<const D: usize>(pose: &Pose<D>, step: &DVector<f64>) -> Pose<D> {
    let mut rotation = pose.rotation;
    for (k, &(i, j)) in planes::<D>().iter().enumerate() {
        rotation = plane_rotation(i, j, step[D + k]) * rotation;
    }
    Pose {
        rotation,
        centre: pose.centre + SVector::from_fn(|k, _| step[k]),
    }
}

/// Number of unknowns of a motion in space: shifts and turns.
const MOST_UNKNOWNS: usize = 6;

/// The sums `sum w r^2`, `J^T w r` and `J^T w J` while nodes are added.
struct Sums<const D: usize> {
    value: f64,
    rhs: [f64; MOST_UNKNOWNS],
    /// The entries on and below the diagonal.
    matrix: [[f64; MOST_UNKNOWNS]; MOST_UNKNOWNS],
}

impl<const D: usize> Sums<D> {
    /// Number of unknowns.
    const N: usize = D + planes::<D>().len();

    fn zeros() -> Self {
        Self {
            value: 0.0,
            rhs: [0.0; MOST_UNKNOWNS],
            matrix: [[0.0; MOST_UNKNOWNS]; MOST_UNKNOWNS],
        }
    }

    fn add(&mut self, weight: f64, residual: f64, slope: &[f64; MOST_UNKNOWNS]) {
        for (i, row) in self.matrix.iter_mut().enumerate().take(Self::N) {
            let weighted = weight * slope[i];
            self.rhs[i] += residual * weighted;
            for (sum, slope) in row.iter_mut().zip(slope).take(i + 1) {
                *sum += weighted * slope;
            }
        }
    }

    fn system(&self) -> System {
        System {
            value: self.value,
            rhs: DVector::from_column_slice(&self.rhs[..Self::N]),
            matrix: DMatrix::from_fn(Self::N, Self::N, |i, j| self.matrix[i.max(j)][i.min(j)]),
        }
    }
}

/// A Gauss-Newton system: `sum w r^2`, `J^T w r` and `J^T w J`.
struct System {
    value: f64,
    rhs: DVector<f64>,
    matrix: DMatrix<f64>,
}

impl System {
    /// Computes the damped step; `None` if the system is not positive definite.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let n = self.rhs.len();
        let mut damped = self.matrix.clone();
        // A lower bound of the diagonal for directions without effect, such as the rotation of a
        // disk.
        let floor = 1e-9 * self.matrix.trace() / n as f64;
        for i in 0..n {
            damped[(i, i)] += damping * self.matrix[(i, i)] + floor;
        }
        let solved = damped.cholesky()?.solve(&self.rhs);
        solved.iter().all(|x| x.is_finite()).then(|| -solved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Field, Grid};
    use levelset::{Compact, Continued};

    /// A ball and a smaller one beside it, as a smooth function that is positive inside.
    fn pair<const D: usize>(grid: Grid<D>, offset: f64) -> Field<f64, D, 1> {
        Field::from_fn(grid, |x| {
            let at = |c: f64, r: f64| {
                let d2: f64 = (0..D).map(|k| (x[k] - c - 0.05 * k as f64).powi(2)).sum();
                r * r - d2
            };
            [at(0.4 + offset, 0.2).max(at(0.62 + offset, 0.12))]
        })
    }

    fn whole<const D: usize>(distance: &Field<f64, D, 1>) -> Masked<'_, D> {
        Masked::new([distance], None)
    }

    fn indicator<const D: usize>(fixed: &Field<f64, D, 1>) -> Indicator<D> {
        let whole = whole(fixed);
        let still = [(&whole, RigidMotion::identity())];
        Indicator::mean(&still, *fixed.grid(), Compact::new(0.03).unwrap()).unwrap()
    }

    fn check_gradient<const D: usize>(n: usize) {
        let grid = Grid::<D>::cube(n);
        let (fixed, shape) = (pair(grid, 0.0), pair(grid, 0.04));
        let (target, whole) = (indicator(&fixed), whole(&shape));
        let matching = Matching::new(&target, &whole).unwrap();
        let start = matching.centred(plane_rotation(0, 1, 0.3));
        let system = matching.linearise(&start);
        assert!((system.value - matching.difference(&start)).abs() < 1e-12 * system.value);
        for k in 0..system.rhs.len() {
            // With so short a step, few nodes cross a kink of the interpolant.
            let h = 1e-7;
            let mut along = DVector::zeros(system.rhs.len());
            along[k] = h;
            let ahead = matching.difference(&moved(&start, &along));
            let behind = matching.difference(&moved(&start, &-along));
            let slope = (ahead - behind) / (2.0 * h);
            let expected = 2.0 * system.rhs[k];
            let scale = 2.0 * system.rhs.amax();
            assert!(
                (slope - expected).abs() < 1e-5 * scale,
                "{k}: {slope} {expected}"
            );
        }
    }

    /// Nodes are passed over without a change of any bit, for distances and for steeper functions,
    /// within the box and beyond it, below targets that are one, zero and between.
    fn check_visits<const D: usize>(n: usize, factor: f64, turn: f64) {
        let grid = Grid::<D>::cube(n);
        let (fixed, mut shape) = (pair(grid, 0.0), pair(grid, 0.04));
        for u in shape.as_mut_slice() {
            *u *= factor;
        }
        let (target, own) = (indicator(&fixed), whole(&shape));
        let step = target.step;
        let matching = Matching::new(&target, &own).unwrap();
        // So steep that no node is passed over.
        let mut steep = whole(&shape);
        steep.parts[0].steepness = f64::INFINITY;
        let without = Matching::new(&target, &steep).unwrap();
        let mut pose = matching.centred(plane_rotation(0, 1, turn));
        for shift in [0.0, 0.23, 0.9] {
            pose.centre[0] += shift;
            let motion = matching.motion(&pose);
            let (mut plain, mut every) = (0.0, 0.0);
            for (index, target) in target.values().enumerate() {
                let z = motion.map_back(grid.position(grid.node(index)));
                plain += (step.value(Continued::new(&shape).value(&z)) - target).powi(2);
            }
            without.visit(0, &motion, |_, target, _, _, u| {
                every += (step.value(u) - target).powi(2);
            });
            assert!((every - plain).abs() < 1e-12 * plain);
            assert_eq!(matching.difference(&pose).to_bits(), every.to_bits());
            let (mut visited, mut active) = (0, 0);
            matching.visit(0, &motion, |_, target, _, _, u| {
                visited += 1;
                active += usize::from(step.derivative(u) > 0.0 || step.value(u) != target);
            });
            assert!(visited < grid.n_nodes() && active > 0);
        }
    }

    #[test]
    fn nodes_beyond_the_step_are_passed_over_exactly() {
        for factor in [0.2, 1.0, 30.0] {
            check_visits::<2>(49, factor, 0.4);
            check_visits::<3>(17, factor, 1.1);
        }
    }

    #[test]
    fn the_linearisation_is_the_gradient_of_the_difference() {
        check_gradient::<2>(33);
        check_gradient::<3>(17);
    }
}
