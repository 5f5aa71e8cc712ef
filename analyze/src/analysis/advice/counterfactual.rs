//! Would it have happened on level ground, at half the speed, without the load, with the arm in, or otherwise? The rows of
//! each event are evaluated again. This is the only place that answers it.

use std::sync::Arc;

use rayon::prelude::*;
use tipwatch_language::word;
use tipwatch_mechanics::machine::{Machine, Parameter, Split};
use tipwatch_mechanics::number::normal_distribution;
use tipwatch_mechanics::{
    BatchEvaluator, ForcesByRule, Placement, Scope, State, StateColumns, Workspace,
    combination_sigma, evaluate,
};

use super::super::standing_rows::StandingRows;
use super::candidates::base_rests;
use super::ground_slope::GroundSlope;
use super::hypothesis::{Hypothesis, Supposed, attached_kg};
use super::simulate::{least_sum, otf};
use super::window::Window;
use crate::base::number::known;
use crate::base::table::Table;
use crate::events::{
    Answer, Counterfactual, Event, EventKind, Reply, ShownBy, Supposition, factors_off,
};

/// The rows before an event that belong to the same manoeuvre (ns).
const BEFORE_NS: i64 = 1_000_000_000;
/// Most rows of an event that are evaluated: of a longer one, rows evenly spaced.
const MOST_ROWS: usize = 4000;
/// Most events with counterfactuals, the gravest first.
const MOST_EVENTS: usize = 24;
/// Postures around an event of which the steadiest is taken.
const POSTURES: usize = 64;
/// A posture must be steadier than those of the event by this much (m).
const STEADIER: f64 = 0.01;
/// Most rows in which derivatives are looked for before a row without any.
const MOST_ROWS_BACK: usize = 500;
/// Forces on the tool up to this are none (N).
const SMALLEST_FORCE: f64 = 1.0;
/// Change of the front axle's share of the roll moment by which its effect on the loads is computed.
const SHARE_STEP: f64 = 0.1;

/// Answers for every lift and tipping which suppositions would have prevented it, unless the machine fell already when the rows begin:
/// they do not show the machine before.
pub(crate) fn ask_all(
    machine: &Machine,
    standing: &[StandingRows<'_>],
    rows: &Table,
    events: &mut [Event],
) {
    let mut asked: Vec<usize> = (0..events.len())
        .filter(|&k| events[k].kind.is_lift() && !events[k].is_of_fall_under_way(events))
        .collect();
    asked.sort_by(|&a, &b| {
        let is_lift = |k: usize| events[k].kind == EventKind::WheelLift;
        let severity = |k: usize| events[k].severity();
        let graver = severity(b).total_cmp(&severity(a));
        is_lift(a).cmp(&is_lift(b)).then(graver)
    });
    asked.truncate(MOST_EVENTS);
    let (mut first, mut repeated) = (Vec::new(), Vec::new());
    for place in asked {
        let event = asked_as(events, &events[place]);
        let same = (first.iter().copied()).find(|&other| is_same(&events[other], event));
        match same {
            Some(other) => repeated.push((place, other)),
            None => first.push(place),
        }
    }
    if first.is_empty() {
        return;
    }
    let slope = GroundSlope::of(machine, rows);
    let answers = first.par_iter().map(|&place| {
        Question::about(standing, rows, &events[place], |question| {
            (question.answers(slope.as_ref()), question.split_flips_at())
        })
    });
    let answers: Vec<Option<(Vec<Counterfactual>, Option<f64>)>> = answers.collect();
    for (place, answers) in first.into_iter().zip(answers) {
        let event = &mut events[place];
        (event.counterfactuals, event.split_flips_at) = answers.unwrap_or_default();
    }
    for (place, other) in repeated {
        events[place].counterfactuals = events[other].counterfactuals.clone();
    }
}

/// The event that is asked about in place of another one: a tip-over is the tipping that it began as, and a wheel that leaves
/// the ground with it leaves it by the rotation about the edge, which the load of that wheel alone does not show.
pub(crate) fn asked_as<'a>(events: &'a [Event], event: &'a Event) -> &'a Event {
    let began = |it: &&Event| it.kind == EventKind::EdgeTipping && it.start_ns == event.start_ns;
    let tippings = events.iter().filter(began);
    // of several edges that it may have begun about, its own
    let own_first = |it: &&Event| it.subject != event.subject;
    tippings.min_by_key(own_first).unwrap_or(event)
}

/// Whether two events with counterfactuals began as one.
fn is_same(one: &Event, other: &Event) -> bool {
    (one.kind != EventKind::WheelLift) == (other.kind != EventKind::WheelLift)
        && one.subject == other.subject
        && one.start_ns == other.start_ns
}

/// One event, and the rows that it is asked about: whoever asks whether it would have happened otherwise is answered by these
/// rows, these wheels and this limit.
pub(crate) struct Question<'a> {
    rows: &'a Table,
    event: &'a Event,
    window: Window,
    /// Weight of the OTF of each wheel in the sum that reaches zero.
    factors: Vec<f64>,
    recorded: Option<Chance>,
    /// Whether the base neither drives nor rocks, so that a speed is that of the arm alone.
    base_rests: bool,
}

/// Margin of the wheels of an event before they lift.
struct Chance {
    /// The smallest weighted sum of their OTF (N).
    otf_n: f64,
    /// Its standard deviation (N).
    sigma_n: Option<f64>,
    /// Probability that the wheels lift.
    probability: Option<f64>,
}

impl<'a> Question<'a> {
    /// Asks about an event of a log; `None` where the supports of the machine are not known, or no row can be evaluated.
    pub(crate) fn about<R>(
        standing: &[StandingRows<'_>],
        rows: &Table,
        event: &Event,
        ask: impl FnOnce(&Question<'_>) -> R,
    ) -> Option<R> {
        let onset = rows.at(event.start_ns);
        let on = standing.get(StandingRows::place_of(onset, rows)?)?;
        Some(ask(&Question::of(on.machine, on.rows(), event)?))
    }

    fn of(machine: &Machine, rows: &'a Table, event: &'a Event) -> Option<Self> {
        let last_ns = *rows.times_ns.last()?;
        let span_ns = [event.start_ns, event.end_ns.unwrap_or(last_ns)];
        let first = rows.at(span_ns[0].saturating_sub(BEFORE_NS));
        let last = rows.at(span_ns[1]).max(first);
        let mut window = Window::of(machine, rows, first..last + 1, span_ns);
        if window.rows.is_empty() {
            return None;
        }
        if window.rows.len() > MOST_ROWS {
            let step = window.rows.len().div_ceil(MOST_ROWS);
            let picked: Vec<usize> = (0..window.rows.len()).step_by(step).collect();
            window = window.pick(&picked);
        }
        let factors = factors(&window, event)?;
        let mut question = Self {
            rows,
            event,
            base_rests: base_rests(&window),
            window,
            factors,
            recorded: None,
        };
        question.recorded = question.chance(&question.window);
        Some(question)
    }

    /// The machine on the supports of the event, with its sensor at the base frame.
    pub(crate) fn machine(&self) -> &Machine {
        self.window.machine()
    }

    pub(crate) fn base_rests(&self) -> bool {
        self.base_rests
    }

    /// Returns the hypothesis that the parts which moved in the event move `times` as fast.
    pub(crate) fn speed(&self, times: f64) -> Hypothesis {
        Hypothesis::speed(times, self.base_rests)
    }

    /// Simulates the event on a machine under hypotheses, and answers how near its wheels come to lifting, whatever was recorded
    /// of the event.
    pub(crate) fn simulate(&self, machine: &Machine, hypotheses: &[Hypothesis]) -> Reply {
        let window = self
            .window
            .supposing(machine, hypotheses, &self.rows.times_ns);
        let Some(chance) = self.chance(&window) else {
            let needs = |is: fn(&Hypothesis) -> bool| hypotheses.iter().any(is);
            return self.open(if needs(|it| matches!(it, Hypothesis::Slope(..))) {
                word!("the attitude of the platform is not known")
            } else if needs(|it| matches!(it, Hypothesis::Speed(_))) {
                word!("the speed of the platform is not known")
            } else {
                word!("the loads cannot be computed")
            });
        };
        let is_known = chance.probability.is_some();
        Reply {
            otf_n: Some(chance.otf_n),
            sigma_n: chance.sigma_n,
            probability: chance.probability,
            answer: Answer::of(chance.probability),
            why_not: (!is_known)
                .then_some(word!("the uncertainty of the loads cannot be computed")),
            ..self.unanswered()
        }
    }

    /// Whether the stated machine does as recorded what happened. Of what it does not do it tells nothing otherwise either: a load
    /// that nobody stated would have tipped it at half the speed, too.
    pub(crate) fn is_shown(&self) -> bool {
        let recorded = self.recorded.as_ref().and_then(|it| it.probability);
        Answer::of(recorded) != Answer::No && self.event.shown_by != Some(ShownBy::Rotation)
    }

    /// Answers whether the event would have happened to a machine under hypotheses.
    pub(crate) fn reply(&self, machine: &Machine, hypotheses: &[Hypothesis]) -> Reply {
        let found = self.simulate(machine, hypotheses);
        if self.is_shown() || found.otf_n.is_none() {
            return found;
        }
        Reply {
            otf_n: found.otf_n,
            ..self.open(word!(
                "evaluated as recorded, the machine as stated does not show it either"
            ))
        }
    }

    fn open(&self, why_not: &'static str) -> Reply {
        Reply {
            why_not: Some(why_not),
            ..self.unanswered()
        }
    }

    /// Returns the reply with the recorded margin and the time span, before anything is supposed.
    fn unanswered(&self) -> Reply {
        let recorded = self.recorded.as_ref();
        let time_ns =
            |row: Option<&usize>| row.map_or(self.event.start_ns, |&row| self.rows.times_ns[row]);
        Reply {
            recorded_otf_n: recorded.and_then(|it| known(it.otf_n)),
            recorded_sigma_n: recorded.and_then(|it| it.sigma_n),
            recorded_probability: recorded.and_then(|it| it.probability),
            from_ns: time_ns(self.window.rows.first()),
            to_ns: time_ns(self.window.rows.last()),
            ..Reply::default()
        }
    }

    fn answers(&self, slope: Option<&Arc<GroundSlope>>) -> Vec<Counterfactual> {
        let all = Supposition::ALL.iter();
        all.filter_map(|&supposed| self.answer(supposed, slope))
            .collect()
    }

    /// Answers one supposition; `None` where the recorded state is the supposed one.
    fn answer(
        &self,
        supposed: Supposition,
        slope: Option<&Arc<GroundSlope>>,
    ) -> Option<Counterfactual> {
        let mut posture_ns = None;
        let hypothesis = match supposed {
            Supposition::LevelGround => {
                slope.map(|slope| Hypothesis::Slope(Arc::clone(slope), 0.0))
            }
            Supposition::HalfSpeed => Some(self.speed(0.5)),
            Supposition::WithoutLoad if self.carries() => Some(Hypothesis::WithoutLoad),
            Supposition::WithoutLoad => return None,
            Supposition::ArmIn => {
                let (positions, at_ns) = self.steadiest()?;
                posture_ns = at_ns;
                Some(Hypothesis::ArmAt(positions))
            }
        };
        let reply = match hypothesis {
            Some(hypothesis) => self.reply(self.machine(), &[hypothesis]),
            None => self.open(word!(
                "the slope of the ground is not known: the log has no attitude, or the machine was never calm"
            )),
        };
        Some(Counterfactual {
            supposed,
            posture_ns,
            base_rests: self.base_rests,
            reply,
        })
    }

    /// Computes the margin of the wheels of the event in a window, and the probability that they lift.
    fn chance(&self, window: &Window) -> Option<Chance> {
        let (otf_n, place) = least_sum(window, &self.factors)?;
        // a machine that would have tipped from the first row on has no derivatives: as recorded it had
        let sigma_n = sigma(window, place, &self.factors)
            .or_else(|| sigma(&self.window, place, &self.factors));
        Some(Chance {
            otf_n,
            sigma_n,
            probability: sigma_n.map(|sigma_n| normal_distribution(-otf_n / sigma_n)),
        })
    }

    /// The front axle's share of the roll moment, nearest to the stated one, at which the wheel would just have stayed on the
    /// ground in every row. OTF are linear in the share:
    ///
    /// ```text
    ///     OTF(share) = OTF + (share - stated) dOTF/dshare >= 0
    /// ```
    /// `None` where no share from 0 to 1 does that, or another rule or measured forces determine the split.
    fn split_flips_at(&self) -> Option<f64> {
        let machine = self.window.machine();
        let Split::RollMomentDistribution { share: stated, .. } = machine.contact().split else {
            return None;
        };
        let is_open = self.event.split_dependent == Some(true) && !self.window.may_measure_split();
        if self.event.kind != EventKind::WheelLift || !is_open {
            return None;
        }
        let is_own = |factor: &f64| *factor > 0.0;
        let wheel = self.factors.iter().position(is_own)?;
        let changed = machine.changed(&[(Parameter::RollMomentDistribution, SHARE_STEP)]);
        let of_wheel = |evaluator: &BatchEvaluator| otf(&self.window, evaluator).swap_remove(wheel);
        let (by_stated, by_other) = (
            of_wheel(&self.window.evaluator),
            of_wheel(&Window::evaluator(&changed)),
        );
        let (mut least, mut most) = (0.0_f64, 1.0_f64);
        for (otf, other) in by_stated.into_iter().zip(by_other) {
            let slope = (other - otf) / SHARE_STEP;
            let zero = stated - otf / slope;
            match slope {
                _ if !otf.is_finite() || !slope.is_finite() => {}
                slope if slope > 0.0 => least = least.max(zero),
                slope if slope < 0.0 => most = most.min(zero),
                _ if otf < 0.0 => return None,
                _ => {}
            }
        }
        let is_outside = stated < least || most < stated;
        (least <= most && is_outside).then(|| stated.clamp(least, most))
    }

    /// Returns the largest mass of the payloads that are attached in the rows of the event (kg).
    pub(crate) fn payload_kg(&self) -> f64 {
        let mut largest_kg: f64 = 0.0;
        self.window.for_each_state(|state| {
            largest_kg = largest_kg.max(attached_kg(self.machine(), state));
        });
        largest_kg
    }

    fn carries(&self) -> bool {
        let mut carries = self.payload_kg() > 0.0;
        self.window.for_each_state(|state| {
            carries |= state.tool_wrench.force.norm() > SMALLEST_FORCE;
        });
        carries
    }

    /// The steadiest posture of the machine around the event, or the stated reference posture, with the time at which
    /// the machine had it; `None` if no posture is steadier than that of the event.
    fn steadiest(&self) -> Option<(Vec<f64>, Option<i64>)> {
        let machine = self.window.machine();
        let mut supposed = Supposed::new(machine);
        let at_onset = self.rows.at(self.event.start_ns);
        let onset = self.window.rows.iter().position(|&row| row >= at_onset);
        let mut state = State::zero(machine);
        (self.window.states).get(onset.unwrap_or(0), &mut state);
        let in_event = supposed.steadiness(&state);
        let mut best: Option<(f64, Vec<f64>, Option<i64>)> = None;
        let reference = &machine.reference().posture;
        if reference.is_stated {
            let mut standing = state.clone();
            supposed.apply(
                &Hypothesis::ArmAt(reference.positions.clone()),
                self.event.start_ns,
                &mut standing,
            );
            let steadiness = supposed.steadiness(&standing);
            best = Some((steadiness, reference.positions.clone(), None));
        }
        let mut take = |time_ns: i64, of_row: &State<f64>| {
            let positions: Vec<f64> = of_row.joints.iter().map(|joint| joint.position).collect();
            let mut standing = state.clone();
            supposed.apply(
                &Hypothesis::ArmAt(positions.clone()),
                time_ns,
                &mut standing,
            );
            let steadiness = supposed.steadiness(&standing);
            if !(best.as_ref()).is_some_and(|best| best.0 >= steadiness) && steadiness.is_finite() {
                best = Some((steadiness, positions, Some(time_ns)));
            }
        };
        let mut of_row = State::zero(machine);
        // the causes compare with this one
        if let Some(causes) = &self.event.causes {
            self.rows.state(self.rows.at(causes.since_ns), &mut of_row);
            take(causes.since_ns, &of_row);
        }
        let step = self.window.rows.len().div_ceil(POSTURES).max(1);
        for place in (0..self.window.rows.len()).step_by(step) {
            self.window.states.get(place, &mut of_row);
            take(self.rows.times_ns[self.window.rows[place]], &of_row);
        }
        let (steadiness, positions, time_ns) = best?;
        (steadiness > in_event + STEADIER).then_some((positions, time_ns))
    }
}

impl Window {
    /// Returns the same rows of a machine under hypotheses; `times_ns` are those of the log's rows (ns).
    fn supposing(&self, machine: &Machine, hypotheses: &[Hypothesis], times_ns: &[i64]) -> Self {
        let mut supposed = Supposed::new(machine);
        let mut states = StateColumns::unknown(machine, self.rows.len());
        let mut state = State::zero(machine);
        let mut forces = ForcesByRule::new(machine);
        for place in 0..self.rows.len() {
            self.states.get(place, &mut state);
            forces.change([self.machine(), machine], &mut state, |state| {
                for hypothesis in hypotheses {
                    supposed.apply(hypothesis, times_ns[self.rows[place]], state);
                }
            });
            states.set(place, &mut state);
        }
        Self {
            evaluator: Arc::new(Self::evaluator(machine)),
            states,
            rows: self.rows.clone(),
            held: self.held.clone(),
            ..*self
        }
    }
}

/// Returns the weight of the OTF of each wheel in the sum that reaches zero when an event begins: for a wheel that wheel alone,
/// for an edge the distance of each wheel from the edge, over the largest.
fn factors(window: &Window, event: &Event) -> Option<Vec<f64>> {
    let machine = window.machine();
    if event.kind == EventKind::WheelLift {
        let own = machine.wheel_named(&event.subject)?;
        let wheels = 0..machine.wheels().len();
        return Some(wheels.map(|wheel| f64::from(wheel == own)).collect());
    }
    let edge = machine.edge_named(&event.subject)?;
    let mut placement = Placement::new(machine);
    let mut state = State::zero(machine);
    window.states.get(0, &mut state);
    placement.place(&state);
    factors_off(machine, &placement, edge).map(|(factors, _)| factors)
}

/// Standard deviation of the weighted sum in a row of a window (N).
fn sigma(window: &Window, place: usize, factors: &[f64]) -> Option<f64> {
    let machine = window.machine();
    sigma_by(machine, place, factors, |place, state| {
        window.states.get(place, state);
    })
}

/// Standard deviation of the weighted sum in a row (N), of a machine in the states that `read` reads. There are no derivatives
/// while a machine tips: it is then that of the last row before.
pub(super) fn sigma_by(
    machine: &Machine,
    place: usize,
    factors: &[f64],
    mut read: impl FnMut(usize, &mut State<f64>),
) -> Option<f64> {
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS_AND_DERIVATIVES);
    let mut state = State::zero(machine);
    let mut places = (0..=place).rev().take(MOST_ROWS_BACK);
    places.find_map(|place| {
        read(place, &mut state);
        evaluate(machine, &state, &mut workspace);
        let sigma_n = combination_sigma(machine, &state, &workspace, factors);
        (sigma_n > 0.0 && sigma_n.is_finite()).then_some(sigma_n)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_over_is_the_tipping_about_its_own_edge() {
        let event = |kind, subject: &str| Event::blank(kind, 7, subject.into());
        let events = [
            event(EventKind::EdgeTipping, "front"),
            event(EventKind::EdgeTipping, "left"),
            event(EventKind::TipOver, "left"),
            event(EventKind::WheelLift, "fr"),
        ];
        let asked = |place: usize| asked_as(&events, &events[place]).subject.as_str();
        assert_eq!([1, 2, 3].map(asked), ["left", "left", "front"]);
    }
}
