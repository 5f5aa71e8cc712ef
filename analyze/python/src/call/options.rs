//! Options of analyses, by the names that they have on the command line.

use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use tipwatch_analyze::base::options::{Estimator, ModelKind, Options};

use super::error::Mistake;

/// The options of an analysis.
///
/// # Errors
/// A name is unknown, or a number is impossible.
pub(crate) fn options(
    rate_hz: Option<f64>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    estimator: Option<&str>,
    model: Option<&str>,
) -> Result<Options> {
    if let Some(rate) = rate_hz
        && !(rate.is_finite() && rate > 0.0)
    {
        bail!(Mistake(format!(
            "expected a positive rate (Hz), found {rate}"
        )));
    }
    for (name, time) in [("start", from_s), ("end", to_s)] {
        if let Some(time) = time
            && !time.is_finite()
        {
            bail!(Mistake(format!(
                "expected a finite {name} (s), found {time}"
            )));
        }
    }
    Ok(Options {
        estimator: value("estimator", estimator, Estimator::Smoother)?,
        model: value("model", model, ModelKind::WholeBody)?,
        rate_hz,
        from_s,
        to_s,
        ..Options::default()
    })
}

/// The value with this name.
///
/// # Errors
/// There is none.
pub(crate) fn value<T: ValueEnum>(name: &str, given: Option<&str>, default: T) -> Result<T> {
    let Some(given) = given else {
        return Ok(default);
    };
    T::from_str(given, false).map_err(|_| {
        let values = T::value_variants().iter();
        let names =
            values.filter_map(|value| Some(value.to_possible_value()?.get_name().to_string()));
        let names: Vec<String> = names.collect();
        anyhow!(Mistake(format!(
            "expected {name} {}, found {given:?}",
            names.join(" or ")
        )))
    })
}
