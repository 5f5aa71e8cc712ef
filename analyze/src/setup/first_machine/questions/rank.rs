//! Orders open values by how far their uncertainty moves the wheel loads of the log.

use std::io::Write;

use anyhow::{Context, Result};
use tempfile::NamedTempFile;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::Machine;

use super::list::{brief, parameters, settled, structure};
use super::open_value::{Effect, OpenValue, OpenValues, Subject};
use crate::analysis::run;
use crate::analysis::sensitivity::{SensitivityRow, SensitivityTable};
use crate::base::error_text::error_text;
use crate::base::number::percent;
use crate::base::options::Options;
use crate::events::support_words::SupportWord;
use crate::setup::first_machine::draft::Draft;
use crate::setup::first_machine::guesses::Guesses;
use crate::setup::first_machine::of_sheet;
use crate::setup::first_machine::render::rendered;
use crate::setup::first_machine::text::quoted;

/// Standard deviation of a roll moment distribution that nobody stated: between the axles, everything is possible.
const OPEN_DISTRIBUTION: f64 = 0.25;
/// Standard deviation of a load that nobody stated, as a share of the mass of the machine.
const OPEN_PAYLOAD_SHARE: f64 = 0.1;
/// Smallest change of a wheel's load, as a share of its load at rest, for which a value is asked.
const LEAST_SHARE: f64 = 0.01;

/// Returns the open and assumed values of a draft, ordered by how far they move the load of the wheel that came closest to
/// lifting in the log. For that, the log is analysed with everything as proposed.
pub fn open_values(draft: &Draft) -> OpenValues {
    let guesses = settled(draft);
    let mut values = structure(draft, guesses.as_ref());
    let mut ranked = parameters(draft, guesses.as_ref());
    let (machine, table) = match sensitivity(draft, guesses.as_ref()) {
        Ok(found) => found,
        Err(error) => {
            values.append(&mut ranked);
            return OpenValues {
                values,
                unranked: Some(error_text(&error)),
                ..OpenValues::default()
            };
        }
    };
    for value in &mut ranked {
        value.effect = effect(value, &machine, &table);
    }
    ranked.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let least_n = LEAST_SHARE * machine.reference().static_load[table.worst_wheel];
    let is_minor = |value: &OpenValue| {
        let effect = value.effect.as_ref();
        effect.is_some_and(|effect| effect.change_n < least_n)
    };
    // the mounting of the IMU is confirmed as a whole
    let asks_for_imu = ranked
        .iter()
        .any(|it| it.subject.is_of_imu() && !is_minor(it));
    let (minor, mut major) = ranked
        .into_iter()
        .partition::<Vec<_>, _>(|it| is_minor(it) && !(it.subject.is_of_imu() && asks_for_imu));
    values.append(&mut major);
    OpenValues {
        values,
        minor,
        least_n,
        unranked: None,
    }
}

/// Returns the share of the value in the variance; values without one come last.
fn share(value: &OpenValue) -> f64 {
    value
        .effect
        .as_ref()
        .map_or(-1.0, |effect| effect.variance_share)
}

/// Computes the joint effect of the parameters of a value, which are not correlated.
fn effect(value: &OpenValue, machine: &Machine, table: &SensitivityTable) -> Option<Effect> {
    let ranked = table.ranked();
    let of_value = |row: &&&SensitivityRow| value.subject.is_about(row.parameter, machine);
    let rows: Vec<&SensitivityRow> = ranked.iter().filter(of_value).copied().collect();
    let first = rows.first()?;
    let changes = rows.iter().map(|row| row.two_sigma_change_n().powi(2));
    let two_sigma = 2.0 * first.sigma;
    let doubt = match (&value.subject, first.parameter.unit(machine), first.nominal) {
        (Subject::TyreStiffness | Subject::RollMomentDistribution, ..) => {
            let share = percent(two_sigma);
            format!("{share} in how the axles share the load difference between the sides")
        }
        (Subject::OtherMasses(_), _, Some(mass)) => percent(two_sigma / mass),
        (_, "rad", _) => format!("{}°", brief(two_sigma.to_degrees())),
        (_, unit, _) => format!("{} {unit}", brief(two_sigma)),
    };
    Some(Effect {
        wheel: SupportWord::named(&machine.wheels()[table.worst_wheel]),
        doubt,
        change_n: changes.sum::<f64>().sqrt(),
        variance_share: rows.iter().map(|row| row.variance_share).sum(),
    })
}

/// The derivatives of the loads of the log with everything as proposed, and with the doubt that is in it.
fn sensitivity(draft: &Draft, guesses: Option<&Guesses>) -> Result<(Machine, SensitivityTable)> {
    // a sheet's URDF is not written yet
    let of_sheet = draft.of_sheet.as_ref();
    let urdf = of_sheet.map(|machine| {
        let mut file = NamedTempFile::new()?;
        file.write_all(machine.urdf().as_bytes()).map(|()| file)
    });
    let urdf = urdf.transpose().context("a temporary file")?;
    let text = match of_sheet.zip(urdf.as_ref()) {
        Some((machine, urdf)) => {
            of_sheet::rendered(draft, machine, guesses, &urdf.path().display().to_string())
        }
        None => rendered(draft, guesses, "") + &open_distribution(),
    };
    let file = MachineFile::from_text(&draft.out, &(text + &open_payload(guesses)))?;
    let options = Options::default();
    let (analysis, ()) =
        run::analyse_into(draft.log.path(), &file, options, &mut |_| {}, |_| Ok(()))?;
    let table = analysis.sensitivity;
    let table = table.context("this machine's loads have no derivatives")?;
    Ok((analysis.machine, table))
}

/// A wide standard deviation of the split that nobody stated.
fn open_distribution() -> String {
    format!("\n[uncertainty]\nroll_moment_distribution = {OPEN_DISTRIBUTION:?}\n")
}

/// A load on the tool of nothing, with a wide standard deviation.
fn open_payload(guesses: Option<&Guesses>) -> String {
    let tool = guesses.and_then(|guesses| {
        let mass: f64 = guesses.outline.links.iter().map(|link| link.mass).sum();
        Some((guesses.tool.as_ref()?, mass))
    });
    tool.map_or(String::new(), |(tool, mass)| {
        format!(
            "[[payload]]\nlink = {}\nmass = 0.0\nmass_sigma = {:?}\n",
            quoted(&tool.link),
            OPEN_PAYLOAD_SHARE * mass
        )
    })
}
