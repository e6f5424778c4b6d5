//! Laws defined in other crates, registered by name.

use crate::compiled::CompiledLaw;
use crate::error::LawError;
use crate::moduli::LameModuli;
use std::any::Any;
use std::sync::{PoisonError, RwLock};

/// A law registered by [`register_law`](crate::register_law).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OwnLaw(usize);

/// Function that creates a law from its moduli.
type Maker<const D: usize> = fn(LameModuli) -> Result<CompiledLaw<D>, LawError>;

struct Registered {
    name: String,
    in_plane: Maker<2>,
    in_space: Maker<3>,
}

static REGISTERED: RwLock<Vec<Registered>> = RwLock::new(Vec::new());

impl OwnLaw {
    /// Registers a law; `None` if its name is already used.
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

    /// Returns all registered laws.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let laws = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        (0..laws.len()).map(Self)
    }

    /// Returns the registered name.
    pub fn name(self) -> String {
        let laws = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        laws[self.0].name.clone()
    }

    /// Creates the law with these moduli.
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
        // The box contains the law for the dimension `D`.
        Ok(*law.downcast().expect("one dimension, one type"))
    }
}
