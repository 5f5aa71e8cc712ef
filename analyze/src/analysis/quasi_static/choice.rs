//! Choice of static rows, which have no neighbours: by the data, by the machine file or by option.

use std::sync::Arc;

use anyhow::{Result, bail};
use tipwatch_language::{say, word};
use tipwatch_mechanics::Scope;
use tipwatch_mechanics::estimation::quasi_static::{Sparseness, UnobservedMotion, sparseness};
use tipwatch_mechanics::machine::{Note, QuasiStaticMode};

use super::super::notes::{NotedLog, Notes};
use super::static_rows::StaticRows;
use crate::base::options::{Estimator, ModelKind, Options, QuasiStaticOption};
use crate::base::table::Table;
use crate::load::{LoadedLog, shared_signals};

/// The static rows of a log.
pub(in crate::analysis) struct QuasiStatic {
    pub(in crate::analysis) rows: Arc<StaticRows>,
    /// Notes: why rows are static, the assumptions about the motion, and those that the log contradicts.
    pub(in crate::analysis) notes: Vec<String>,
}

impl Notes for QuasiStatic {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        self.notes.iter().cloned().map(Note::from).collect()
    }
}

/// Makes the rows of a log static if its data or the user ask for it.
///
/// # Errors
/// Static rows were asked for with an estimator or a model that has none, or samples cannot be read.
pub(in crate::analysis) fn choose(
    loaded: &mut LoadedLog,
    options: &Options,
) -> Result<Option<QuasiStatic>> {
    let stated = loaded.machine.quasi_static().mode;
    let mode = match options.quasi_static {
        Some(QuasiStaticOption::Auto) => QuasiStaticMode::Auto,
        Some(QuasiStaticOption::Always) => QuasiStaticMode::Always,
        Some(QuasiStaticOption::Never) => QuasiStaticMode::Never,
        None => stated,
    };
    let sensors = loaded.matched.sensors.clone();
    let found = sparseness(&loaded.machine, &sensors, &shared_signals(loaded));
    let sparse: Vec<&Sparseness> = found.iter().filter(|it| it.is_sparse()).collect();
    let is_chosen = match mode {
        QuasiStaticMode::Never => false,
        QuasiStaticMode::Always => true,
        QuasiStaticMode::Auto => !sparse.is_empty(),
    };
    if !is_chosen {
        return Ok(None);
    }
    let can = options.estimator == Estimator::Smoother && options.model == ModelKind::WholeBody;
    if !can && mode == QuasiStaticMode::Always {
        bail!(
            "quasi-static rows: expected --estimator smoother and --model whole-body, found {} and {}",
            options.estimator.name(),
            options.model.name()
        );
    }
    let max_gap_s = loaded.machine.estimator().max_gap;
    let why = match mode {
        QuasiStaticMode::Always => word!("as requested").to_string(),
        _ => {
            let names: Vec<String> = sparse
                .iter()
                .map(|it| {
                    let signal = loaded.signals.iter().find(|s| s.sensor == it.sensor);
                    say!(
                        "{:.0} % of the time of {} is in gaps longer than {max_gap_s} s (one sample in {:.2} s)",
                        100.0 * it.gap_share,
                        signal.map_or(word!("a signal"), |signal| signal.topic.as_str()),
                        it.median_s
                    )
                })
                .collect();
            say!("because {}", names.join(word!(" and ")))
        }
    };
    if !can {
        loaded.notes.push(say!(
            "This log is sparse, {why}. Rows in gaps are invalid: static rows need --estimator smoother and --model whole-body."
        ));
        return Ok(None);
    }
    loaded.machine.set_quasi_static(true);
    let motion = UnobservedMotion::new(&loaded.machine, &sensors, shared_signals(loaded))?;
    let spec = loaded.machine.quasi_static();
    let mut notes = vec![say!(
        "Rows without neighbours are static, {why}: they hold the last known samples, at rest, for at most {} s. Their \
         bands contain what motion could have done to the loads, with accelerations of the platform up to {} m/s², \
         angular velocities up to {} rad/s, angular accelerations up to {} rad/s², and joint accelerations up to {} \
         rad/s² or {} m/s² ([quasi_static] of the machine file). Payloads are assumed to change only as the machine file \
         states.",
        spec.hold,
        spec.platform_acceleration,
        spec.platform_rate,
        spec.platform_angular_acceleration,
        spec.joint_acceleration,
        spec.joint_acceleration_linear,
    )];
    notes.extend(motion.exceeded().iter().map(|it| {
        say!(
            "quasi_static.{}: expected at most {:.3}, found {:.3} in the samples; the larger one is used.",
            it.key, it.stated, it.observed
        )
    }));
    let joints = &loaded.machine.contact().actuated_joints;
    let has = |is_rod: bool| {
        let mut signals = loaded.matched.sensors.actuators.iter();
        signals.any(|signal| joints[signal.joint].linkage().is_some() == is_rod)
    };
    if has(true) {
        notes.push(
            word!("Static rows do not use measured cylinder forces: the load split follows the split rule there.").into(),
        );
    }
    if has(false) {
        notes.push(
            word!("Static rows use the measured loads of supports only at the stamps of their samples.").into(),
        );
    }
    Ok(Some(QuasiStatic {
        rows: Arc::new(StaticRows::new(motion)),
        notes,
    }))
}

impl QuasiStatic {
    /// Adds the columns of static rows.
    pub(in crate::analysis) fn scope(found: Option<&Self>, scope: Scope) -> Scope {
        Scope {
            between_rows: found.is_some(),
            ..scope
        }
    }

    /// Makes a table widen its rows.
    pub(in crate::analysis) fn apply(&self, table: &mut Table) {
        table.widen_by(Arc::<StaticRows>::clone(&self.rows));
    }
}
