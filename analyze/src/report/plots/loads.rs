//! Wheel loads over time, with their uncertainty and the range that equilibrium allows.

use plotly::color::Rgba;
use plotly::common::{DashType, Line, Marker, Mode, Visible};
use plotly::{Trace, Traces};
use tipwatch_mechanics::Quantity;

use super::plotter::{Plotter, axis};
use crate::page::{Figure, colour, line, plain};
use crate::report::sketch::Curve;

impl Plotter<'_> {
    pub(super) fn loads(&self) -> Figure {
        let mut traces = Traces::new();
        let names = self.wheel_names();
        // below everything else
        for (wheel, name) in names.iter().enumerate() {
            traces.push(self.envelope(wheel, name));
        }
        for (wheel, name) in names.iter().enumerate() {
            if let Some(band) = self.two_sigma(wheel, name) {
                traces.push(band);
            }
        }
        for (wheel, name) in names.iter().enumerate() {
            traces.push(self.curve(wheel, name, Curve::Result(Quantity::Load(wheel))));
        }
        self.add_measured(&mut traces);
        self.add_limits(&mut traces, &names);
        for (wheel, name) in names.iter().enumerate() {
            let otf = Quantity::Otf(wheel);
            let label = format!("{name} {}", otf.kind().label);
            let otf = self.curve(wheel, &label, Curve::Result(otf));
            traces.push(otf.visible(Visible::LegendOnly));
        }
        self.figure(
            "Wheel loads with bands of two standard deviations (± 2 σ) and envelopes",
            &axis("Load", Quantity::Load(0)),
            480,
            traces,
        )
    }

    /// What load sensors measured, as points in the colour of the wheel; beside those of several wheels the sum of the
    /// computed loads.
    fn add_measured(&self, traces: &mut Traces) {
        let compared = &self.analysis.load_comparison.rows;
        let seconds: Vec<f64> = compared.iter().map(|row| self.seconds(row.row)).collect();
        let wheels = self.analysis.machine.wheels().len();
        for (k, load) in self.analysis.measured_loads.sensors.iter().enumerate() {
            let name = plain(&load.sensor.name);
            let of: Vec<usize> = load.sensor.places(&self.analysis.machine).collect();
            let tint = if let [only] = of[..] {
                only
            } else {
                wheels + k
            };
            if of.len() > 1 {
                let computed: Vec<f64> = compared.iter().map(|row| row.computed[k]).collect();
                let name = format!("{name} computed");
                traces.push(line(self.columns, tint, &name, &seconds, &computed));
            }
            let measured: Vec<f64> = compared.iter().map(|row| row.measured[k]).collect();
            traces.push(
                (self.columns)
                    .scatter(&seconds, &measured)
                    .name(format!("{name} measured"))
                    .mode(Mode::Markers)
                    .marker(Marker::new().size(3).color(colour(tint, 0.8))),
            );
        }
    }

    /// Two standard deviations on either side of a load, never below zero.
    fn two_sigma(&self, wheel: usize, name: &str) -> Option<Box<dyn Trace>> {
        let sigma = Quantity::LoadSigma(wheel);
        if !self.has(sigma) {
            return None;
        }
        let band = self.area(
            &format!("{name} ± 2 σ"),
            Curve::TwoSigma(wheel),
            colour(wheel, 0.16),
        );
        Some(band.show_legend(false))
    }

    /// The load limit of each wheel; one line if all are equal.
    fn add_limits(&self, traces: &mut Traces, names: &[String]) {
        let Some(limits) = &self.analysis.min_loads_n else {
            return;
        };
        let same = limits.windows(2).all(|pair| pair[0] == pair[1]);
        for (wheel, &limit) in limits
            .iter()
            .enumerate()
            .take(if same { 1 } else { limits.len() })
        {
            let name = if same {
                "load limit".to_string()
            } else {
                format!("{} load limit", names[wheel])
            };
            let tint = if same {
                Rgba::new(170, 0, 0, 1.0)
            } else {
                colour(wheel, 0.7)
            };
            let ends = [0.0, self.last_second()];
            let line = Line::new().width(1.2).color(tint).dash(DashType::LongDash);
            traces.push(
                (self.columns)
                    .scatter(&ends, &[limit; 2])
                    .name(name)
                    .mode(Mode::Lines)
                    .line(line),
            );
        }
    }

    /// The smallest and the largest load that equilibrium allows.
    fn envelope(&self, wheel: usize, name: &str) -> Box<dyn Trace> {
        let name = format!("{name} envelope");
        self.area(&name, Curve::Envelope(wheel), colour(wheel, 0.07))
    }
}
