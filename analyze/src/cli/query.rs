//! `tipwatch query`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::exit::{Exit, Terminal};
use crate::base::stdout::to_stdout;
use crate::screen::query;

#[derive(Debug, Args)]
pub(super) struct QueryArgs {
    /// The folder of `tipwatch screen`, or the same in a bucket.
    data_set: PathBuf,
    /// The query, over the tables `logs`, `events` and `comparisons`: "SELECT machine, min(worst_margin) FROM logs GROUP BY machine".
    sql: String,
    /// Print CSV.
    #[arg(long, conflicts_with_all = ["json", "parquet"])]
    csv: bool,
    /// Print JSON: a list of rows.
    #[arg(long, conflicts_with = "parquet")]
    json: bool,
    /// Write a Parquet file.
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
    /// Most rows of the table that is printed.
    #[arg(long, value_name = "N", default_value_t = 100, conflicts_with_all = ["csv", "json", "parquet"])]
    rows: usize,
}

pub(super) fn run(args: &QueryArgs, terminal: Terminal) -> Result<Exit> {
    let answer = query(&args.data_set, &args.sql)?;
    if let Some(file) = &args.parquet {
        answer.write_parquet(file)?;
        terminal.print(&format!("{} rows: {}", answer.rows(), file.display()));
    } else if args.csv {
        let lines: Vec<String> = answer.to_csv().collect();
        to_stdout(&format!("{}\n", lines.join("\n")))?;
    } else if args.json {
        let rows: Vec<_> = answer.to_json().collect();
        to_stdout(&format!("{}\n", serde_json::to_string_pretty(&rows)?))?;
    } else {
        to_stdout(&answer.to_text(args.rows))?;
    }
    Ok(Exit::DONE)
}
