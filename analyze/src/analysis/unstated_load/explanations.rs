//! The explanations that are tried, and how each is fitted.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::machine::{LinkGroup, Machine, Proof, Proofs, Unknown};
use tipwatch_mechanics::{Axis, Parameter};

use super::amounts::{Amounts, Scene, Unstated};
use super::equations::{Equations, ModelError, Part};
use super::nuisances::Nuisances;
use super::regression::{Posterior, mixed, regress};

/// Prior standard deviations: a load as a share of the machine's mass, a force of its weight; where a load is (m), an
/// angle of an encoder that slipped (rad), a sliding joint (m).
const LOAD_SHARE: f64 = 0.1;
const FORCE_SHARE: f64 = 0.05;
const LOAD_PLACE_M: f64 = 0.3;
const ENCODER_RAD: f64 = 0.2;
const ENCODER_M: f64 = 0.2;
/// Prior standard deviation of a fitted parameter of the machine, in standard deviations stated for it: the machine file may be
/// wrong by more than it states.
const WRONG_SIGMAS: f64 = 3.0;
/// Stiffness of the tyres where the machine file states none: a share of the usual one.
const UNKNOWN_STIFFNESS: f64 = 0.5;
/// An encoder whose position changes by less than this (rad or m) has stopped, if it did for so long (s).
const STOPPED: f64 = 1e-6;
const STOPPED_S: f64 = 0.5;
/// Prior standard deviations beyond which a fitted amount explains nothing, however well it fits: the true error is not among the
/// explanations.
const MOST_SIGMAS: f64 = 5.0;
/// Most rounds in which the derivatives are taken anew at the fitted amounts, and most steps of one that are tried, each half as long.
const ROUNDS: usize = 8;
const STEPS: usize = 5;
/// Logarithmic evidence that a step may lose: the other uncertain amounts change with it, too.
const LOST: f64 = 0.1;
/// Amounts are found if those of the next round are so near to them; those of a round that are farther away than `FAR` are not told. Squared
/// (standard deviations).
const FOUND: f64 = 1e-4;
const FAR: f64 = 1.0;
/// Share of the prior standard deviation by which derivatives are taken.
const STEP: f64 = 0.05;

/// An explanation to try.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) kind: &'static str,
    pub(super) subject: Option<String>,
    /// Amounts that the explanation fits.
    pub(super) fitted: Vec<Wanted>,
    /// Amounts that the explanation fixes, with their values.
    pub(super) fixed: Vec<(Unstated, f64)>,
    /// Further amounts that the explanation leaves uncertain, with their standard deviations.
    pub(super) uncertain: Vec<(Unstated, f64)>,
}

/// An amount that an explanation fits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub(super) of: Unstated,
    /// Prior standard deviation, in `unit`.
    pub(super) sigma: f64,
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
}

/// A fitted explanation.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) posterior: Posterior,
    /// The last linear equations: residuals, derivatives, covariance of everything else but the model's errors.
    pub(super) y: DVector<f64>,
    pub(super) derivatives: DMatrix<f64>,
    pub(super) uncertain: DMatrix<f64>,
    /// The errors of the model that are most probable.
    pub(super) error: ModelError,
}

impl Trial {
    fn new(kind: &'static str, subject: Option<String>) -> Self {
        Self {
            kind,
            subject,
            fitted: Vec::new(),
            fixed: Vec::new(),
            uncertain: Vec::new(),
        }
    }

    fn fitting(mut self, name: &'static str, unit: &'static str, of: Unstated, sigma: f64) -> Self {
        self.fitted.push(Wanted {
            of,
            sigma,
            name,
            unit,
        });
        self
    }

    /// A parameter that the machine file states wrongly.
    fn fitting_stated(
        self,
        machine: &Machine,
        name: &'static str,
        unit: &'static str,
        of: Parameter,
    ) -> Self {
        let sigma = WRONG_SIGMAS * Unknown::Parameter(of).stated_sigma(machine);
        self.fitting(name, unit, Unstated::Parameter(of), sigma)
    }

    /// Fits one such parameter along each axis.
    fn fitting_axes(
        self,
        machine: &Machine,
        unit: &'static str,
        of: impl Fn(Axis) -> Parameter,
    ) -> Self {
        Axis::ALL.into_iter().fold(self, |trial, axis| {
            trial.fitting_stated(machine, axis.name(), unit, of(axis))
        })
    }

    /// A mass on the tool.
    pub(super) fn load(machine: &Machine) -> Self {
        let sigma = LOAD_SHARE * machine.mass();
        let trial = Self::new("load_on_tool", None);
        let mut trial = trial.fitting("mass", "kg", Unstated::LoadMass, sigma);
        trial.uncertain = Axis::ALL
            .map(|axis| (Unstated::LoadPlace(axis), LOAD_PLACE_M))
            .into();
        trial
    }

    /// Fits the explanation; `None` if it cannot be fitted.
    ///
    /// The equations are linear about the amounts that the round before has found. Where they are not linear in between, a whole step
    /// may end at amounts of less evidence: it is halved then. What counts in the end is the evidence of amounts that the equations
    /// were computed with, not of such that are only reached by going on straight.
    pub(super) fn fit(&self, scene: &Scene<'_>, of: &Problem<'_>) -> Option<Fitted> {
        let errors = self.errors(of.equations);
        let mut amounts = vec![0.0; self.fitted.len()];
        let (mut best, mut apart) = self.about(scene, of, &errors, &amounts)?;
        for _ in 1..ROUNDS {
            if apart < FOUND {
                return Some(best);
            }
            let way: Vec<f64> = (best.posterior.mean.iter().zip(&amounts))
                .map(|(mean, amount)| mean - amount)
                .collect();
            let steps = std::iter::successors(Some(1.0), |step| Some(0.5 * step));
            let nearer = steps.take(STEPS).find_map(|step| {
                let there = amounts
                    .iter()
                    .zip(&way)
                    .map(|(amount, way)| amount + step * way);
                let there: Vec<f64> = there.collect();
                let (found, apart) = self.about(scene, of, &errors, &there)?;
                let gained = found.posterior.log_evidence - best.posterior.log_evidence;
                (gained > -LOST).then_some((there, found, apart))
            });
            let Some(nearer) = nearer else {
                break;
            };
            (amounts, best, apart) = nearer;
        }
        if apart > FAR {
            best.posterior.mean = DVector::from_vec(amounts);
        }
        Some(best)
    }

    /// Returns the errors of the model that the explanation may have, and their covariance.
    fn errors(&self, equations: &Equations) -> Vec<(ModelError, DMatrix<f64>)> {
        match self.kind {
            // how large they are, and how fast they change, is as unknown
            "none_of_these" => {
                let stated = equations.covariance(ModelError::STATED);
                let unexplained = equations.unexplained();
                let with_more = |more| (ModelError::STATED, &stated + more);
                unexplained.map(with_more).collect()
            }
            _ => ModelError::all()
                .map(|error| (error, equations.covariance(error)))
                .collect(),
        }
    }

    /// The fit by equations that are linear about some amounts, with the evidence of these, and how far the most probable ones are
    /// from them, squared (standard deviations).
    fn about(
        &self,
        scene: &Scene<'_>,
        of: &Problem<'_>,
        errors: &[(ModelError, DMatrix<f64>)],
        amounts: &[f64],
    ) -> Option<(Fitted, f64)> {
        let sigmas: Vec<f64> = self.fitted.iter().map(|wanted| wanted.sigma).collect();
        let linear = self.linear(scene, of, amounts);
        let posteriors = errors.iter().map(|(_, errors)| {
            let errors = errors + &linear.uncertain;
            regress(&linear.y, &linear.derivatives, &sigmas, &errors)
        });
        let posteriors: Vec<Posterior> = posteriors.collect::<Option<_>>()?;
        let best = (posteriors.iter().enumerate())
            .max_by(|a, b| a.1.log_evidence.total_cmp(&b.1.log_evidence));
        let error = best.map_or(ModelError::STATED, |(place, _)| errors[place].0);
        let mut posterior = mixed(&posteriors)?;
        let apart = posterior.apart(&DVector::from_column_slice(amounts))?;
        posterior.log_evidence -= 0.5 * apart;
        let fitted = Fitted {
            posterior,
            error,
            ..linear
        };
        Some((fitted, apart))
    }

    /// The equations, linear about some amounts.
    fn linear(&self, scene: &Scene<'_>, of: &Problem<'_>, amounts: &[f64]) -> Fitted {
        let Problem {
            equations,
            nuisances,
        } = of;
        let mut here = self.fixed.clone();
        let fitted = self.fitted.iter().zip(amounts);
        here.extend(fitted.map(|(wanted, amount)| (wanted.of, *amount)));
        let computed = |more: &Amounts| {
            let all = [&here[..], more].concat();
            scene.computed(&equations.rows, &all)
        };
        let now = computed(&[]);
        let missed = equations.residuals(&now);
        let mut y = &missed - &nuisances.mean;
        let mut derivatives = DMatrix::zeros(y.len(), self.fitted.len());
        for (place, wanted) in self.fitted.iter().enumerate() {
            let step = STEP * wanted.sigma;
            let changed = equations.residuals(&computed(&[(wanted.of, step)]));
            let derivative = (&missed - changed) / step;
            y += &derivative * amounts[place];
            derivatives.set_column(place, &derivative);
        }
        let mut uncertain = nuisances.covariance.clone();
        for &(unstated, sigma) in &self.uncertain {
            let column = &missed - equations.residuals(&computed(&[(unstated, sigma)]));
            uncertain += &column * column.transpose();
        }
        let stiffness = match &scene.lean {
            Some(lean) if lean.stiffness_is_stated() => {
                scene.machine.uncertainty().tyre_stiffness_share
            }
            _ => UNKNOWN_STIFFNESS,
        };
        let first = equations.all.iter().find(|of| of.part == Part::Lean);
        let leaned = equations
            .all
            .iter()
            .map(|equation| match (equation.part, first) {
                (Part::Lean, Some(first)) => {
                    let axis = equation.axis;
                    let since = now[equation.row].lean_rad[axis] - now[first.row].lean_rad[axis];
                    stiffness * since
                }
                _ => 0.0,
            });
        let leaned = DVector::from_iterator(y.len(), leaned);
        uncertain += &leaned * leaned.transpose();
        Fitted {
            posterior: Posterior {
                log_evidence: f64::NAN,
                mean: DVector::zeros(0),
                covariance: DMatrix::zeros(0, 0),
            },
            y,
            derivatives,
            uncertain,
            error: ModelError::STATED,
        }
    }
}

impl Fitted {
    /// Whether the fitted amounts are possible: no mass on the machine is negative, and no amount is beyond belief. `scene` tells
    /// what a load could lack.
    pub(super) fn is_possible(&self, trial: &Trial, scene: &Scene<'_>) -> bool {
        let links = scene.machine.links();
        let mass_of = |link: usize| links[link].inertia.mass;
        let mut pairs = trial.fitted.iter().zip(self.posterior.mean.iter());
        pairs.all(|(wanted, &amount)| {
            let is_credible = amount.abs() <= MOST_SIGMAS * wanted.sigma;
            match wanted.of {
                Unstated::LoadMass => {
                    let on_tool = scene.load.map_or(0.0, |load| mass_of(load.link));
                    let payloads = scene.machine.payloads().iter();
                    // the mass that is known by row alone may be any
                    let carried = payloads.map(|of| match of.is_by_row {
                        true => f64::INFINITY,
                        false => of.inertia.mass,
                    });
                    amount >= -(on_tool + carried.sum::<f64>())
                }
                // how much a machine is overloaded by nobody knows beforehand; a force inwards holds it
                Unstated::OutwardForce => amount >= 0.0,
                Unstated::Parameter(Parameter::LinkMass(link)) => {
                    is_credible && amount >= -mass_of(link)
                }
                _ => is_credible,
            }
        })
    }
}

/// Inputs that all explanations share: the equations of the fall, and the uncertain parameters.
pub(super) struct Problem<'a> {
    pub(super) equations: &'a Equations,
    pub(super) nuisances: &'a Nuisances,
}

/// All explanations that can be tried: no other sign of a signal that is proven.
pub(super) fn trials(
    scene: &Scene<'_>,
    equations: &Equations,
    onset_ns: i64,
    proven: Proofs,
) -> Vec<Trial> {
    let machine = scene.machine;
    let mut all = vec![Trial::new("stated_machine", None)];
    if scene.load.is_some() {
        all.push(Trial::load(machine));
        if machine.tool().is_none() {
            let sigma = FORCE_SHARE * machine.mass() * machine.gravity();
            let trial = Trial::new("force_on_tool", None);
            all.push(trial.fitting("outwards", "N", Unstated::OutwardForce, sigma));
        }
    }
    if let Some(link) = heaviest(machine, LinkGroup::Chassis) {
        let name = Some(machine.links()[link].name.clone());
        let of = |axis| Parameter::LinkCom(link, axis);
        let centre = Trial::new("centre_of_mass", name.clone());
        all.push(centre.fitting_axes(machine, "m", of));
        let mass = Parameter::LinkMass(link);
        all.push(Trial::new("mass", name).fitting_stated(machine, "mass", "kg", mass));
    }
    let turned = Trial::new("imu_rotation", None);
    all.push(turned.fitting_axes(machine, "rad", Parameter::ImuRotation));
    for (joint, of) in machine.joints().iter().enumerate() {
        if of.spins_wheel.is_some() || !of.logged {
            continue;
        }
        let name = || Some(of.name.clone());
        let (sigma, unit) = match machine.joint_slides(joint) {
            true => (ENCODER_M, "m"),
            false => (ENCODER_RAD, "rad"),
        };
        let position = Unstated::Parameter(Parameter::JointPosition(joint));
        let offset = Trial::new("encoder_offset", name());
        all.push(offset.fitting("offset", unit, position, sigma));
        if !proven.has(Proof::Joint(joint)) {
            let mut reversed = Trial::new("encoder_sign", name());
            reversed.fixed = vec![(Unstated::Reversed(Parameter::JointPosition(joint)), 1.0)];
            all.push(reversed);
        }
        if let Some(since_ns) = stopped_since(equations, joint, onset_ns) {
            let stopped = Unstated::Stopped {
                joint,
                since_ns,
                onset_ns,
            };
            let trial = Trial::new("encoder_stopped", name());
            all.push(trial.fitting("way", unit, stopped, sigma));
        }
    }
    for proof in Proof::OF_IMU {
        if proven.has(proof) {
            continue;
        }
        let (sensor, signal): (_, fn(Axis) -> Parameter) = match proof {
            Proof::SpecificForce => ("specific_force", Parameter::SpecificForce),
            _ => ("angular_velocity", Parameter::AngularVelocity),
        };
        for axis in Axis::ALL {
            let name = format!("{sensor}_{}", axis.name());
            let mut reversed = Trial::new("imu_sign", Some(name));
            reversed.fixed = vec![(Unstated::Reversed(signal(axis)), 1.0)];
            all.push(reversed);
        }
    }
    for (&support, of) in machine.stands_on().iter().zip(machine.wheels()) {
        let trial = Trial::new("wheel_radius", Some(of.name.clone()));
        let radius = Parameter::WheelRadius(support);
        all.push(trial.fitting_stated(machine, "radius", "m", radius));
    }
    all.push(Trial::new("none_of_these", None));
    all
}

/// Returns the time (ns) since which the encoder of a joint has not moved until the end; `None` if that is not long enough before
/// the onset.
fn stopped_since(equations: &Equations, joint: usize, onset_ns: i64) -> Option<i64> {
    let mut rows: Vec<_> = equations.rows.iter().collect();
    rows.sort_by_key(|row| row.time_ns);
    let last = rows.last()?.state.joints[joint].position;
    let moved = |row: &&&super::amounts::RowState| {
        (row.state.joints[joint].position - last).abs() > STOPPED
    };
    let since_ns = match rows.iter().rposition(|row| moved(&row)) {
        Some(place) => rows.get(place + 1)?.time_ns,
        None => rows.first()?.time_ns,
    };
    let before_onset_s = (onset_ns - since_ns) as f64 * 1e-9;
    (before_onset_s >= STOPPED_S).then_some(since_ns)
}

fn heaviest(machine: &Machine, group: LinkGroup) -> Option<usize> {
    let links = machine.links().iter().enumerate();
    let of_group = links.filter(|(_, link)| link.group == group && link.inertia.mass > 0.0);
    of_group
        .max_by(|a, b| a.1.inertia.mass.total_cmp(&b.1.inertia.mass))
        .map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::super::rows::FallRows;
    use super::*;
    use crate::base::rigid::rigid;

    #[test]
    fn no_sign_that_is_proven_is_an_explanation() {
        let machine = rigid();
        let scene = Scene {
            machine: &machine,
            edge: 1,
            load: machine.load_on_tool(),
            lean: None,
        };
        let rows = FallRows {
            onset: Vec::new(),
            fall: Vec::new(),
            lean: Vec::new(),
            no_lean: None,
            has_attitude: true,
        };
        let equations = Equations::new(&scene, rows, false);
        let signs = |proven: Proofs| -> Vec<String> {
            let trials = trials(&scene, &equations, 0, proven).into_iter();
            let signs = trials.filter(|trial| trial.kind.ends_with("_sign"));
            signs.filter_map(|trial| trial.subject).collect()
        };
        let of_gyro = |signs: &[String]| signs.iter().any(|sign| sign.contains("angular_velocity"));
        let of_slew = |signs: &[String]| signs.iter().any(|sign| sign == "slew");
        let all = signs(Proofs::NONE);
        assert!(of_gyro(&all) && of_slew(&all), "{all:?}");
        let slew = machine
            .joints()
            .iter()
            .position(|it| it.name == "slew")
            .unwrap();
        let proven = [Proof::AngularVelocity, Proof::Joint(slew)]
            .into_iter()
            .collect();
        let left = signs(proven);
        assert!(!of_gyro(&left) && !of_slew(&left), "{left:?}");
        assert_eq!(left.len() + 4, all.len());
    }
}
