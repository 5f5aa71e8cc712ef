//! Names of columns as fields of messages.

use std::fmt::Write as _;

use tipwatch_language::say;

/// The topic of all rows.
pub(super) const TOPIC: &str = "table";
pub(super) const TYPE: &str = "tipwatch_table/msg/Row";

/// The columns other than the time, as fields.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) definition: String,
    /// Names of the columns in the table.
    pub(super) names: Vec<String>,
    /// Notes on columns that would have had the same field.
    pub(super) notes: Vec<String>,
}

impl Columns {
    /// Makes field names of column names: letters, digits and underscores; `Boom angle [deg]` becomes
    /// `Boom_angle_deg`. `units` are those of a line below the names.
    pub(super) fn new(names: Vec<String>, units: &[String]) -> Self {
        let mut fields: Vec<String> = Vec::with_capacity(names.len());
        let mut definition = String::new();
        let mut notes = Vec::new();
        for (at, name) in names.iter().enumerate() {
            let plain = field_name(name);
            // a column keeps its exact name, wherever it stands
            let is_taken =
                |field: &String| fields.contains(field) || field != name && names.contains(field);
            let field = unused(&plain, &is_taken);
            if field != plain {
                notes.push(say!(
                    "column {name:?} is read as field {field}: {plain} is another column"
                ));
            }
            let unit = units.get(at).map_or("", String::as_str);
            let described = format!("{name} {unit}");
            // writing to a string cannot fail
            let _ = writeln!(
                definition,
                "float64 {field} # {}",
                described.trim_end().escape_default()
            );
            fields.push(field);
        }
        Self {
            definition,
            names,
            notes,
        }
    }
}

fn field_name(name: &str) -> String {
    let mut field = String::new();
    for c in name.trim().chars() {
        match c {
            c if c.is_ascii_alphanumeric() => field.push(c),
            _ if field.ends_with('_') => {}
            _ => field.push('_'),
        }
    }
    let field = field.trim_matches('_');
    match field.chars().next() {
        None => "column".to_owned(),
        Some(first) if first.is_ascii_digit() => format!("column_{field}"),
        Some(_) => field.to_owned(),
    }
}

/// The name, with a number behind it if it is taken.
fn unused(name: &str, is_taken: &dyn Fn(&String) -> bool) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    names.find(|name| !is_taken(name)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_fields() {
        let names = ["Boom angle [deg]", "2nd", "", "load", "load", "größe"];
        let columns = Columns::new(names.map(str::to_owned).to_vec(), &[]);
        let fields: Vec<&str> = columns
            .definition
            .lines()
            .map(|line| line.split(' ').nth(1).unwrap())
            .collect();
        assert_eq!(
            fields,
            [
                "Boom_angle_deg",
                "column_2nd",
                "column",
                "load",
                "load_2",
                "gr_e"
            ]
        );
        assert_eq!(columns.notes.len(), 1, "{:?}", columns.notes);
    }

    #[test]
    fn an_exact_name_is_that_of_its_column() {
        let names = ["imu.ax", "Roll", "imu_ax", "roll", "imu ax", "imu_ax_2"];
        let columns = Columns::new(names.map(str::to_owned).to_vec(), &[]);
        let fields = columns.definition.lines();
        let fields: Vec<&str> = fields.map(|line| line.split(' ').nth(1).unwrap()).collect();
        assert_eq!(
            fields,
            ["imu_ax_3", "Roll", "imu_ax", "roll", "imu_ax_4", "imu_ax_2"]
        );
        assert!(columns.notes[0].contains("\"imu.ax\"") && columns.notes[0].contains("imu_ax_3"));
        assert_eq!(columns.notes.len(), 2, "{:?}", columns.notes);
    }
}
