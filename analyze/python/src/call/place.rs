//! Places that callers name: paths and URLs.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use tipwatch_storage::{Location, redact};

use super::error::exception;

/// A path or URL of a call, without what is secret in it; the place is found again by what remains.
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
            return Err(exception(&anyhow::anyhow!(
                "expected {scheme}://… as text, found a path object: it keeps one slash only"
            )));
        }
        Ok(Self::named(&path))
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
