//! Prints a checked machine as text or JSON.

use std::fmt::Write;

use anyhow::Result;

use crate::base::stdout;
use crate::setup::identify::AgreementRow;

use super::document::{MachineCheck, Posture, Reading, Weighed};

/// Prints a checked machine.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(check: &MachineCheck, as_json: bool) -> Result<()> {
    stdout::print(check, as_json, table)
}

fn table(check: &MachineCheck) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let out = &mut text;
    writeln!(
        out,
        "{} ({}), positions in {}, gravity {} m/s²",
        check.name, check.machine_file, check.base_link, check.gravity_m_s2
    )?;
    masses(out, check)?;
    geometry(out, check)?;
    writeln!(out, "\nIMU: {}", check.imu_mounting)?;
    loads(out, check)?;
    for weighed in check.weighed.iter().chain(&check.weighings) {
        readings(out, weighed)?;
    }
    if let Some(agreement) = &check.agreement {
        agreement_of_weighings(out, agreement)?;
    }
    for note in &check.notes {
        writeln!(out, "\nnote: {note}")?;
    }
    Ok(text)
}

fn agreement_of_weighings(out: &mut String, agreement: &AgreementRow) -> std::fmt::Result {
    let verdict = match agreement.contradict_each_other {
        true => format!("they CONTRADICT each other, {}", agreement.suspects_text()),
        false => "they agree".into(),
    };
    writeln!(
        out,
        "\nweighings against each other, whatever the machine weighs: chi-square {:.1} of {} redundant, {verdict}",
        agreement.chi_square, agreement.redundant_readings
    )
}

fn masses(out: &mut String, check: &MachineCheck) -> std::fmt::Result {
    writeln!(
        out,
        "\n{:<12} {:>12} {:>24}",
        "part", "mass (kg)", "centre of mass (m)"
    )?;
    for part in &check.masses {
        let com = part.centre_of_mass_m.map_or("-".into(), point);
        writeln!(out, "{:<12} {:>12.1} {com:>24}", part.part, part.mass_kg)?;
    }
    Ok(())
}

fn geometry(out: &mut String, check: &MachineCheck) -> std::fmt::Result {
    writeln!(out)?;
    for (i, axle) in check.axles.iter().enumerate() {
        writeln!(
            out,
            "axle {}: {} at x = {:.3} m, track {} m",
            i + 1,
            axle.wheels.join(", "),
            axle.x_m,
            number(axle.track_m, 3)
        )?;
    }
    writeln!(out, "wheelbase {} m", number(check.wheelbase_m, 3))
}

fn loads(out: &mut String, check: &MachineCheck) -> std::fmt::Result {
    writeln!(
        out,
        "\nstatic loads, level, at rest: {}",
        check.posture.source
    )?;
    joints(out, &check.posture)?;
    writeln!(
        out,
        "{:<12} {:>10} {:>10} {:>8} {:>26} {:>11}",
        "wheel", "load (N)", "sigma (N)", "share", "centre (m)", "radius (m)"
    )?;
    for wheel in &check.wheels {
        writeln!(
            out,
            "{:<12} {:>10} {:>10} {:>6} % {:>26} {:>11.3}",
            wheel.wheel,
            number(wheel.static_load_n, 0),
            number(wheel.sigma_n, 0),
            percent(wheel.share),
            point(wheel.centre_m),
            wheel.radius_m
        )?;
    }
    for sum in &check.sums {
        writeln!(
            out,
            "{:<12} {:>10} {:>10} {:>6} %",
            sum.name,
            number(sum.static_load_n, 0),
            number(sum.sigma_n, 0),
            percent(sum.share)
        )?;
    }
    Ok(())
}

fn readings(out: &mut String, weighed: &Weighed) -> std::fmt::Result {
    writeln!(
        out,
        "\ncomparison with [weighed]: {}",
        weighed.posture.source
    )?;
    joints(out, &weighed.posture)?;
    writeln!(
        out,
        "{:<20} {:>16} {:>16} {:>14} {:>8} {:>7}",
        "scale under", "weighed (N)", "model (N)", "difference (N)", "(%)", "sigmas"
    )?;
    let signed =
        |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:+.digits$}"));
    for reading in &weighed.readings {
        writeln!(
            out,
            "{:<20} {:>16} {:>16} {:>14} {:>8} {:>7} {}",
            reading.name,
            with_sigma(Some(reading.weighed_n), Some(reading.weighed_sigma_n)),
            with_sigma(reading.model_n, reading.model_sigma_n),
            signed(reading.difference_n, 0),
            signed(reading.difference_percent, 1),
            signed(reading.sigmas, 1),
            verdict(reading)
        )?;
    }
    Ok(())
}

fn verdict(reading: &Reading) -> &'static str {
    match reading.is_within {
        Some(true) => "within two sigma",
        Some(false) => "BEYOND two sigma: check model and scale",
        None => "unknown",
    }
}

fn with_sigma(value: Option<f64>, sigma: Option<f64>) -> String {
    format!("{} ± {}", number(value, 0), number(sigma, 0))
}

fn joints(out: &mut String, posture: &Posture) -> std::fmt::Result {
    let moved = posture.joints.iter().filter(|j| j.position != Some(0.0));
    let moved: Vec<String> = moved
        .map(|joint| format!("{} {}", joint.joint, number(joint.position, 3)))
        .collect();
    match moved.is_empty() {
        true => Ok(()),
        false => writeln!(out, "  joints (rad, m): {}", moved.join(", ")),
    }
}

/// Coordinates to the millimetre, without negative zero.
fn point(coordinates: [f64; 3]) -> String {
    let text = coordinates.map(|c| format!("{c:8.3}").replace("-0.000", " 0.000"));
    text.concat()
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".into(), |value| format!("{value:.digits$}"))
}

fn percent(share: Option<f64>) -> String {
    number(share.map(|share| share * 100.0), 1)
}
