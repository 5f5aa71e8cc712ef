//! The columns of `samples.parquet` as topics of flat messages.

use anyhow::Result;
use tipwatch_ingest::{Ros2Writer, WriterTopic};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{ColumnNames, QuantityGroup};

use super::messages::{Flat, Header, Time};
use crate::base::options::Precision;
use crate::base::rows::Rows;

/// A topic and the quantities in its messages.
#[derive(Debug)]
pub(super) struct FlatTopic {
    topic: WriterTopic,
    columns: Vec<usize>,
    values: Vec<f64>,
    precision: Precision,
}

/// Topic and type name of a group.
fn topic_of(group: QuantityGroup) -> (&'static str, &'static str) {
    match group {
        QuantityGroup::Loads => ("/tipwatch/loads", "tipwatch_msgs/msg/Loads"),
        QuantityGroup::Margins => ("/tipwatch/margins", "tipwatch_msgs/msg/Margins"),
        QuantityGroup::Causes => ("/tipwatch/causes", "tipwatch_msgs/msg/Causes"),
        QuantityGroup::Indicators => ("/tipwatch/indicators", "tipwatch_msgs/msg/Indicators"),
    }
}

impl FlatTopic {
    /// Opens all topics for which rows like these have quantities.
    pub(super) fn all(
        machine: &Machine,
        like: &Rows,
        precision: Precision,
        writer: &mut Ros2Writer,
    ) -> Result<Vec<Self>> {
        let number = match precision {
            Precision::Single => "float32",
            Precision::Double => "float64",
        };
        let mut topics = Vec::new();
        let column_names = ColumnNames::of(machine);
        for &group in QuantityGroup::ALL {
            let mut fields = vec!["std_msgs/Header header".to_string()];
            let mut names: Vec<String> = Vec::new();
            let mut columns = Vec::new();
            for (column, &quantity) in like.outcomes.quantities.iter().enumerate() {
                if quantity.kind().group != group {
                    continue;
                }
                let name = field_name(&quantity.column(&column_names), &names);
                fields.push(format!("{number} {name}  # {}", quantity.kind().unit));
                names.push(name);
                columns.push(column);
            }
            if columns.is_empty() {
                continue;
            }
            let (name, type_name) = topic_of(group);
            let definition = fields.join("\n") + "\n";
            topics.push(Self {
                precision,
                topic: writer.topic(name, type_name, Some(&definition))?,
                values: vec![f64::NAN; columns.len()],
                columns,
            });
        }
        Ok(topics)
    }

    /// Writes a row.
    pub(super) fn write(
        &mut self,
        machine: &Machine,
        rows: &Rows,
        row: usize,
        writer: &mut Ros2Writer,
    ) -> Result<()> {
        let columns = &rows.outcomes.columns;
        for (value, &column) in self.values.iter_mut().zip(&self.columns) {
            *value = columns[column][row];
        }
        let message = flat(machine, rows, row, &self.values, self.precision);
        Ok(writer.write(self.topic, rows.times_ns[row], &message)?)
    }
}

/// The numbers of a row as a flat message.
pub(super) fn flat<'a>(
    machine: &'a Machine,
    rows: &Rows,
    row: usize,
    values: &'a [f64],
    precision: Precision,
) -> Flat<'a> {
    Flat {
        header: Header {
            stamp: Time::from_ns(rows.times_ns[row]),
            frame_id: machine.base_link(),
        },
        values,
        precision,
    }
}

/// A valid field name for a column: letters, digits and single underscores, starting with a letter, and
/// unique.
fn field_name(column: &str, taken: &[String]) -> String {
    let mut name = String::new();
    for character in column.chars() {
        let character = match character.is_ascii_alphanumeric() {
            true => character.to_ascii_lowercase(),
            false => '_',
        };
        if !(character == '_' && name.ends_with('_')) {
            name.push(character);
        }
    }
    let name = name.trim_matches('_');
    let name = match name.starts_with(|c: char| c.is_ascii_lowercase()) {
        true => name.to_string(),
        false => format!("f_{name}"),
    };
    let alike = (2..).map(|count| format!("{name}_{count}"));
    std::iter::once(name.clone())
        .chain(alike)
        .find(|candidate| !taken.contains(candidate))
        .unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::field_name;

    #[test]
    fn field_names_are_valid_and_unique() {
        assert_eq!(field_name("load_fl_sigma", &[]), "load_fl_sigma");
        assert_eq!(
            field_name("load_Rad vorn-links__1", &[]),
            "load_rad_vorn_links_1"
        );
        assert_eq!(field_name("7_ä", &[]), "f_7");
        let taken = ["load_a_b".to_string(), "load_a_b_2".to_string()];
        assert_eq!(field_name("load_a/b", &taken), "load_a_b_3");
    }
}
