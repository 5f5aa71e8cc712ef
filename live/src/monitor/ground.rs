//! The machine on the supports that are on the ground.

use tipwatch_mechanics::estimation::support_configuration::{
    GroundGap, GroundSet, doubts_by_measured_loads,
};
use tipwatch_mechanics::machine::SupportId;
use tipwatch_mechanics::state::{Reason, Reasons, State};
use tipwatch_mechanics::verdict::{LiftOff, LiftOffForecast};
use tipwatch_mechanics::{Machine, Outcome, Scope, Workspace, evaluate_one};

use crate::wire::topics::WireVerdict;
use crate::wire::verdict::GroundUnknown;

/// Computes loads on the supports that are on the ground. Nothing allocates but a change to another set of them.
#[derive(Debug)]
pub(super) struct Ground {
    /// The last set on which the machine can stand, and which it is; no set for a machine that is always on the same supports.
    on: Option<OnSet>,
    set: Option<GroundSet>,
    /// The last set on which it cannot.
    impossible: Option<GroundSet>,
    /// Reason for which the supports are unknown now; `None` if they are known.
    unknown: Option<GroundUnknown>,
}

/// The machine on one set of supports.
#[derive(Debug)]
struct OnSet {
    machine: Machine,
    workspace: Workspace<f64>,
    forecast: LiftOffForecast,
}

/// The loads of a row.
#[derive(Debug)]
pub(super) struct Loads<'a> {
    /// `None` where the supports are unknown.
    pub(super) outcome: Option<&'a Outcome<f64>>,
    pub(super) reasons: Reasons,
    /// The next wheel to lift, by its place among those on the ground.
    pub(super) next: Option<LiftOff>,
}

impl OnSet {
    fn new(machine: Machine) -> Self {
        Self {
            workspace: Workspace::with_scope(&machine, Scope::ALL),
            forecast: LiftOffForecast::new(&machine),
            machine,
        }
    }
}

impl Ground {
    /// The ground under a machine; of one whose supports come and go it is unknown until they are told.
    pub(super) fn new(machine: &Machine, message: &mut WireVerdict) -> Self {
        let is_constant = !machine.supports().vary();
        let missing = machine.supports().ids().next().map(GroundGap::Missing);
        let ground = Self {
            on: is_constant.then(|| OnSet::new(machine.clone())),
            set: None,
            impossible: None,
            unknown: missing.filter(|_| !is_constant).map(GroundUnknown::Gap),
        };
        ground.tell(machine, message);
        ground
    }

    /// Follows what is told of the supports: `None` of a machine that is always on the same ones.
    pub(super) fn follow(
        &mut self,
        machine: &Machine,
        stands_on: Option<Result<GroundSet, GroundGap>>,
        message: &mut WireVerdict,
    ) {
        let Some(stands_on) = stands_on else { return };
        let before = (self.set, self.unknown);
        self.unknown = match stands_on {
            Err(gap) => Some(GroundUnknown::Gap(gap)),
            Ok(set) if self.set == Some(set) => None,
            Ok(set) if self.impossible == Some(set) => Some(GroundUnknown::Impossible),
            Ok(set) => self.step_on(machine, set).err(),
        };
        if before != (self.set, self.unknown) {
            self.tell(machine, message);
        }
    }

    /// Puts the machine on another set of its supports. Without reference loads its utilisation there is unknown.
    fn step_on(&mut self, machine: &Machine, set: GroundSet) -> Result<(), GroundUnknown> {
        let Ok(mut on) = machine.standing_on(&set.list(machine.supports())) else {
            self.impossible = Some(set);
            return Err(GroundUnknown::Impossible);
        };
        let _ = on.set_reference_loads();
        self.on = Some(OnSet::new(on));
        self.set = Some(set);
        Ok(())
    }

    fn tell(&self, machine: &Machine, message: &mut WireVerdict) {
        let wheels = match machine.supports().vary() {
            true => machine.supports().all.len(),
            false => machine.wheels().len(),
        };
        let on = match (self.unknown, &self.on) {
            (None, Some(on)) => Ok(&on.machine),
            (why, _) => Err(why.unwrap_or(GroundUnknown::Impossible)),
        };
        message.set_ground(wheels, on);
    }

    /// The supports on the ground, where they are known.
    pub(super) fn stands_on(&self) -> Option<&[SupportId]> {
        let on = self.on.as_ref().filter(|_| self.unknown.is_none())?;
        Some(on.machine.stands_on())
    }

    /// The loads of a row on the supports that are on the ground.
    pub(super) fn row(&mut self, time_ns: i64, state: &State<f64>, so_far: Reasons) -> Loads<'_> {
        let (None, Some(on)) = (self.unknown, &mut self.on) else {
            let mut reasons = so_far;
            reasons.add(Reason::SupportsUnknown);
            return Loads {
                outcome: None,
                reasons,
                next: None,
            };
        };
        let outcome = evaluate_one(&on.machine, state, &mut on.workspace);
        let mut reasons = so_far.with_outcome(outcome);
        if on.machine.supports().vary() {
            reasons.add_all(doubts_by_measured_loads(
                &on.machine,
                state,
                |joint| outcome.torque_residual.get(joint).copied(),
                |wheel| outcome.uncertainty.load.get(wheel).copied(),
            ));
        }
        let mut next = None;
        if reasons.leave_loads() {
            next = on.forecast.row(&on.machine, time_ns, &outcome.otf);
        }
        Loads {
            outcome: Some(outcome),
            reasons,
            next,
        }
    }
}
