//! Errors of queries: why one has no answer, and what was expected.

use std::collections::BTreeSet;

use polars::prelude::PolarsError;

use super::TABLES;

/// Error: a query has no answer, because it is not valid or names what the tables do not have.
#[derive(Debug)]
pub struct NotAnswered(String);

impl std::fmt::Display for NotAnswered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NotAnswered {}

/// First words that a statement may have: a data set is only read.
const READING: [&str; 6] = ["SELECT", "WITH", "FROM", "VALUES", "SHOW", "EXPLAIN"];

impl NotAnswered {
    /// The first word of a query.
    ///
    /// # Errors
    /// The query is empty, or would do something else than read.
    pub(super) fn unless_reading(sql: &str) -> Result<&str, Self> {
        let word = first_word(sql);
        if READING.iter().any(|known| known.eq_ignore_ascii_case(word)) {
            return Ok(word);
        }
        let found = match word {
            "" => "none".into(),
            word => format!("\"{word}\""),
        };
        Err(Self(format!(
            "not a valid query: {sql}: a data set is read with SELECT: expected \"SELECT path FROM logs\" or the like, \
             found {found}"
        )))
    }

    /// A query that cannot be parsed.
    pub(super) fn not_parsed(sql: &str, error: &PolarsError) -> Self {
        Self(format!("not a valid query: {sql}: {}", reason(error)))
    }

    /// A query that says nothing of what is wanted.
    pub(super) fn without_columns(sql: &str) -> Self {
        Self(format!(
            "not a valid query: {sql}: expected a column or * after SELECT, found none"
        ))
    }

    /// A query over the tables `named` that has no answer.
    pub(super) fn of(sql: &str, error: &PolarsError, named: &BTreeSet<String>) -> Self {
        Self(text(sql, error, named))
    }
}

/// Describes why a query over the tables `named` has no answer.
pub(super) fn text(sql: &str, error: &PolarsError, named: &BTreeSet<String>) -> String {
    let reason = reason(error);
    let lacks_a_column = ["unable to find column", "no column named"];
    let lacks_a_column = lacks_a_column.iter().any(|text| reason.starts_with(text));
    let tables = TABLES.iter().filter(|(name, _)| named.contains(*name));
    let known = tables.map(|(name, columns)| {
        let columns: Vec<&str> = columns.iter().map(|column| column.name).collect();
        format!("{name} has {}", columns.join(", "))
    });
    let expected = match lacks_a_column {
        true => known.collect::<Vec<_>>().join("; "),
        false => {
            "the tables are logs, events and comparisons; the reference page \"Fleet data set\" has their columns"
                .into()
        }
    };
    format!("not answered: {sql}: {reason} ({expected})")
}

/// The sentence of an error, without what only the authors of its library can read.
fn reason(error: &PolarsError) -> String {
    let text = error.to_string();
    let is_twice = text.starts_with("duplicate: ")
        || text.starts_with("the name '") && text.contains("is duplicate");
    if is_twice {
        let name = text.split('\'').nth(1).unwrap_or_default();
        return format!(
            "expected a name of its own for each column, found \"{name}\" twice: AS gives another"
        );
    }
    let (first, more) = text.split_once('\n').unwrap_or((&text, ""));
    let first = first.split("; valid columns:").next().unwrap_or(first);
    let hint = more.lines().find(|line| line.starts_with("Did you mean"));
    let first = first
        .trim_start_matches("not found: ")
        .trim_end_matches(':');
    match hint {
        Some(hint) => format!("{first}. {hint}"),
        None => first.to_owned(),
    }
}

/// The first word of a statement, behind comments and brackets.
fn first_word(sql: &str) -> &str {
    let mut rest = sql;
    loop {
        rest = rest.trim_start_matches(|c: char| c.is_whitespace() || c == '(');
        let behind = match rest {
            line if line.starts_with("--") => line.split_once('\n'),
            block if block.starts_with("/*") => block.split_once("*/"),
            _ => {
                let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
                return &rest[..end.unwrap_or(rest.len())];
            }
        };
        match behind {
            Some((_, behind)) => rest = behind,
            None => return "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_statements_that_read_are_answered() {
        for sql in [
            "SELECT path FROM logs",
            " -- all\n/* of them */ (select path FROM logs)",
            "WITH best AS (SELECT path FROM logs) SELECT * FROM best",
            "FROM logs",
        ] {
            assert!(NotAnswered::unless_reading(sql).is_ok(), "{sql}");
        }
        for sql in [
            "",
            "--",
            "/*",
            "(((",
            "é",
            "INSERT INTO logs VALUES (1)",
            "delete FROM logs",
            "DROP TABLE logs",
            "UPDATE logs SET path = 'x'",
            "SELECTED",
            "\"SELECT\"",
        ] {
            assert!(NotAnswered::unless_reading(sql).is_err(), "{sql}");
        }
    }
}
