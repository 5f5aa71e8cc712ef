//! Places that callers name: paths and URLs.

use std::path::{Path, PathBuf};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyString};
use tipwatch_storage::{Location, redact};

use super::error::{Mistake, exception};

/// A path or URL of a call, without its secrets; the rest is enough to find the place again.
///
/// Every argument that names a place has this type: no message can repeat a secret that it never had. (A test of the
/// workspace sees to it.)
#[derive(Debug, Clone)]
pub(crate) struct Place(PathBuf);

impl Place {
    fn named(place: &Path) -> Self {
        Self(match Location::of(place) {
            Ok(location) => location.path().into(),
            // it is refused where it is used
            Err(_) => redact(&place.to_string_lossy()).into(),
        })
    }

    pub(crate) fn into_path(self) -> PathBuf {
        self.0
    }
}

/// The paths of several places.
pub(crate) fn paths(places: Vec<Place>) -> Vec<PathBuf> {
    places.into_iter().map(Place::into_path).collect()
}

impl std::ops::Deref for Place {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl<'py> FromPyObject<'_, 'py> for Place {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let path: PathBuf = given.extract()?;
        if let Some(scheme) = scheme_with_one_slash(&path) {
            return Err(exception(&anyhow::anyhow!(Mistake(format!(
                "expected {scheme}://… as text, found a path object: it keeps one slash only"
            )))));
        }
        Ok(Self::named(&path))
    }
}

/// The places of a call: one, or any iterable of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Places(pub(crate) Vec<PathBuf>);

impl<'py> FromPyObject<'_, 'py> for Places {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let is_text = given.is_instance_of::<PyString>() || given.is_instance_of::<PyBytes>();
        if is_text || given.hasattr("__fspath__")? {
            return Ok(Self(vec![given.extract::<Place>()?.into_path()]));
        }
        let Ok(places) = given.try_iter() else {
            return Err(PyTypeError::new_err(format!(
                "expected a path or an iterable of paths, found {}",
                given.get_type().name()?
            )));
        };
        let places = places.map(|place| Ok(place?.extract::<Place>()?.into_path()));
        Ok(Self(places.collect::<PyResult<_>>()?))
    }
}

/// The scheme of a URL that went through a path object, unless there is a folder of this name.
fn scheme_with_one_slash(path: &Path) -> Option<&str> {
    let (scheme, rest) = path.to_str()?.split_once(":/")?;
    let is_known = [
        "s3", "s3a", "gs", "az", "abfs", "abfss", "http", "https", "file",
    ]
    .contains(&scheme);
    let is_url = rest.starts_with('/');
    (is_known && !is_url && !Path::new(&format!("{scheme}:")).is_dir()).then_some(scheme)
}
