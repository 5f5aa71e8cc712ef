//! Rows that the report draws, kept while they are computed block by block.

mod late;

use std::sync::Arc;

use anyhow::Result;
use rayon::prelude::*;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Contribution, Quantity, State};

pub(crate) use self::late::LateSketch;
use super::moment::Instants;
use super::path::{Path, PathPass};
use crate::analysis::Analysis;
use crate::analysis::run::{Prepared, RowSink};
use crate::base::rows::Rows;
use crate::page::{MOST_POINTS, Point, Thinned, VALUES, together};

/// Detail with which a report draws the rows of a log, and the number of events that it lists; the output tables have all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Detail {
    /// Points of a curve.
    pub(super) points: usize,
    /// Points of a filled shape's edge, and of a curve that is hidden at first: the page stays small.
    pub(super) fewer_points: usize,
    /// Instants under the slider, those of events not counted.
    instants: usize,
    /// Findings with their evidence.
    pub(super) findings: usize,
    /// Rows of the table of events, and of that of their causes by kind.
    pub(super) events: usize,
    pub(super) causes_of_kind: usize,
}

impl Detail {
    /// A report by itself.
    pub(super) const WHOLE: Self = Self {
        points: MOST_POINTS,
        fewer_points: 1000,
        instants: 600,
        findings: 12,
        events: 500,
        causes_of_kind: 20,
    };
    /// One of the many reports of a fleet.
    const BRIEF: Self = Self {
        points: 200,
        fewer_points: 80,
        instants: 80,
        findings: 5,
        events: 20,
        causes_of_kind: 5,
    };
}

/// Points of a curve on paper, which shows no more.
const POINTS_ON_PAPER: usize = 600;
/// Kinds of moments and angles about each edge that are hidden at first.
const HIDDEN: [fn(usize) -> Quantity; 4] = [
    Quantity::Itom,
    Quantity::Tom,
    Quantity::Mhs,
    Quantity::StabilityAngle,
];

/// Curve that is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curve {
    /// A result where loads are usable.
    Result(Quantity),
    /// Position of a joint.
    Position(usize),
    /// Specific force along an axis of the IMU.
    SpecificForce(usize),
    /// Angular velocity about an axis of the IMU.
    AngularVelocity(usize),
    /// Load of a wheel less and plus two standard deviations.
    TwoSigma(usize),
    /// Smallest and largest load of a wheel over all splits.
    Envelope(usize),
    /// Load, standard deviation, smallest and largest load of a wheel, for paper.
    OnPaper(usize),
}

/// Everything that the report draws.
#[derive(Debug)]
pub struct Sketch {
    pub(super) detail: Detail,
    curves: Vec<(Curve, Vec<Point>)>,
    stacks: Vec<Vec<Layer<Vec<Point>>>>,
    pub(super) instants: Instants,
    pub(super) path: Option<Path>,
}

/// A layer of the stacked contributions to the OTF of a wheel: below and above it, for the positive and for the
/// negative part.
#[derive(Debug)]
pub(super) struct Layer<T> {
    pub(super) cause: Contribution,
    /// Whether the contribution is large enough to be seen.
    pub(super) matters: bool,
    pub(super) above: T,
    pub(super) below: T,
}

impl Sketch {
    /// Computes the rows of an analysis once more.
    #[must_use]
    pub fn of(analysis: &Analysis) -> Self {
        let mut pass = SketchPass::begin(&Prepared {
            machine: &analysis.machine,
            table: &analysis.rows,
            options: &analysis.options,
            input_events: &[],
            measured_loads: &analysis.measured_loads,
        });
        let fed = analysis.rows.feed(&mut |rows| {
            pass.add(rows);
            Ok::<(), std::convert::Infallible>(())
        });
        match fed {
            Ok(()) => pass.finish(),
        }
    }

    /// Points of all curves that are drawn from it; of some shapes, both edges.
    pub(super) fn points_drawn(&self) -> usize {
        let curves = self.curves.iter().map(|(curve, points)| match curve {
            Curve::TwoSigma(_) | Curve::Envelope(_) => 2 * points.len(),
            Curve::OnPaper(_) => 0,
            _ => points.len(),
        });
        let layers = self.stacks.iter().flatten();
        let layers = layers.map(|layer| 2 * (layer.above.len() + layer.below.len()));
        curves.chain(layers).sum()
    }

    /// The points of a curve; none if the analysis has no such curve.
    pub(super) fn points(&self, curve: Curve) -> &[Point] {
        let found = self.curves.iter().find(|(known, _)| *known == curve);
        found.map_or(&[], |(_, points)| points)
    }

    /// The layers of a wheel, the lowest first; none for models without contributions.
    pub(super) fn layers(&self, wheel: usize) -> &[Layer<Vec<Point>>] {
        self.stacks.get(wheel).map_or(&[], Vec::as_slice)
    }
}

/// The sketch while rows are computed.
#[derive(Debug)]
pub struct SketchPass {
    detail: Detail,
    machine: Machine,
    curves: Vec<Drawn>,
    stacks: Vec<Stack>,
    instants: Instants,
    path: PathPass,
}

/// A curve, thinned by one or more values.
#[derive(Debug)]
struct Drawn {
    curve: Curve,
    thinned: Vec<Thinned>,
}

/// The contributions to the OTF of a wheel.
#[derive(Debug)]
struct Stack {
    wheel: usize,
    layers: Vec<Layer<Thinned>>,
}

impl SketchPass {
    /// Before the first row.
    #[must_use]
    pub fn begin(prepared: &Prepared<'_>) -> Self {
        Self::in_detail(prepared, Detail::WHOLE)
    }

    fn in_detail(prepared: &Prepared<'_>, detail: Detail) -> Self {
        let Detail {
            points: most,
            fewer_points: fewer,
            instants,
            ..
        } = detail;
        let (machine, table) = (prepared.machine, prepared.table);
        let wheels = 0..machine.wheels().len();
        let mut curves: Vec<(Curve, usize)> = Vec::new();
        for quantity in results(prepared) {
            let hidden = HIDDEN.iter().any(|kind| kind(0).kind() == quantity.kind());
            let points = if hidden { fewer } else { most };
            curves.push((Curve::Result(quantity), points));
        }
        let joints = (machine.joints().iter().enumerate()).filter(|(_, joint)| joint.logged);
        curves.extend(joints.map(|(joint, facts)| {
            // the turns of a wheel are hidden at first
            let is_hidden = facts.spins_wheel.is_some();
            (Curve::Position(joint), if is_hidden { fewer } else { most })
        }));
        for axis in 0..3 {
            curves.push((Curve::SpecificForce(axis), most));
            curves.push((Curve::AngularVelocity(axis), most));
        }
        for wheel in wheels.clone() {
            curves.push((Curve::TwoSigma(wheel), fewer));
            curves.push((Curve::Envelope(wheel), fewer));
            curves.push((Curve::OnPaper(wheel), POINTS_ON_PAPER));
        }
        let rows = table.len();
        let curves = curves.into_iter().map(|(curve, points)| {
            let thinned = match curve {
                Curve::TwoSigma(_) | Curve::Envelope(_) => vec![Thinned::new(rows, points); 2],
                Curve::OnPaper(_) => [points, points / 2, points / 2]
                    .map(|points| Thinned::new(rows, points))
                    .to_vec(),
                _ => vec![Thinned::new(rows, points)],
            };
            Drawn { curve, thinned }
        });
        let has_causes = table.has(Quantity::Contribution(Contribution::ArmWeight, 0));
        let layer = |&cause: &Contribution| Layer {
            cause,
            matters: false,
            above: Thinned::new(rows, fewer),
            below: Thinned::new(rows, fewer),
        };
        let causes = Contribution::ALL.iter();
        let causes: Vec<_> = causes
            .filter(|cause| **cause != Contribution::LiftOff)
            .collect();
        let stacks = wheels.filter(|_| has_causes).map(|wheel| Stack {
            wheel,
            layers: causes.iter().copied().map(layer).collect(),
        });
        Self {
            detail,
            machine: machine.clone(),
            curves: curves.collect(),
            stacks: stacks.collect(),
            instants: Instants::new(table, instants),
            path: PathPass::new(machine),
        }
    }

    /// Takes the next rows.
    pub fn add(&mut self, rows: &Rows) {
        let inputs = Inputs::of(&self.machine, rows);
        let (curves, stacks) = (&mut self.curves, &mut self.stacks);
        rayon::join(
            || {
                rayon::join(
                    || {
                        curves
                            .par_iter_mut()
                            .for_each(|curve| curve.add(rows, &inputs));
                    },
                    || {
                        stacks
                            .par_iter_mut()
                            .for_each(|stack| stack.add(rows, &inputs));
                    },
                )
            },
            || {
                self.instants.add(rows);
                self.path.add(&self.machine, rows);
            },
        );
    }

    /// After the last row.
    #[must_use]
    pub fn finish(self) -> Sketch {
        let points = |thinned: Vec<Thinned>| together(thinned.into_iter().map(Thinned::finish));
        let curves = self.curves.into_iter();
        Sketch {
            detail: self.detail,
            curves: curves
                .map(|drawn| (drawn.curve, points(drawn.thinned)))
                .collect(),
            stacks: self.stacks.into_iter().map(Stack::finish).collect(),
            instants: self.instants,
            path: self.path.finish(),
        }
    }
}

impl RowSink for SketchPass {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        self.add(rows);
        Ok(())
    }
}

/// The results that have curves of their own.
fn results(prepared: &Prepared<'_>) -> Vec<Quantity> {
    let (machine, table) = (prepared.machine, prepared.table);
    let is_drawn = |quantity: &Quantity| match quantity {
        Quantity::Load(_)
        | Quantity::Otf(_)
        | Quantity::ZmpMargin
        | Quantity::ItomFull(_)
        | Quantity::Itom(_)
        | Quantity::Tom(_)
        | Quantity::Mhs(_)
        | Quantity::ForceAngle(_)
        | Quantity::StabilityAngle(_) => true,
        // beside the bands of the study
        Quantity::ArmForce(_) | Quantity::ArmMoment(_) => prepared.options.monte_carlo.is_some(),
        _ => false,
    };
    debug_assert!(!machine.wheels().is_empty());
    (table.quantities.iter().copied())
        .filter(is_drawn)
        .collect()
}

/// The inputs of some rows, one column each, and which of their results are drawn.
struct Inputs {
    /// Whether the loads of each row are usable.
    usable: Vec<bool>,
    positions: Vec<Vec<f64>>,
    specific_force: [Vec<f64>; 3],
    angular_velocity: [Vec<f64>; 3],
}

impl Inputs {
    fn of(machine: &Machine, rows: &Rows) -> Self {
        let mut state = State::zero(machine);
        let usable = rows.reasons.iter().map(|reasons| reasons.leave_loads());
        let mut found = Self {
            usable: usable.collect(),
            positions: vec![Vec::with_capacity(rows.len()); machine.joints().len()],
            specific_force: Default::default(),
            angular_velocity: Default::default(),
        };
        for row in 0..rows.len() {
            rows.states.get(row, &mut state);
            for (column, joint) in found.positions.iter_mut().zip(&state.joints) {
                column.push(joint.position);
            }
            for axis in 0..3 {
                found.specific_force[axis].push(state.imu.specific_force[axis]);
                found.angular_velocity[axis].push(state.imu.angular_velocity[axis]);
            }
        }
        found
    }

    /// A result in the rows whose loads are usable, else NaN; NaN throughout if there is no such result.
    fn usable(&self, rows: &Rows, quantity: Quantity) -> Vec<f64> {
        let Some(column) = rows.outcomes.known_column(quantity) else {
            return vec![f64::NAN; rows.len()];
        };
        let values = column.iter().zip(&self.usable);
        values
            .map(|(&value, &usable)| if usable { value } else { f64::NAN })
            .collect()
    }
}

impl Drawn {
    fn add(&mut self, rows: &Rows, inputs: &Inputs) {
        let column = |quantity: Quantity| inputs.usable(rows, quantity);
        match self.curve {
            Curve::Result(quantity) => self.line(&column(quantity)),
            Curve::Position(joint) => self.line(&inputs.positions[joint]),
            Curve::SpecificForce(axis) => self.line(&inputs.specific_force[axis]),
            Curve::AngularVelocity(axis) => self.line(&inputs.angular_velocity[axis]),
            Curve::TwoSigma(wheel) => {
                let load = column(Quantity::Load(wheel));
                let sigma = column(Quantity::LoadSigma(wheel));
                let pairs = || load.iter().zip(&sigma);
                let low = pairs().map(|(&load, &sigma)| {
                    let low = (load - 2.0 * sigma).max(0.0);
                    if load.is_nan() { load } else { low }
                });
                let high = pairs().map(|(&load, &sigma)| load + 2.0 * sigma);
                self.area(&low.collect::<Vec<_>>(), &high.collect::<Vec<_>>());
            }
            Curve::Envelope(wheel) => {
                let least = column(Quantity::LoadLeast(wheel));
                let largest = column(Quantity::LoadLargest(wheel));
                self.area(&least, &largest);
            }
            Curve::OnPaper(wheel) => {
                let columns = [
                    Quantity::Load(wheel),
                    Quantity::LoadSigma(wheel),
                    Quantity::LoadLeast(wheel),
                    Quantity::LoadLargest(wheel),
                ]
                .map(column);
                let [load, _, least, largest] = &columns;
                let values = |row: usize| std::array::from_fn(|k| columns[k][row]);
                for (thinned, chosen) in self.thinned.iter_mut().zip([load, least, largest]) {
                    thinned.extend(chosen, values);
                }
            }
        }
    }

    fn line(&mut self, values: &[f64]) {
        for thinned in &mut self.thinned {
            thinned.extend(values, |row| [values[row]; VALUES]);
        }
    }

    fn area(&mut self, low: &[f64], high: &[f64]) {
        let values = |row: usize| [low[row], high[row], f64::NAN, f64::NAN];
        for (thinned, chosen) in self.thinned.iter_mut().zip([low, high]) {
            thinned.extend(chosen, values);
        }
    }
}

impl Stack {
    fn add(&mut self, rows: &Rows, inputs: &Inputs) {
        let mut above = vec![0.0; rows.len()];
        let mut below = vec![0.0; rows.len()];
        let nothing = vec![0.0; rows.len()];
        let count = self.layers.len();
        let parts = self
            .layers
            .iter()
            .map(|layer| inputs.usable(rows, Quantity::Contribution(layer.cause, self.wheel)));
        let parts: Vec<Vec<f64>> = parts.collect();
        for (place, layer) in self.layers.iter_mut().enumerate() {
            layer.matters |= parts[place].iter().any(|value| value.abs() > 1.0);
            let next = if place + 1 < count {
                &parts[place + 1]
            } else {
                &nothing
            };
            layer.above.stack(&mut above, &parts[place], next, positive);
            layer.below.stack(&mut below, &parts[place], next, negative);
        }
    }

    fn finish(self) -> Vec<Layer<Vec<Point>>> {
        let mut under: [Vec<Point>; 2] = Default::default();
        let mut layers = Vec::with_capacity(self.layers.len());
        for layer in self.layers {
            let upper = [layer.above.finish(), layer.below.finish()];
            let [above, below] = std::array::from_fn(|side| {
                // from here to the layer above: what was "this" and "next" is now "before" and "this"
                let lower = under[side].iter().map(|point| {
                    let [_, from, to, _] = point.values();
                    Point::new(point.row(), [from, to, f64::NAN, f64::NAN])
                });
                together([upper[side].clone(), lower.collect()])
            });
            layers.push(Layer {
                cause: layer.cause,
                matters: layer.matters,
                above,
                below,
            });
            under = upper;
        }
        layers
    }
}

impl Thinned {
    /// Takes the next rows of a layer on top of `base`, which becomes its upper edge. Of its values and of those of the
    /// `next` layer only the `part` with its sign counts.
    fn stack(
        &mut self,
        base: &mut Vec<f64>,
        values: &[f64],
        next: &[f64],
        part: impl Fn(f64) -> f64,
    ) {
        let values = base.iter().zip(values);
        let to: Vec<f64> = values.map(|(from, &value)| from + part(value)).collect();
        self.extend(&to, |row| {
            [base[row], to[row], to[row] + part(next[row]), f64::NAN]
        });
        *base = to;
    }
}

/// The value where it is positive, else zero; NaN stays.
fn positive(value: f64) -> f64 {
    if value < 0.0 { 0.0 } else { value }
}

/// The value where it is negative, else zero; NaN stays.
fn negative(value: f64) -> f64 {
    if value > 0.0 { 0.0 } else { value }
}
