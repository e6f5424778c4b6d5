//! What results are shown by: tables, charts, and the font and the colours of all pictures.
//!
//! [`table`] writes CSV, Markdown and aligned text; [`chart`] draws lines on axes and bars as SVG;
//! [`palette`] has colours, markers and dashes that can be told apart, and [`font`] the letters of
//! labels. Nothing here knows what is shown, and no file is opened.

pub mod chart;
pub mod font;
pub mod palette;
pub mod table;
