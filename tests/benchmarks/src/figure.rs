//! The ratios of speed that are compared from release to release.

use std::fmt::Write;

/// A ratio; larger is better.
pub struct Figure {
    /// Name that the benchmark prints.
    pub name: &'static str,
    /// Name of the figure in the table.
    pub heading: &'static str,
    /// Software that must be on the computer beside the repository; `None` if none.
    pub needs: Option<&'static str>,
}

/// All figures, in the order of the table's rows.
pub const FIGURES: [Figure; 9] = [
    Figure {
        name: "sensors-lz4-vs-stream",
        heading: "sensors in blocks, lz4, against the stream of `mcap`",
        needs: None,
    },
    Figure {
        name: "sensors-zstd-vs-stream",
        heading: "sensors in blocks, zstd, against the stream of `mcap`",
        needs: None,
    },
    Figure {
        name: "sensors-lz4-vs-decompressor",
        heading: "sensors in blocks, lz4, against the bare decompressor",
        needs: None,
    },
    Figure {
        name: "loads-vs-everything",
        heading: "equations: time of the loads alone, of that of all results",
        needs: None,
    },
    Figure {
        name: "loads-vs-rnea",
        heading: "equations: loads, against Pinocchio's `rnea`",
        needs: Some("TIPWATCH_PINOCCHIO"),
    },
    Figure {
        name: "whole-log-samples-vs-stream",
        heading: "a long log, `samples.parquet`, against the stream of `mcap`",
        needs: Some("instructions of the processor for SHA-256"),
    },
    Figure {
        name: "whole-log-all-vs-stream",
        heading: "a long log, all files, against the stream of `mcap`",
        needs: Some("instructions of the processor for SHA-256"),
    },
    Figure {
        name: "samples-vs-python",
        heading: "a short log, `samples.parquet`, against the Python peer",
        needs: Some("a Python with the peer"),
    },
    Figure {
        name: "all-files-vs-python",
        heading: "a short log, all files, against the Python peer",
        needs: Some("a Python with the peer"),
    },
];

/// Figures that the benchmarks printed, by name.
#[derive(Debug, Default)]
pub struct Measured(Vec<(String, f64)>);

impl Measured {
    /// Takes a line of a benchmark's output; other lines than `figure NAME RATIO` are passed over.
    ///
    /// # Errors
    /// The ratio is not a finite number.
    pub fn take(&mut self, line: &str) -> Result<(), String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let ["figure", name, ratio] = words[..] else {
            return Ok(());
        };
        let number = ratio.parse().ok().filter(|ratio: &f64| ratio.is_finite());
        let number =
            number.ok_or_else(|| format!("{name}: expected a finite ratio, found {ratio}"))?;
        self.0.push((name.to_string(), number));
        Ok(())
    }

    /// Keeps the larger ratio of each figure.
    pub fn keep_larger(&mut self, other: &Self) {
        for (name, ratio) in &other.0 {
            match self.0.iter_mut().find(|(known, _)| known == name) {
                Some((_, best)) => *best = best.max(*ratio),
                None => self.0.push((name.clone(), *ratio)),
            }
        }
    }

    /// The ratio of this figure; `None` if it was not measured.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        let found = self.0.iter().find(|(known, _)| known == name);
        found.map(|(_, ratio)| *ratio)
    }

    /// Returns one line for each figure; those that could not be measured with the reason.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        for figure in &FIGURES {
            let value = match (self.get(figure.name), figure.needs) {
                (Some(ratio), _) => rounded(ratio),
                (None, needs) => format!("left out: needs {}", needs.unwrap_or("nothing")),
            };
            writeln!(text, "{:60} {value}", figure.heading).expect("memory");
        }
        text
    }
}

/// Three digits.
pub(crate) fn rounded(ratio: f64) -> String {
    let digits = 2 - ratio.abs().log10().floor() as i32;
    format!("{ratio:.*}", digits.clamp(0, 6) as usize)
}

/// One figure, for tests.
#[cfg(test)]
pub(crate) fn measured(name: &str, ratio: f64) -> Measured {
    Measured(vec![(name.to_string(), ratio)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_that_is_no_number_is_an_error() {
        let mut measured = Measured::default();
        measured.take("figure a 2.5").unwrap();
        measured.take("a figure of the report").unwrap();
        assert_eq!(measured.get("a"), Some(2.5));
        for ratio in ["NaN", "inf", "fast"] {
            let error = measured.take(&format!("figure b {ratio}")).unwrap_err();
            assert_eq!(error, format!("b: expected a finite ratio, found {ratio}"));
        }
    }

    #[test]
    fn the_larger_ratio_is_kept() {
        let mut best = measured("a", 2.5);
        best.keep_larger(&measured("a", 2.0));
        best.keep_larger(&measured("b", 1.0));
        assert_eq!([best.get("a"), best.get("b")], [Some(2.5), Some(1.0)]);
    }
}
