//! Tables: widths of columns, rows that stay whole, and a head on every page.

use super::blocks::Table;
use super::flow::{Flow, HEIGHT, LEADING};

const LARGEST: f32 = 8.0;
const SMALLEST: f32 = 5.5;
/// Room on either side of a cell (points).
const PADDING: f32 = 2.5;

pub(super) fn add(flow: &mut Flow<'_>, table: &Table) {
    let table = without_empty_columns(table);
    let columns = columns(&table);
    if columns == 0 {
        return;
    }
    let (size, widths) = widths(flow, &table, columns);
    let head = (!table.head.is_empty()).then_some(&table.head);
    if let Some(head) = head {
        // a head never stands alone at the foot of a page
        flow.room(64.0 * flow.scale);
        row(flow, head, &widths, size, true, true);
    }
    for cells in &table.rows {
        let height = height_of(flow, cells, &widths, size);
        let before = flow.y;
        flow.room(height.min(HEIGHT / 2.0));
        if flow.y < before
            && let Some(head) = head
        {
            row(flow, head, &widths, size, true, true);
        }
        row(flow, cells, &widths, size, false, table.names_rows);
    }
    flow.y += 5.0 * flow.scale;
}

fn columns(table: &Table) -> usize {
    let lengths = table.rows.iter().map(Vec::len);
    lengths.chain([table.head.len()]).max().unwrap_or(0)
}

/// Bars are drawn in columns that have no text.
fn without_empty_columns(table: &Table) -> Table {
    let has_text = |column: usize| {
        let mut rows = table.rows.iter().chain([&table.head]);
        rows.any(|row| row.get(column).is_some_and(|cell| !cell.is_empty()))
    };
    let kept: Vec<usize> = (0..columns(table))
        .filter(|&column| has_text(column))
        .collect();
    let of = |row: &Vec<String>| -> Vec<String> {
        let cells = kept.iter().map(|&column| row.get(column).cloned());
        cells.map(Option::unwrap_or_default).collect()
    };
    Table {
        head: if table.head.is_empty() {
            Vec::new()
        } else {
            of(&table.head)
        },
        rows: table.rows.iter().map(of).collect(),
        names_rows: table.names_rows,
    }
}

/// The largest letters at which no word is broken, and the widths of the columns. Words that are too long
/// even for the smallest letters, such as hashes, are broken.
fn widths(flow: &Flow<'_>, table: &Table, columns: usize) -> (f32, Vec<f32>) {
    let room = flow.width;
    let padding = PADDING * flow.scale;
    let mut size = LARGEST * flow.scale;
    loop {
        let of = |measure: &dyn Fn(&str) -> f32| -> Vec<f32> {
            let widest = |column: usize| {
                let rows = table.rows.iter().chain([&table.head]);
                let cells = rows.filter_map(|row| row.get(column));
                cells.map(|cell| measure(cell)).fold(0.0, f32::max)
            };
            (0..columns)
                .map(|column| widest(column) + 2.0 * padding)
                .collect()
        };
        let whole = of(&|cell| flow.letters.width(cell, size));
        let least = of(&|cell| flow.letters.longest_word(cell, size).min(room / 3.0));
        let (sum_whole, sum_least) = (whole.iter().sum::<f32>(), least.iter().sum::<f32>());
        if sum_whole <= room {
            let share = (room - sum_whole) / columns as f32;
            return (size, whole.iter().map(|width| width + share).collect());
        }
        if sum_least <= room {
            let free = (room - sum_least) / (sum_whole - sum_least);
            let width = |(least, whole): (&f32, &f32)| least + free * (whole - least);
            return (size, least.iter().zip(&whole).map(width).collect());
        }
        if size <= SMALLEST * flow.scale {
            let share = room / sum_least;
            return (size, least.iter().map(|width| width * share).collect());
        }
        size -= 0.5;
    }
}

fn lines(flow: &Flow<'_>, cells: &[String], widths: &[f32], size: f32) -> Vec<Vec<String>> {
    let cells = cells.iter().zip(widths);
    cells
        .map(|(cell, width)| {
            flow.letters
                .lines(cell, size, width - 2.0 * PADDING * flow.scale)
        })
        .collect()
}

fn height_of(flow: &Flow<'_>, cells: &[String], widths: &[f32], size: f32) -> f32 {
    let lines = lines(flow, cells, widths, size);
    let most = lines.iter().map(Vec::len).max().unwrap_or(1);
    most as f32 * size * LEADING + 2.0 * PADDING * flow.scale
}

fn row(flow: &mut Flow<'_>, cells: &[String], widths: &[f32], size: f32, head: bool, named: bool) {
    let all = lines(flow, cells, widths, size);
    let most = all.iter().map(Vec::len).max().unwrap_or(1);
    let padding = PADDING * flow.scale;
    let height = most as f32 * size * LEADING + 2.0 * padding;
    if head {
        flow.rectangle([0.0, flow.y], [flow.width, height], 238);
    }
    // a row that is higher than a page continues on the next one
    let per_line = size * LEADING;
    let mut y = flow.y + padding;
    for line in 0..most {
        if line > 0 && y + per_line > Flow::end() {
            flow.y = y;
            flow.room(per_line);
            y = flow.y + padding;
        }
        let mut x = 0.0;
        for (column, (cell, width)) in all.iter().zip(widths).enumerate() {
            if let Some(text) = cell.get(line) {
                let bold = head || (named && column == 0);
                flow.text([x + padding, y + size], size, bold, text);
            }
            x += width;
        }
        y += per_line;
    }
    flow.y = y + padding;
    flow.rectangle([0.0, flow.y - 0.3], [flow.width, 0.3], 190);
}
