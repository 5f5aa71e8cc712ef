//! The table of releases in the book: a row for each figure, a column for each release.

use super::figure::{FIGURES, Measured, rounded};

const NOT_MEASURED: &str = "–";
const CORNER: &str = "figure";

/// The columns, oldest release first.
#[derive(Debug, Default, PartialEq)]
pub struct Table {
    releases: Vec<Release>,
}

#[derive(Debug, PartialEq)]
struct Release {
    name: String,
    /// Ratio of each figure, in the order of [`FIGURES`].
    ratios: Vec<Option<f64>>,
}

impl Table {
    /// Reads the first table of a page. A figure without a row was not measured yet.
    ///
    /// # Errors
    /// There is no such table, a row is of no known figure, or a cell is neither a number nor a dash.
    pub fn read(page: &str) -> Result<Self, String> {
        let is_row = |line: &&str| line.starts_with('|');
        let mut rows = (page.lines().skip_while(|line| !is_row(line)))
            .take_while(is_row)
            .map(cells);
        let heads = rows.next().unwrap_or_default();
        if heads.first() != Some(&CORNER) {
            return Err(format!(
                "expected a table that begins with {CORNER}, found {heads:?}"
            ));
        }
        let releases = heads[1..].iter().map(|name| Release {
            name: (*name).to_string(),
            ratios: vec![None; FIGURES.len()],
        });
        let mut table = Self {
            releases: releases.collect(),
        };
        for row in rows.skip(1) {
            let figure = FIGURES.iter().position(|figure| figure.heading == row[0]);
            let figure =
                figure.ok_or_else(|| format!("expected a known figure, found {}", row[0]))?;
            if row.len() != heads.len() {
                let (expected, found) = (heads.len(), row.len());
                return Err(format!(
                    "{}: expected {expected} cells, found {found}",
                    row[0]
                ));
            }
            for (release, cell) in table.releases.iter_mut().zip(&row[1..]) {
                release.ratios[figure] = match *cell {
                    NOT_MEASURED => None,
                    cell => Some(
                        cell.parse()
                            .map_err(|_| format!("{}: expected a number, found {cell}", row[0]))?,
                    ),
                };
            }
        }
        Ok(table)
    }

    /// Adds or replaces the column of a release. What was not measured keeps the figure that it had.
    pub fn record(&mut self, name: &str, measured: &Measured) {
        if !self.releases.iter().any(|release| release.name == name) {
            self.releases.push(Release {
                name: name.to_string(),
                ratios: vec![None; FIGURES.len()],
            });
        }
        for release in self.releases.iter_mut().filter(|known| known.name == name) {
            for (known, figure) in release.ratios.iter_mut().zip(&FIGURES) {
                *known = measured.get(figure.name).or(*known);
            }
        }
    }

    /// A line for each measured figure that is below `least_share` of the last release's.
    #[must_use]
    pub fn worse(&self, measured: &Measured, least_share: f64) -> Vec<String> {
        let Some(last) = self.releases.last() else {
            return Vec::new();
        };
        let pairs = FIGURES.iter().zip(&last.ratios);
        let worse = pairs.filter_map(|(figure, &before)| {
            let (before, now) = (before?, measured.get(figure.name)?);
            (now < before * least_share).then(|| {
                format!(
                    "{}: expected at least {least_share:.2} of the {} of {}, found {}",
                    figure.heading,
                    rounded(before),
                    last.name,
                    rounded(now)
                )
            })
        });
        worse.collect()
    }

    /// The page with this table in the place of its first one.
    #[must_use]
    pub fn written_into(&self, page: &str) -> String {
        let is_row = |line: &&str| line.starts_with('|');
        let before: Vec<&str> = page.lines().take_while(|line| !is_row(line)).collect();
        let after = page.lines().skip(before.len()).skip_while(is_row);
        let names = self.releases.iter().map(|release| release.name.clone());
        let mut lines: Vec<String> = before.iter().copied().map(String::from).collect();
        lines.push(row(CORNER, names));
        lines.push(format!("|---|{}", "---|".repeat(self.releases.len())));
        for (which, figure) in FIGURES.iter().enumerate() {
            let ratios = self.releases.iter().map(|release| release.ratios[which]);
            let cells = ratios.map(|ratio| ratio.map_or(NOT_MEASURED.into(), rounded));
            lines.push(row(figure.heading, cells));
        }
        lines.extend(after.map(String::from));
        lines.join("\n") + "\n"
    }
}

fn cells(line: &str) -> Vec<&str> {
    let inner = line.trim().trim_start_matches('|').trim_end_matches('|');
    inner.split('|').map(str::trim).collect()
}

fn row(head: &str, cells: impl Iterator<Item = String>) -> String {
    let cells: Vec<String> = cells.collect();
    format!("| {head} | {} |", cells.join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::measured;

    #[test]
    fn a_recorded_release_is_read_back() {
        let page = "# Page\n\n| figure |\n|---|\n\nafter\n";
        let mut table = Table::read(page).unwrap();
        table.record("0.1.0", &measured(FIGURES[0].name, 4.25));
        table.record("0.2.0", &measured(FIGURES[1].name, 1.5));
        let written = table.written_into(page);
        assert!(written.starts_with("# Page\n\n| figure | 0.1.0 | 0.2.0 |\n"));
        assert!(written.ends_with("\n\nafter\n"), "{written}");
        assert_eq!(Table::read(&written).unwrap(), table);
    }

    #[test]
    fn only_a_fall_below_the_share_is_worse() {
        let name = FIGURES[0].name;
        let mut table = Table::default();
        table.record("0.1.0", &measured(name, 6.0));
        assert!(table.worse(&measured(name, 4.1), 2.0 / 3.0).is_empty());
        assert_eq!(table.worse(&measured(name, 3.9), 2.0 / 3.0).len(), 1);
        // of what is not measured nothing is said
        assert!(table.worse(&Measured::default(), 2.0 / 3.0).is_empty());
    }

    #[test]
    fn the_page_of_the_book_is_readable() {
        let page = include_str!("../../../book/src/benchmarks.md");
        Table::read(page).unwrap();
    }

    #[test]
    fn a_cell_that_is_no_number_is_an_error() {
        let page = format!(
            "| figure | 0.1.0 |\n|---|---|\n| {} | fast |\n",
            FIGURES[0].heading
        );
        assert!(
            Table::read(&page)
                .unwrap_err()
                .contains("expected a number")
        );
    }
}
