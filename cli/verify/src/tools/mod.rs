//! What several experiments need: laws at a point, random matrices, quadrature.

pub mod averages;
pub mod curves;
pub mod derivatives;
pub mod ellipses;
pub mod fields;
pub mod matrices;
pub mod pointwise;
pub mod quadrature;
pub mod search;
pub mod shapes;
