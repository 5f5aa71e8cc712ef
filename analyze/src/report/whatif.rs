//! The page of a replay: the suspension locked beside the suspension moved.

use super::plots::{Curve, Figure, chart};
use super::{PlotLibrary, head_of, log_name, page_of, section};
use crate::page::html;
use crate::suspension::{CAVEATS, Summary, SuspensionMode, Track, WhatIf, rod_names};

/// The page, with everything it needs inside. The same replay gives the same bytes.
#[must_use]
pub(crate) fn render_what_if(what_if: &WhatIf) -> String {
    let summary = Summary::of(what_if);
    let figures = figures(what_if);
    let title = format!(
        "Suspension {}: {}",
        name(what_if),
        log_name(&what_if.analysis)
    );
    let subtitle = format!(
        "Machine {}; the log replayed with the suspension {}, beside the suspension locked.",
        what_if.analysis.machine.name(),
        name(what_if)
    );
    let mut content = section("Findings", &html::list("findings", &summary.findings));
    content += &section("Side by side", &side_by_side(&summary, name(what_if)));
    content += &section("Curves", &curves(&figures));
    content += &section("Actuators against their limits", &actuators(&summary));
    content += &section(
        "What a replay cannot show",
        &html::list("notes", &CAVEATS.map(String::from)),
    );
    content += &section(
        "Data limitations",
        &html::list("notes", &what_if.analysis.notes),
    );
    content += &section("Provenance", &super::tables::provenance(&what_if.analysis));
    page_of(
        &head_of(&title, &subtitle, PlotLibrary::Inside),
        &content,
        &figures,
        PlotLibrary::Inside,
    )
}

fn name(what_if: &WhatIf) -> &'static str {
    match what_if.options.suspension {
        SuspensionMode::Locked => "locked",
        SuspensionMode::Recorded => "as recorded",
        SuspensionMode::Literal => "controlled (literal)",
        SuspensionMode::LookAhead => "controlled (look-ahead)",
    }
}

fn side_by_side(summary: &Summary, moved: &str) -> String {
    let json = |value: &dyn erased::Object| value.object();
    let (fixed, other) = (json(&summary.fixed), json(&summary.moved));
    let text = |value: Option<&serde_json::Value>| match value {
        Some(serde_json::Value::Object(by)) => by
            .iter()
            .map(|(name, value)| format!("{name} {}", number(value)))
            .collect::<Vec<_>>()
            .join(", "),
        Some(value) => number(value),
        None => String::new(),
    };
    let mut rows: Vec<Vec<String>> = fixed
        .keys()
        .map(|key| vec![label(key), text(fixed.get(key)), text(other.get(key))])
        .collect();
    rows.push(vec![
        "statuses of the control (rows)".into(),
        String::new(),
        summary
            .statuses
            .iter()
            .map(|(status, rows)| format!("{status} {rows}"))
            .collect::<Vec<_>>()
            .join(", "),
    ]);
    html::table(&["", "locked", moved], &rows)
}

fn actuators(summary: &Summary) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (name, actuator) in &summary.actuators {
        for (key, value) in erased::Object::object(actuator) {
            let text = match &value {
                serde_json::Value::Array(of) => {
                    of.iter().map(number).collect::<Vec<_>>().join(" to ")
                }
                value => number(value),
            };
            rows.push(vec![name.clone(), label(&key), text]);
        }
    }
    html::table(&["Actuator", "", "value"], &rows)
}

fn number(value: &serde_json::Value) -> String {
    match value.as_f64() {
        Some(value) if value == value.trunc() && value.abs() < 1e6 => format!("{value:.0}"),
        Some(value) if value.abs() >= 100.0 => format!("{value:.0}"),
        Some(value) => format!("{value:.4}"),
        None => "not known".into(),
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
        Some((name, unit)) => format!("{} [{unit}]", name.replace('_', " ")),
        None => key.replace('_', " "),
    }
}

mod erased {
    //! What is serialised as an object, as one.

    pub(super) trait Object {
        fn object(&self) -> serde_json::Map<String, serde_json::Value>;
    }

    impl<T: serde::Serialize> Object for T {
        fn object(&self) -> serde_json::Map<String, serde_json::Value> {
            match serde_json::to_value(self) {
                Ok(serde_json::Value::Object(object)) => object,
                _ => serde_json::Map::new(),
            }
        }
    }
}

fn curves(figures: &[Figure]) -> String {
    let mut content = String::from(
        "<p class=\"hint\">Time is in seconds from the first row. Lines break where nothing can be computed. \
         Limits are those that bind command and reference, not the rod itself.</p>\n\
         <p class=\"hint screen\">Drag to zoom, double-click to see everything; all plots share the time axis.</p>\n",
    );
    for (index, figure) in figures.iter().enumerate() {
        content.push_str(&format!(
            "<h3>{}</h3>\n<div class=\"plot\" id=\"plot-{index}\"></div>\n",
            html::escape(&figure.title)
        ));
    }
    content
        + "<noscript><p>The plots need JavaScript; everything else on this page does not.</p></noscript>\n"
}

fn figures(what_if: &WhatIf) -> Vec<Figure> {
    let rows = &what_if.analysis.rows;
    let seconds: Vec<f64> = (0..rows.len())
        .map(|row| (rows.seconds(row) * 1e6).round() / 1e6)
        .collect();
    let plot = |title: &str, unit: &str, curves: Vec<Curve>| chart(title, unit, &seconds, &curves);
    let (fixed, moved, now) = (&what_if.fixed, &what_if.moved, name(what_if));
    let mut best = vec![f64::NAN; rows.len()];
    for window in 0..what_if.best.rows.len() {
        let from = what_if.best.rows[window];
        let to = what_if.best.rows.get(window + 1).copied();
        // between the rows that were looked at the last one holds
        for value in &mut best[from..to.unwrap_or(from + 1)] {
            *value = what_if.best.spread[window];
        }
    }
    let mut figures = vec![plot(
        "Spread of the loads (35)",
        "N",
        vec![
            Curve::new("locked", fixed.spread.clone()),
            Curve::new(now, moved.spread.clone()),
            Curve::new("best posture at rest", best),
        ],
    )];
    let com = |axis: usize, title: &str| {
        plot(
            title,
            "m",
            vec![
                Curve::new("locked", fixed.com[axis].clone()),
                Curve::new(now, moved.com[axis].clone()),
            ],
        )
    };
    figures.push(com(
        0,
        "Centre of mass forward of the middle of the contact points",
    ));
    figures.push(com(1, "Centre of mass left of it"));
    let wheels = what_if.analysis.machine.wheels();
    for (wheel, spec) in wheels.iter().enumerate() {
        figures.push(plot(
            &format!("Load {}", spec.name),
            "N",
            vec![
                Curve::new("locked", fixed.load[wheel].clone()),
                Curve::new(now, moved.load[wheel].clone()),
            ],
        ));
    }
    figures.push(plot(
        "Least stability angle",
        "rad",
        vec![
            Curve::new("locked", fixed.stability_angle.clone()),
            Curve::new(now, moved.stability_angle.clone()),
        ],
    ));
    figures.extend(rod_figures(what_if, moved, &plot));
    figures
}

fn rod_figures(
    what_if: &WhatIf,
    moved: &Track,
    plot: &dyn Fn(&str, &str, Vec<Curve>) -> Figure,
) -> Vec<Figure> {
    let suspension = &what_if.suspension;
    let level = |value: f64| vec![value; moved.spread.len()];
    let mut figures = Vec::new();
    for (name, rod) in rod_names(what_if).iter().zip(&moved.rods) {
        let [least, greatest] = suspension.stroke;
        let controlled = moved.is_controlled();
        let mut position = vec![Curve::new("rod", rod.position.clone())];
        let mut velocity = vec![Curve::new("rod", rod.velocity.clone())];
        let mut acceleration = vec![Curve::new("rod", rod.acceleration.clone())];
        if controlled {
            position.push(Curve::new("reference", rod.reference.clone()));
            velocity.push(Curve::new("reference", rod.reference_velocity.clone()));
            let commanded = rod.commanded_acceleration.clone();
            acceleration.push(Curve::new("command", commanded));
        }
        position.extend([
            Curve::new("least", level(least)),
            Curve::new("greatest", level(greatest)),
        ]);
        if controlled {
            let limits = |[least, greatest]: &[Vec<f64>; 2]| {
                [
                    Curve::new("least", least.clone()),
                    Curve::new("greatest", greatest.clone()),
                ]
            };
            velocity.extend(limits(&rod.velocity_limits));
            acceleration.extend(limits(&rod.acceleration_limits));
        }
        figures.push(plot(&format!("Position of {name}"), "m", position));
        figures.push(plot(&format!("Velocity of {name}"), "m/s", velocity));
        figures.push(plot(
            &format!("Acceleration of {name}"),
            "m/s²",
            acceleration,
        ));
        let mut force = vec![Curve::new("needed by the motion", rod.force_needed.clone())];
        if controlled {
            force.push(Curve::new("piston", rod.force.clone()));
            figures.push(plot(
                &format!("Valve of {name}"),
                "-",
                vec![Curve::new("opening", rod.opening.clone())],
            ));
            figures.push(plot(
                &format!("Pressures of {name}"),
                "Pa",
                vec![
                    Curve::new("piston's side", rod.piston_pressure.clone()),
                    Curve::new("rod's side", rod.rod_pressure.clone()),
                ],
            ));
            figures.push(plot(
                &format!("Tracking error of {name}"),
                "m",
                vec![Curve::new("reference less rod", rod.tracking_error())],
            ));
        }
        figures.push(plot(&format!("Force of {name}"), "N", force));
    }
    figures
}
