//! The page of a replay: the suspension locked compared with the suspension moved.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, told, word};
use tipwatch_suspension::replay::Track;

use super::findings::finding_list;
use crate::page::{
    self, Columns, Curve, Document, Figure, Plots, Scripts, chart, list, readable, section, table,
};
use crate::suspension::{CAVEATS, Summary, SuspensionMode, WhatIf, findings, rod_names};

/// The page, with everything it needs inside. The same replay gives the same bytes.
#[must_use]
pub(crate) fn render_what_if(what_if: &WhatIf) -> String {
    let (analysis, moved) = (&what_if.analysis, name(what_if));
    let summary = Summary::of(what_if);
    let columns = Columns::default();
    let figures = figures(what_if, &columns);
    let content = html! {
        (section(word!("Findings"), finding_list(&findings(what_if))))
        (section(word!("Comparison"), side_by_side(&summary, moved)))
        (section(word!("Time histories"), time_histories(&figures)))
        (section(word!("Actuators and their limits"), actuators(&summary)))
        (section(word!("What a replay cannot show"), list(CAVEATS.map(told))))
        (section(word!("Data limitations"), list(analysis.notes.iter().map(ToString::to_string))))
        (section(word!("Provenance"), super::tables::provenance(analysis)))
    };
    Document {
        title: &say!("Suspension {moved}: {}", analysis.provenance.log_name()),
        subtitle: &say!(
            "Machine {}; the log replayed with the suspension {moved} and with it locked.",
            analysis.machine.name()
        ),
        styles: &[],
        plots: Some(Plots {
            figures: &figures,
            columns: &columns,
            scripts: Scripts::Within(""),
            data: &html! {},
        }),
    }
    .render(&content)
}

fn name(what_if: &WhatIf) -> &'static str {
    match what_if.options.suspension {
        SuspensionMode::Locked => word!("locked"),
        SuspensionMode::Recorded => word!("as recorded"),
        SuspensionMode::Literal => word!("controlled (literal)"),
        SuspensionMode::LookAhead => word!("controlled (look-ahead)"),
    }
}

/// The keys and values of what is serialised as an object.
fn object(of: &impl serde::Serialize) -> serde_json::Map<String, serde_json::Value> {
    match serde_json::to_value(of) {
        Ok(serde_json::Value::Object(object)) => object,
        _ => serde_json::Map::new(),
    }
}

fn side_by_side(summary: &Summary, moved: &str) -> Markup {
    let (fixed, other) = (object(&summary.fixed), object(&summary.moved));
    let mut rows: Vec<Vec<String>> = (fixed.keys())
        .map(|key| {
            let value = |side: &serde_json::Map<_, _>| side.get(key).map_or(String::new(), text);
            vec![label(key), value(&fixed), value(&other)]
        })
        .collect();
    let statuses = summary
        .statuses
        .iter()
        .map(|(status, rows)| format!("{status} {rows}"));
    let statuses = statuses.collect::<Vec<_>>().join(", ");
    rows.push(vec![
        word!("controller status (rows)").into(),
        String::new(),
        statuses,
    ]);
    table(&[word!("Quantity"), word!("locked"), moved], &rows)
}

fn actuators(summary: &Summary) -> Markup {
    let actuators = summary.actuators.iter();
    let rows = actuators.flat_map(|(name, actuator)| {
        let values = object(actuator).into_iter();
        values.map(move |(key, value)| vec![name.clone(), label(&key), text(&value)])
    });
    table(
        &[word!("Actuator"), word!("Quantity"), word!("Value")],
        &rows.collect::<Vec<_>>(),
    )
}

/// A number, the ends of a range, or values by name.
fn text(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Object(by) => {
            let parts = by
                .iter()
                .map(|(name, value)| format!("{name} {}", number(value)));
            parts.collect::<Vec<_>>().join(", ")
        }
        serde_json::Value::Array(of) => of
            .iter()
            .map(number)
            .collect::<Vec<_>>()
            .join(word!(" to ")),
        value => number(value),
    }
}

fn number(value: &serde_json::Value) -> String {
    match value.as_f64() {
        Some(value) if value == value.trunc() && value.abs() < 1e6 => format!("{value:.0}"),
        Some(value) if value.abs() >= 100.0 => format!("{value:.0}"),
        Some(value) => decimals(format!("{value:.4}")),
        None => word!("unknown").into(),
    }
}

/// A key of the summary in words, its unit in brackets.
fn label(key: &str) -> String {
    let units = [
        ("_m_s2", "m/s²"),
        ("_m_s", "m/s"),
        ("_rad", "rad"),
        ("_pa", "Pa"),
        ("_n", "N"),
        ("_m", "m"),
    ];
    let found = units
        .iter()
        .find_map(|(end, unit)| Some((key.strip_suffix(end)?, unit)));
    match found {
        Some((name, unit)) => format!("{} [{unit}]", readable(name)),
        None => readable(key),
    }
}

fn time_histories(figures: &[Figure]) -> Markup {
    html! {
        p.hint {
            (word!("Time is in seconds from the first row. Curves break where nothing can be computed. \
                    The limits apply to command and reference, not to the cylinder itself."))
        }
        (page::figures_help())
        (page::figures(figures, ""))
    }
}

fn figures(what_if: &WhatIf, columns: &Columns) -> Vec<Figure> {
    let rows = &what_if.analysis.rows;
    let seconds: Vec<f64> = (0..rows.len())
        .map(|row| (rows.seconds(row) * 1e6).round() / 1e6)
        .collect();
    let plot = |title: &str, unit: &str, curves: Vec<Curve>| {
        chart(columns, title, unit, &seconds, &curves)
    };
    let (fixed, moved, now) = (
        &what_if.comparison.fixed,
        &what_if.comparison.moved,
        name(what_if),
    );
    let mut best = vec![f64::NAN; rows.len()];
    for window in 0..what_if.comparison.best.rows.len() {
        let from = what_if.comparison.best.rows[window];
        let to = what_if.comparison.best.rows.get(window + 1).copied();
        // each row of the study holds until the next
        for value in &mut best[from..to.unwrap_or(from + 1)] {
            *value = what_if.comparison.best.spread[window];
        }
    }
    let both = |title: &str, unit: &str, of: &dyn Fn(&Track) -> Vec<f64>| {
        let curves = vec![
            Curve::new(word!("locked"), of(fixed)),
            Curve::new(now, of(moved)),
        ];
        plot(title, unit, curves)
    };
    let spread = vec![
        Curve::new(word!("locked"), fixed.spread.clone()),
        Curve::new(now, moved.spread.clone()),
        Curve::new(word!("best posture at rest"), best),
    ];
    let mut figures = vec![plot(
        word!("Spread of the wheel loads (equation 35)"),
        "N",
        spread,
    )];
    for (axis, side) in [word!("forward"), word!("left")].into_iter().enumerate() {
        let title = say!("Centre of mass, {side} of the centre of the contact points");
        figures.push(both(&title, "m", &|track| track.com[axis].clone()));
    }
    for (wheel, spec) in what_if.analysis.machine.wheels().iter().enumerate() {
        let title = say!("Load of wheel {}", spec.name);
        figures.push(both(&title, "N", &|track| track.load[wheel].clone()));
    }
    let angle = |track: &Track| track.stability_angle.clone();
    figures.push(both(word!("Minimum stability angle"), "rad", &angle));
    figures.extend(rod_figures(what_if, moved, &plot));
    figures
}

fn rod_figures(
    what_if: &WhatIf,
    moved: &Track,
    plot: &dyn Fn(&str, &str, Vec<Curve>) -> Figure,
) -> Vec<Figure> {
    let suspension = &what_if.comparison.suspension;
    let level = |value: f64| vec![value; moved.spread.len()];
    let mut figures = Vec::new();
    for (name, rod) in rod_names(what_if).iter().zip(&moved.rods) {
        let [least, greatest] = suspension.stroke;
        let controlled = moved.is_controlled();
        let mut position = vec![Curve::new(word!("cylinder"), rod.position.clone())];
        let mut velocity = vec![Curve::new(word!("cylinder"), rod.velocity.clone())];
        let mut acceleration = vec![Curve::new(word!("cylinder"), rod.acceleration.clone())];
        if controlled {
            position.push(Curve::new(word!("reference"), rod.reference.clone()));
            velocity.push(Curve::new(
                word!("reference"),
                rod.reference_velocity.clone(),
            ));
            let commanded = rod.commanded_acceleration.clone();
            acceleration.push(Curve::new(word!("command"), commanded));
        }
        position.extend([
            Curve::new(word!("minimum"), level(least)),
            Curve::new(word!("maximum"), level(greatest)),
        ]);
        if controlled {
            let limits = |[least, greatest]: &[Vec<f64>; 2]| {
                [
                    Curve::new(word!("minimum"), least.clone()),
                    Curve::new(word!("maximum"), greatest.clone()),
                ]
            };
            velocity.extend(limits(&rod.velocity_limits));
            acceleration.extend(limits(&rod.acceleration_limits));
        }
        figures.push(plot(&say!("Position of {name}"), "m", position));
        figures.push(plot(&say!("Velocity of {name}"), "m/s", velocity));
        figures.push(plot(&say!("Acceleration of {name}"), "m/s²", acceleration));
        let mut force = vec![Curve::new(
            word!("required by the motion"),
            rod.force_needed.clone(),
        )];
        if controlled {
            force.push(Curve::new(word!("piston force"), rod.force.clone()));
            figures.push(plot(
                &say!("Valve command of {name}"),
                word!("share of full opening"),
                vec![Curve::new(word!("valve command"), rod.opening.clone())],
            ));
            figures.push(plot(
                &say!("Pressures of {name}"),
                "Pa",
                vec![
                    Curve::new(word!("piston side"), rod.piston_pressure.clone()),
                    Curve::new(word!("rod side"), rod.rod_pressure.clone()),
                ],
            ));
            figures.push(plot(
                &say!("Tracking error of {name}"),
                "m",
                vec![Curve::new(
                    word!("reference minus position"),
                    rod.tracking_error(),
                )],
            ));
        }
        figures.push(plot(&say!("Force of {name}"), "N", force));
    }
    figures
}
