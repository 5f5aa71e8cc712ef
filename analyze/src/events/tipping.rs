//! Tipping about an edge of the support polygon.
//!
//! The load off an edge E is the moment about it over the distance of the farthest wheel, a sum of overturning
//! forces that no split of the load changes:
//! ```text
//!     L_E = sum over wheels (d_i / d_max) OTF_i,    d_i distance of wheel i from the edge
//! ```
//! An edge with an axle astride that swings about a pivot is the line to where that axle presses the ground.
//! Wheels off the ground cannot pull, so its true value is never below zero: the computed one stays near zero,
//! within its own error, for as long as the machine rotates about the edge. A threshold at zero would see that
//! at random. Two hypotheses are compared instead, over the time in which L_E is within its error of zero: the
//! wheels carry load and the platform does not rotate about the edge, or they carry nothing and it does.

use nalgebra::Vector3;
use tipwatch_mechanics::estimation::plausibility::student;
use tipwatch_mechanics::machine::{JointCoupling, Machine, SupportKind};
use tipwatch_mechanics::number::{BEYOND_SURE, SURE_SIGMAS, normal_density, normal_distribution};
use tipwatch_mechanics::{Parameter, Placement, Quantity, Scope, State, Workspace, evaluate};

use super::episodes::{Episode, MERGED_NS, episodes_within, joined, least};
use super::onset::{self, Curve, Onset};
use super::pages::{MOST_ROWS_BACK, Pages};
use super::rotation::FoundRotation;
use super::turning::Turning;
use crate::base::table::Table;

/// Loads off an edge below this share of the weight are looked at.
const SMALL_SHARE: f64 = 0.15;
/// A load is near zero if it is below [`SURE_SIGMAS`] standard deviations, and below this share of the weight.
const NEAR_SHARE: f64 = 0.03;
/// Standard deviation of the rotation about an edge (rad) of a machine whose wheels stay on the ground: standing,
/// by its tyres, and driving, by the ground.
const STANDING_SIGMA_RAD: f64 = 0.6 * DEGREE;
const DRIVING_SIGMA_RAD: f64 = 2.0 * DEGREE;
/// The platform rotates for certain from this many standard deviations on.
pub(super) const ROTATES_SIGMAS: f64 = 3.3;
/// Faster than this a machine drives (m/s).
const DRIVES_M_PER_S: f64 = 0.1;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Share of logs whose machine or sensors are not as stated, beforehand.
const WRONG_SHARE: f64 = 1e-3;
/// Largest rotation considered (rad).
const LARGEST_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// Rotation that usual tyres do not allow: the onset was before it (rad). What is computed after it is of a machine that falls, and
/// in its quick motion the load off the edge keeps no level.
const BEYOND_TYRES_RAD: f64 = ROTATES_SIGMAS * STANDING_SIGMA_RAD;
/// Time after the onset of a measured rotation up to which the load off the edge is looked at (s).
const FITTED_S: f64 = 0.5;
/// Rotation up to which the last wheel off the edge may have come up (rad).
const UP_RAD: f64 = 4.0 * DEGREE;
/// Rotation by which a fall shows in the load off the edge, if ever (rad).
pub(super) const FALLEN_RAD: f64 = 40.0 * DEGREE;
/// Rotation until which a platform may rock from wheel to wheel before it tips (rad).
const KEPT_RAD: f64 = 1.5 * DEGREE;
/// While the machine rotates across its wheels, the ground carries the tyre further out, on its shoulder: by this share of its
/// radius per radian, on average, up to about this rotation (rad).
pub(crate) const SHIFT_SHARE: f64 = 0.25;
const SHIFT_UNTIL_RAD: f64 = 0.3;
/// Longest time before the load is near zero that the onset is searched with (s).
const BEFORE_S: f64 = 1.5;

/// Time before the end of a log whose computed loads decide whether a fall has begun (ns).
const LAST_NS: i64 = 100_000_000;

/// A time in which the machine tipped about an edge.
#[derive(Debug, Clone)]
pub(super) struct Tipping {
    pub(super) edge: usize,
    /// The rows.
    pub(super) episode: Episode,
    /// Weight of the OTF of each wheel in the load off the edge.
    pub(super) factors: Vec<f64>,
    /// Time at which the load off the edge reached zero, if the rows show it.
    pub(super) onset: Option<Onset>,
    /// Whether the machine rotated already in the first row that is known.
    pub(super) is_under_way: bool,
    /// Standard deviation of the load off the edge at its start (N); NaN without derivatives.
    pub(super) sigma_n: f64,
    /// Rotation about the edge since the onset, outwards positive: the largest (rad), and its row.
    pub(super) rotation: (f64, usize),
    /// Whether the rotation shows that the wheels were off the ground.
    pub(super) rotates: bool,
    /// Whether the computed load off the edge was zero within its error, as on the stated machine.
    pub(super) is_by_loads: bool,
    /// Probability that the wheels were off the ground; `None` if it cannot be computed.
    pub(super) certainty: Option<f64>,
    /// The row on which that rests: the one with the least load off the edge before tyres can no longer explain a rotation.
    pub(super) judged: usize,
    /// Probability that machine and sensors are as stated, by how far the computed load is below zero: wheels cannot pull.
    pub(super) loads_are_right: f64,
}

/// Whether the load off an edge is so small in a row that the row is examined: `size_m` is that of [`size`], `moment_nm` the
/// moment about the edge of the wheels off it.
pub(super) fn is_small(moment_nm: f64, weight_n: f64, size_m: f64) -> bool {
    -moment_nm <= SMALL_SHARE * size_m * weight_n
}

/// Finds the times of tipping about all edges within some rows. Where gyro and attitude show one of the `rotations`, the
/// wheels off its edge carry nothing, whatever the computed load: its fall ends at the onset, at any level.
pub(super) fn within(
    machine: &Machine,
    rows: &Pages<'_>,
    within: Episode,
    scope: Scope,
    rotations: &[FoundRotation],
) -> Vec<Tipping> {
    let mut placement = Placement::new(machine);
    let edges = 0..machine.polygon().edges().len();
    let found = edges.flat_map(|edge| {
        let mut of_edge = OfEdge {
            machine,
            rows,
            scope,
            edge,
            placement: &mut placement,
        };
        let name = &machine.polygon().edges()[edge].name;
        let measured = rotations.iter().filter(|it| it.edge == name.to_lowercase());
        let measured: Vec<Tipping> = measured
            .filter_map(|rotation| of_edge.measured(within, rotation))
            .collect();
        let mut found = of_edge.find(within);
        // the loads of the same say nothing more
        let is_other = |by_loads: &Tipping| {
            let overlaps = |it: &Tipping| it.episode.overlaps(by_loads.episode);
            !measured.iter().any(overlaps)
        };
        found.retain(is_other);
        found.extend(measured);
        found
    });
    found.collect()
}

/// Returns the distance of each wheel's contact point from the tipping line of an edge on the ground, in a placed state (m); zero
/// for wheels that stay on the ground.
pub(crate) fn distances(machine: &Machine, placement: &Placement<'_>, edge: usize) -> Vec<f64> {
    let [from, to] = placement.tipping_line(edge).on_ground;
    let along = (to - from).normalize();
    let stays = machine.stays_on_ground(&machine.polygon().edges()[edge]);
    let wheels = placement.contacts.iter().zip(&stays);
    wheels
        .map(|(contact, &stays)| {
            let distance = along.perp(&(placement.on_plane(contact) - from));
            if stays { 0.0 } else { distance }
        })
        .collect()
}

/// Weights of the wheels in the load off an edge in a placed state, and the distance of the farthest wheel (m).
pub(crate) fn factors_off(
    machine: &Machine,
    placement: &Placement<'_>,
    edge: usize,
) -> Option<(Vec<f64>, f64)> {
    let distances = distances(machine, placement, edge);
    let reach = distances.iter().copied().fold(0.0, f64::max);
    (reach > 0.0).then(|| (distances.iter().map(|d| d / reach).collect(), reach))
}

/// The load off an edge by row (N): the moment about it over the distance of the farthest wheel.
fn load_off<'a>(rows: &'a Pages<'a>, edge: usize, reach: f64) -> impl Fn(usize) -> f64 + use<'a> {
    move |row| -rows.value(Quantity::ItomFull(edge), row) / reach
}

/// Distance of the farthest wheel from an edge with all joints at zero (m).
pub(super) fn size(machine: &Machine, edge: usize) -> f64 {
    let spec = &machine.polygon().edges()[edge];
    let place = |wheel: usize| machine.wheels()[wheel].centre_at_zero.xy();
    let along = (place(spec.to) - place(spec.from)).normalize();
    let wheels = 0..machine.wheels().len();
    wheels
        .map(|wheel| along.perp(&(place(wheel) - place(spec.from))))
        .fold(0.0, f64::max)
}

/// Returns the shifts (m) out of its edge of the line on which the ground carries a rotated machine: the first because wheels
/// roll, the second on the shoulders of tyres, per [`SHIFT_SHARE`].
///
/// A wheel is a circle about its axle. The ground carries it under the axle, whichever way platform and wheel turn:
/// ```text
///     r tan(rotation) cos^2(edge, axle),      force along the normal times this = weight times r sin(rotation) cos^2
/// ```
pub(crate) fn outwards(machine: &Machine, edge: usize, rotation_rad: f64) -> [f64; 2] {
    let wheels = machine.wheels();
    let edge = &machine.polygon().edges()[edge];
    let [from, to] = [edge.from, edge.to].map(|wheel| &wheels[wheel]);
    let along = (to.centre_at_zero.xy() - from.centre_at_zero.xy()).normalize();
    let rolls = [from, to].map(|wheel| wheel.kind == SupportKind::Wheel);
    let by_axle = if rolls == [true; 2] {
        along.y * along.y
    } else {
        0.0
    };
    let shoulder = SHIFT_UNTIL_RAD * (rotation_rad / SHIFT_UNTIL_RAD).tanh();
    [
        from.radius * rotation_rad.tan() * by_axle,
        from.radius * shoulder * (1.0 - by_axle),
    ]
}

/// Whether a rotation at the end of a log may be a fall: neither tyres nor ground explain it, or hardly any load is left off the
/// edge.
pub(crate) fn may_be_fall(turning: &Turning, table: &Table) -> bool {
    let limit = match turning.is_beyond_tyres {
        true => SMALL_SHARE,
        false => NEAR_SHARE,
    };
    turning.is_beyond_ground || share_off(turning, table).is_some_and(|share| share <= limit)
}

/// The computed load off its edge in the last rows, as a share of the weight.
fn share_off(turning: &Turning, table: &Table) -> Option<f64> {
    let machine = table.machine_at(table.at(turning.at_ns))?;
    let edge = machine.edge_named(&turning.edge)?;
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let mut state = State::zero(machine);
    let times = &table.times_ns;
    let from_ns = turning.at_ns.saturating_sub(LAST_NS);
    let first = times.partition_point(|time_ns| *time_ns < from_ns);
    let until = times.partition_point(|time_ns| *time_ns <= turning.at_ns);
    let mut sums = [0.0; 2];
    for row in (first..until).filter(|row| table.reasons[*row].leave_loads()) {
        table.state(row, &mut state);
        let outcome = evaluate(machine, &state, &mut workspace);
        sums[0] -= outcome.itom_full[edge] / size(machine, edge);
        sums[1] += outcome.normal_force;
    }
    let [load_n, weight_n] = sums;
    (weight_n > 0.0 && load_n.is_finite()).then(|| load_n / weight_n)
}

/// Whether the machine drives in a state, or may.
pub(crate) fn drives(machine: &Machine, state: &State<f64>) -> bool {
    let joints = machine.joints().iter().zip(&state.joints);
    let by_wheels = joints.filter_map(|(joint, motion)| {
        let radius = machine.wheels()[joint.spins_wheel?].radius;
        Some((motion.rate * radius).abs())
    });
    let by_wheels = by_wheels.filter(|v| v.is_finite()).reduce(f64::max);
    let by_odometry = Some(state.base.velocity.norm()).filter(|v| v.is_finite());
    let speed = by_wheels.into_iter().chain(by_odometry).reduce(f64::max);
    speed.is_none_or(|speed| speed > DRIVES_M_PER_S)
}

struct OfEdge<'a, 'm> {
    machine: &'m Machine,
    rows: &'a Pages<'a>,
    scope: Scope,
    edge: usize,
    placement: &'a mut Placement<'m>,
}

impl OfEdge<'_, '_> {
    fn find(&mut self, within: Episode) -> Vec<Tipping> {
        let (rows, edge) = (self.rows, self.edge);
        let times = rows.times_ns;
        let moment = |row: usize| rows.value(Quantity::ItomFull(edge), row);
        let weight = |row: usize| rows.value(Quantity::NormalForce, row);
        let stays = (self.machine).stays_on_ground(&self.machine.polygon().edges()[edge]);
        let off: Vec<usize> = (0..stays.len()).filter(|&wheel| !stays[wheel]).collect();
        let load = |wheel: usize, row: usize| rows.value(Quantity::Load(wheel), row);
        let unloaded = |row: usize| {
            rows.is_meaningful(row) && off.iter().all(|&wheel| load(wheel, row) <= 0.0)
        };
        let size = size(self.machine, edge);
        let small =
            |row: usize| rows.is_meaningful(row) && is_small(moment(row), weight(row), size);
        let candidates = episodes_within(times, within, small);
        let mut found = Vec::new();
        for candidate in candidates {
            let Some((factors, reach)) = self.factors(candidate) else {
                continue;
            };
            let sigma_n = self.sigma(candidate, &factors);
            let load = load_off(rows, edge, reach);
            let limit_n = SURE_SIGMAS * sigma_n.max(0.0);
            let near = |row: usize| {
                let limit_n = limit_n.min(NEAR_SHARE * weight(row));
                unloaded(row) || (rows.is_meaningful(row) && load(row) <= limit_n)
            };
            for episode in episodes_within(times, candidate, near) {
                let blank = Tipping {
                    edge: self.edge,
                    episode,
                    factors: factors.clone(),
                    onset: None,
                    is_under_way: false,
                    sigma_n,
                    rotation: (0.0, episode.first),
                    rotates: false,
                    is_by_loads: true,
                    certainty: None,
                    judged: episode.first,
                    loads_are_right: 1.0,
                };
                match self.rotating(&blank, &load) {
                    Some(tipping) => found.push(tipping),
                    None => {
                        let brief = episodes_within(times, episode, unloaded);
                        let may_tip = |row: usize| rows.is_meaningful(row) && load(row) <= sigma_n;
                        let brief = joined(times, brief, may_tip).into_iter();
                        found.extend(brief.map(|episode| self.unloaded(&blank, episode, &load)));
                    }
                }
            }
        }
        found
    }

    /// The tipping of a measured rotation that begins in these rows, or was under way in the first known row of the log; `None`
    /// where its first rows are missing behind others.
    fn measured(&mut self, within: Episode, rotation: &FoundRotation) -> Option<Tipping> {
        let rows = self.rows;
        let began = rows.at(rotation.start_ns);
        let begins = (began..=within.last).find(|&row| rows.is_meaningful(row))?;
        let is_later = rows.times_ns[begins].abs_diff(rotation.start_ns) > MERGED_NS as u64;
        let is_unseen = rotation.start_ns < rows.times_ns[begins]
            && !(0..begins).rev().any(|row| rows.is_meaningful(row));
        if begins < within.first || (is_later && !is_unseen) {
            return None;
        }
        let until_ns = rotation.off_ground_until_ns();
        let is_of = |row: &usize| rows.times_ns[*row] <= until_ns && rows.is_meaningful(*row);
        let last = (begins..=within.last).take_while(is_of).last()?;
        let rows_of = Episode {
            first: begins,
            last,
        };
        let (factors, reach) = self.factors(rows_of)?;
        let sigma_n = self.sigma(rows_of, &factors);
        let edge = self.edge;
        let computed = load_off(rows, edge, reach);
        let load = |row: usize| {
            let angle = rotation.angle_at(rows.times_ns[row]);
            computed(row) + self.of_rotation(row, angle) / reach
        };
        let limit_n = self.limit_n(begins, sigma_n);
        let by_rates = rotation.onset(rows.times_ns[0]);
        // in the rows of a fall that is under way, the load off the edge has corners, but none of them is the onset
        let near = by_rates.filter(|_| !is_unseen);
        let onset = near.and_then(|near| {
            let margin_s = onset::NEAR_SIGMAS * near.sigma_s;
            let from_s = (near.at_s - margin_s).max(0.0);
            let to_s = near.at_s + margin_s + FITTED_S;
            let first = self.rows.row_from(from_s);
            // a heavy machine on soft tyres leans by more before its last wheel has lifted; about the pivot of an axle it turns on
            // to its stop, where the load has a corner of another beginning
            let edge = &self.machine.polygon().edges()[edge];
            let beyond_tyres = match self.machine.axles_astride(edge).next() {
                Some(_) => BEYOND_TYRES_RAD,
                None => BEYOND_TYRES_RAD.max(rotation.on_tyres_rad),
            };
            let rotated_ns = rotation.reached(beyond_tyres).unwrap_or(i64::MAX);
            let rotated = rows.at(rotated_ns).min(self.rows.row_from(to_s));
            let to_s = rows.seconds(rotated).min(to_s);
            let curve = self.curve(first, rotated.min(last), &load);
            // a corner is found on either side of missing rows, never between them
            if curve.has_gap(from_s, to_s) {
                return None;
            }
            // `near` is what the rates show: they do not count twice
            onset::corner(&curve, &Curve::default(), sigma_n, Some(near))
        });
        let is_under_way = is_unseen || by_rates.is_none();
        let level_n = onset
            .and_then(|onset| onset.level_n)
            .unwrap_or_else(|| load(begins));
        let onset = onset.map(|onset| {
            let is_on = |row: &usize| *row <= last && rows.is_meaningful(*row);
            let rotated =
                [KEPT_RAD, UP_RAD].map(|angle| rotation.reached(angle).map(|at_ns| rows.at(at_ns)));
            match rotated {
                [Some(kept), Some(up)] if is_on(&kept) && is_on(&up) => {
                    let curve = self.curve(begins, up, &load);
                    onset::until_level(&curve, onset, rows.seconds(kept), sigma_n)
                }
                _ => onset,
            }
        });
        let mut is_by_loads = level_n.abs() <= limit_n;
        // what turned the platform so far was not its fall: that begins where the load off the edge is lost
        let lost = (!is_by_loads && rotation.creeps)
            .then(|| {
                let fallen = rotation
                    .reached(FALLEN_RAD)
                    .map_or(last, |at_ns| rows.at(at_ns));
                self.lost(begins, fallen.min(last), sigma_n, &computed)
            })
            .flatten();
        is_by_loads |= lost.is_some();
        let is_under_way = is_under_way && lost.is_none();
        let onset = lost.or(onset).or(by_rates);
        let begins = match onset.filter(|_| !is_under_way) {
            Some(onset) => self.rows.row_from(onset.at_s).min(last),
            None => begins,
        };
        let (largest_rad, largest_ns) = rotation.largest();
        let largest_rad = match lost {
            Some(_) => largest_rad - rotation.angle_at(rows.times_ns[begins]),
            None => largest_rad,
        };
        Some(Tipping {
            edge,
            episode: Episode {
                first: begins,
                last,
            },
            factors,
            onset,
            is_under_way,
            sigma_n,
            rotation: (largest_rad, rows.at(largest_ns).min(last)),
            rotates: true,
            is_by_loads,
            certainty: Some(rotation.certainty_of_edge(is_by_loads)),
            judged: begins,
            loads_are_right: 1.0,
        })
    }

    /// Largest load off the edge that is that of wheels in the air, within its error (N); without derivatives that is unknown.
    fn limit_n(&self, row: usize, sigma_n: f64) -> f64 {
        let weight_n = self.rows.value(Quantity::NormalForce, row);
        (onset::STATED_SIGMAS * sigma_n).max(NEAR_SHARE * weight_n)
    }

    /// The moment about the edge by which a machine that rotates about it seems to carry less off it (N m): the ground carries
    /// it farther out than on the plane of its wheels.
    fn of_rotation(&self, row: usize, rotation_rad: f64) -> f64 {
        let [rolled, shoulder] = outwards(self.machine, self.edge, rotation_rad);
        self.rows.value(Quantity::NormalForce, row) * (rolled + SHIFT_SHARE * shoulder)
    }

    /// Finds the time at which the load off the edge passes through zero for good, in a rotation.
    fn lost(
        &self,
        first: usize,
        last: usize,
        sigma_n: f64,
        load: &dyn Fn(usize) -> f64,
    ) -> Option<Onset> {
        let carries = |row: &usize| self.rows.is_meaningful(*row) && load(*row) > 0.0;
        let from = (first..=last).rev().find(carries)?;
        // it carried load at first, and no longer at the end
        let is_lost = from > first && from < last && carries(&first);
        let near_s = self.rows.seconds(from);
        is_lost
            .then(|| onset::passage(&self.curve(first, last, load), near_s, sigma_n))
            .flatten()
    }

    /// Weights of the wheels in the load off the edge, and the distance of the farthest wheel (m).
    fn factors(&mut self, candidate: Episode) -> Option<(Vec<f64>, f64)> {
        self.axis(candidate.first)?;
        factors_off(self.machine, self.placement, self.edge)
    }

    /// Unit vector along the edge at a row, in base axes: a positive rotation about it lifts the interior.
    fn axis(&mut self, row: usize) -> Option<Vector3<f64>> {
        let mut state = State::zero(self.machine);
        self.rows.state(row, &mut state);
        self.placement.place(&state);
        let [from, to] = self.placement.tipping_line(self.edge).through;
        let axis = (to - from).normalize();
        axis.iter().all(|c| c.is_finite()).then_some(axis)
    }

    fn sigma(&self, candidate: Episode, factors: &[f64]) -> f64 {
        if !self.scope.sensitivities {
            return f64::NAN;
        }
        // Derivatives are unknown while the machine tips, so they are taken where it does not yet.
        let first = candidate.first;
        let forward = (first..=candidate.last).take(MOST_ROWS_BACK);
        let before = self.rows.sigma_near(first, factors, 0);
        before
            .or_else(|| {
                let last = forward.last()?;
                self.rows.sigma_near(last, factors, first)
            })
            .unwrap_or(f64::NAN)
    }

    /// Standard deviation of the rotation about the edge if the wheels stay on the ground (rad).
    fn rotation_sigma_rad(&self, row: usize) -> f64 {
        match self.drives(row) {
            true => DRIVING_SIGMA_RAD,
            false => STANDING_SIGMA_RAD,
        }
    }

    /// The tipping of an episode in which the platform rotates about the edge.
    fn rotating(&mut self, blank: &Tipping, load: &dyn Fn(usize) -> f64) -> Option<Tipping> {
        let Episode { first, last } = blank.episode;
        let axis = self.axis(first)?;
        let rotation = self.rotations(&axis, first, last);
        let largest = largest(&rotation, first);
        let sigma_rad = self.rotation_sigma_rad(first);
        if !(largest.0 >= ROTATES_SIGMAS * sigma_rad) {
            return None;
        }
        // The onset lies between the fall and the row by which the platform has rotated more than tyres allow.
        let rotated = first + rotation.iter().position(|&r| r >= BEYOND_TYRES_RAD)?;
        let (_, reach) = self.factors(blank.episode)?;
        let rotated_load = |row: usize| {
            let angle = row.checked_sub(first).map_or(0.0, |since| rotation[since]);
            load(row) + self.of_rotation(row, angle.max(0.0)) / reach
        };
        let curve = self.curve(first, rotated, &rotated_load);
        let rates = self.rates(&axis, &curve);
        // a machine that carries load off the edge in its first row has not begun to fall
        let limit_n = self.limit_n(first, blank.sigma_n);
        let may_be_off = (curve.loads_n.first()).is_some_and(|load_n| *load_n <= limit_n);
        let is_under_way =
            may_be_off && self.begins_unseen(&curve) && onset::had_begun(&rates) >= BEYOND_SURE;
        let onset = match is_under_way {
            true => None,
            false => onset::corner(&curve, &rates, blank.sigma_n, None),
        };
        let begins = onset.map_or(first, |onset| self.rows.row_from(onset.at_s).min(last));
        let until = rotation.len() - 1 + first;
        let since_onset = self.rotations(&axis, begins, until);
        let rotation = self::largest(&since_onset, begins);
        let level_n = match is_under_way {
            true => Some(load(first)),
            false => onset.and_then(|onset| onset.level_n),
        };
        let certainty = level_n
            .filter(|_| blank.sigma_n.is_finite())
            .map(|level_n| {
                let before_n = (begins.saturating_sub(1)..=begins)
                    .map(load)
                    .fold(0.0, f64::max);
                let range_n = SMALL_SHARE * self.rows.value(Quantity::NormalForce, first);
                let level = (level_n, blank.sigma_n);
                probability(level, (rotation.0, sigma_rad), range_n.max(before_n))
            })
            .filter(|p| p.is_finite());
        Some(Tipping {
            episode: Episode {
                first: begins,
                last,
            },
            onset,
            is_under_way,
            rotation,
            rotates: true,
            certainty,
            judged: least(
                load,
                Episode {
                    first: begins,
                    last: rotated.max(begins),
                },
            )
            .0,
            ..blank.clone()
        })
    }

    /// The tipping of an episode that only the loads show.
    fn unloaded(
        &mut self,
        blank: &Tipping,
        episode: Episode,
        load: &dyn Fn(usize) -> f64,
    ) -> Tipping {
        let near_s = self.rows.seconds(episode.first);
        let curve = self.curve(episode.first, episode.last, load);
        let rotation = match self.axis(episode.first) {
            Some(axis) => {
                let rotation = self.rotations(&axis, episode.first, episode.last);
                largest(&rotation, episode.first)
            }
            None => (f64::NAN, episode.first),
        };
        let (judged, least_n) = least(load, episode);
        let certainty = normal_distribution(-least_n / blank.sigma_n);
        let weight_n = self.rows.value(Quantity::NormalForce, episode.first);
        // a machine that is supposed may carry its load where the recorded one would have fallen, and one on the stop of its axle is
        // held by it
        let loads_are_right = match self.rows.is_supposed() || self.rests_on_stop(judged) {
            true => 1.0,
            false => is_right(
                (least_n, blank.sigma_n),
                (rotation.0, self.rotation_sigma_rad(episode.first)),
                weight_n,
            ),
        };
        Tipping {
            loads_are_right,
            episode,
            onset: onset::passage(&curve, near_s, blank.sigma_n),
            rotation,
            certainty: Some(certainty).filter(|p| p.is_finite()),
            judged,
            ..blank.clone()
        }
    }

    /// Whether an axle astride the edge is measured at the stop that the machine turns on to when it tips. On it, the ground under that
    /// axle holds a machine whose load about the line to the pivot is below zero.
    fn rests_on_stop(&mut self, row: usize) -> bool {
        let Some(outwards) = self.axis(row) else {
            return false;
        };
        let machine = self.machine;
        let mut state = State::zero(machine);
        self.rows.state(row, &mut state);
        let mut axles = machine.axles_astride(&machine.polygon().edges()[self.edge]);
        axles.any(|axle| {
            let JointCoupling::Measured(joint) = machine.bodies()[axle.body].coupling else {
                return false;
            };
            let it = &machine.joints()[joint];
            let Some([least, most]) = it.limits.filter(|_| it.constant.is_none()) else {
                return false;
            };
            let [from, to] = [Vector3::zeros(), Vector3::z()]
                .map(|in_body| self.placement.point(axle.body, &in_body));
            // the axle stays on the ground, and so turns back in the platform
            let position = state.joints[joint].position;
            let until_stop = match outwards.dot(&(to - from)) > 0.0 {
                true => position - least,
                false => most - position,
            };
            let sigma = Parameter::JointPosition(joint).sigma(machine);
            until_stop <= SURE_SIGMAS * sigma
        })
    }

    /// The load off the edge around an onset: from some time before `first` to `last`, gaps left out.
    fn curve(&self, first: usize, last: usize, load: &dyn Fn(usize) -> f64) -> Curve {
        let from_s = self.rows.seconds(first) - BEFORE_S;
        let mut curve = Curve::default();
        let from = (0..first)
            .rev()
            .take_while(|&row| self.rows.is_meaningful(row) && self.rows.seconds(row) >= from_s)
            .last()
            .unwrap_or(first);
        for row in (from..=last).filter(|&row| self.rows.is_meaningful(row)) {
            curve.push(self.rows.seconds(row), load(row));
        }
        curve
    }

    /// Whether nothing is known of the time before a curve.
    fn begins_unseen(&self, curve: &Curve) -> bool {
        let first_s = curve.times_s.first();
        let before = first_s.and_then(|&first_s| self.rows.row_from(first_s).checked_sub(1));
        before.is_none_or(|row| !self.rows.is_meaningful(row))
    }

    /// Whether the machine drives at a row, or may.
    fn drives(&self, row: usize) -> bool {
        let mut state = State::zero(self.machine);
        self.rows.state(row, &mut state);
        drives(self.machine, &state)
    }

    /// Rate of rotation about an axis of the base (rad/s) at the times of a curve.
    fn rates(&mut self, axis: &Vector3<f64>, of: &Curve) -> Curve {
        let mut state = State::zero(self.machine);
        let mut rates = Curve::default();
        for &time_s in &of.times_s {
            self.rows.state(self.rows.row_from(time_s), &mut state);
            self.placement.place(&state);
            rates.push(time_s, axis.dot(&self.placement.angular_velocity));
        }
        rates
    }

    /// Rotation about an axis of the base since row `first`, outwards positive (rad), row by row: from the
    /// attitude if the log has it, else the integral of the angular velocity.
    fn rotations(&mut self, axis: &Vector3<f64>, first: usize, last: usize) -> Vec<f64> {
        let mut state = State::zero(self.machine);
        let before = self.rows.up_in_base(self.machine, first);
        let (mut turned, mut last_ns) = (0.0, self.rows.times_ns[first]);
        let rotation = (first..=last).map(|row| {
            let now = self.rows.up_in_base(self.machine, row);
            if let (Some(before), Some(now)) = (before, now) {
                // Base axes rotate under a fixed direction, which therefore turns the other way in them.
                let across = |up: &Vector3<f64>| up - axis * axis.dot(up);
                let (a, b) = (across(&before), across(&now));
                return -axis.dot(&a.cross(&b)).atan2(a.dot(&b));
            }
            self.rows.state(row, &mut state);
            self.placement.place(&state);
            let time_ns = self.rows.times_ns[row];
            let step_s = (time_ns - last_ns) as f64 * 1e-9;
            last_ns = time_ns;
            let rate = axis.dot(&self.placement.angular_velocity);
            // A row in a gap has no rate: what was turned in it stays unknown and is left out.
            if rate.is_finite() && step_s * 1e9 <= MERGED_NS as f64 {
                turned += rate * step_s;
            }
            turned
        });
        rotation.collect()
    }
}

/// The largest rotation and its row.
fn largest(rotations: &[f64], first: usize) -> (f64, usize) {
    let rows = rotations.iter().enumerate();
    rows.fold((0.0, first), |best, (row, &rotation)| {
        if rotation > best.0 {
            (rotation, first + row)
        } else {
            best
        }
    })
}

/// Probability that the wheels off the edge carried nothing, both hypotheses equally likely beforehand.
///
/// ```text
///     lifted:        level ~ N(0, sigma^2),                             rotation anywhere from 0 to 90 degrees
///     on the ground: level ~ N(load, sigma^2), load from 0 to range,    rotation ~ N(0, rotation sigma^2)
/// ```
fn probability(
    (level_n, sigma_n): (f64, f64),
    (rotation_rad, rotation_sigma_rad): (f64, f64),
    range_n: f64,
) -> f64 {
    let lifted = normal_density(level_n, sigma_n) / LARGEST_RAD;
    let loaded =
        normal_distribution(level_n / sigma_n) - normal_distribution((level_n - range_n) / sigma_n);
    let on_ground = loaded / range_n * normal_density(rotation_rad, rotation_sigma_rad);
    lifted / (lifted + on_ground)
}

/// Probability that machine and sensors are as stated, by the least computed load off an edge and the rotation about it.
///
/// ```text
///     as stated: load ~ t(0, sigma) where it is below zero, for wheels cannot pull,   rotation anywhere from 0 to 90 degrees
///     otherwise: any load between minus and plus the weight,                          rotation ~ N(0, rotation sigma^2)
/// ```
/// t is Student's distribution, as in the comparisons of sensors: where a platform rotates fast, the error of smoothed loads has
/// heavier tails than a normal one.
fn is_right(
    (least_n, sigma_n): (f64, f64),
    (rotation_rad, rotation_sigma_rad): (f64, f64),
    weight_n: f64,
) -> f64 {
    let as_stated = student(least_n.min(0.0), sigma_n) * (1.0 - WRONG_SHARE);
    let otherwise = WRONG_SHARE / (2.0 * weight_n);
    // a rotation that is not known tells nothing
    let of_rotation = match rotation_rad.is_finite() {
        true => LARGEST_RAD * normal_density(rotation_rad, rotation_sigma_rad),
        false => 1.0,
    };
    let probability = as_stated / (as_stated + otherwise * of_rotation);
    // without derivatives the error is unknown
    if probability.is_finite() {
        probability
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_far_below_zero_are_wrong_where_nothing_rotates() {
        let rests = |least_n| {
            is_right(
                (least_n, 300.0),
                (0.1 * DEGREE, STANDING_SIGMA_RAD),
                60_000.0,
            )
        };
        assert!(rests(100.0) > 0.999 && rests(-600.0) > 0.99);
        assert!(rests(-5000.0) < 0.1);
        // a machine that is braked, with both rear wheels in the air for 0.9 s
        let rotates = is_right(
            (-2400.0, 450.0),
            (2.9 * DEGREE, DRIVING_SIGMA_RAD),
            45_000.0,
        );
        assert!(rotates > 0.98, "{rotates}");
        assert_eq!(
            is_right((-5000.0, f64::NAN), (0.0, STANDING_SIGMA_RAD), 60_000.0),
            1.0
        );
    }

    #[test]
    fn rotation_decides_where_the_load_cannot() {
        let rotation = |degrees: f64| (degrees * DEGREE, STANDING_SIGMA_RAD);
        let at =
            |level_n: f64, degrees: f64| probability((level_n, 180.0), rotation(degrees), 4000.0);
        assert!(at(80.0, 4.0) > 0.999);
        assert!(at(80.0, 0.0) < 0.5);
        assert!(at(1500.0, 0.5) < 1e-6);
    }

    #[test]
    fn the_largest_rotation_is_outwards() {
        assert_eq!(largest(&[0.0, -0.3, 0.1, 0.05], 7), (0.1, 9));
        assert_eq!(largest(&[0.0, -0.3], 7), (0.0, 7));
    }
}
