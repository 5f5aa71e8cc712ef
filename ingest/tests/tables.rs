//! Tables as logs.

use std::sync::Arc;

use arrow_array::{
    ArrayRef, Float32Array, Float64Array, Int64Array, RecordBatch, StringArray,
    TimestampMillisecondArray,
};
use parquet::{arrow::ArrowWriter, file::properties::WriterProperties};
use tipwatch_ingest::{FieldRequest, Log, record_fields};

use crate::support::TempLog;

fn field(log: &Log, name: &str) -> (Vec<i64>, Vec<f64>, Vec<String>) {
    let (mut columns, losses) =
        record_fields(log, &[FieldRequest::raw("table", name)], None).unwrap();
    let column = columns.remove(0);
    (column.stamps_ns, column.values, losses.notes)
}

fn csv(text: &str) -> TempLog {
    TempLog::new("table", text.as_bytes())
}

#[test]
fn columns_are_fields_and_empty_cells_are_absent() {
    let file =
        csv("# by hand\nTime [ms],Boom angle [deg],load\n1000,1.5,\n1010.5,,200\n1020,-2,bad\n");
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.format().to_string(), "CSV table");
    assert_eq!(log.topics()[0].message_count, Some(3));
    let (times, values, notes) = field(&log, "Boom_angle_deg");
    assert_eq!(
        (times, values),
        (vec![1_000_000_000, 1_020_000_000], vec![1.5, -2.0])
    );
    assert!(
        notes
            .iter()
            .any(|note| note.contains("1 cells are not numbers, for example \"bad\"")),
        "{notes:?}"
    );
    let (times, values, _) = field(&log, "load");
    assert_eq!((times, values), (vec![1_010_500_000], vec![200.0]));
}

#[test]
fn decimal_commas_and_dates_are_read() {
    let file = csv("timestamp;x\n2023-11-14 22:13:20,5;1,25\n2023-11-14 22:13:21;-3\n");
    let log = Log::open(&file.path).unwrap();
    let (times, values, notes) = field(&log, "x");
    assert_eq!(times[1], 1_700_000_001_000_000_000);
    assert_eq!(values, [1.25, -3.0]);
    assert!(
        notes.iter().any(|note| note.contains("UTC is assumed")),
        "{notes:?}"
    );
}

#[test]
fn a_time_without_a_unit_is_refused_with_the_names_to_use() {
    let file = csv("time,x\n0.01,1\n");
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(
        error.contains("states no unit") && error.contains("time_ms"),
        "{error}"
    );
    let file = csv("angle,x\n0.01,1\n");
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(error.contains("not a log"), "{error}");
}

#[test]
fn broken_rows_are_lost_with_their_bytes() {
    let text = "time_s,x\n1,1\n2\n3,3\nlater,4\n5,5\n6,6";
    let file = csv(text);
    let log = Log::open(&file.path).unwrap();
    let (times, values, notes) = field(&log, "x");
    assert_eq!(times, [1_000_000_000, 3_000_000_000, 5_000_000_000]);
    assert_eq!(values, [1.0, 3.0, 5.0]);
    let lost: Vec<&str> = log
        .losses()
        .ranges
        .iter()
        .map(|range| &text[range.start_byte as usize..range.end_byte as usize])
        .collect();
    assert_eq!(lost, ["2\n", "later,4\n"]);
    assert!(
        notes.iter().any(|note| note.contains("no line break")),
        "{notes:?}"
    );
}

fn parquet(columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let properties = WriterProperties::builder()
        .set_max_row_group_row_count(Some(10))
        .build();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

fn thirty() -> Vec<u8> {
    let times: Vec<i64> = (0..30).map(|row| 1_700_000_000_000 + row * 20).collect();
    let x: Vec<f64> = (0..30).map(f64::from).collect();
    let y: Vec<Option<f32>> = (0..30)
        .map(|row| (row % 2 == 0).then_some(row as f32))
        .collect();
    parquet(vec![
        ("when", Arc::new(TimestampMillisecondArray::from(times))),
        ("x", Arc::new(Float64Array::from(x))),
        ("y", Arc::new(Float32Array::from(y))),
        ("operator", Arc::new(StringArray::from(vec!["a"; 30]))),
    ])
}

#[test]
fn parquet_files_are_read() {
    let file = TempLog::new("table", &thirty());
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.format().to_string(), "Parquet table");
    let (times, values, notes) = field(&log, "x");
    assert_eq!((times.len(), times[1]), (30, 1_700_000_000_020_000_000));
    assert_eq!(values[29], 29.0);
    assert!(
        notes.iter().any(|note| note.contains("not read: operator")),
        "{notes:?}"
    );
    assert_eq!(field(&log, "y").1.len(), 15);
    let by_name = parquet(vec![
        ("t_us", Arc::new(Int64Array::from(vec![5, 6])) as ArrayRef),
        ("x", Arc::new(Float64Array::from(vec![1.0, 2.0]))),
    ]);
    let file = TempLog::new("table", &by_name);
    assert_eq!(
        field(&Log::open(&file.path).unwrap(), "x").0,
        [5_000, 6_000]
    );
    let without = parquet(vec![(
        "x",
        Arc::new(Float64Array::from(vec![1.0])) as ArrayRef,
    )]);
    let file = TempLog::new("table", &without);
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(
        error.contains("without a column of time") && error.contains("found x"),
        "{error}"
    );
}

#[test]
fn damaged_parquet_files_give_their_intact_row_groups() {
    let bytes = thirty();
    let mut fewer = 0;
    for at in (4..bytes.len()).step_by(37) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0xff;
        let file = TempLog::new("table", &damaged);
        let Ok(log) = Log::open(&file.path) else {
            continue;
        };
        let rows = log.topics()[0].message_count.unwrap();
        if rows < 30 {
            fewer += 1;
            assert!(
                !log.losses().is_empty() || !log.losses().notes.is_empty(),
                "byte {at}"
            );
        }
    }
    assert!(fewer > 0);
    let file = TempLog::new("table", &bytes[..bytes.len() - 20]);
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(error.contains("damaged"), "{error}");
}
