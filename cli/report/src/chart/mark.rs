//! Markers on axes and in legends.

use plotters::element::{Drawable, PointCollection};
use plotters::style::RGBColor;
use plotters_backend::{BackendCoord, DrawingBackend, DrawingErrorKind};

use crate::palette::Marker;

/// A marker at a point.
pub(super) struct Mark<C> {
    pub at: C,
    pub marker: Marker,
    pub colour: RGBColor,
}

impl<'a, C> PointCollection<'a, C> for &'a Mark<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<C, DB: DrawingBackend> Drawable<DB> for Mark<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut place: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        const RADIUS: f32 = 4.0;
        let Some((x, y)) = place.next() else {
            return Ok(());
        };
        if self.marker == Marker::Circle {
            return backend.draw_circle((x, y), RADIUS as u32, &self.colour, true);
        }
        let corners = self.marker.outline(RADIUS);
        let corners = corners.iter().map(|p| p.map(|c| c.round() as i32));
        backend.fill_polygon(corners.map(|[i, j]| (x + i, y + j)), &self.colour)
    }
}
