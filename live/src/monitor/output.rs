//! Verdicts as text and JSON.
//!
//! With `--json` every row is one line, and so is every change of the verdict between rows. Schema 3:
//!
//! | key | meaning |
//! |---|---|
//! | `schema` | 3 |
//! | `event` | `row`, or `between`: the numbers are then those of the last row |
//! | `time_ns` | time of the row, by the clock of the joint states |
//! | `verdict`, `verdict_latched` | the current level, and the level to act on |
//! | `basis` | what the level stands on: `proven`, `assumed` or `doubted` |
//! | `unproven` | what the loads hang on that nothing has proven |
//! | `proven_by` | for each of these, the motion or the statement that would prove it |
//! | `faults`, `cautions` | problems of the input since the last row |
//! | `held_faults`, `held_cautions`, `held_reasons` | what the level rests on: a level outlasts its causes |
//! | `valid`, `reasons` | whether the row is valid, and why not |
//! | `utilisation` | 1 - (OTF - 2 sigma) / static load, of the worst wheel |
//! | `time_to_lift_off_s`, `next_wheel` | time until the next wheel lifts if its load keeps falling at its present rate, and which one; null beyond 5 s, where the rate is not significant, and at levels that name no lost load |
//! | `predicted` | what is ahead by three assumed motions, see below |
//! | `commanded` | the joints that are predicted to move as a controller asks, not as they move |
//! | `doubted_loads` | the measured loads that contradict the computed ones for two seconds: the load sensor that is furthest off, and `total` |
//! | `load_explanations` | what would explain the total: `unstated_load`, `load_on_tool`, `support_sensor`, `exchanged_sensors` |
//! | `exchanged_sensors` | the wheels whose sensors would explain it if they were exchanged |
//! | `doubted_forces` | the linkages whose measured force contradicts what masses and motion require for two seconds, or whose arm rests on something |
//! | `frozen_forces` | the linkages whose measured force repeats one value although the required one changes |
//! | `unstated_mass_kg`, `unstated_mass_sigma_kg` | the load that would explain it, negative for less than what is stated; null if none would |
//! | `payload_mass_kg`, `payload_mass_sigma_kg` | mass of the payloads that a signal states or that is estimated row by row, and its standard deviation; null while unknown, and without such payloads |
//! | `standing` | the wheels that are on the ground as supports, of a machine whose supports come and go those of now; null while unknown |
//! | `ground_gap`, `ground_gap_wheel` | why that is unknown (`transition`, `impossible`, `signal_missing`, `carries_though_off`), and of which wheel, or why the utilisation on it is (`no_reference_loads`); else null |
//! | `load_n` | load by wheel, names in lower case; null for one that is off the ground |
//! | `otf_n` | overturning force (OTF): load with every wheel held to the ground, by wheel |
//! | `load_sigma_n` | standard deviation of the load, by wheel |
//! | `load_min_n`, `load_max_n` | smallest and largest load that equilibrium allows, by wheel |
//! | `zmp_x_m`, `zmp_y_m`, `zmp_margin_m` | centre of pressure, and its distance from the nearest edge |
//! | `normal_force_n` | sum of the loads |
//! | `untimed` | true if real time is not checked because a log is replayed as fast as possible |
//!
//! `predicted` has the keys `age_s` (the prediction was made so long before this row, and its times are from then; null if
//! there is none), `go_on` (the motion goes on), `brake_now` and `stop_arm`; each of the last three has
//!
//! | key | content |
//! |---|---|
//! | `gap` | why nothing is predicted; null if something is, and all others are null otherwise |
//! | `lift_off_s`, `earliest_s`, `latest_s` | time until a wheel lifts, by the OTF and by the OTF less and plus two standard deviations; null beyond the horizon |
//! | `wheel`, `cause` | the wheel that lifts first or comes closest, and what takes most load off it |
//! | `utilisation` | utilisation at that instant |
//! | `otf_min_n` | smallest OTF within the horizon, by wheel |
//!
//! Numbers are printed so that reading them back gives the same bits. A number that cannot be computed is null.

use std::io::{self, Write};

use serde::ser::{Serialize, SerializeMap, Serializer};
use tipwatch_mechanics::prediction::{Law, PredictedNumber, PredictionGap};
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::verdict::{Basis, InputFault, InputFaults};
use tipwatch_mechanics::{Contribution, Quantity};

use crate::wire::names::Names;
use crate::wire::prediction_text::prediction_text;
use crate::wire::topics::{EVENT_ROW, WireVerdict};

/// Text is thinned out to one line in this time of the rows' clock (ns).
const LINE_PERIOD_NS: u64 = 200_000_000;

/// Format in which verdicts are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Every row as JSON.
    Json,
    /// Some rows, and every change of the level, as text.
    Text,
    /// Every change of the level, as text.
    Changes,
}

/// Prints verdicts.
#[derive(Debug)]
pub struct Printer<W: Write> {
    format: Format,
    names: Names,
    /// The session that the times belong to.
    session: u64,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    levels: Option<[u32; 2]>,
    out: W,
}

impl<W: Write> Printer<W> {
    /// A printer that has printed nothing.
    #[must_use]
    pub fn new(format: Format, names: Names, out: W) -> Self {
        Self {
            format,
            names,
            session: 0,
            first_ns: None,
            last_ns: None,
            levels: None,
            out,
        }
    }

    /// Sets the names of wheels and edges.
    pub fn set_names(&mut self, names: Names) {
        self.names = names;
    }

    /// Prints a verdict unless it repeats the last one.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn print(&mut self, verdict: &WireVerdict) -> io::Result<()> {
        let levels = [verdict.level, verdict.latched_level];
        let is_new = self.levels.replace(levels) != Some(levels);
        let is_row = verdict.event == EVENT_ROW;
        match self.format {
            Format::Json if is_row || is_new => write_json(&mut self.out, verdict, &self.names),
            Format::Json => Ok(()),
            Format::Text | Format::Changes => self.text(verdict, is_row, is_new),
        }
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Times count from the first row of the session; without one there is none.
    fn text(&mut self, verdict: &WireVerdict, is_row: bool, is_new: bool) -> io::Result<()> {
        if std::mem::replace(&mut self.session, verdict.session) != verdict.session {
            (self.first_ns, self.last_ns) = (None, None);
        }
        let is_early = |last: i64| verdict.time_ns.abs_diff(last) < LINE_PERIOD_NS;
        let is_left_out =
            self.format == Format::Changes || !is_row || self.last_ns.is_some_and(is_early);
        if is_row {
            self.first_ns.get_or_insert(verdict.time_ns);
        }
        if !is_new && is_left_out {
            return Ok(());
        }
        if is_row {
            self.last_ns = Some(verdict.time_ns);
        }
        let since_ns = |first: i64| verdict.time_ns.saturating_sub(first);
        let seconds = self
            .first_ns
            .map_or(0.0, |first| since_ns(first) as f64 * 1e-9);
        let shown = verdict.verdict();
        write!(self.out, "{seconds:8.2} s  {:7}", shown.level.name())?;
        if shown.latched_level != shown.level {
            let not = if verdict.latch().is_acknowledged {
                ""
            } else {
                "not "
            };
            let latched = shown.latched_level.name();
            write!(self.out, " ({latched} {not}acknowledged)")?;
        }
        if verdict.utilisation.is_finite() {
            write!(self.out, "  {:3.0} %", 100.0 * verdict.utilisation)?;
        }
        let loads = verdict.load.iter().zip(&verdict.load_sigma);
        let wheels = self.names.wheels.iter().zip(loads).enumerate();
        for (_, (wheel, (&load, &sigma))) in wheels.filter(|(at, _)| verdict.is_standing(*at)) {
            write!(self.out, "  {wheel} {load:.0} ± {:.0} N", 2.0 * sigma)?;
        }
        if verdict.payload_mass_kg.is_finite() {
            write!(self.out, "  {}", self.names.payload_text(verdict))?;
        }
        if let Some(gap) = self.names.ground_gap_text(verdict) {
            write!(self.out, "  supports: {gap}")?;
        }
        if verdict.time_to_lift_off_s.is_finite() {
            let wheel = self.names.wheels.get(verdict.next_wheel as usize);
            let wheel = wheel.map_or("?", String::as_str);
            write!(
                self.out,
                "  {wheel} lifts in {:.1} s",
                verdict.time_to_lift_off_s
            )?;
        }
        if let Some(text) = prediction_text(verdict, &self.names.wheels) {
            write!(self.out, "  {text}")?;
        }
        let held = shown.held;
        let mut reasons = verdict.row_reasons();
        reasons.add_all(held.reasons);
        for reason in reasons.iter() {
            write!(self.out, "  {}", reason.name())?;
        }
        if shown.basis == Basis::Assumed {
            let unproven = self.names.unproven(verdict);
            write!(self.out, "  not proven: {}", unproven.join(", "))?;
        }
        if verdict.doubted != 0 {
            let doubted = self.names.doubted(verdict);
            write!(self.out, "  doubted: {}", doubted.join(", "))?;
        }
        if verdict.load_doubt != 0 {
            write!(self.out, "  {}", self.names.load_doubt_text(verdict))?;
        }
        let forces = self.names.force_doubt_text(verdict);
        if !forces.is_empty() {
            write!(self.out, "  {forces}")?;
        }
        for fault in held.faults.iter() {
            write!(self.out, "  fault: {}", fault.name())?;
        }
        for caution in held.cautions.iter() {
            write!(self.out, "  caution: {}", caution.name())?;
        }
        writeln!(self.out)
    }
}

/// Writes a verdict as one line of JSON.
///
/// # Errors
/// `out` cannot be written.
pub fn write_json(out: &mut impl Write, verdict: &WireVerdict, names: &Names) -> io::Result<()> {
    serde_json::to_writer(&mut *out, &Line { verdict, names })?;
    out.write_all(b"\n")
}

struct Line<'a> {
    verdict: &'a WireVerdict,
    names: &'a Names,
}

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let verdict = self.verdict;
        let reasons = verdict.row_reasons();
        let conditions = verdict.conditions();
        let is_row = verdict.event == EVENT_ROW;
        let next_wheel = (verdict.time_to_lift_off_s.is_finite())
            .then(|| self.names.wheels.get(verdict.next_wheel as usize))
            .flatten();
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("schema", &3)?;
        map.serialize_entry("event", if is_row { "row" } else { "between" })?;
        map.serialize_entry("time_ns", &verdict.time_ns)?;
        map.serialize_entry("verdict", verdict.verdict().level.name())?;
        map.serialize_entry("verdict_latched", verdict.verdict().latched_level.name())?;
        map.serialize_entry("basis", verdict.verdict().basis.name())?;
        map.serialize_entry("unproven", &self.names.unproven(verdict))?;
        map.serialize_entry("proven_by", &self.names.proven_by(verdict))?;
        map.serialize_entry("doubted", &self.names.doubted(verdict))?;
        map.serialize_entry("doubted_loads", &self.names.doubted_loads(verdict))?;
        map.serialize_entry("load_explanations", &self.names.load_explanations(verdict))?;
        map.serialize_entry("exchanged_sensors", &self.names.exchanged_sensors(verdict))?;
        map.serialize_entry("doubted_forces", &self.names.doubted_forces(verdict))?;
        map.serialize_entry("frozen_forces", &self.names.frozen_forces(verdict))?;
        map.serialize_entry("unstated_mass_kg", &verdict.unstated_mass_kg)?;
        map.serialize_entry("unstated_mass_sigma_kg", &verdict.unstated_mass_sigma_kg)?;
        map.serialize_entry("payload_mass_kg", &verdict.payload_mass_kg)?;
        map.serialize_entry("payload_mass_sigma_kg", &verdict.payload_mass_sigma_kg)?;
        map.serialize_entry("faults", &FaultNames(conditions.faults))?;
        map.serialize_entry("cautions", &FaultNames(conditions.cautions))?;
        let held = verdict.verdict().held;
        map.serialize_entry("held_faults", &FaultNames(held.faults))?;
        map.serialize_entry("held_cautions", &FaultNames(held.cautions))?;
        map.serialize_entry("held_reasons", &ReasonNames(held.reasons))?;
        map.serialize_entry("valid", &(is_row && reasons.leave_valid()))?;
        map.serialize_entry("reasons", &ReasonNames(reasons))?;
        let number = |quantity| verdict.number(quantity);
        map.serialize_entry(&key(Quantity::Utilisation), &number(Quantity::Utilisation))?;
        map.serialize_entry("time_to_lift_off_s", &verdict.time_to_lift_off_s)?;
        map.serialize_entry("next_wheel", &next_wheel)?;
        map.serialize_entry("predicted", &PredictedOf(self))?;
        map.serialize_entry("commanded", &self.names.commanded(verdict))?;
        map.serialize_entry("standing", &self.names.standing(verdict))?;
        let gap = self.names.ground_gap(verdict);
        map.serialize_entry("ground_gap", &gap.map(|(gap, _)| gap))?;
        map.serialize_entry("ground_gap_wheel", &gap.and_then(|(_, wheel)| wheel))?;
        for of_wheel in BY_WHEEL {
            map.serialize_entry(
                &key(of_wheel(0)),
                &ByWheel {
                    line: self,
                    of_wheel,
                },
            )?;
        }
        for quantity in OF_MACHINE {
            map.serialize_entry(&key(quantity), &number(quantity))?;
        }
        map.serialize_entry("untimed", &(verdict.untimed != 0))?;
        map.end()
    }
}

/// Quantities of each wheel, in the order of the line.
const BY_WHEEL: [fn(usize) -> Quantity; 5] = [
    Quantity::Load,
    Quantity::Otf,
    Quantity::LoadSigma,
    Quantity::LoadLeast,
    Quantity::LoadLargest,
];

/// Quantities of the machine that follow them.
const OF_MACHINE: [Quantity; 4] = [
    Quantity::ZmpX,
    Quantity::ZmpY,
    Quantity::ZmpMargin,
    Quantity::NormalForce,
];

/// Key of a quantity: name of its column without the wheel, and unit.
fn key(quantity: Quantity) -> String {
    let kind = quantity.kind();
    let stem = kind.pattern.replace("_{wheel}", "");
    match kind.unit {
        "-" => stem,
        unit => format!("{stem}_{}", unit.to_lowercase()),
    }
}

struct ByWheel<'a> {
    line: &'a Line<'a>,
    of_wheel: fn(usize) -> Quantity,
}

impl Serialize for ByWheel<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Line { verdict, names } = self.line;
        let number = |wheel| verdict.number((self.of_wheel)(wheel));
        serializer.collect_map((names.wheels.iter().enumerate()).map(|(i, name)| (name, number(i))))
    }
}

/// Predictions of a verdict, by assumed motion.
struct PredictedOf<'a>(&'a Line<'a>);

impl Serialize for PredictedOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("age_s", &self.0.verdict.predicted_age_s)?;
        for law in Law::ALL {
            map.serialize_entry(law.name(), &PredictedBy { line: self.0, law })?;
        }
        map.end()
    }
}

struct PredictedBy<'a> {
    line: &'a Line<'a>,
    law: Law,
}

impl Serialize for PredictedBy<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Line { verdict, names } = self.line;
        let place = self.law as usize;
        let gap = verdict.gap_of(self.law);
        let is_known = gap.is_none();
        let wheel = names.wheels.get(verdict.predicted_wheel[place] as usize);
        let cause = verdict.predicted_cause_of(self.law);
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("gap", &gap.map(PredictionGap::name))?;
        for number in PredictedNumber::ALL {
            let name = match number {
                PredictedNumber::LiftOff => "lift_off_s",
                PredictedNumber::Earliest => "earliest_s",
                PredictedNumber::Latest => "latest_s",
                PredictedNumber::Utilisation => "utilisation",
            };
            map.serialize_entry(name, &verdict.predicted(number)[place])?;
        }
        map.serialize_entry("wheel", &wheel.filter(|_| is_known))?;
        map.serialize_entry("cause", &cause.filter(|_| is_known).map(Contribution::name))?;
        let otf = names.wheels.iter().zip(&verdict.predicted_otf_min[place]);
        map.serialize_entry("otf_min_n", &otf.collect::<ByName<'_>>())?;
        map.end()
    }
}

/// Numbers by name.
struct ByName<'a>(Vec<(&'a String, &'a f64)>);

impl<'a> FromIterator<(&'a String, &'a f64)> for ByName<'a> {
    fn from_iter<I: IntoIterator<Item = (&'a String, &'a f64)>>(numbers: I) -> Self {
        Self(numbers.into_iter().collect())
    }
}

impl Serialize for ByName<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

struct ReasonNames(Reasons);

impl Serialize for ReasonNames {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(Reason::name))
    }
}

struct FaultNames(InputFaults);

impl Serialize for FaultNames {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(InputFault::name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::topics::EVENT_BETWEEN;

    #[test]
    fn times_are_those_of_the_session() {
        let mut printed = Vec::new();
        let mut printer = Printer::new(Format::Text, Names::default(), &mut printed);
        let stamp_ns = 1_795_648_666_000_000_000;
        let row = |session: u64, time_ns: i64, level: u32| {
            let mut verdict = WireVerdict::unknown();
            (verdict.session, verdict.time_ns, verdict.level) = (session, time_ns, level);
            verdict.event = EVENT_ROW;
            verdict
        };
        let mut idle = row(0, 0, 5);
        idle.event = EVENT_BETWEEN;
        for verdict in [
            row(1, stamp_ns, 0),
            row(1, stamp_ns + 2_000_000_000, 6),
            idle,
            row(2, stamp_ns - 9_000_000_000, 0),
        ] {
            printer.print(&verdict).unwrap();
        }
        let text = String::from_utf8(printed).unwrap();
        let times = text
            .lines()
            .map(|line| line.split_whitespace().next().unwrap());
        assert_eq!(times.collect::<Vec<_>>(), ["0.00", "2.00", "0.00", "0.00"]);
    }
}
