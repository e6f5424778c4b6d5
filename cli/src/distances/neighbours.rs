//! The nearest neighbours of shapes, and what classes they have.

use ::geodesic::distances::{Neighbour, PathLengths, nearest, vote};
use serde::Serialize;
use shapespace_report::table::{Table, exact};

use super::classes::Labels;
use super::scope::Scope;

/// The nearest neighbours of all shapes whose distances are asked for.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Neighbours {
    /// Number of neighbours of each, if there are so many.
    pub count: usize,
    pub of: Vec<NeighboursOf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agreement: Option<VoteAgreement>,
}

/// The nearest neighbours of one shape.
#[derive(Clone, Debug, Serialize)]
pub(super) struct NeighboursOf {
    pub shape: usize,
    /// Nearest first.
    pub nearest: Vec<Neighbour>,
    /// The class of the nearest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// The class that most of them have; of several the one whose first is nearest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vote: Option<String>,
}

/// How often the classes of neighbours are those of the shapes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct VoteAgreement {
    /// Number of shapes whose class is known, and that others have, too.
    pub shapes: usize,
    /// Share of them whose nearest neighbour has their class.
    pub nearest: f64,
    /// Share of them for which most of the neighbours do.
    pub vote: f64,
}

impl Neighbours {
    /// The neighbours by known distances.
    pub fn new(
        scope: &Scope,
        count: usize,
        between: &PathLengths,
        labels: Option<&Labels>,
    ) -> Self {
        let class = |shape: usize| labels.and_then(|labels| labels.class(shape));
        let (mut of, mut counted, mut right) = (Vec::new(), 0, [0usize; 2]);
        for shape in scope.rows() {
            let others = || scope.columns().filter(move |&other| other != shape);
            let row = others().map(|other| (other, between.between(shape, other)));
            let nearest = nearest(row, count);
            let first = nearest.first().and_then(|first| class(first.object));
            // Either all neighbours have a class, or none.
            let most = first.and_then(|_| vote(&nearest, |n| class(n).unwrap_or_default()));
            let own = class(shape).filter(|own| others().any(|other| class(other) == Some(*own)));
            if own.is_some() {
                counted += 1;
                right[0] += usize::from(own == first);
                right[1] += usize::from(own == most);
            }
            let name = |class: Option<usize>| Some(labels?.names()[class?].clone());
            of.push(NeighboursOf {
                shape,
                class: name(first),
                vote: name(most),
                nearest,
            });
        }
        let share = |right: usize| right as f64 / counted as f64;
        Self {
            count,
            of,
            agreement: (counted > 0).then(|| VoteAgreement {
                shapes: counted,
                nearest: share(right[0]),
                vote: share(right[1]),
            }),
        }
    }

    /// A row for every shape and neighbour.
    pub fn table(&self, names: &[String], labels: Option<&Labels>) -> Table {
        let mut table = Table::new(["name", "rank", "neighbour", "distance", "class"]);
        for of in &self.of {
            for (rank, neighbour) in of.nearest.iter().enumerate() {
                let class = labels.and_then(|labels| labels.name(neighbour.object));
                table.texts([
                    names[of.shape].clone(),
                    (rank + 1).to_string(),
                    names[neighbour.object].clone(),
                    exact(neighbour.distance),
                    class.unwrap_or_default().into(),
                ]);
            }
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::DistancesConfig;

    #[test]
    fn new_shapes_get_the_classes_of_their_neighbours() {
        let config = DistancesConfig {
            inputs: vec!["new/a.png".into(), "new/x.png".into()],
            against: ["s/b-1.png", "s/a-1.png", "s/b-2.png", "s/a-2.png"]
                .map(Into::into)
                .into(),
            ..DistancesConfig::default()
        };
        let scope = Scope::new(&config);
        let labels = Labels::of("prefix".as_ref(), &config).unwrap();
        // On a line: the stored shapes lie at 1, 2, 3, and there is no path from the second to the last.
        let between = PathLengths::from_fn(6, |i, j| {
            let (i, j) = (i.min(j), i.max(j));
            (i < 2 && j >= 2 && [i, j] != [1, 5]).then(|| (j - 1) as f64)
        });
        let found = Neighbours::new(&scope, 3, &between, Some(&labels));
        let objects = |k: usize| {
            found.of[k]
                .nearest
                .iter()
                .map(|n| n.object)
                .collect::<Vec<_>>()
        };
        assert_eq!((objects(0), objects(1)), (vec![2, 3, 4], vec![2, 3, 4]));
        assert_eq!(found.of[0].class.as_deref(), Some("b"));
        assert_eq!(found.of[0].vote.as_deref(), Some("b"));
        // Only the first is of a class that stored shapes have, and its neighbours are of the other.
        let agreement = found.agreement.unwrap();
        assert_eq!((agreement.shapes, agreement.vote), (1, 0.0));
        // Two and two: the class of the nearest wins.
        let all = Neighbours::new(&scope, 9, &between, Some(&labels));
        assert_eq!((all.of[0].nearest.len(), all.of[1].nearest.len()), (4, 3));
        assert_eq!(all.of[0].vote.as_deref(), Some("b"));
        let none = Neighbours::new(&scope, 1, &between, None);
        assert!(none.of[0].class.is_none() && none.agreement.is_none());
    }
}
