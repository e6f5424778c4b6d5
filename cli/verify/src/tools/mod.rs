//! What several experiments need: laws at a point, random matrices, quadrature.

pub(crate) mod averages;
pub mod curves;
pub(crate) mod derivatives;
pub(crate) mod ellipses;
pub(crate) mod fields;
pub(crate) mod matrices;
pub(crate) mod pointwise;
pub mod quadrature;
pub(crate) mod search;
pub(crate) mod shapes;
