//! The inputs of an evaluation: for every row, or one for all of them.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::{Result, bail};
use numpy::{AllowTypeChange, PyArrayLikeDyn};
use tipwatch_mechanics::state::UNIT_TOLERANCE;
use tipwatch_mechanics::{State, StateColumns, machine};

use crate::call::error::Mistake;

/// An array of numbers, or what NumPy makes one of: a tuple, a list, whole numbers.
pub(crate) type Numbers<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// The arrays of a call.
pub(crate) struct Given<'py> {
    pub(crate) positions: Numbers<'py>,
    pub(crate) rates: Option<Numbers<'py>>,
    pub(crate) accelerations: Option<Numbers<'py>>,
    pub(crate) specific_force: Option<Numbers<'py>>,
    pub(crate) up: Option<Numbers<'py>>,
    pub(crate) angular_velocity: Option<Numbers<'py>>,
    pub(crate) angular_acceleration: Option<Numbers<'py>>,
    pub(crate) tool_force: Option<Numbers<'py>>,
    pub(crate) tool_moment: Option<Numbers<'py>>,
}

impl Given<'_> {
    /// The inputs; at rest on level ground where nothing else is given.
    ///
    /// # Errors
    /// An array has the wrong shape.
    pub(crate) fn inputs(&self, machine: &machine::Machine, frame: &str) -> Result<Inputs<'_>> {
        let joints = machine.joints().len();
        // borrowed from self, as the arrays are
        fn input<'a>(
            name: &str,
            array: &'a Option<Numbers<'_>>,
            width: usize,
        ) -> Result<Input<'a>> {
            array.as_ref().map_or_else(
                || Ok(Input::constant(vec![0.0; width])),
                |array| Input::new(name, array, width),
            )
        }
        let specific_force = match (&self.specific_force, frame) {
            (None, "base") => Input::constant(vec![0.0, 0.0, machine.gravity()]),
            (None, _) => bail!(Mistake(
                "expected specific_force with frame \"imu\", found none".into()
            )),
            (Some(array), _) => Input::new("specific_force", array, 3)?,
        };
        Ok(Inputs {
            positions: Input::new("positions", &self.positions, joints)?,
            rates: input("rates", &self.rates, joints)?,
            accelerations: input("accelerations", &self.accelerations, joints)?,
            specific_force,
            up: match (&self.up, &self.specific_force) {
                (Some(up), _) => unit_vectors(Input::new("up", up, 3)?)?,
                (None, None) => Input::constant(vec![0.0, 0.0, 1.0]),
                (None, Some(_)) => Input::constant(vec![f64::NAN; 3]),
            },
            velocity: match &self.specific_force {
                None => 0.0,
                Some(_) => f64::NAN,
            },
            angular_velocity: input("angular_velocity", &self.angular_velocity, 3)?,
            angular_acceleration: input("angular_acceleration", &self.angular_acceleration, 3)?,
            tool_force: input("tool_force", &self.tool_force, 3)?,
            tool_moment: input("tool_moment", &self.tool_moment, 3)?,
        })
    }
}

/// An input of every row: one value for all rows, or one for each.
#[derive(Debug)]
struct Input<'a> {
    /// Row by row; those of the caller's array where they stand so in its memory.
    values: Cow<'a, [f64]>,
    /// Numbers of a row.
    width: usize,
    is_constant: bool,
}

impl<'a> Input<'a> {
    fn row(&self, row: usize) -> &[f64] {
        let row = if self.is_constant { 0 } else { row };
        &self.values[row * self.width..(row + 1) * self.width]
    }

    /// An array of shape (width,) or (rows, width).
    fn new(name: &str, array: &'a Numbers<'_>, width: usize) -> Result<Self> {
        let view = array.as_array();
        let is_constant = view.ndim() == 1;
        if !matches!(view.ndim(), 1 | 2) || view.shape().last() != Some(&width) {
            bail!(Mistake(format!(
                "expected {name} of shape ({width},) or (rows, {width}), found {:?}",
                view.shape()
            )));
        }
        Ok(Self {
            values: match view.to_slice() {
                Some(values) => Cow::Borrowed(values),
                None => view.iter().copied().collect(),
            },
            width,
            is_constant,
        })
    }

    fn constant(values: Vec<f64>) -> Self {
        Self {
            width: values.len(),
            values: Cow::Owned(values),
            is_constant: true,
        }
    }

    fn rows(&self) -> Option<usize> {
        (!self.is_constant).then(|| self.values.len() / self.width.max(1))
    }
}

/// The attitude, unless it is neither a unit vector nor unknown.
///
/// # Errors
/// A row has another length than 1.
fn unit_vectors(up: Input<'_>) -> Result<Input<'_>> {
    let mut rows = up.values.chunks_exact(3).enumerate();
    let wrong = rows.find(|(_, up)| {
        let length = up.iter().map(|x| x * x).sum::<f64>().sqrt();
        // what is not known is NaN
        !length.is_nan() && (length - 1.0).abs() > UNIT_TOLERANCE
    });
    match wrong {
        Some((row, up)) => bail!(Mistake(format!(
            "expected up as unit vectors, found {up:?} in row {row}"
        ))),
        None => Ok(up),
    }
}

/// The inputs of all rows.
#[derive(Debug)]
pub(crate) struct Inputs<'a> {
    positions: Input<'a>,
    rates: Input<'a>,
    accelerations: Input<'a>,
    specific_force: Input<'a>,
    /// Attitude; NaN where unknown.
    up: Input<'a>,
    /// Velocity of the base and its rate: zero at rest, else unknown.
    velocity: f64,
    angular_velocity: Input<'a>,
    angular_acceleration: Input<'a>,
    tool_force: Input<'a>,
    tool_moment: Input<'a>,
}

impl Inputs<'_> {
    /// Number of rows.
    ///
    /// # Errors
    /// The inputs differ in it.
    pub(crate) fn rows(&self) -> Result<usize> {
        let all = [
            ("positions", &self.positions),
            ("rates", &self.rates),
            ("accelerations", &self.accelerations),
            ("specific_force", &self.specific_force),
            ("up", &self.up),
            ("angular_velocity", &self.angular_velocity),
            ("angular_acceleration", &self.angular_acceleration),
            ("tool_force", &self.tool_force),
            ("tool_moment", &self.tool_moment),
        ];
        let mut first: Option<(&str, usize)> = None;
        for (name, input) in all {
            match (first, input.rows()) {
                (None, Some(rows)) => first = Some((name, rows)),
                (Some((other, expected)), Some(rows)) if rows != expected => {
                    bail!(Mistake(format!(
                        "expected {expected} rows of {name} as of {other}, found {rows}"
                    )))
                }
                _ => {}
            }
        }
        Ok(first.map_or(1, |(_, rows)| rows))
    }

    /// Reads a row into `state`.
    pub(crate) fn state(&self, row: usize, state: &mut State<f64>) {
        let motions = self.positions.row(row).iter();
        let motions = motions
            .zip(self.rates.row(row))
            .zip(self.accelerations.row(row));
        for (joint, ((&position, &rate), &acceleration)) in state.joints.iter_mut().zip(motions) {
            joint.position = position;
            joint.rate = rate;
            joint.acceleration = acceleration;
        }
        state
            .imu
            .specific_force
            .copy_from_slice(self.specific_force.row(row));
        state
            .imu
            .angular_velocity
            .copy_from_slice(self.angular_velocity.row(row));
        let turning = &mut state.imu.angular_acceleration;
        turning.copy_from_slice(self.angular_acceleration.row(row));
        state.base.up.copy_from_slice(self.up.row(row));
        state.base.velocity.fill(self.velocity);
        state.base.velocity_rate.fill(self.velocity);
        state
            .tool_wrench
            .force
            .copy_from_slice(self.tool_force.row(row));
        state
            .tool_wrench
            .moment
            .copy_from_slice(self.tool_moment.row(row));
    }

    /// The inputs that differ from row to row, each with the columns of its numbers.
    pub(crate) fn varying(&self, machine: &machine::Machine) -> Varying<'_> {
        // a state whose numbers are those of their columns
        let mut columns = StateColumns::unknown(machine, 1);
        let numbers: Vec<f64> = (0..State::<f64>::size(machine)).map(|n| n as f64).collect();
        columns.set_values(0, &numbers);
        let mut column = State::zero(machine);
        columns.get(0, &mut column);
        let (joints, imu, tool) = (&column.joints, &column.imu, &column.tool_wrench);
        let of_joints = |value: fn(&Motion) -> f64| joints.iter().map(value).collect();
        let all: [(&Input<'_>, Vec<f64>); 9] = [
            (&self.positions, of_joints(|joint| joint.position)),
            (&self.rates, of_joints(|joint| joint.rate)),
            (&self.accelerations, of_joints(|joint| joint.acceleration)),
            (&self.specific_force, imu.specific_force.as_slice().into()),
            (&self.up, column.base.up.as_slice().into()),
            (
                &self.angular_velocity,
                imu.angular_velocity.as_slice().into(),
            ),
            (
                &self.angular_acceleration,
                imu.angular_acceleration.as_slice().into(),
            ),
            (&self.tool_force, tool.force.as_slice().into()),
            (&self.tool_moment, tool.moment.as_slice().into()),
        ];
        let varying = all.into_iter().filter(|(input, _)| !input.is_constant);
        Varying(
            varying
                .map(|(input, columns)| {
                    let columns = columns.into_iter().map(|number| number as usize);
                    (&*input.values, columns.collect())
                })
                .collect(),
        )
    }
}

type Motion = tipwatch_mechanics::Motion<f64>;

/// Inputs that differ from row to row: values row by row, and the columns of a row's numbers.
#[derive(Debug)]
pub(crate) struct Varying<'a>(Vec<(&'a [f64], Vec<usize>)>);

impl Varying<'_> {
    /// Writes some rows into the first rows of `states`.
    pub(crate) fn fill(&self, rows: Range<usize>, states: &mut StateColumns) {
        for (values, columns) in &self.0 {
            let width = columns.len();
            let values = &values[rows.start * width..rows.end * width];
            for (place, &column) in columns.iter().enumerate() {
                let numbers = values.iter().skip(place).step_by(width);
                states.set_column(column, numbers.copied());
            }
        }
    }
}
