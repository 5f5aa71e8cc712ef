//! Exit codes, usage errors, and messages on standard error.

use std::process::ExitCode;

use tipwatch_language::{say, word};

use crate::analysis::{Analysis, Coverage, Undecided};
use crate::base::error_text::error_text;
use crate::base::stderr::to_stderr;

/// An error in a file, the machine description or the system.
const FAILED: u8 = 1;
/// Done, but bytes or messages of a log were lost.
const LOST: u8 = 3;
/// A log broke a rule of the policy or of `--fail-on`.
const BROKEN: u8 = 4;
/// Nothing is decided: no row, or too little time, can be computed.
const UNDECIDED: u8 = 8;

/// A repeated analysis did not give the same bits.
const DIFFERS: u8 = 6;
/// An analysis cannot be repeated as it was recorded.
const NOT_VERIFIABLE: u8 = 7;

/// Failures at the end of a command. The codes of [`FAILED`], [`BROKEN`] and [`UNDECIDED`] add up, so that one number tells each
/// of them from the others; [`LOST`] is returned only without them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Exit {
    pub(super) failed: bool,
    pub(super) broken: bool,
    pub(super) undecided: bool,
    pub(super) lost: bool,
    /// Result of `verify` for an analysis that is not verified; its code stands alone.
    pub(super) unverified: Option<Unverified>,
}

/// Reason why an analysis is not verified.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unverified {
    /// An output was altered, or repeating the analysis did not give the same bits.
    Differs,
    /// The analysis cannot be repeated as it was recorded.
    NotRepeatable,
}

impl Exit {
    /// Nothing is wrong.
    pub(super) const DONE: Self = Self {
        failed: false,
        broken: false,
        undecided: false,
        lost: false,
        unverified: None,
    };
    pub(super) const FAILED: Self = Self {
        failed: true,
        ..Self::DONE
    };
    pub(super) const LOST: Self = Self {
        lost: true,
        ..Self::DONE
    };

    /// Combines the failures of two results.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            failed: self.failed || other.failed,
            broken: self.broken || other.broken,
            undecided: self.undecided || other.undecided,
            lost: self.lost || other.lost,
            unverified: self.unverified.or(other.unverified),
        }
    }

    fn code(self) -> u8 {
        match self.unverified {
            Some(Unverified::Differs) => return DIFFERS,
            Some(Unverified::NotRepeatable) => return NOT_VERIFIABLE,
            None => {}
        }
        let parts = [
            (self.failed, FAILED),
            (self.broken, BROKEN),
            (self.undecided, UNDECIDED),
        ];
        let sum = parts
            .iter()
            .filter(|(is_so, _)| *is_so)
            .map(|(_, code)| code)
            .sum();
        match (sum, self.lost) {
            (0, true) => LOST,
            _ => sum,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

/// Contradictory arguments: exit code 2.
#[derive(Debug)]
pub(super) struct Usage(pub(super) &'static str);

impl std::fmt::Display for Usage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.0)
    }
}

impl std::error::Error for Usage {}

/// Messages on standard error, as many as the user asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terminal {
    pub(super) quiet: bool,
    pub(super) verbose: bool,
}

impl Terminal {
    pub(super) fn print(self, text: &str) {
        if !self.quiet {
            to_stderr(text);
        }
    }

    pub(super) fn error(self, error: &anyhow::Error) {
        to_stderr(&format!("error: {}", error_text(error)));
    }

    /// Prints the text that explains the exit code, even when quiet.
    pub(super) fn verdict(self, text: &str) {
        to_stderr(text);
    }
}

/// End of an analysis without a policy: decided or not, with losses or not.
#[derive(Debug)]
pub(super) struct Ending {
    coverage: Coverage,
    undecided: Option<Undecided>,
    lost: bool,
}

impl Ending {
    /// The end of an analysis of which this share of the time must be computable.
    pub(super) fn of(analysis: &Analysis, min_valid: f64) -> Self {
        Self {
            coverage: analysis.coverage,
            undecided: analysis.undecided(min_valid),
            lost: !analysis.losses.is_empty(),
        }
    }

    /// Prints how much of the log's time is computable, and why nothing is decided.
    pub(super) fn tell(self, terminal: Terminal) -> Exit {
        self.tell_of(word!("of the log"), terminal)
    }

    /// Prints how much of the time is computable, and why nothing is decided; `of` names the time.
    pub(super) fn tell_of(self, of: &str, terminal: Terminal) -> Exit {
        terminal.print(&say!("computable: {} {of}", self.coverage));
        if let Some(reason) = &self.undecided {
            terminal.verdict(&say!("not decided: {reason}"));
        }
        Exit {
            undecided: self.undecided.is_some(),
            lost: self.lost,
            ..Exit::DONE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_combination_has_a_code_of_its_own() {
        let mut codes = Vec::new();
        for bits in 0..8 {
            let exit = Exit {
                failed: bits & 1 != 0,
                broken: bits & 2 != 0,
                undecided: bits & 4 != 0,
                lost: true,
                unverified: None,
            };
            codes.push(exit.code());
        }
        assert_eq!(codes, [3, 1, 4, 5, 8, 9, 12, 13]);
        assert_eq!(Exit::DONE.code(), 0);
    }
}
