//! The load of every wheel over time, with its uncertainty and the range that equilibrium allows, each on its own scale.

use tipwatch_language::{say, word};
use tipwatch_mechanics::Quantity;

use super::plotter::{Part, Plotter, axis};
use crate::events::support_words::SupportWord;
use crate::page::{Figure, Look, Trace, readable};
use crate::report::sketch::Curve;

/// Height of the figure of a wheel (pixels).
const HEIGHT: usize = 200;
/// Colours of a load, of what was measured, and of the overturning force.
const LOAD: usize = 0;
const MEASURED: usize = 1;
const OTF: usize = 4;

impl Plotter<'_> {
    pub(super) fn loads(&self) -> Vec<Figure> {
        let wheels = 0..self.analysis.machine.wheels().len();
        let mut figures: Vec<Figure> = wheels.map(|wheel| self.load_of(wheel)).collect();
        figures.extend(self.measured_sums());
        figures
    }

    fn load_of(&self, wheel: usize) -> Figure {
        let named = SupportWord::headed(&self.analysis.machine.wheels()[wheel]);
        let title = say!("{named}: load");
        let unit = axis(word!("Load"), Quantity::Load(wheel));
        let mut figure = self.figure(Part::Loads, &title, &unit, HEIGHT);
        let envelope = Curve::Envelope(wheel);
        if self.is_known(envelope) {
            let envelope = self.area(Look::Envelope, LOAD, word!("any split"), envelope);
            figure.add(envelope);
        }
        if self.has(Quantity::LoadSigma(wheel)) {
            figure.add(self.area(Look::Area, LOAD, "± 2 σ", Curve::TwoSigma(wheel)));
        }
        figure.add(self.curve(LOAD, word!("load"), Curve::Result(Quantity::Load(wheel))));
        for trace in self.measured_on(wheel) {
            figure.add(trace);
        }
        let otf = Quantity::Otf(wheel);
        let otf = self.curve(OTF, &readable(otf.kind().label), Curve::Result(otf));
        figure.add(otf.hidden(true));
        if let Some(limits) = &self.analysis.min_loads_n {
            figure.limit(limits[wheel], word!("load limit"));
        }
        figure
    }

    /// Returns the traces of load sensors that measure this wheel alone.
    fn measured_on(&self, wheel: usize) -> Vec<Trace> {
        let sensors = self.analysis.measured_loads.sensors.iter().enumerate();
        let own = sensors.filter(|(_, load)| {
            let mut places = load.sensor.places(&self.analysis.machine);
            places.next() == Some(wheel) && places.next().is_none()
        });
        own.map(|(k, load)| self.measured(k, &say!("{} measured", load.sensor.name)))
            .collect()
    }

    /// Returns the trace of the load sensor with this index.
    fn measured(&self, sensor: usize, name: &str) -> Trace {
        let compared = self.analysis.load_comparison.rows.iter();
        let (x, y): (Vec<f64>, Vec<f64>) = compared
            .map(|row| (self.seconds(row.row), row.measured[sensor]))
            .unzip();
        Trace::new(self.columns, Look::Points, MEASURED, name, &x, &y)
    }

    /// Returns the figures of load sensors that measure several wheels, beside the sum of the computed loads.
    fn measured_sums(&self) -> Vec<Figure> {
        let compared = &self.analysis.load_comparison.rows;
        let seconds: Vec<f64> = compared.iter().map(|row| self.seconds(row.row)).collect();
        let sensors = self.analysis.measured_loads.sensors.iter().enumerate();
        let sums =
            sensors.filter(|(_, load)| load.sensor.places(&self.analysis.machine).count() > 1);
        sums.map(|(k, load)| {
            let title = say!("Load sensor {}", load.sensor.name);
            let unit = axis(word!("Load"), Quantity::Load(0));
            let mut figure = self.figure(Part::Loads, &title, &unit, HEIGHT);
            let computed: Vec<f64> = compared.iter().map(|row| row.computed[k]).collect();
            figure.add(Trace::line(
                self.columns,
                LOAD,
                word!("computed"),
                &seconds,
                &computed,
            ));
            figure.add(self.measured(k, word!("measured")));
            figure
        })
        .collect()
    }
}
