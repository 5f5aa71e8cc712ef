//! The list of figures.

use super::plotter::Plotter;
use crate::analysis::Analysis;
use crate::page::{Columns, Figure};
use crate::report::sketch::Sketch;

/// All figures of the page, on one time axis. The numbers of their curves are added to `columns`.
pub(in crate::report) fn figures(
    analysis: &Analysis,
    sketch: &Sketch,
    columns: &Columns,
) -> Vec<Figure> {
    let plotter = Plotter {
        analysis,
        sketch,
        columns,
    };
    let mut figures: Vec<Figure> = plotter.timeline().into_iter().collect();
    figures.extend(plotter.loads());
    figures.extend(plotter.indicators());
    figures.extend(plotter.causes());
    figures.extend(plotter.drawn_machines());
    figures.extend(plotter.inputs());
    figures.push(plotter.quality());
    if let Some(first) = figures.first_mut() {
        plotter.shade_events(first);
    }
    figures
}
