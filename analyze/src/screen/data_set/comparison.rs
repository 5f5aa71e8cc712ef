//! A row of `comparisons`: a machine compared with its own history or with its type.

use crate::base::frame::{Day, record};

record! {
    /// A row of `comparisons`.
    pub(in crate::screen) struct FleetComparison {
        /// name of the machine
        machine: String,
        /// what it is compared with: `history`, its days since they changed most with those before, or `type`, its logs with
        /// those of the other machines of its type
        compared_with: &'static str,
        /// the type, if it is compared with that
        machine_type: Option<String>,
        /// `worst_margin`, `exposed_share` (of the computable time, below the notice level) or `lifted_share` (of the
        /// computable time, with a wheel off the ground)
        quantity: &'static str,
        /// `outlier`, `inconspicuous`: it does not stand out, or not surely enough, or `not_comparable`
        verdict: &'static str,
        /// whether an outlier is worse than usual; null for all others
        is_worse: Option<bool>,
        /// why nothing can be said
        reason: Option<String>,
        /// first day (UTC) after the change, for a comparison with the history
        since: Option<Day>,
        /// median of the machine, or of its days since then
        value: Option<f64> ["-"],
        /// median of the other machines, or of the days before
        usual: Option<f64> ["-"],
        /// confidence that the difference is no chance: 1 minus the share of false ones to expect among all machines that are
        /// at least as conspicuous
        confidence: Option<f64>,
        /// number of its logs, or of its days since the change
        count: u64 ["logs or days"],
        /// number of other machines, or of earlier days
        usual_count: u64 ["machines or days"],
    }
}
