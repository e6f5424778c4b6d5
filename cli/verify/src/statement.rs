//! A statement of the theory, and the setting of its experiment.

use crate::error::VerifyError;
use crate::outcome::Outcome;

/// A definition, lemma, theorem or claim that an experiment checks.
#[derive(Clone, Copy, Debug)]
pub struct Statement {
    /// Its name, which begins with its theme, as in `dissipation-balls-2d`.
    pub name: &'static str,
    /// Its reference in the notes.
    pub reference: &'static str,
    /// The claim, in one sentence.
    pub claim: &'static str,
    /// The change of a broken run, in words.
    pub broken: &'static str,
    /// The experiment.
    pub run: fn(Setting) -> Result<Outcome, VerifyError>,
}

/// How an experiment is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The amount of work.
    pub effort: Effort,
    /// Whether an ingredient is broken.
    pub ingredient: Ingredient,
}

/// The amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Small enough for continuous integration.
    Quick,
    /// Large enough to show orders clearly.
    Full,
}

/// Whether an ingredient of an experiment is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ingredient {
    /// All ingredients agree with the statement.
    Sound,
    /// One ingredient is wrong: the statement must be refuted.
    Broken,
}

impl Setting {
    /// The setting of a run, of small or full size, with a broken ingredient or none.
    pub fn new(quick: bool, broken: bool) -> Self {
        Self {
            effort: if quick { Effort::Quick } else { Effort::Full },
            ingredient: if broken {
                Ingredient::Broken
            } else {
                Ingredient::Sound
            },
        }
    }

    /// The ingredient of this run.
    pub fn ingredient<T>(self, sound: T, broken: T) -> T {
        match self.ingredient {
            Ingredient::Sound => sound,
            Ingredient::Broken => broken,
        }
    }

    /// Whether an ingredient is broken.
    pub fn is_broken(self) -> bool {
        self.ingredient == Ingredient::Broken
    }

    /// The size of this run.
    pub fn effort<T>(self, quick: T, full: T) -> T {
        match self.effort {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }
}
