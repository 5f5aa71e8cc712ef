//! Parts of all HTML pages: the frame of a page, tables, figures, numbers as text, the glossary.

mod chart;
mod column;
mod decimate;
mod document;
mod elements;
mod figure;
mod glossary;
mod packed;
pub(crate) mod svg;

pub(crate) use chart::{Curve, chart};
pub(crate) use column::Columns;
pub(crate) use decimate::{Point, Thinned, VALUES, rows_to_draw, together};
pub(crate) use document::{Document, Plots, Program, Scripts, json_script, library, packed_script};
pub(crate) use elements::{Bar, bars, facts, list, part, section, table, table_of, whole};
pub(crate) use figure::{Figure, Look, MOST_POINTS, Trace, figures, figures_help};
pub(crate) use glossary::glossary;

pub(crate) use crate::base::number::{
    band, capital, input_in_words, logs, number, or_dash, percent, probability, readable, short,
    time, with_sure_band, with_unit,
};
