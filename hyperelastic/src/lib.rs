//! Polyconvex stored energy densities, pointwise and vectorised, in 2D and 3D.
