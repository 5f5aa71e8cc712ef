//! The list of figures.

use super::plotter::Plotter;
use crate::analysis::Analysis;
use crate::page::Figure;
use crate::report::sketch::Sketch;

/// All figures of the page, on one time axis.
pub(in crate::report) fn figures(analysis: &Analysis, sketch: &Sketch) -> Vec<Figure> {
    let plotter = Plotter { analysis, sketch };
    let mut figures: Vec<Figure> = plotter.timeline().into_iter().collect();
    figures.extend([plotter.loads(), plotter.stability()]);
    figures.extend(plotter.edges());
    figures.extend(plotter.causes());
    figures.extend(plotter.drawn_machines());
    figures.extend(plotter.inputs());
    figures.push(plotter.quality());
    figures
}
