//! Access to places: credentials, time limits, attempts.

use std::time::Duration;

/// Settings for access to the places of a bucket or host.
///
/// The usual variables of the environment are `AWS_…`, `GOOGLE_…`, `AZURE_…` as the crate `object_store` knows them.
#[derive(Debug, Clone)]
pub struct Access {
    /// Variables that take precedence over the environment, such as ("AWS_ENDPOINT_URL", "http://localhost:9000").
    pub variables: Vec<(String, String)>,
    /// Longest time for one request, with its answer. By default `TIPWATCH_STORAGE_TIMEOUT` seconds, else 60 s.
    pub timeout: Duration,
    /// Attempts for each request. By default `TIPWATCH_STORAGE_ATTEMPTS`, else 6.
    pub attempts: u32,
    /// Wait before the second attempt; it doubles with each further one.
    pub first_wait: Duration,
    /// Requests at a time for one object. By default `TIPWATCH_STORAGE_PARALLEL`, else 8.
    pub parallel: usize,
}

const LONGEST_TIMEOUT_S: f64 = 3600.0;
const MOST_ATTEMPTS: u32 = 20;
const MOST_PARALLEL: usize = 64;

impl Default for Access {
    fn default() -> Self {
        let timeout_s = number("TIPWATCH_STORAGE_TIMEOUT", 60.0).clamp(0.05, LONGEST_TIMEOUT_S);
        let attempts = number("TIPWATCH_STORAGE_ATTEMPTS", 6.0);
        let parallel = number("TIPWATCH_STORAGE_PARALLEL", 8.0);
        Self {
            variables: Vec::new(),
            timeout: Duration::from_secs_f64(timeout_s),
            // casts saturate
            attempts: (attempts as u32).clamp(1, MOST_ATTEMPTS),
            first_wait: Duration::from_millis(100),
            parallel: (parallel as usize).clamp(1, MOST_PARALLEL),
        }
    }
}

/// A number of the environment; the default where it is absent or no number.
fn number(name: &str, default: f64) -> f64 {
    let value = std::env::var(name)
        .ok()
        .and_then(|text| text.trim().parse().ok());
    value
        .filter(|number: &f64| number.is_finite())
        .unwrap_or(default)
}

impl Access {
    /// Returns all variables whose names begin with `prefix`, those of this object last.
    pub(crate) fn variables_of(&self, prefix: &str) -> Vec<(String, String)> {
        let environment = std::env::vars_os().filter_map(|(name, value)| {
            Some((name.into_string().ok()?, value.into_string().ok()?))
        });
        environment
            .chain(self.variables.iter().cloned())
            .filter(|(name, _)| name.starts_with(prefix))
            .collect()
    }
}
