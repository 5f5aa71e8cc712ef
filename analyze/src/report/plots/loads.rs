//! Wheel loads over time, with their uncertainty and the range that equilibrium allows.

use plotly::color::Rgba;
use plotly::common::{DashType, Line, Mode, Visible};
use plotly::{Trace, Traces};
use tipwatch_mechanics::Quantity;

use super::plotter::{Plotter, axis};
use crate::page::{Figure, colour, scatter};

impl Plotter<'_> {
    pub(super) fn loads(&self) -> Figure {
        let mut traces = Traces::new();
        let names = self.wheel_names();
        for (wheel, name) in names.iter().enumerate() {
            if let Some(band) = self.two_sigma(wheel, name) {
                traces.push(band);
            }
        }
        for (wheel, name) in names.iter().enumerate() {
            traces.push(self.curve(wheel, name, &self.valid(Quantity::Load(wheel))));
        }
        self.add_limits(&mut traces, &names);
        for (wheel, name) in names.iter().enumerate() {
            let otf = Quantity::Otf(wheel);
            let label = format!("{name} {}", otf.kind().label);
            let otf = self.curve(wheel, &label, &self.valid(otf));
            traces.push(otf.visible(Visible::LegendOnly));
        }
        for (wheel, name) in names.iter().enumerate() {
            traces.push(self.envelope(wheel, name));
        }
        self.figure(
            "Wheel loads with bands of two standard deviations (± 2 σ)",
            &axis("Load", Quantity::Load(0)),
            480,
            traces,
            true,
        )
    }

    /// Two standard deviations on either side of a load, never below zero.
    fn two_sigma(&self, wheel: usize, name: &str) -> Option<Box<dyn Trace>> {
        let sigma = Quantity::LoadSigma(wheel);
        if !self.has(sigma) {
            return None;
        }
        let (load, sigma) = (self.valid(Quantity::Load(wheel)), self.valid(sigma));
        let pairs = || load.iter().zip(&sigma);
        let low: Vec<f64> = pairs()
            .map(|(l, s)| {
                if l.is_nan() {
                    *l
                } else {
                    (l - 2.0 * s).max(0.0)
                }
            })
            .collect();
        let high: Vec<f64> = pairs().map(|(l, s)| l + 2.0 * s).collect();
        let band = self.between(&format!("{name} ± 2 σ"), &low, &high, colour(wheel, 0.16));
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
                scatter(&ends, &[limit; 2])
                    .name(name)
                    .mode(Mode::Lines)
                    .line(line),
            );
        }
    }

    /// The smallest and the largest load that equilibrium allows.
    fn envelope(&self, wheel: usize, name: &str) -> Box<dyn Trace> {
        let (least, largest) = (
            self.valid(Quantity::LoadLeast(wheel)),
            self.valid(Quantity::LoadLargest(wheel)),
        );
        let name = format!("{name} envelope");
        self.between(&name, &least, &largest, colour(wheel, 0.08))
    }
}
