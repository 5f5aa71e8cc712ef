//! The inputs of an evaluation: for every row, or one for all of them.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::{Result, bail};
use numpy::{AllowTypeChange, PyArrayLikeDyn};
use tipwatch_mechanics::state::UNIT_TOLERANCE;
use tipwatch_mechanics::{State, StateColumns, machine};

use crate::call::error::Mistake;

/// An array of numbers, or a tuple, a list or whole numbers, of which NumPy makes an array.
pub(crate) type Numbers<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// The inputs, in their order.
const NAMES: [&str; 9] = [
    "positions",
    "rates",
    "accelerations",
    "specific_force",
    "up",
    "angular_velocity",
    "angular_acceleration",
    "tool_force",
    "tool_moment",
];

/// Calls `take` with each number of a state that an input gives: the place of the input in [`NAMES`], that of the number in the
/// input, and the number.
fn visit(state: &mut State<f64>, mut take: impl FnMut(usize, usize, &mut f64)) {
    for (joint, motion) in state.joints.iter_mut().enumerate() {
        take(0, joint, &mut motion.position);
        take(1, joint, &mut motion.rate);
        take(2, joint, &mut motion.acceleration);
    }
    let vectors = [
        &mut state.imu.specific_force,
        &mut state.base.up,
        &mut state.imu.angular_velocity,
        &mut state.imu.angular_acceleration,
        &mut state.tool_wrench.force,
        &mut state.tool_wrench.moment,
    ];
    for (input, vector) in (3..).zip(vectors) {
        for (place, number) in vector.iter_mut().enumerate() {
            take(input, place, number);
        }
    }
}

/// The arrays of a call, in the order of [`NAMES`].
pub(crate) struct Given<'py>(pub(crate) [Option<Numbers<'py>>; NAMES.len()]);

impl Given<'_> {
    /// The inputs; at rest on level ground where nothing else is given.
    ///
    /// # Errors
    /// An array has the wrong shape.
    pub(crate) fn inputs(&self, machine: &machine::Machine, frame: &str) -> Result<Inputs<'_>> {
        let [_, _, _, specific_force, ..] = &self.0;
        let is_at_rest = specific_force.is_none();
        if is_at_rest && frame != "base" {
            bail!(Mistake(
                "expected specific_force with frame \"imu\", found none".into()
            ));
        }
        let mut all = Vec::with_capacity(NAMES.len());
        for (name, array) in NAMES.into_iter().zip(&self.0) {
            let width = match name {
                "positions" | "rates" | "accelerations" => machine.joints().len(),
                _ => 3,
            };
            all.push(match (name, array) {
                ("up", Some(up)) => unit_vectors(Input::new(name, up, width)?)?,
                (_, Some(array)) => Input::new(name, array, width)?,
                ("specific_force", None) => Input::constant(vec![0.0, 0.0, machine.gravity()]),
                ("up", None) if is_at_rest => Input::constant(vec![0.0, 0.0, 1.0]),
                ("up", None) => Input::constant(vec![f64::NAN; width]),
                (_, None) => Input::constant(vec![0.0; width]),
            });
        }
        Ok(Inputs {
            all,
            velocity: if is_at_rest { 0.0 } else { f64::NAN },
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
    /// In the order of [`NAMES`]; NaN where unknown.
    all: Vec<Input<'a>>,
    /// Velocity of the base and its rate: zero at rest, else unknown.
    velocity: f64,
}

impl Inputs<'_> {
    /// Number of rows.
    ///
    /// # Errors
    /// The inputs differ in it.
    pub(crate) fn rows(&self) -> Result<usize> {
        let mut first: Option<(&str, usize)> = None;
        for (name, input) in NAMES.into_iter().zip(&self.all) {
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
        visit(state, |input, place, number| {
            *number = self.all[input].row(row)[place];
        });
        state.base.velocity.fill(self.velocity);
        state.base.velocity_rate.fill(self.velocity);
    }

    /// The inputs that differ from row to row, each with the columns of its numbers.
    pub(crate) fn varying(&self, machine: &machine::Machine) -> Varying<'_> {
        // a state whose numbers are those of their columns
        let mut columns = StateColumns::unknown(machine, 1);
        let numbers: Vec<f64> = (0..State::<f64>::size(machine)).map(|n| n as f64).collect();
        columns.set_values(0, &numbers);
        let mut column = State::zero(machine);
        columns.get(0, &mut column);
        let mut places: [Vec<usize>; NAMES.len()] = Default::default();
        visit(&mut column, |input, _, number| {
            places[input].push(*number as usize);
        });
        let all = self.all.iter().zip(places);
        let varying = all.filter(|(input, _)| !input.is_constant);
        Varying(
            varying
                .map(|(input, columns)| (&*input.values, columns))
                .collect(),
        )
    }
}

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
