//! Signed distances, contours, surfaces and measures of 2D and 3D shapes.
