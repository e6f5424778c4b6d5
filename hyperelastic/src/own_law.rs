//! Laws of other crates, by a name of their own.

use crate::compiled::CompiledLaw;
use crate::error::LawError;
use crate::moduli::LameModuli;
use std::any::Any;
use std::sync::{PoisonError, RwLock};

/// A law that [`register_law`](crate::register_law) has given a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OwnLaw(usize);

/// Makes one law from its moduli.
type Maker<const D: usize> = fn(LameModuli) -> Result<CompiledLaw<D>, LawError>;

struct Registered {
    name: String,
    in_plane: Maker<2>,
    in_space: Maker<3>,
}

static REGISTERED: RwLock<Vec<Registered>> = RwLock::new(Vec::new());

impl OwnLaw {
    /// Registers a law unless its name is taken.
    pub(crate) fn register(name: &str, in_plane: Maker<2>, in_space: Maker<3>) -> Option<Self> {
        let mut laws = REGISTERED.write().unwrap_or_else(PoisonError::into_inner);
        if laws.iter().any(|law| law.name == name) {
            return None;
        }
        laws.push(Registered {
            name: name.to_owned(),
            in_plane,
            in_space,
        });
        Some(Self(laws.len() - 1))
    }

    /// All laws that are registered.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let laws = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        (0..laws.len()).map(Self)
    }

    /// The name that it was given.
    pub fn name(self) -> String {
        let laws = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        laws[self.0].name.clone()
    }

    /// The law with these moduli.
    pub(crate) fn compile<const D: usize>(
        self,
        moduli: LameModuli,
    ) -> Result<CompiledLaw<D>, LawError> {
        let (in_plane, in_space) = {
            let laws = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
            (laws[self.0].in_plane, laws[self.0].in_space)
        };
        let law: Box<dyn Any> = if D == 2 {
            Box::new(in_plane(moduli)?)
        } else {
            Box::new(in_space(moduli)?)
        };
        // The box holds the law for the dimension `D`.
        Ok(*law.downcast().expect("one dimension, one type"))
    }
}
