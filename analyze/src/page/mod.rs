//! What all HTML pages share: tables and bars, and charts as SVG.

pub(crate) mod html;
pub(crate) mod svg;
