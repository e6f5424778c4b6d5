//! The functional at a state computed by another program.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use shape_average::{AverageObjective, AverageParams, Energy};
use shapespace_input::read_array;

use super::averages::authors_levels;
use super::shapes::{Source, nodal};
use crate::outcome::Outcome;

/// A state to be evaluated with the authors' functional, as our averages are.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScoreJob {
    /// The shapes.
    pub source: Source,
    /// Parameters.
    pub params: AverageParams,
    /// Phase fields, one for each shape.
    pub phase_fields: Vec<PathBuf>,
    /// Displacements in units of the box, one for each shape, component by component.
    pub displacements: Vec<PathBuf>,
    /// The average of that state.
    pub average: PathBuf,
}

/// The functional with the average of that program, and with the best average for its
/// displacements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// `J` with its own average.
    pub functional: f64,
    /// `J` with the best average.
    pub functional_at_best: f64,
    /// Sum of the elastic energies.
    pub elastic: f64,
    /// Sum of the mismatches, with its own average.
    pub mismatch: f64,
}

impl ScoreJob {
    /// Evaluates the functional in this process.
    pub fn run(&self) -> Outcome<Score> {
        match self.source.dimension()? {
            2 => self.in_dimension::<2>(),
            _ => self.in_dimension::<3>(),
        }
    }

    fn in_dimension<const D: usize>(&self) -> Outcome<Score> {
        let distances = self.source.distances::<D>()?;
        let mut levels = authors_levels(&distances, &self.params, &self.phase_fields)?;
        let shapes = levels.pop().ok_or("there is no level")?;
        let mut x = Vec::new();
        for file in &self.displacements {
            x.extend(read_array(file)?.1);
        }
        if x.len() != distances.len() * D * shapes.grid().n_nodes() {
            return Err("the displacements are not of the size of the shapes".into());
        }
        let average = nodal::<D>(&self.average)?.into_vec();
        let mut objective = AverageObjective::new(shapes, &self.params, average)?;
        let own = energy(&objective, &x)?;
        objective.solve_average(&x)?;
        let best = energy(&objective, &x)?;
        Ok(Score {
            functional: own.total,
            functional_at_best: best.total,
            elastic: own.elastic.iter().sum(),
            mismatch: own.mismatch.iter().sum(),
        })
    }
}

fn energy<const D: usize>(objective: &AverageObjective<D>, x: &[f64]) -> Outcome<Energy> {
    let energy = objective.at_present_average(x, &mut [])?;
    Ok(energy.ok_or("a deformation folds")?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Grid, ScalarField};
    use shapespace::output::npy::{Precision, write_field};

    #[test]
    fn arrays_are_read_in_the_order_of_the_file() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("a.npy");
        let field = ScalarField::<f64, 2>::from_fn(Grid::cube(3), |[x, y]| [x - 2.0 * y]);
        write_field(&file, &field, Precision::Double).unwrap();
        assert_eq!(read_array(&file).unwrap().1, field.as_slice());
        let error = read_array(&place.path().join("b.npy")).unwrap_err();
        assert!(error.to_string().contains("b.npy"));
    }
}
