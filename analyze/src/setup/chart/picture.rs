//! A chart as a picture: where the load is, from the side, and how much the machine carries there.

use std::fmt::Write;

use super::compare::Compared;
use super::points::Chart;

/// Size of the picture and its margins (px).
const SIZE: [f64; 2] = [960.0, 640.0];
const MARGIN: [f64; 2] = [70.0, 60.0];
/// Colours of no load and of the largest.
const COLOURS: [[f64; 3]; 2] = [[178.0, 24.0, 43.0], [33.0, 102.0, 172.0]];

/// A point of the picture: reach and height (m), load (kg).
struct Spot {
    place: [f64; 2],
    load_kg: f64,
    label: String,
}

/// The chart, or the points of a sheet beside it, as SVG (Scalable Vector Graphics).
#[must_use]
pub fn picture(chart: &Chart, compared: Option<&[Compared]>) -> String {
    let of_chart = || {
        let points = chart.points.iter();
        let points =
            points.filter_map(|point| Some((point, chart.share * point.tipping.as_ref()?.mass_kg)));
        points.map(|(point, load_kg)| Spot {
            place: [point.reach_m, point.height_m],
            label: format!("{:.2}", 1e-3 * load_kg),
            load_kg,
        })
    };
    let of_sheet = |compared: &[Compared]| -> Vec<Spot> {
        let points = compared.iter().filter_map(|compared| {
            let point = compared.point.as_ref()?;
            let load_kg = compared.computed_kg(chart.share)?;
            Some(Spot {
                place: [point.reach_m, point.height_m],
                label: format!(
                    "{:.2} / {:.2}",
                    1e-3 * load_kg,
                    1e-3 * compared.sheet.load_kg
                ),
                load_kg,
            })
        });
        points.collect()
    };
    let spots: Vec<Spot> = compared.map_or_else(|| of_chart().collect(), of_sheet);
    let what = match compared {
        Some(_) => "computed / stated load [t]",
        None => "load [t]",
    };
    let mut out = String::new();
    let [width, height] = SIZE;
    let share = match chart.share < 1.0 {
        true => format!("{:.0} % of the tipping load", 100.0 * chart.share),
        false => "the tipping load".into(),
    };
    let title = format!(
        "{}: {what}, {share}, on {}",
        chart.machine.name(),
        chart.machine.supports().names(chart.machine.stands_on())
    );
    let title = escaped(&title);
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<title>{title}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"{:.0}\" y=\"28\" font-size=\"16\" font-weight=\"bold\" fill=\"#1b1d20\">{title}</text>",
        MARGIN[0]
    );
    let axes = [0, 1].map(|axis| Axis::of(spots.iter().map(|spot| spot.place[axis])));
    let at = |place: [f64; 2]| {
        let along = |axis: usize| {
            MARGIN[axis] + axes[axis].share(place[axis]) * (SIZE[axis] - 2.0 * MARGIN[axis])
        };
        [along(0), height - along(1)]
    };
    frame(&mut out, &axes, at);
    let most = spots
        .iter()
        .map(|spot| spot.load_kg)
        .fold(f64::MIN_POSITIVE, f64::max);
    for spot in &spots {
        let [x, y] = at(spot.place);
        let share = (spot.load_kg / most).clamp(0.0, 1.0);
        let colour = [0, 1, 2].map(|k| COLOURS[0][k] + share * (COLOURS[1][k] - COLOURS[0][k]));
        let _ = writeln!(
            out,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"rgb({:.0},{:.0},{:.0})\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#333\">{}</text>",
            colour[0],
            colour[1],
            colour[2],
            y - 8.0,
            spot.label
        );
    }
    out += "</svg>\n";
    out
}

/// An axis of the picture, in whole steps.
struct Axis {
    from: f64,
    to: f64,
    step: f64,
}

impl Axis {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (least, most) = values.fold((0.0_f64, 1.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        let raw = (most - least) / 8.0;
        let power = 10.0_f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|k| k * power)
            .into_iter()
            .find(|step| *step >= raw);
        let step = step.unwrap_or(1.0);
        Self {
            from: (least / step).floor() * step,
            to: (most / step).ceil() * step,
            step,
        }
    }

    fn share(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }
}

fn frame(out: &mut String, axes: &[Axis; 2], at: impl Fn([f64; 2]) -> [f64; 2]) {
    for (axis, it) in axes.iter().enumerate() {
        let count = ((it.to - it.from) / it.step).round() as usize;
        for k in 0..=count {
            let value = it.from + it.step * k as f64;
            let ends = match axis {
                0 => [[value, axes[1].from], [value, axes[1].to]],
                _ => [[axes[0].from, value], [axes[0].to, value]],
            };
            let [[x1, y1], [x2, y2]] = ends.map(&at);
            let _ = writeln!(
                out,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#e2e4e8\"/>"
            );
            let (x, y, anchor) = match axis {
                0 => (x1, y1 + 18.0, "middle"),
                _ => (x1 - 8.0, y1 + 4.0, "end"),
            };
            // a step of less than one needs decimals
            let decimals = usize::from(it.step < 1.0) * 2;
            let _ = writeln!(
                out,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"#555\">{value:.decimals$}</text>"
            );
        }
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#1b1d20\">reach [m]</text>\n\
         <text x=\"18\" y=\"{:.1}\" fill=\"#1b1d20\" transform=\"rotate(-90 18 {:.1})\" text-anchor=\"middle\">height [m]</text>",
        0.5 * SIZE[0],
        SIZE[1] - 14.0,
        0.5 * SIZE[1],
        0.5 * SIZE[1]
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
