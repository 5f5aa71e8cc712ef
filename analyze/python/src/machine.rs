//! Machines: a machine file and its URDF, checked.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::SupportId;
use tipwatch_mechanics::{Parameter, machine};

use crate::call::error::{Mistake, exception};
use crate::call::options::Words;
use crate::call::place::Place;
use crate::evaluation::{Evaluation, evaluate};
use crate::inputs::{Given, Numbers};
use crate::pose::{Posture, positions};

/// Files and settings that a machine is read from: the machine file, its URDF where that is another, and whether impossible
/// inertias are accepted.
type ReadFrom = (PathBuf, Option<PathBuf>, bool);

/// A machine, from its machine file and URDF.
///
/// Parameters
/// ----------
/// file : path
///     The machine file (TOML).
/// urdf : path, optional
///     The URDF, for a machine file that names none.
/// accept_inertias : bool
///     Inertias of the URDF that no body can have are replaced, with their uncertainty, instead of refused; as
///     ``accept_inertias = true`` in the machine file.
///
/// Raises
/// ------
/// TipwatchError
///     The files do not describe a valid machine: what was expected, what was found and where.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Machine {
    pub(crate) file: MachineFile,
    pub(crate) machine: machine::Machine,
    /// Reason why the static loads are unknown.
    reference_error: Option<String>,
    /// Whether the machine differs from its machine file.
    is_changed: bool,
}

impl Machine {
    fn of(file: MachineFile) -> anyhow::Result<Self> {
        let machine = file.check_alone()?;
        Ok(Self::with(file, machine))
    }

    fn with(file: MachineFile, mut machine: machine::Machine) -> Self {
        let reference_error = machine.set_reference_loads().err().map(|e| e.to_string());
        Self {
            file,
            machine,
            reference_error,
            is_changed: false,
        }
    }

    /// All joints at zero, or at the limit next to zero (rad or m).
    fn zero(&self) -> Vec<f64> {
        let joints = self.machine.joints().iter();
        let zero = joints.map(|joint| match (joint.constant, joint.limits) {
            (Some(constant), _) => constant,
            (None, Some([low, high])) => 0.0_f64.max(low).min(high),
            (None, None) => 0.0,
        });
        zero.collect()
    }

    fn posture(&self, given: Option<&Numbers<'_>>) -> PyResult<Posture<'_>> {
        let posture = positions(given, self.zero()).and_then(|at| Posture::new(&self.machine, &at));
        posture.map_err(|error| exception(&error))
    }

    fn parameter(&self, name: &str) -> anyhow::Result<Parameter> {
        let all = Parameter::all(&self.machine);
        let mut known = all.iter().filter(|parameter| !parameter.is_signal());
        let found = known.find(|parameter| parameter.name(&self.machine) == name);
        found.copied().ok_or_else(|| {
            anyhow!(Mistake(format!(
                "expected the name of a parameter of the machine (Machine.parameters), found {name:?}"
            )))
        })
    }
}

/// The place of a name among others.
fn position<'a>(
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
    name: &str,
) -> PyResult<usize> {
    let found = names.clone().position(|other| other == name);
    found.ok_or_else(|| {
        let names = names.collect::<Vec<_>>().join(", ");
        let text = format!("expected a {what} ({names}), found {name:?}");
        exception(&anyhow!(Mistake(text)))
    })
}

#[pymethods]
impl Machine {
    #[new]
    #[pyo3(signature = (file, urdf=None, accept_inertias=false))]
    fn new(file: Place, urdf: Option<Place>, accept_inertias: bool) -> PyResult<Self> {
        let read = || {
            let mut machine = MachineFile::read(&file)?;
            if accept_inertias {
                machine = machine.accepting_inertias()?;
            }
            if let Some(urdf) = &urdf {
                machine = machine.with_urdf(urdf)?;
            }
            Self::of(machine)
        };
        read().map_err(|error: anyhow::Error| exception(&error))
    }

    /// For pickle, and so for workers of Ray, Dask and joblib: they read the machine from its files.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, ReadFrom)> {
        let machine = slf.get();
        if machine.is_changed {
            return Err(exception(&anyhow!(
                "expected a machine as in its file {}, found one with other parameters: it has no file to be read from",
                machine.file.path.display()
            )));
        }
        let absolute = |path: &Path| {
            std::path::absolute(path)
                .with_context(|| format!("{}: not a valid path", path.display()))
                .map_err(|error| exception(&error))
        };
        let urdf = machine.file.urdf_path();
        let urdf = urdf.as_deref().map(absolute).transpose()?;
        let accepts_inertias = machine.file.spec.accept_inertias == Some(true);
        let read_from = (absolute(&machine.file.path)?, urdf, accepts_inertias);
        Ok((slf.get_type().into_any(), read_from))
    }

    /// Name of the machine.
    #[getter]
    fn name(&self) -> &str {
        self.machine.name()
    }

    /// Gravitational acceleration (m/s^2).
    #[getter]
    fn gravity(&self) -> f64 {
        self.machine.gravity()
    }

    /// Mass (kg), with the payloads that are always attached.
    #[getter]
    fn mass(&self) -> f64 {
        self.machine.mass()
    }

    /// Names of the joints, in the order of every posture.
    #[getter]
    fn joints(&self) -> Vec<&str> {
        let joints = self.machine.joints().iter();
        joints.map(|joint| joint.name.as_str()).collect()
    }

    /// Units of the joints' positions: "rad" or "m".
    #[getter]
    fn joint_units(&self) -> Vec<&'static str> {
        let slides = |joint| self.machine.joint_slides(joint);
        let unit = |joint| if slides(joint) { "m" } else { "rad" };
        (0..self.machine.joints().len()).map(unit).collect()
    }

    /// Names of the wheels, in the order of every array by wheel.
    #[getter]
    fn wheels(&self) -> Vec<&str> {
        let wheels = self.machine.wheels().iter();
        wheels.map(|wheel| wheel.name.as_str()).collect()
    }

    /// Names of all wheels and supports, those off the ground included: ``wheels`` are the ones that it stands on.
    #[getter]
    fn supports(&self) -> Vec<&str> {
        let all = self.machine.supports().all.iter();
        all.map(|support| support.name.as_str()).collect()
    }

    /// Names of the edges of the support polygon, in the order of every array by edge.
    #[getter]
    fn edges(&self) -> Vec<&str> {
        let edges = self.machine.polygon().edges().iter();
        edges.map(|edge| edge.name.as_str()).collect()
    }

    /// Place of a joint in a posture.
    fn joint(&self, name: &str) -> PyResult<usize> {
        let joints = self.machine.joints().iter();
        position("joint", joints.map(|joint| joint.name.as_str()), name)
    }

    /// Place of a wheel in the arrays by wheel.
    fn wheel(&self, name: &str) -> PyResult<usize> {
        let wheels = self.machine.wheels().iter();
        position("wheel", wheels.map(|wheel| wheel.name.as_str()), name)
    }

    /// Place of an edge in the arrays by edge.
    fn edge(&self, name: &str) -> PyResult<usize> {
        let edges = self.machine.polygon().edges().iter();
        position("edge", edges.map(|edge| edge.name.as_str()), name)
    }

    /// All joints at zero, or at the limit next to zero (rad or m): shape (joints,).
    #[getter]
    fn zero_posture<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.zero().into_pyarray(py)
    }

    /// Smallest and largest position of each joint (rad or m); NaN where the URDF states none: shape (joints, 2).
    #[getter]
    fn joint_limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let joints = self.machine.joints().iter();
        let limits = joints.map(|joint| joint.limits.map_or(vec![f64::NAN; 2], Vec::from));
        Ok(PyArray2::from_vec2(py, &limits.collect::<Vec<_>>())?)
    }

    /// Loads of the wheels (N) at rest on level ground in the reference posture, shape (wheels,); they define the
    /// utilisation.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     A wheel carries nothing in that posture.
    #[getter]
    fn static_load<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        match &self.reference_error {
            Some(error) => Err(exception(&anyhow!("{error}"))),
            None => Ok(self
                .machine
                .reference()
                .static_load
                .clone()
                .into_pyarray(py)),
        }
    }

    /// Peculiarities that are not errors, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        (self.machine.notes().iter())
            .map(ToString::to_string)
            .collect()
    }

    /// Names of the parameters that ``changed`` takes, as "boom.mass".
    #[getter]
    fn parameters(&self) -> Vec<String> {
        let all = Parameter::all(&self.machine).into_iter();
        let parameters = all.filter(|parameter| !parameter.is_signal());
        parameters.map(|p| p.name(&self.machine)).collect()
    }

    /// Names of everything that the loads depend on, signals first: the last axis of
    /// ``Evaluation.load_gradient``.
    #[getter]
    fn gradient_names(&self) -> Vec<String> {
        let all = Parameter::all(&self.machine).into_iter();
        all.map(|p| p.name(&self.machine)).collect()
    }

    /// This machine with each parameter changed by an amount in its SI unit:
    /// ``machine.changed({"boom.mass": +50.0})``. It is for ``evaluate`` and ``draw``: analyses read machine files,
    /// and refuse it.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     There is no such parameter, or an amount is not finite.
    fn changed(&self, changes: std::collections::BTreeMap<String, f64>) -> PyResult<Self> {
        let change = |(name, &amount): (&String, &f64)| {
            if !amount.is_finite() {
                return Err(anyhow!(Mistake(format!(
                    "expected a finite change of {name}, found {amount}"
                ))));
            }
            Ok((self.parameter(name)?, amount))
        };
        let changes: anyhow::Result<Vec<_>> = changes.iter().map(change).collect();
        let changes = changes.map_err(|error| exception(&error))?;
        let mut changed = Self::with(self.file.clone(), self.machine.changed(&changes));
        changed.is_changed = self.is_changed || !changes.is_empty();
        Ok(changed)
    }

    /// This machine on other supports: on its outriggers, or with a wheel in the air. Their parameters are those of the
    /// machine file. It is for ``evaluate`` and ``draw``: analyses find the supports in the log.
    ///
    /// Parameters
    /// ----------
    /// supports : sequence of str
    ///     Names out of ``supports``; the order does not matter.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     There is no such support, the machine cannot stand on these, or it was changed before: use ``changed`` on the
    ///     result.
    fn standing_on(&self, supports: Vec<String>) -> PyResult<Self> {
        if self.is_changed {
            return Err(exception(&anyhow!(Mistake(
                "expected standing_on before changed, found a machine that was changed".into()
            ))));
        }
        let names = self.supports();
        let all: Vec<SupportId> = self.machine.supports().ids().collect();
        let id = |name: &String| Ok(all[position("support", names.iter().copied(), name)?]);
        let on: Vec<SupportId> = supports.iter().map(id).collect::<PyResult<_>>()?;
        let machine = self.machine.standing_on(&on);
        let machine = machine.map_err(|error| exception(&anyhow!(Mistake(error.to_string()))))?;
        let mut standing = Self::with(self.file.clone(), machine);
        standing.is_changed = true;
        Ok(standing)
    }

    /// Pose of every link's frame in the base frame, by the link's name: arrays of shape (4, 4), translation in m.
    ///
    /// Parameters
    /// ----------
    /// posture : array, shape (joints,), optional
    ///     Joint positions (rad or m); ``zero_posture`` if not given.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     The array has the wrong shape or is not finite, or a linkage cannot close.
    #[pyo3(signature = (posture=None))]
    fn link_poses<'py>(
        &self,
        py: Python<'py>,
        posture: Option<Numbers<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.posture(posture.as_ref())?.links(py)
    }

    /// Wheels, support polygon and centre of mass at rest on level ground, in the base frame (m).
    ///
    /// Parameters
    /// ----------
    /// posture : array, shape (joints,), optional
    ///     Joint positions (rad or m); ``zero_posture`` if not given.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``wheel_centres`` and ``contacts`` (wheels, 3), ``wheel_radii`` (wheels,), ``edges`` (edges, 2): the
    ///     wheels at both ends of an edge of the support polygon; ``normal`` (3,): unit normal of the contact plane,
    ///     up; ``centre_of_mass`` (3,), payloads without a time limit included; ``arm`` (2 segments, 3): start and
    ///     end of each segment of the arm in turn.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     As in ``link_poses``.
    #[pyo3(signature = (posture=None))]
    fn layout<'py>(
        &self,
        py: Python<'py>,
        posture: Option<Numbers<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.posture(posture.as_ref())?.layout(py)
    }

    /// The text of the URDF.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     Its file cannot be read any more.
    #[getter]
    fn urdf(&self) -> PyResult<String> {
        let urdf = self.file.urdf(None, None).map_err(anyhow::Error::from);
        Ok(urdf.map_err(|error| exception(&error))?.text)
    }

    /// Draws the machine in a posture, from the right and from above: boxes, cylinders and spheres of the URDF,
    /// lines between links, wheels, support polygon and centre of mass. Meshes are not drawn. Needs matplotlib.
    ///
    /// Parameters
    /// ----------
    /// posture : array, shape (joints,), optional
    ///     Joint positions (rad or m); ``zero_posture`` if not given.
    /// ax : pair of matplotlib axes, optional
    ///     Axes for the view from the right and for that from above; a new figure if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    ///     The figure; ``machine.draw().savefig("machine.png")`` saves it. Of given axes it is theirs.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     matplotlib is not installed.
    /// TipwatchError
    ///     As in ``link_poses``.
    #[pyo3(signature = (posture=None, ax=None))]
    fn draw<'py>(
        this: &Bound<'py, Self>,
        posture: Option<Bound<'py, PyAny>>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let drawing = this.py().import("tipwatch._drawing")?;
        drawing.call_method1("draw", (this, posture, ax))
    }

    /// Wheel loads and stability of many postures, on all cores, without the interpreter's lock.
    ///
    /// Every input has one row per posture, or one row for all of them. The equations are those of
    /// ``tipwatch analyze``, with the same bits.
    ///
    /// Parameters
    /// ----------
    /// positions : array, shape (rows, joints) or (joints,)
    ///     Joint positions (rad or m), in the order of ``machine.joints``.
    /// rates, accelerations : arrays like positions, optional
    ///     Their first and second derivatives; zero if not given.
    /// specific_force : array, shape (rows, 3) or (3,), optional
    ///     Acceleration minus gravity (m/s^2): points up at rest. If not given, the machine is at rest on level
    ///     ground.
    /// up : array, shape (rows, 3) or (3,), optional
    ///     Unit vector against gravity, in base axes. The loads do not depend on it; "causes" need it to tell slope from
    ///     acceleration.
    /// angular_velocity, angular_acceleration : arrays like specific_force, optional
    ///     rad/s and rad/s^2; zero if not given.
    /// tool_force, tool_moment : arrays like specific_force, optional
    ///     Of the surroundings on the tool, in the axes of the tool frame (N, N m); zero if not given.
    /// what : str, or sequence of str
    ///     "loads" (always), "indicators", "causes", "sigma", "parts", "gradient"; "all" is the first four.
    /// frame : "base" or "imu"
    ///     Where specific force and angular motion are given: in the origin and axes of the base frame, or as the
    ///     machine's inertial measurement unit (IMU) measures them. The standard deviations of "sigma" count
    ///     errors of the IMU only with "imu".
    ///
    /// Returns
    /// -------
    /// Evaluation
    ///     One array per quantity, rows first; loads in N. NaN where a row cannot be computed.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     An array has the wrong shape, or a name is unknown.
    #[pyo3(signature = (
        positions, rates=None, accelerations=None, *, specific_force=None, up=None, angular_velocity=None,
        angular_acceleration=None, tool_force=None, tool_moment=None, what=None, frame="base"
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn evaluate(
        &self,
        py: Python<'_>,
        positions: Numbers<'_>,
        rates: Option<Numbers<'_>>,
        accelerations: Option<Numbers<'_>>,
        specific_force: Option<Numbers<'_>>,
        up: Option<Numbers<'_>>,
        angular_velocity: Option<Numbers<'_>>,
        angular_acceleration: Option<Numbers<'_>>,
        tool_force: Option<Numbers<'_>>,
        tool_moment: Option<Numbers<'_>>,
        what: Option<Words>,
        frame: &str,
    ) -> PyResult<Evaluation> {
        let given = Given([
            Some(positions),
            rates,
            accelerations,
            specific_force,
            up,
            angular_velocity,
            angular_acceleration,
            tool_force,
            tool_moment,
        ]);
        let what = what.map_or_else(Vec::new, |Words(what)| what);
        evaluate(py, &self.machine, &given, &what, frame)
    }

    fn __repr__(&self) -> String {
        format!(
            "<tipwatch.Machine {:?}: {:.0} kg, {} joints, {} wheels>",
            self.machine.name(),
            self.machine.mass(),
            self.machine.joints().len(),
            self.machine.wheels().len()
        )
    }
}

/// Reads a machine file for an analysis: a machine, or the path of its file.
pub(crate) fn machine_file(machine: &Bound<'_, PyAny>) -> PyResult<MachineFile> {
    if let Ok(machine) = machine.cast::<Machine>() {
        let machine = machine.get();
        if machine.is_changed {
            return Err(exception(&anyhow!(Mistake(format!(
                "expected a machine as in its file {}, found one from Machine.changed or standing_on: change the machine file",
                machine.file.path.display()
            )))));
        }
        return Ok(machine.file.clone());
    }
    let path: Place = machine.extract()?;
    MachineFile::read(&path)
        .with_context(|| "the machine of an analysis")
        .map_err(|error| exception(&error))
}
