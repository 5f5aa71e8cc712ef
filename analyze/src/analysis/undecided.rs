//! Reasons why an analysis decides nothing: the gates of all commands ask here and fail closed.

use tipwatch_language::{say, word};

use super::coverage::Coverage;

/// Default of `--min-valid`: the least share of a log's time that must be computable.
pub const DEFAULT_MIN_VALID: f64 = 0.5;

/// Reason why nothing may be concluded from the absence of events.
#[derive(Debug, Clone, PartialEq)]
pub enum Undecided {
    /// No row has wheel loads.
    NoComputableRow,
    /// Less of the log's time is computable than required.
    TooLittleTime {
        /// The computable share.
        coverage: Coverage,
        /// The required share, 0 to 1.
        min_valid: f64,
    },
    /// Between the rows of a sparse log a lift cannot be excluded.
    LiftNotExcluded {
        /// Time in which a lift is not excluded (s).
        not_excluded_s: f64,
        /// Time that the log covers (s).
        covered_s: f64,
    },
    /// Signals that the loads rest on contradict each other: what was found stands, and more may be hidden.
    Doubted {
        /// Time in which the signals contradict each other (s).
        doubted_s: f64,
        /// Time with known loads (s).
        computable_s: f64,
    },
    /// Measured forces determine the loads, and none of their samples was used.
    UnusedForces {
        /// Number of measured forces without a used sample.
        count: usize,
    },
    /// Inputs are grossly wrong, so that computed loads mean nothing: one sentence each.
    GrossInputs(Vec<String>),
}

impl Undecided {
    /// The reason, the gravest first; `None` if the analysis decides.
    #[must_use]
    pub fn of(coverage: &Coverage, gross_inputs: &[String], min_valid: f64) -> Option<Self> {
        if !gross_inputs.is_empty() {
            return Some(Self::GrossInputs(gross_inputs.to_vec()));
        }
        if coverage.computable_rows == 0 {
            return Some(Self::NoComputableRow);
        }
        let is_enough = coverage.valid_share.is_some_and(|share| share >= min_valid);
        if !is_enough {
            return Some(Self::TooLittleTime {
                coverage: *coverage,
                min_valid,
            });
        }
        if coverage.doubted_s > 0.0 {
            return Some(Self::Doubted {
                doubted_s: coverage.doubted_s,
                computable_s: coverage.computable_s,
            });
        }
        if coverage.unused_forces > 0 {
            return Some(Self::UnusedForces {
                count: coverage.unused_forces,
            });
        }
        Some(Self::LiftNotExcluded {
            not_excluded_s: coverage.lift_not_excluded_s()?,
            covered_s: coverage.covered_s,
        })
    }

    /// Whether the events that were found stand all the same: too little time hides events, and wrong
    /// inputs invent them.
    #[must_use]
    pub fn leaves_events(&self) -> bool {
        !matches!(self, Self::GrossInputs(_))
    }
}

impl std::fmt::Display for Undecided {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&match self {
            Self::NoComputableRow => word!("loads cannot be computed in any row").to_owned(),
            Self::TooLittleTime {
                coverage,
                min_valid,
            } => {
                let percent = 100.0 * min_valid;
                match coverage.valid_share {
                    Some(_) => say!(
                        "loads can be computed in {coverage} of the log, expected at least {percent:.0} %"
                    ),
                    None => word!("the log covers no time").to_owned(),
                }
            }
            Self::LiftNotExcluded {
                not_excluded_s,
                covered_s,
            } => say!(
                "between the rows of this sparse log a lift cannot be excluded for {not_excluded_s:.1} of \
                 {covered_s:.1} s"
            ),
            Self::Doubted {
                doubted_s,
                computable_s,
            } => say!(
                "signals contradict each other for {doubted_s:.1} of {computable_s:.1} s, and which one is wrong is unknown"
            ),
            Self::UnusedForces { count } => say!(
                "measured forces of cylinders or supports ({count}) are used in no row: their samples are farther apart than \
                 max_gap of [estimator] in the machine file. Record them more often, or state a larger max_gap"
            ),
            Self::GrossInputs(findings) => say!("inputs are wrong: {}", findings.join("; ")),
        })
    }
}
