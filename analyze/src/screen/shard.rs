//! One part of the logs, for one of several processes.

use std::path::PathBuf;

use anyhow::{Result, bail};

/// One part of the logs, for one of several processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: usize,
    /// Number of parts.
    pub count: usize,
}

/// Variables in which an engine gives a task its index, counted from 0, and the number of tasks.
const ENGINES: [(&str, Option<&str>); 5] = [
    // Kubernetes, indexed job
    ("JOB_COMPLETION_INDEX", None),
    // AWS Batch, array job
    (
        "AWS_BATCH_JOB_ARRAY_INDEX",
        Some("AWS_BATCH_JOB_ARRAY_SIZE"),
    ),
    // Slurm, job array; the count is that of the tasks submitted, which may be a second try of a few
    ("SLURM_ARRAY_TASK_ID", None),
    // Google Batch
    ("BATCH_TASK_INDEX", Some("BATCH_TASK_COUNT")),
    // Google Cloud Run
    ("CLOUD_RUN_TASK_INDEX", Some("CLOUD_RUN_TASK_COUNT")),
];

impl Shard {
    /// Reads `I/N`, `auto/N` or `auto`. `auto` is the index that the engine of this task gives in the
    /// environment `variable`.
    ///
    /// # Errors
    /// The text has another form, I is not from 1 to N, or the environment does not tell which part.
    pub fn read(text: &str, variable: impl Fn(&str) -> Option<String>) -> Result<Self> {
        let (index, count) = match text.split_once('/') {
            Some((index, count)) => (index, Some(number(text, count)?)),
            None => (text, None),
        };
        let shard = match (index, count) {
            ("auto", count) => of_engine(count, variable)?,
            (index, Some(count)) => Self {
                index: number(text, index)?,
                count,
            },
            (_, None) => return Err(expected(text)),
        };
        match (1..=shard.count).contains(&shard.index) {
            true => Ok(shard),
            false => Err(expected(text).context(format!(
                "part {} of {} does not exist",
                shard.index, shard.count
            ))),
        }
    }

    /// Every n-th log: all processes must see the same list.
    pub(super) fn of(self, logs: Vec<PathBuf>) -> Vec<PathBuf> {
        let own = logs.into_iter().skip(self.index - 1);
        own.step_by(self.count).collect()
    }
}

fn of_engine(count: Option<usize>, variable: impl Fn(&str) -> Option<String>) -> Result<Shard> {
    let names = || {
        let names: Vec<&str> = ENGINES.iter().map(|(name, _)| *name).collect();
        names.join(", ")
    };
    let mut found = ENGINES
        .iter()
        .filter_map(|(index, count)| Some((*index, variable(index)?, *count)));
    let Some((name, value, count_name)) = found.next() else {
        bail!(
            "--shard auto: expected one of the variables {}, found none",
            names()
        );
    };
    if let Some((other, ..)) = found.next() {
        bail!(
            "--shard auto: expected one of the variables {}, found {name} and {other}; name the part with I/N",
            names()
        );
    }
    let index: usize = match value.trim().parse() {
        Ok(index) => index,
        Err(_) => bail!("{name}: expected an index, found \"{value}\""),
    };
    let told = count_name.and_then(|name| Some((name, variable(name)?)));
    let told = match told {
        None => None,
        Some((name, value)) => match value.trim().parse::<usize>() {
            Ok(count) => Some((name, count)),
            Err(_) => bail!("{name}: expected a number of tasks, found \"{value}\""),
        },
    };
    let count = match (count, told) {
        (Some(count), Some((name, told))) if count != told => {
            bail!("--shard auto/{count}: expected as many parts as tasks, found {told} in {name}")
        }
        (Some(count), _) | (None, Some((_, count))) => count,
        (None, None) => {
            bail!("--shard auto: {name} comes without the number of tasks; write auto/N")
        }
    };
    let Some(from_one) = index.checked_add(1).filter(|&index| index <= count) else {
        bail!(
            "{name}: expected an index from 0 to {}, found {index}",
            count.saturating_sub(1)
        );
    };
    Ok(Shard {
        index: from_one,
        count,
    })
}

fn number(text: &str, part: &str) -> Result<usize> {
    part.parse().map_err(|_| expected(text))
}

fn expected(text: &str) -> anyhow::Error {
    anyhow::anyhow!("expected I/N, such as 2/8, with I from 1 to N, or auto/N, found \"{text}\"")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    fn read(text: &str, variables: &[(&str, &str)]) -> Result<(usize, usize), String> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.to_string())
        };
        let shard = Shard::read(text, variable).map_err(|error| format!("{error:#}"))?;
        Ok((shard.index, shard.count))
    }

    #[test]
    fn the_part_is_named_or_comes_from_the_engine() {
        assert_eq!(read("2/8", &[]), Ok((2, 8)));
        assert_eq!(read("auto/8", &[("JOB_COMPLETION_INDEX", "0")]), Ok((1, 8)));
        assert_eq!(read("auto/8", &[("SLURM_ARRAY_TASK_ID", "7")]), Ok((8, 8)));
        let batch = [
            ("AWS_BATCH_JOB_ARRAY_INDEX", "3"),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "5"),
        ];
        assert_eq!(read("auto", &batch), Ok((4, 5)));
        assert_eq!(read("auto/5", &batch), Ok((4, 5)));
        for (text, variables, part) in [
            ("0/3", &[][..], "does not exist"),
            ("4/3", &[], "does not exist"),
            ("3", &[], "expected I/N"),
            ("1/0", &[], "does not exist"),
            ("auto/4", &[], "found none"),
            ("auto", &[("JOB_COMPLETION_INDEX", "1")], "write auto/N"),
            ("auto/6", &batch, "found 5 in AWS_BATCH_JOB_ARRAY_SIZE"),
            ("auto/4", &[("JOB_COMPLETION_INDEX", "4")], "from 0 to 3"),
            (
                "auto/4",
                &[("JOB_COMPLETION_INDEX", "x")],
                "expected an index",
            ),
            (
                "auto/4",
                &[("JOB_COMPLETION_INDEX", "1"), ("SLURM_ARRAY_TASK_ID", "2")],
                "JOB_COMPLETION_INDEX and SLURM_ARRAY_TASK_ID",
            ),
        ] {
            let error = read(text, variables).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn parts_hold_every_log_once() {
        let logs: Vec<PathBuf> = (0..23).map(|i| PathBuf::from(format!("{i:02}"))).collect();
        let mut all: Vec<PathBuf> = (1..=5)
            .flat_map(|index| Shard { index, count: 5 }.of(logs.clone()))
            .collect();
        all.sort();
        assert_eq!(all, logs);
    }
}
