//! Unilateral contact: the active set of wheels on the ground, none of which pulls.

use nalgebra::Vector2;

use super::envelope::{self, Envelope};
use super::equilibrium::Equations;
use super::least_energy::LeastEnergy;
use super::loads::Loads;
use super::response::Response;
use crate::machine::{MAX_WHEELS, Machine, Split};
use crate::number::{Mask, Real};

/// Changes of the active set need a violation larger than this fraction of the weight; smaller ones are
/// rounding errors.
const ROUNDING_SHARE: f64 = 1e-9;

/// Solver for the loads, with its scratch memory: a step does not allocate.
#[derive(Debug)]
pub struct Solver<T: Real> {
    least_energy: LeastEnergy<T>,
    relative_stiffness: [T; MAX_WHEELS],
    /// Whether all wheels have the same stiffness.
    alike: bool,
    /// The wheels on the edge that the machine tips about; all wheels if it does not tip.
    allowed: [T::Mask; MAX_WHEELS],
    on_ground: [T::Mask; MAX_WHEELS],
    loads: [T; MAX_WHEELS],
    value: [T; MAX_WHEELS],
    tipping: T::Mask,
    airborne: T::Mask,
    /// Self-equilibrated loads, where the envelope is a line segment.
    exchange: [T; MAX_WHEELS],
    envelope: Envelope,
    /// Whether to keep the responses of OTF and loads.
    responds: bool,
    otf_response: Response<T>,
    load_response: Response<T>,
    /// Response of the OTF by the split rule alone, where torques are measured.
    rule_response: Response<T>,
    /// Whether a wheel is lifted in any sample, so that the loads differ from the OTF.
    lifted: bool,
}

impl<T: Real> Solver<T> {
    /// `responds`: whether to keep the responses, which derivatives need.
    #[must_use]
    pub fn new(machine: &Machine, responds: bool) -> Self {
        let rows = Equations::<T>::new(machine).value.len();
        let mut relative_stiffness = [T::zero(); MAX_WHEELS];
        for (stiffness, wheel) in relative_stiffness.iter_mut().zip(&machine.wheels) {
            *stiffness = T::constant(wheel.relative_stiffness);
        }
        let nowhere = [T::Mask::splat(false); MAX_WHEELS];
        Self {
            least_energy: LeastEnergy::new(),
            relative_stiffness,
            alike: machine.wheels.iter().all(|w| w.relative_stiffness == 1.0),
            allowed: nowhere,
            on_ground: nowhere,
            loads: [T::zero(); MAX_WHEELS],
            value: [T::zero(); MAX_WHEELS],
            tipping: T::Mask::splat(false),
            airborne: T::Mask::splat(false),
            exchange: [T::zero(); MAX_WHEELS],
            envelope: Envelope::new(machine),
            responds: responds || !machine.contact.actuated_joints.is_empty(),
            otf_response: Response::new(rows),
            load_response: Response::new(rows),
            rule_response: Response::new(rows),
            lifted: false,
        }
    }

    /// Response of the OTF to the right-hand side.
    pub(crate) fn otf_response(&self) -> &Response<T> {
        &self.otf_response
    }

    /// Response of the loads; `None` where all wheels are on the ground and the loads equal the OTF. NaN while
    /// the machine tips.
    pub(crate) fn load_response(&self) -> Option<&Response<T>> {
        self.lifted.then_some(&self.load_response)
    }

    /// The loads to which [`Self::load_response`] belongs. In a sample with all wheels on the ground it is that of the OTF,
    /// whatever other samples are beside it.
    pub(crate) fn loads_of_response(&self, otf: &[T], load: &[T]) -> [T; MAX_WHEELS] {
        let on_ground = self.on_ground[..load.len()].iter();
        let all = on_ground.fold(T::Mask::splat(true), |all, &on| all & on);
        let mut loads = [T::zero(); MAX_WHEELS];
        for (loads, (&otf, &load)) in loads.iter_mut().zip(otf.iter().zip(load)) {
            *loads = T::select(all, otf, load);
        }
        loads
    }

    /// Solves for the OTF alone: the signed loads with all wheels held to the ground.
    #[inline]
    pub fn hold_down(&mut self, machine: &Machine, equations: &Equations<T>, otf: &mut [T]) {
        let pressed = machine.contact.mean_stiffness.is_some() && machine.contact.warp.is_none();
        let exact = equations.measured == equations.value.len();
        if self.alike && exact && !pressed {
            self.least_energy
                .solve_alike(equations, &equations.value, otf);
            return;
        }
        let solve = least_energy_of::<T>(machine);
        solve(
            &mut self.least_energy,
            equations,
            &equations.holds,
            &equations.value,
            &self.relative_stiffness[..equations.wheels],
            otf,
        );
    }

    /// Solves for OTF and loads. `edge_moments` are the overturning moments about the edges of the machine's
    /// polygon (N m), positive where it tips.
    pub(crate) fn solve(
        &mut self,
        machine: &Machine,
        equations: &Equations<T>,
        contacts: &[Vector2<T>],
        edge_moments: &[T],
        out: &mut Loads<'_, T>,
    ) {
        let n = equations.wheels;
        let stiffness = self.relative_stiffness;
        let rows = equations.value.len();
        self.hold_down(machine, equations, out.otf);
        if self.responds {
            self.otf_response
                .read(&mut self.least_energy, equations, rows, &stiffness);
            self.otf_response.follow_supports(equations);
        }
        if matches!(self.envelope, Envelope::Line) {
            envelope::exchange(
                &mut self.least_energy,
                equations,
                &stiffness[..n],
                &mut self.exchange,
            );
        }
        self.value[..equations.value.len()].copy_from_slice(&equations.value);
        self.allowed = [T::Mask::splat(true); MAX_WHEELS];
        self.stand_on_tipping_edge(machine, contacts, edge_moments);
        self.press_down(machine, equations, out.otf);
        if self.responds {
            self.read_load_response(equations);
        }
        let airborne = equations.value[0].lt(T::constant(f64::MIN_POSITIVE));
        for (wheel, load) in out.load.iter_mut().enumerate() {
            *load = T::select(airborne, T::zero(), self.loads[wheel]);
        }
        self.airborne = airborne;
    }

    /// Reads the response of the loads. With a lifted wheel it is that of the loaded wheels, and the split rule
    /// does not apply.
    fn read_load_response(&mut self, equations: &Equations<T>) {
        let n = equations.wheels;
        let (mut all, mut stiffness) = (T::Mask::splat(true), [T::zero(); MAX_WHEELS]);
        for wheel in 0..n {
            let carries = self.on_ground[wheel];
            all = all & carries;
            stiffness[wheel] = T::select(carries, self.relative_stiffness[wheel], T::zero());
        }
        self.lifted = (!all | self.tipping).any();
        if !self.lifted {
            return;
        }
        let rows = if equations.are_measured() {
            equations.value.len()
        } else {
            equations.certain
        };
        self.load_response
            .read(&mut self.least_energy, equations, rows, &stiffness);
        self.load_response.replace_where(all, &self.otf_response);
        self.load_response.follow_supports(equations);
        let unknown = T::constant(f64::NAN);
        for value in self.load_response.loads.iter_mut().flatten() {
            *value = T::select(self.tipping, unknown, *value);
        }
    }

    /// Computes the load envelope for the equations and edge moments solved last.
    pub(crate) fn find_envelope(
        &mut self,
        machine: &Machine,
        equations: &Equations<T>,
        edge_moments: &[T],
        out: &mut Loads<'_, T>,
    ) {
        self.envelope
            .find(&mut self.least_energy, equations, &self.exchange, out);
        if equations.are_measured() {
            self.narrow_envelope(equations, out);
        }
        self.settle_envelope(machine, edge_moments, self.airborne, out);
    }

    /// Narrows the envelope to two standard deviations around the loads, where torques are measured and all wheels are loaded.
    /// Where a wheel is lifted: around the loads that the supports measure themselves.
    fn narrow_envelope(&self, equations: &Equations<T>, out: &mut Loads<'_, T>) {
        let n = equations.wheels;
        let all_carry =
            (self.on_ground[..n].iter()).fold(T::Mask::splat(true), |all, &on| all & on);
        let [variance, _] = self.measured_variances(equations);
        for wheel in 0..n {
            let narrow = all_carry & T::zero().lt(variance[wheel]);
            let band = variance[wheel].sqrt() * T::constant(2.0);
            let (low, high) = (out.otf[wheel] - band, out.otf[wheel] + band);
            out.least[wheel] = T::select(narrow, low.max(out.least[wheel]), out.least[wheel]);
            out.largest[wheel] =
                T::select(narrow, high.min(out.largest[wheel]), out.largest[wheel]);
        }
        for (measured, wheel) in equations.load_of.iter().enumerate() {
            let (Some(wheel), row) = (*wheel, equations.measured + measured) else {
                continue;
            };
            let known = T::zero().lt(equations.holds[row]) & !all_carry;
            let scale = T::constant(2.0 * equations.prior_scale);
            let band = equations.compliance[row].max(T::zero()).sqrt() * scale;
            let (least, largest) = (out.least[wheel], out.largest[wheel]);
            // what equilibrium forbids, no measurement allows
            let low = (equations.value[row] - band).max(least).min(largest);
            let high = (equations.value[row] + band).min(largest).max(low);
            out.least[wheel] = T::select(known, low, least);
            out.largest[wheel] = T::select(known, high, largest);
        }
    }

    /// Variances of the OTF and the loads given the measured torques (N^2); zero without any.
    fn measured_variances(&self, equations: &Equations<T>) -> [[T; MAX_WHEELS]; 2] {
        if !equations.are_measured() {
            return [[T::zero(); MAX_WHEELS]; 2];
        }
        let of = |response: &Response<T>| {
            let left = equations.measured_variance(|wheel| response.slack(equations, wheel, wheel));
            equations.by_supports.or_measured(left)
        };
        let load = self.load_response().unwrap_or(&self.otf_response);
        [of(&self.otf_response), of(load)]
    }

    /// Variances of the OTF and the loads that the split leaves: by measured torques, and by side forces (N^2).
    pub(crate) fn split_variances(&self, equations: &Equations<T>) -> [[T; MAX_WHEELS]; 2] {
        let mut variances = self.measured_variances(equations);
        let load = self.load_response().unwrap_or(&self.otf_response);
        for (variances, response) in variances.iter_mut().zip([&self.otf_response, load]) {
            for (wheel, variance) in variances[..equations.wheels].iter_mut().enumerate() {
                *variance += equations.side_variance(|row| response.loads[row][wheel]);
            }
        }
        variances
    }

    /// Response of the OTF by the split rule alone.
    pub(crate) fn rule_or_otf_response(&self, equations: &Equations<T>) -> &Response<T> {
        if equations.are_measured() {
            &self.rule_response
        } else {
            &self.otf_response
        }
    }

    /// Solves by the split rule without the measured torques: fills `otf` and returns its response.
    pub(crate) fn solve_by_rule(
        &mut self,
        machine: &Machine,
        equations: &Equations<T>,
        otf: &mut [T],
    ) -> &Response<T> {
        let stiffness = self.relative_stiffness;
        let solve = least_energy_of::<T>(machine);
        let n = equations.wheels;
        solve(
            &mut self.least_energy,
            equations,
            &equations.holds,
            &equations.value,
            &stiffness[..n],
            otf,
        );
        self.rule_response.read(
            &mut self.least_energy,
            equations,
            equations.value.len(),
            &stiffness,
        );
        &self.rule_response
    }

    /// Puts everything on the edge with the largest overturning moment, as if the centre of pressure were at the nearest point of
    /// that edge, where it is outside the polygon.
    fn stand_on_tipping_edge(
        &mut self,
        machine: &Machine,
        contacts: &[Vector2<T>],
        edge_moments: &[T],
    ) {
        let largest = edge_moments
            .iter()
            .fold(T::zero(), |largest, &m| m.max(largest));
        self.tipping = T::zero().lt(largest);
        if !self.tipping.any() {
            return;
        }
        let [normal, moment_x, moment_y] = [self.value[0], self.value[1], self.value[2]];
        let pressure = Vector2::new(-moment_y / normal, moment_x / normal);
        let mut settled = !self.tipping;
        for (edge, &moment) in machine.polygon.edges.iter().zip(edge_moments) {
            let about_this = !settled & !moment.lt(largest);
            settled = settled | about_this;
            let along = contacts[edge.to] - contacts[edge.from];
            let share = (pressure - contacts[edge.from]).dot(&along) / along.dot(&along);
            let share = share.max(T::zero()).min(T::one());
            let nearest = contacts[edge.from] + along * share;
            self.value[1] = T::select(about_this, nearest.y * normal, self.value[1]);
            self.value[2] = T::select(about_this, -nearest.x * normal, self.value[2]);
            for (allowed, &on_edge) in self.allowed.iter_mut().zip(&edge.carries) {
                *allowed = *allowed & (!about_this | T::Mask::splat(on_edge));
            }
        }
    }

    /// Active-set iteration: lifts the wheels that pull and lowers those that would be pressed, one at a time,
    /// for a bounded number of rounds.
    fn press_down(&mut self, machine: &Machine, equations: &Equations<T>, otf: &[T]) {
        let n = equations.wheels;
        self.on_ground = self.allowed;
        self.loads[..n].copy_from_slice(otf);
        if self.tipping.any() {
            self.solve_on_ground(machine, equations, otf);
        }
        // A wheel is lowered again only if all split rules are springs; otherwise the iteration could cycle.
        let contact = &machine.contact;
        let springs =
            T::Mask::splat(contact.split == Split::Springs && contact.free_joints.is_empty());
        let threshold = self.value[0].abs() * T::constant(ROUNDING_SHARE);
        for _ in 0..4 * n {
            let lifted = self.lift_most_pulling(n, threshold);
            let lowered = self.lower_most_pressed(equations, threshold, springs & !lifted);
            if !(lifted | lowered).any() {
                break;
            }
            self.solve_on_ground(machine, equations, otf);
        }
        for load in &mut self.loads[..n] {
            *load = T::select(load.lt(T::zero()), T::zero(), *load);
        }
    }

    /// Lifts the wheel that pulls most, sample by sample.
    fn lift_most_pulling(&mut self, n: usize, threshold: T) -> T::Mask {
        let mut least = -threshold;
        for wheel in 0..n {
            least = T::select(self.on_ground[wheel], self.loads[wheel].min(least), least);
        }
        let pulling = least.lt(-threshold);
        for wheel in 0..n {
            let lifts = pulling & self.on_ground[wheel] & !least.lt(self.loads[wheel]);
            self.on_ground[wheel] = self.on_ground[wheel] & !lifts;
        }
        pulling
    }

    /// Lowers the wheel whose spring would be deflected most, sample by sample.
    fn lower_most_pressed(
        &mut self,
        equations: &Equations<T>,
        threshold: T,
        possible: T::Mask,
    ) -> T::Mask {
        let (n, rows) = (equations.wheels, equations.certain);
        let mut most = threshold;
        let mut pressed = [T::zero(); MAX_WHEELS];
        for (wheel, pressed) in pressed[..n].iter_mut().enumerate() {
            let in_air = self.allowed[wheel] & !self.on_ground[wheel];
            *pressed = T::select(
                in_air,
                self.least_energy.indentation(equations, rows, wheel) + equations.offset[wheel],
                T::zero(),
            );
            most = pressed.max(most);
        }
        let comes_down = possible & threshold.lt(most);
        for wheel in 0..n {
            let lowered = comes_down & !pressed[wheel].lt(most);
            self.on_ground[wheel] = self.on_ground[wheel] | lowered;
        }
        comes_down
    }

    /// Solves with the active wheels. With a lifted wheel the split rule by roll moment distribution does not
    /// apply; a joint with a lifted distal wheel is not free: it rests against its stop.
    fn solve_on_ground(&mut self, machine: &Machine, equations: &Equations<T>, otf: &[T]) {
        let n = equations.wheels;
        let mut stiffness = [T::zero(); MAX_WHEELS];
        let mut all = T::Mask::splat(true);
        for wheel in 0..n {
            stiffness[wheel] = T::select(
                self.on_ground[wheel],
                self.relative_stiffness[wheel],
                T::zero(),
            );
            all = all & self.on_ground[wheel];
        }
        let mut holds = [T::one(); MAX_WHEELS];
        let rows = if equations.are_measured() {
            holds[..equations.value.len()].copy_from_slice(&equations.holds);
            holds[equations.certain..equations.measured].fill(T::zero());
            equations.value.len()
        } else {
            equations.certain
        };
        for (joint, holds) in machine.contact.free_joints.iter().zip(&mut holds[3..]) {
            for wheel in (0..n).filter(|&wheel| joint.supports_wheel[wheel]) {
                *holds = T::select(self.on_ground[wheel], *holds, T::zero());
            }
        }
        let mut loads = [T::zero(); MAX_WHEELS];
        let holds = &holds[..rows];
        let solve = least_energy_of::<T>(machine);
        solve(
            &mut self.least_energy,
            equations,
            holds,
            &self.value,
            &stiffness[..n],
            &mut loads[..n],
        );
        for wheel in 0..n {
            self.loads[wheel] = T::select(all, otf[wheel], loads[wheel]);
        }
    }

    /// Sets the envelope where the machine tips or is airborne: about two wheels it has no freedom left, about
    /// more the split along the edge is unknown; in the air no wheel carries load.
    fn settle_envelope(
        &self,
        machine: &Machine,
        edge_moments: &[T],
        airborne: T::Mask,
        out: &mut Loads<'_, T>,
    ) {
        if !self.tipping.any() && !airborne.any() {
            return;
        }
        let unknown = T::constant(f64::NAN);
        let largest = edge_moments
            .iter()
            .fold(T::zero(), |largest, &m| m.max(largest));
        for (wheel, &load) in out.load.iter().enumerate() {
            let mut known = load;
            for (edge, &moment) in machine.polygon.edges.iter().zip(edge_moments) {
                let crowded =
                    edge.carries.iter().filter(|&&c| c).count() > 2 && edge.carries[wheel];
                let open = T::Mask::splat(crowded) & !moment.lt(largest);
                known = T::select(open, unknown, known);
            }
            let certain = self.tipping | airborne;
            out.least[wheel] = T::select(
                certain,
                T::select(airborne, T::zero(), known),
                out.least[wheel],
            );
            out.largest[wheel] = T::select(
                certain,
                T::select(airborne, T::zero(), known),
                out.largest[wheel],
            );
        }
    }
}

/// The solution for a machine: with offsets where its tyres may be deflected by heights.
fn least_energy_of<T: Real>(machine: &Machine) -> LeastEnergySolution<T> {
    let contact = &machine.contact;
    if contact.mean_stiffness.is_some() && contact.warp.is_none() {
        LeastEnergy::solve_pressed
    } else {
        LeastEnergy::solve
    }
}

type LeastEnergySolution<T> = fn(&mut LeastEnergy<T>, &Equations<T>, &[T], &[T], &[T], &mut [T]);
