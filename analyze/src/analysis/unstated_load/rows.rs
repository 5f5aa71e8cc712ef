//! The rows of a fall: its onset, the rotation, and the time before in which the platform leans on its tyres.

use nalgebra::{Vector2, Vector3};
use tipwatch_language::word;
use tipwatch_mechanics::machine::{LoadOnTool, Machine};
use tipwatch_mechanics::number::SURE_SIGMAS;
use tipwatch_mechanics::{Placement, State};

use super::amounts::RowState;
use super::fall::Fall;
use crate::base::table::Table;
use crate::events::drives;

/// Largest rotation that is used (rad): beyond it the tyre's shoulder carries, at a place that is hardly known.
const LARGEST_RAD: f64 = 0.35;
/// Longest time before the onset in which the lean is looked at (s).
const LEAN_S: f64 = 30.0;
/// Half the time around the onset whose rows count as its rows (s).
const AT_ONSET_S: f64 = 0.03;
/// Most rows of each part.
const MOST_FALL_ROWS: usize = 40;
const MOST_LEAN_ROWS: usize = 30;
/// A machine that was caught rotates less than half as fast within this time (s). What caught it is a force from outside,
/// which the estimated accelerations show for this time before (s).
const STOPS_S: f64 = 0.15;
const CAUGHT_S: f64 = 0.3;
/// Rows over which a rate of rotation is taken.
const RATE_ROWS: usize = 4;
/// Longer than this between two rows is a gap (ns).
const GAP_NS: i64 = 200_000_000;

/// The rows that are used.
pub(super) struct FallRows {
    pub(super) onset: Vec<RowState>,
    pub(super) fall: Vec<RowState>,
    /// Rows before the lift, evenly thinned out.
    pub(super) lean: Vec<RowState>,
    /// Reason why there are no rows of the lean.
    pub(super) no_lean: Option<String>,
    /// Whether the log has an attitude; otherwise the lean is the integral of the angular velocity.
    pub(super) has_attitude: bool,
}

/// Reads rows of a log.
pub(super) struct Reader<'a> {
    machine: &'a Machine,
    table: &'a Table,
    placement: Placement<'a>,
    load: Option<LoadOnTool>,
    fall: Fall,
    /// Unit vector along the edge in base axes; a positive rotation about it lifts the interior.
    along: Vector3<f64>,
}

impl<'a> Reader<'a> {
    /// `None` if the state at the onset is unknown.
    pub(super) fn new(machine: &'a Machine, table: &'a Table, fall: Fall) -> Option<Self> {
        let mut reader = Self {
            machine,
            table,
            placement: Placement::new(machine),
            load: machine.load_on_tool(),
            fall,
            along: Vector3::zeros(),
        };
        let onset = table.at(fall.onset_ns);
        let _ = reader.read(onset)?;
        let edge = &machine.polygon().edges()[fall.edge];
        let contacts = &reader.placement.contacts;
        reader.along = (contacts[edge.to] - contacts[edge.from]).try_normalize(0.0)?;
        Some(reader)
    }

    /// All rows that are used.
    pub(super) fn rows(&mut self) -> FallRows {
        let [first, last] = [self.fall.onset_ns, self.fall.until_ns].map(|at| self.table.at(at));
        let onset_row = first;
        let until = self.readable(onset_row..self.table.len().min(last + 1));
        let mut rotating = self.row_states(onset_row..until);
        self.measure_rotation(&mut rotating);
        let is_free = caught_s(&rotating).map(|at_s| at_s - CAUGHT_S);
        let has_attitude = rotating.first().is_some_and(has_up);
        let largest = (rotating.iter()).fold(0.0, |most: f64, row| most.max(row.rotation_rad));
        let begins_s = (SURE_SIGMAS * self.fall.onset_sigma_s()).max(AT_ONSET_S);
        let ends = rotating
            .iter()
            .position(|row| row.rotation_rad > LARGEST_RAD);
        rotating.truncate(ends.unwrap_or(rotating.len()));
        // a machine that comes back touches the ground again before it has turned back
        let peak = rotating.iter().position(|row| row.rotation_rad >= largest);
        let counts = |(place, row): (usize, &RowState)| {
            let is_past = peak.is_some_and(|peak| place > peak);
            let is_caught = is_free.is_some_and(|until_s| row.time_s > until_s);
            row.time_s >= begins_s && !is_caught && (!is_past || row.rotation_rad >= 0.5 * largest)
        };
        let keep: Vec<bool> = rotating.iter().enumerate().map(counts).collect();
        let mut keep = keep.into_iter();
        rotating.retain(|_| keep.next() == Some(true));
        let lean = self.lean_rows(onset_row);
        let (lean, no_lean) = match lean {
            Ok(rows) => (rows, None),
            Err(why) => (Vec::new(), Some(why)),
        };
        FallRows {
            onset: self.at_onset(onset_row),
            fall: thinned(rotating, MOST_FALL_ROWS),
            lean,
            no_lean,
            has_attitude,
        }
    }

    /// The rows around the onset.
    fn at_onset(&mut self, onset: usize) -> Vec<RowState> {
        let half_ns = (AT_ONSET_S * 1e9) as i64;
        let first = self.table.at(self.fall.onset_ns.saturating_sub(half_ns));
        let last = self.table.at(self.fall.onset_ns.saturating_add(half_ns));
        let first = first.min(onset);
        let until = self.readable(first..(last + 1).min(self.table.len()));
        self.row_states(first..until)
    }

    /// The rows before the onset while the machine stands, with the measured lean.
    fn lean_rows(&mut self, onset: usize) -> Result<Vec<RowState>, String> {
        let margin_ns = (2e9 * self.fall.onset_sigma_s()) as i64;
        let last = self
            .table
            .at(self.fall.onset_ns.saturating_sub(margin_ns))
            .min(onset);
        let times = &self.table.times_ns;
        let earliest_ns = times[last].saturating_sub((LEAN_S * 1e9) as i64);
        let mut first = last;
        while first > 0
            && times[first - 1] >= earliest_ns
            && times[first] - times[first - 1] <= GAP_NS
            && !self.table.reasons[first - 1].leave_state_unknown()
        {
            first -= 1;
        }
        let mut rows = self.row_states(first..last);
        let stood = rows
            .iter()
            .rev()
            .take_while(|row| !drives(self.machine, &row.state));
        let stood = stood.count();
        if rows.len() < 2 {
            return Err(word!("the log begins with the lift").into());
        }
        if stood < 2 {
            return Err(word!("the machine was driving, so that the ground leaned it, too").into());
        }
        rows.drain(..rows.len() - stood);
        self.measure_lean(&mut rows);
        Ok(thinned(rows, MOST_LEAN_ROWS))
    }

    /// The end of the rows that can be read without a gap.
    fn readable(&self, rows: std::ops::Range<usize>) -> usize {
        let times = &self.table.times_ns;
        let is_next = |row: &usize| {
            let is_near = *row == rows.start || times[*row] - times[*row - 1] <= GAP_NS;
            is_near && !self.table.reasons[*row].leave_state_unknown()
        };
        rows.start + rows.clone().take_while(is_next).count()
    }

    fn row_states(&mut self, rows: std::ops::Range<usize>) -> Vec<RowState> {
        rows.map_while(|row| self.read(row)).collect()
    }

    /// The state of a row and the places of its parts; `None` if they are unknown.
    fn read(&mut self, row: usize) -> Option<RowState> {
        let mut state = State::zero(self.machine);
        self.table.state(row, &mut state);
        self.placement.place(&state);
        let edge = &self.machine.polygon().edges()[self.fall.edge];
        let contacts = &self.placement.contacts;
        let across = (contacts[edge.to] - contacts[edge.from]).cross(&self.placement.normal);
        let up = state.base.known_up().unwrap_or(self.placement.normal);
        let outward = (across - up * across.dot(&up)).try_normalize(0.0)?;
        let load_place = self.load.map_or_else(Vector3::zeros, |load| {
            self.placement.point(load.body, &load.place)
        });
        let time_ns = self.table.times_ns[row];
        let is_known = outward.iter().chain(&load_place).all(|v| v.is_finite());
        is_known.then_some(RowState {
            time_ns,
            time_s: (time_ns - self.fall.onset_ns) as f64 * 1e-9,
            state,
            load_place,
            outward,
            rotation_rad: 0.0,
            lean_rad: Vector2::zeros(),
        })
    }

    fn measure_rotation(&mut self, rows: &mut [RowState]) {
        let along = self.along;
        let turned = self.turned(rows);
        for (row, turned) in rows.iter_mut().zip(turned) {
            row.rotation_rad = along.dot(&turned);
        }
    }

    fn measure_lean(&mut self, rows: &mut [RowState]) {
        let turned = self.turned(rows);
        for (row, turned) in rows.iter_mut().zip(turned) {
            row.lean_rad = turned.xy();
        }
    }

    /// Rotation since the first row, as a vector in base axes (rad): by the attitude where it is known, else by the
    /// angular velocity. A rotation about the vertical is left out or small.
    fn turned(&mut self, rows: &[RowState]) -> Vec<Vector3<f64>> {
        let Some(before) = rows.first() else {
            return Vec::new();
        };
        let (mut sum, mut last_s) = (Vector3::zeros(), before.time_s);
        let has_attitude = rows.iter().all(has_up);
        let of = |row: &RowState| {
            if has_attitude {
                // base axes turn under a fixed direction, which therefore turns the other way in them
                let turn = row.state.base.up.cross(&before.state.base.up);
                let angle = turn
                    .norm()
                    .atan2(row.state.base.up.dot(&before.state.base.up));
                return turn
                    .try_normalize(0.0)
                    .map_or(Vector3::zeros(), |axis| axis * angle);
            }
            self.placement.place(&row.state);
            sum += self.placement.angular_velocity * (row.time_s - last_s);
            last_s = row.time_s;
            sum
        };
        rows.iter().map(of).collect()
    }
}

/// Returns the time since the onset at which a rotation stopped abruptly (s): the tool, a stop or the ground caught the machine.
fn caught_s(rotating: &[RowState]) -> Option<f64> {
    let pairs = rotating.windows(RATE_ROWS + 1).filter_map(|rows| {
        let (first, last) = (rows.first()?, rows.last()?);
        let seconds = last.time_s - first.time_s;
        let rate = (last.rotation_rad - first.rotation_rad) / seconds;
        rate.is_finite().then_some((first.time_s, rate))
    });
    let rates: Vec<(f64, f64)> = pairs.collect();
    let (at_s, fastest) = (rates.iter().copied()).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let soon = rates
        .iter()
        .filter(|(t, _)| *t > at_s && *t <= at_s + STOPS_S);
    let slowest = soon.map(|(_, rate)| *rate).reduce(f64::min)?;
    (slowest < 0.5 * fastest).then_some(at_s)
}

fn has_up(row: &RowState) -> bool {
    row.state.base.known_up().is_some()
}

/// Selects `most` rows at most, evenly spread, the first and the last among them.
fn thinned(mut rows: Vec<RowState>, most: usize) -> Vec<RowState> {
    let count = rows.len();
    if count <= most {
        return rows;
    }
    let mut places = (0..most).map(|k| k * (count - 1) / (most - 1)).peekable();
    let mut place = 0;
    rows.retain(|_| {
        let is_chosen = places.next_if_eq(&place).is_some();
        place += 1;
        is_chosen
    });
    rows
}
