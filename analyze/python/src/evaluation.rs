//! Wheel loads of many postures at once.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::{Result, anyhow, bail};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use rayon::prelude::*;
use tipwatch_mechanics::{
    BatchWorkspace, Model, OutcomeColumns, Quantity, Scope, State, StateColumns, Workspace,
    evaluate as evaluate_state, evaluate_into, machine,
};

use crate::call::error::{Mistake, exception};
use crate::call::interrupt::{Stop, interruptible};
use crate::call::pickle::{Reduced, reduced};
use crate::inputs::{Given, Inputs, Varying};

/// Rows that one core evaluates at once.
const CHUNK_ROWS: usize = 1024;

/// Results of ``Machine.evaluate``: one array per quantity, rows first.
///
/// ``load`` has the shape (rows, wheels), ``itom`` (rows, edges), ``cause`` (rows, causes, wheels), ``zmp_margin``
/// (rows,). ``names`` lists them, ``describe(name)`` gives meaning and unit. What cannot be computed is NaN.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Evaluation {
    arrays: BTreeMap<String, (Entry, Py<PyAny>)>,
}

/// Description of an array of an evaluation.
#[derive(Debug, Clone)]
struct Entry {
    name: String,
    /// Sizes of the axes after the rows.
    shape: Vec<usize>,
    /// Names of the columns of samples.parquet with the same numbers, in order.
    columns: Vec<String>,
    unit: String,
    meaning: String,
}

/// An array of an evaluation, taken apart: name, shape, columns, unit, meaning, numbers.
type Part = (String, Vec<usize>, Vec<String>, String, String, Py<PyAny>);

#[pymethods]
impl Evaluation {
    /// Names of the arrays.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.arrays.keys().map(String::as_str).collect()
    }

    /// Meaning, unit and shape of an array.
    fn describe(&self, name: &str) -> PyResult<String> {
        let (entry, _) = self.entry(name)?;
        let shape: String = entry.shape.iter().map(|n| format!(", {n}")).collect();
        Ok(format!(
            "{} [{}], shape (rows{shape})",
            entry.meaning, entry.unit
        ))
    }

    /// Names of the columns of ``samples.parquet`` that hold the same numbers, in the order of the array's last
    /// axes.
    fn columns(&self, name: &str) -> PyResult<Vec<String>> {
        Ok(self.entry(name)?.0.columns.clone())
    }

    fn __getattr__(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        Ok(self.entry(name)?.1.clone_ref(py))
    }

    /// For pickle.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, (Vec<Part>,)> {
        let py = this.py();
        let arrays = this.get().arrays.values();
        let parts = arrays.map(|(entry, array)| {
            let Entry {
                name,
                shape,
                columns,
                unit,
                meaning,
            } = entry.clone();
            (name, shape, columns, unit, meaning, array.clone_ref(py))
        });
        reduced(this, (parts.collect(),))
    }

    #[staticmethod]
    fn _of_parts(parts: Vec<Part>) -> Self {
        let arrays = parts.into_iter();
        let arrays = arrays.map(|(name, shape, columns, unit, meaning, array)| {
            let entry = Entry {
                name,
                shape,
                columns,
                unit,
                meaning,
            };
            (entry.name.clone(), (entry, array))
        });
        Self {
            arrays: arrays.collect(),
        }
    }

    fn __dir__(&self) -> Vec<String> {
        let own = ["names", "describe", "columns"].map(String::from);
        self.arrays.keys().cloned().chain(own).collect()
    }

    fn __repr__(&self) -> String {
        format!("<tipwatch.Evaluation: {}>", self.names().join(", "))
    }
}

impl Evaluation {
    fn entry(&self, name: &str) -> PyResult<&(Entry, Py<PyAny>)> {
        self.arrays.get(name).ok_or_else(|| {
            let names = self.names().join(", ");
            PyAttributeError::new_err(format!("expected one of {names}, found {name:?}"))
        })
    }
}

/// The array that a quantity belongs to: the name of its columns without their indices.
fn array_name(pattern: &str) -> String {
    let mut name = pattern.to_string();
    while let (Some(open), Some(close)) = (name.find("_{"), name.find('}')) {
        name.replace_range(open..=close, "");
    }
    name
}

/// The arrays of all quantities: each with the range of its columns.
fn entries(machine: &machine::Machine, quantities: &[Quantity]) -> Vec<(Entry, Range<usize>)> {
    let names = tipwatch_mechanics::ColumnNames::of(machine);
    let mut entries: Vec<(Entry, Range<usize>)> = Vec::new();
    for (place, quantity) in quantities.iter().enumerate() {
        let kind = quantity.kind();
        let name = array_name(kind.pattern);
        let column = quantity.column(&names);
        match entries.last_mut() {
            Some((entry, range)) if entry.name == name => {
                range.end = place + 1;
                entry.columns.push(column);
            }
            _ => entries.push((
                Entry {
                    name,
                    shape: Vec::new(),
                    columns: vec![column],
                    unit: kind.unit.into(),
                    meaning: kind.meaning.into(),
                },
                place..place + 1,
            )),
        }
    }
    let wheels = machine.wheels().len();
    for (entry, range) in &mut entries {
        let pattern = quantities[range.start].kind().pattern;
        entry.shape = match pattern.matches('{').count() {
            0 => Vec::new(),
            1 => vec![range.len()],
            _ => vec![range.len() / wheels.max(1), wheels],
        };
    }
    entries
}

/// Numbers of a chunk of rows, row by row, for each array.
struct Chunk<'a> {
    rows: Range<usize>,
    arrays: Vec<&'a mut [f64]>,
    gradient: Option<&'a mut [f64]>,
}

fn chunks<'a>(
    rows: usize,
    arrays: &'a mut [Vec<f64>],
    gradient: Option<&'a mut Vec<f64>>,
    gradient_width: usize,
    widths: &[usize],
) -> Vec<Chunk<'a>> {
    let mut rest: Vec<&mut [f64]> = arrays.iter_mut().map(Vec::as_mut_slice).collect();
    let mut gradient = gradient.map(Vec::as_mut_slice);
    let starts = (0..rows).step_by(CHUNK_ROWS);
    starts
        .map(|start| {
            let here = start..(start + CHUNK_ROWS).min(rows);
            let arrays = rest.iter_mut().zip(widths).map(|(rest, width)| {
                let (part, others) = std::mem::take(rest).split_at_mut(width * here.len());
                *rest = others;
                part
            });
            let arrays = arrays.collect();
            let gradient = gradient.as_mut().map(|rest| {
                let (part, others) = std::mem::take(rest).split_at_mut(gradient_width * here.len());
                *rest = others;
                part
            });
            Chunk {
                rows: here,
                arrays,
                gradient,
            }
        })
        .collect()
}

/// Buffers that the chunks of one core use in turn.
struct Memory {
    batch: BatchWorkspace,
    single: Workspace<f64>,
    state: State<f64>,
    states: StateColumns,
    outcomes: OutcomeColumns,
}

/// The inputs of an evaluation.
struct Asked<'a> {
    inputs: &'a Inputs<'a>,
    varying: Varying<'a>,
}

impl Memory {
    fn new(machine: &machine::Machine, scope: Scope, inputs: &Inputs<'_>) -> Self {
        let model = Arc::new(Model::WholeBody);
        // what does not differ from row to row is written once; the first row stands for all
        let mut state = State::zero(machine);
        inputs.state(0, &mut state);
        let mut states = StateColumns::unknown(machine, CHUNK_ROWS);
        (0..CHUNK_ROWS).for_each(|row| states.set(row, &mut state));
        Self {
            batch: BatchWorkspace::new(machine, scope, &model),
            single: Workspace::with_model(machine, Scope::LOADS_AND_DERIVATIVES, model),
            state,
            states,
            outcomes: OutcomeColumns::empty(machine, scope),
        }
    }
}

fn evaluate_chunk(
    machine: &machine::Machine,
    asked: &Asked<'_>,
    ranges: &[Range<usize>],
    memory: &mut Memory,
    chunk: &mut Chunk<'_>,
) {
    let Memory {
        batch,
        single,
        state,
        states,
        outcomes,
    } = memory;
    asked.varying.fill(chunk.rows.clone(), states);
    evaluate_into(machine, states, 0..chunk.rows.len(), batch, outcomes);
    for (array, range) in chunk.arrays.iter_mut().zip(ranges) {
        let width = range.len();
        for (place, column) in outcomes.columns[range.clone()].iter().enumerate() {
            let cells = array.iter_mut().skip(place).step_by(width);
            cells.zip(column).for_each(|(cell, &value)| *cell = value);
        }
    }
    if let Some(gradient) = &mut chunk.gradient {
        let mut cells = gradient.iter_mut();
        for row in chunk.rows.clone() {
            asked.inputs.state(row, state);
            evaluate_state(machine, state, single);
            for wheel in 0..machine.wheels().len() {
                for value in single.sensitivity().load(wheel) {
                    if let Some(cell) = cells.next() {
                        *cell = value;
                    }
                }
            }
        }
    }
}

/// Request of [`Machine::evaluate`].
struct Request {
    scope: Scope,
    gradient: bool,
}

fn request(what: &[String]) -> Result<Request> {
    let mut scope = Scope::LOADS;
    let mut gradient = false;
    for word in what {
        match word.as_str() {
            "loads" => {}
            "indicators" => scope.indicators = true,
            "causes" => scope.contributions = true,
            "sigma" => scope.sensitivities = true,
            "parts" => scope.parts = true,
            "gradient" => gradient = true,
            "all" => {
                scope = Scope {
                    parts: scope.parts,
                    ..Scope::ALL
                }
            }
            _ => bail!(Mistake(format!(
                "expected loads, indicators, causes, sigma, parts, gradient or all in what, found {word:?}"
            ))),
        }
    }
    Ok(Request { scope, gradient })
}

/// [`Machine::evaluate`](crate::machine::Machine).
pub(crate) fn evaluate(
    py: Python<'_>,
    machine: &machine::Machine,
    given: &Given<'_>,
    what: &[String],
    frame: &str,
) -> PyResult<Evaluation> {
    let at_base;
    let machine = match frame {
        "base" => {
            at_base = machine.with_imu_at_base();
            &at_base
        }
        "imu" => machine,
        _ => {
            let error = anyhow!(Mistake(format!(
                "expected frame \"base\" or \"imu\", found {frame:?}"
            )));
            return Err(exception(&error));
        }
    };
    let asked = given.inputs(machine, frame).and_then(|inputs| {
        let rows = inputs.rows()?;
        Ok((inputs, rows, request(what)?))
    });
    let (inputs, rows, request) = asked.map_err(|error| exception(&error))?;
    let quantities = Quantity::all(machine, request.scope);
    let (entries, ranges): (Vec<_>, Vec<_>) = entries(machine, &quantities).into_iter().unzip();
    let widths: Vec<usize> = ranges.iter().map(Range::len).collect();
    let parameters = tipwatch_mechanics::Parameter::all(machine).len();
    let gradient_width = parameters * machine.wheels().len();
    // Every cell is written. Zeros, unlike any other number, come from the system without being written here, so that
    // all cores share the work of the first touch.
    let mut arrays: Vec<Vec<f64>> = widths.iter().map(|width| vec![0.0; width * rows]).collect();
    let mut gradient = request.gradient.then(|| vec![0.0; gradient_width * rows]);
    let compute = |stop: &Stop| {
        if rows == 0 {
            return;
        }
        let chunks = chunks(
            rows,
            &mut arrays,
            gradient.as_mut(),
            gradient_width,
            &widths,
        );
        let asked = Asked {
            inputs: &inputs,
            varying: inputs.varying(machine),
        };
        let memory = || Memory::new(machine, request.scope, &inputs);
        chunks
            .into_par_iter()
            .for_each_init(memory, |memory, mut chunk| {
                if !stop.is_set() {
                    evaluate_chunk(machine, &asked, &ranges, memory, &mut chunk);
                }
            });
    };
    interruptible(py, compute, |_| Ok(()))?;
    let mut found = BTreeMap::new();
    for (entry, values) in entries.into_iter().zip(arrays) {
        let array = shaped(py, values, rows, &entry.shape)?;
        found.insert(entry.name.clone(), (entry, array));
    }
    if let Some(values) = gradient {
        let entry = Entry {
            name: "load_gradient".into(),
            shape: vec![machine.wheels().len(), parameters],
            columns: Vec::new(),
            unit: "N per unit of Machine.gradient_names".into(),
            meaning: "Derivative of the load".into(),
        };
        let array = shaped(py, values, rows, &entry.shape)?;
        found.insert(entry.name.clone(), (entry, array));
    }
    Ok(Evaluation { arrays: found })
}

/// The values as an array of shape (rows, ...), which takes over their memory.
fn shaped(py: Python<'_>, values: Vec<f64>, rows: usize, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let array = PyArray1::from_vec(py, values);
    let whole: Vec<usize> = std::iter::once(rows).chain(shape.iter().copied()).collect();
    let array: Bound<'_, PyArrayDyn<f64>> = array.reshape(whole)?;
    Ok(array.into_any().unbind())
}
