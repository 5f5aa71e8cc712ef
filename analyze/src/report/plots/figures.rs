//! The list of figures.

use super::plotter::Plotter;
use crate::analysis::Analysis;
use crate::page::Figure;

/// All figures of the page, on one time axis.
pub(in crate::report) fn figures(analysis: &Analysis) -> Vec<Figure> {
    let plotter = Plotter::new(analysis);
    let mut figures: Vec<Figure> = plotter.timeline().into_iter().collect();
    figures.extend([plotter.loads(), plotter.stability()]);
    figures.extend(plotter.edges());
    figures.extend(plotter.causes());
    figures.extend(plotter.drawn_machines());
    figures.extend(plotter.inputs());
    figures.push(plotter.quality());
    figures
}
