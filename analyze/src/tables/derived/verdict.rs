//! The verdict of each row as numbers: level, latched level, basis, time to lift-off.

use anyhow::Result;
use tipwatch_ingest::{Ros2Writer, WriterTopic};
use tipwatch_mechanics::RowColumn;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::prediction::{Law, PREDICTED_AGE, PredictedNumber, predicted_column};

use super::flat::flat;
use crate::base::options::Precision;
use crate::base::rows::Rows;

const DEFINITION: &str = "std_msgs/Header header\n\
    float64 level  # 0 unknown, 1 safe, 2 notice, 3 warning, 4 danger, 5 fault, 6 assumed\n\
    float64 latched_level  # the same, held until acknowledged\n\
    float64 basis  # what the level stands on: 0 doubted, 1 assumed, 2 proven\n";

/// The numbers of the prediction.
fn predicted() -> impl Iterator<Item = (Law, PredictedNumber)> {
    let numbers = |law| PredictedNumber::ALL.map(|number| (law, number));
    Law::ALL.into_iter().flat_map(numbers)
}

/// The topic of the verdicts.
#[derive(Debug)]
pub(super) struct VerdictTopic {
    topic: WriterTopic,
}

impl VerdictTopic {
    /// Opens the topic; `None` for models without verdicts.
    pub(super) fn begin(like: &Rows, writer: &mut Ros2Writer) -> Result<Option<Self>> {
        if like.verdicts.is_none() {
            return Ok(None);
        }
        let RowColumn { name, unit, .. } = RowColumn::TIME_TO_LIFT_OFF;
        let mut definition = format!("{DEFINITION}float64 {name}  # {unit}\n");
        let verdicts = like.verdicts.as_ref();
        if verdicts.is_some_and(|verdicts| verdicts.predictions.is_some()) {
            for (law, number) in predicted() {
                let (name, unit) = (predicted_column(number.column(), law), number.column().unit);
                definition += &format!("float64 {name}  # {unit}\n");
            }
            let RowColumn { name, unit, .. } = PREDICTED_AGE;
            definition += &format!("float64 {name}  # {unit}\n");
        }
        let topic = writer.topic(
            "/tipwatch/verdict",
            "tipwatch_msgs/msg/Verdict",
            Some(&definition),
        )?;
        Ok(Some(Self { topic }))
    }

    /// Writes a row.
    pub(super) fn write(
        &self,
        machine: &Machine,
        rows: &Rows,
        row: usize,
        writer: &mut Ros2Writer,
    ) -> Result<()> {
        let Some(verdicts) = &rows.verdicts else {
            return Ok(());
        };
        let verdict = verdicts.verdicts[row];
        let mut values = vec![
            f64::from(verdict.level as u8),
            f64::from(verdict.latched_level as u8),
            f64::from(verdict.basis as u8),
            verdicts.time_to_lift_off_s[row],
        ];
        if let Some(predictions) = &verdicts.predictions {
            values.extend(predicted().map(|(law, n)| predictions.of(law).number(n)[row]));
            values.push(predictions.age_s[row]);
        }
        let message = flat(machine, rows, row, &values, Precision::Double);
        Ok(writer.write(self.topic, rows.times_ns[row], &message)?)
    }
}
