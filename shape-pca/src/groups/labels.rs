//! The groups of shapes.

/// Errors of statistics of groups.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GroupError {
    /// A group has no shapes, or there is only one.
    #[error("at least two groups of shapes are needed, found {found}")]
    TooFewGroups {
        /// Number of groups with shapes.
        found: usize,
    },
    /// There are as many groups as shapes: nothing is known of the variation within groups.
    #[error("{shapes} shapes in {groups} groups: at least one group needs two shapes")]
    NoVariationWithin {
        /// Number of shapes.
        shapes: usize,
        /// Number of groups.
        groups: usize,
    },
    /// All shapes of every group are equal, those of different groups are not: no ratio says how different.
    #[error("the shapes of every group are equal: nothing varies within the groups")]
    EqualWithin,
    /// A table has not one line for every shape, or its lines differ in length.
    #[error("expected {expected} {what}, found {found}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// Expected number.
        expected: usize,
        /// Found number.
        found: usize,
    },
    /// A number is not finite.
    #[error("the {what} of shape {index} is not a finite number")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// Index of the shape.
        index: usize,
    },
    /// A covariate has the same value for all shapes.
    #[error("the covariate is the same for all shapes")]
    ConstantCovariate,
    /// There are too few shapes for a regression.
    #[error("a regression needs at least three shapes, found {found}")]
    TooFewShapes {
        /// Number of shapes.
        found: usize,
    },
}

/// A division of shapes into groups.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups {
    labels: Vec<usize>,
    sizes: Vec<usize>,
}

impl Groups {
    /// Creates the groups from the number of every shape's group, from 0.
    ///
    /// # Errors
    /// [`GroupError::TooFewGroups`], also where a number between has no shape, and
    /// [`GroupError::NoVariationWithin`].
    pub fn new(labels: Vec<usize>) -> Result<Self, GroupError> {
        let n_groups = labels.iter().max().map_or(0, |most| most.saturating_add(1));
        // A number beyond that of the shapes leaves a group empty.
        let found = n_groups.min(labels.len() + 1);
        let mut sizes = vec![0; found];
        for &label in &labels {
            if let Some(size) = sizes.get_mut(label) {
                *size += 1;
            }
        }
        let filled = sizes.iter().filter(|&&size| size > 0).count();
        if filled < 2 || filled < n_groups {
            return Err(GroupError::TooFewGroups { found: filled });
        }
        if filled == labels.len() {
            return Err(GroupError::NoVariationWithin {
                shapes: labels.len(),
                groups: filled,
            });
        }
        Ok(Self { labels, sizes })
    }

    /// The number of every shape's group.
    pub fn labels(&self) -> &[usize] {
        &self.labels
    }

    /// The number of shapes in every group.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Number of shapes.
    pub fn n_shapes(&self) -> usize {
        self.labels.len()
    }

    /// The mean of the rows of every group.
    ///
    /// # Errors
    /// [`GroupError::Count`] unless there is one row for every shape, all of one length.
    pub fn means(&self, rows: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, GroupError> {
        self.check_rows(rows)?;
        let columns = rows.first().map_or(0, Vec::len);
        let mut means = vec![vec![0.0; columns]; self.sizes.len()];
        for (row, &label) in rows.iter().zip(&self.labels) {
            for (mean, x) in means[label].iter_mut().zip(row) {
                *mean += x / self.sizes[label] as f64;
            }
        }
        Ok(means)
    }

    /// Checks that there is one row of finite numbers for every shape, all of one length.
    pub(super) fn check_rows(&self, rows: &[Vec<f64>]) -> Result<(), GroupError> {
        check_table(rows, self.n_shapes())
    }
}

/// Checks that there is a number of rows of finite numbers, all of one length.
pub(super) fn check_table(rows: &[Vec<f64>], expected: usize) -> Result<(), GroupError> {
    let count = |what, expected, found| {
        let same = expected == found;
        same.then_some(()).ok_or(GroupError::Count {
            what,
            expected,
            found,
        })
    };
    count("rows", expected, rows.len())?;
    let columns = rows.first().map_or(0, Vec::len);
    for (index, row) in rows.iter().enumerate() {
        count("numbers in a row", columns, row.len())?;
        if !row.iter().all(|x| x.is_finite()) {
            let what = "score";
            return Err(GroupError::NotFinite { what, index });
        }
    }
    Ok(())
}
