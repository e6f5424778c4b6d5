//! What a statement of the theory is, and in which setting it is tried.

use crate::error::VerifyError;
use crate::outcome::Outcome;

/// A definition, lemma, theorem or claim that an experiment tries.
#[derive(Clone, Copy, Debug)]
pub struct Statement {
    /// The name that it is asked for by; its theme stands in front, as in `dissipation-balls-2d`.
    pub name: &'static str,
    /// Where the notes have it.
    pub reference: &'static str,
    /// What is claimed, in one sentence.
    pub claim: &'static str,
    /// What is changed in a broken run, in words.
    pub broken: &'static str,
    /// The experiment.
    pub run: fn(Setting) -> Result<Outcome, VerifyError>,
}

/// How an experiment is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// How much work is done.
    pub effort: Effort,
    /// Whether an ingredient is broken.
    pub ingredient: Ingredient,
}

/// How much work is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// As much as continuous integration has time for.
    Quick,
    /// As much as shows orders clearly.
    Full,
}

/// Whether an ingredient of an experiment is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ingredient {
    /// All is as the statement says.
    Sound,
    /// One ingredient is not: the statement must then be refuted.
    Broken,
}

impl Setting {
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
