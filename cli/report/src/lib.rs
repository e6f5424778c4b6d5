//! Presentation of results: tables, charts, and the font and the colours of all pictures.
//!
//! [`table`] writes CSV, Markdown, HTML and aligned text; [`html`] writes pages that load nothing; [`chart`] draws lines on axes and bars as SVG;
//! [`palette`] has distinguishable colours, markers and dashes, and [`font`] lays out labels. [`error_bar`]
//! estimates errors from values on several grids. This crate does not know the meaning of the data, and
//! opens no file.

#![forbid(unsafe_code)]

pub mod chart;
pub mod error_bar;
pub mod font;
pub mod html;
pub mod palette;
pub mod table;
