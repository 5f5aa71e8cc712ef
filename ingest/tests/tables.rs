//! Tables as logs.

use std::{io::Write as _, sync::Arc};

use parquet::{
    basic::{
        Compression, GzipLevel, LogicalType, Repetition, TimeUnit as ColumnUnit, Type as Physical,
        ZstdLevel,
    },
    column::writer::ColumnWriter,
    data_type::{DoubleType, Int64Type, Int96},
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::{parser::parse_message_type, types::Type},
};
use tipwatch_ingest::{
    BindingError, DateOrder, Error, FieldRequest, Log, LostPart, ReadOptions, TableOptions,
    TimeUnit, record_fields, topic_contents,
};

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
fn a_row_may_begin_with_the_mark_of_remarks() {
    // what a spreadsheet writes for a cell without a value
    let file = csv(
        "speed,time [s],x\n1,1,10\n#N/A,2,20\n# stopped by \"hand\n# speed,time [s],x\n#N/A,3,30\n",
    );
    let (times, values, notes) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(values, [10.0, 20.0, 30.0]);
    assert_eq!(times[2], 3_000_000_000);
    assert!(
        notes.iter().any(|note| note.contains("2 lines")),
        "{notes:?}"
    );
    let (_, values, _) = field(&Log::open(&file.path).unwrap(), "speed");
    assert_eq!(values, [1.0]);
    // a time that is none is a lost row
    let file = csv("time [s],x\n1,10\n#N/A,20\n3,30\n");
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.losses().ranges[0].message_count, Some(1));
    let file = csv("id,time [s],x\n#1,1,10\n#2,2,20\n");
    assert_eq!(field(&Log::open(&file.path).unwrap(), "x").1, [10.0, 20.0]);
}

#[test]
fn lost_rows_lie_between_the_intact_ones_and_repeated_names_are_no_loss() {
    let file = csv("time [s],x\n1,10\nbad,20\n3,30\ntime [s],x\n4,40\n5,50\n6,60\n");
    let log = Log::open(&file.path).unwrap();
    let [lost] = &log.losses().ranges[..] else {
        panic!("{:?}", log.losses());
    };
    let between = (lost.first_time_ns, lost.last_time_ns);
    assert_eq!(between, (Some(1_000_000_000), Some(3_000_000_000)));
    assert_eq!(lost.message_count, Some(1));
    let file = csv("time [s],x\n1,10\n2,20\nbad,30\n");
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.losses().ranges[0].last_time_ns, None);
}

#[test]
fn the_column_tells_whether_a_mark_stands_between_groups_of_digits() {
    for (rows, values) in [
        (
            "0,0;998;1,5\n0,1;1.002;1,5\n0,2;-1.010;1,5\n",
            [998.0, 1002.0, -1010.0],
        ),
        // a column of another table, with decimal points
        (
            "0,0;0.998;1,5\n0,1;1.002;1,5\n0,2;-1.010;1,5\n",
            [0.998, 1.002, -1.01],
        ),
        (
            "0,0;99.5;1,5\n0,1;1.002;1,5\n0,2;-1.010;1,5\n",
            [99.5, 1.002, -1.01],
        ),
    ] {
        let file = csv(&format!("time_s;p;q\n{rows}"));
        let (_, found, notes) = field(&Log::open(&file.path).unwrap(), "p");
        assert_eq!(found, values);
        let is_told = notes.iter().any(|note| note.contains("between thousands"));
        assert_eq!(is_told, values[0] == 998.0, "{notes:?}");
    }
    // the other columns tell where this one does not: decimal points mark no groups, and commas beside them do
    for (cells, values) in [
        (["1.250", "1.251", "1.252"], [1.25, 1.251, 1.252]),
        (["998", "2,942", "1,002"], [998.0, 2942.0, 1002.0]),
        (["1,998", "2,942", "1,002"], [1998.0, 2942.0, 1002.0]),
    ] {
        let [a, b, c] = cells;
        let file = csv(&format!(
            "time_s;p;q\n0;{a};0.125\n1;{b};-1.5\n2;{c};0.25\n"
        ));
        let (_, found, _) = field(&Log::open(&file.path).unwrap(), "p");
        assert_eq!(found, values);
    }
    let file = csv("time_s,p,q\n0.0,998,1.5\n0.1,\"1,002\",1.5\n0.2,999,1.5\n");
    assert_eq!(
        field(&Log::open(&file.path).unwrap(), "p").1,
        [998.0, 1002.0, 999.0]
    );
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

#[test]
fn a_block_of_zeros_in_a_table_costs_one_row_and_few_words() {
    let text = format!("time_s,x\n1,1\n{}2,2\n3,3\n", "\0".repeat(4096));
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(field(&log, "x").1, [1.0, 3.0]);
    let [lost] = log.losses().ranges.as_slice() else {
        panic!("{:?}", log.losses());
    };
    assert!(lost.reason.len() < 200, "{}", lost.reason);
}

/// A column with values that may be missing.
enum Column {
    Boolean(Vec<Option<bool>>),
    Single(Vec<Option<f32>>),
    Double(Vec<Option<f64>>),
    Whole32(Vec<Option<i32>>, Option<LogicalType>),
    Whole64(Vec<Option<i64>>, Option<LogicalType>),
    Int96(Vec<Option<Int96>>),
    Text(Vec<Option<&'static str>>),
}

fn parquet(columns: &[(&str, Column)]) -> Vec<u8> {
    packed(columns, Compression::UNCOMPRESSED)
}

/// A Parquet file of row groups of ten rows.
fn packed(columns: &[(&str, Column)], compression: Compression) -> Vec<u8> {
    use Column::{Boolean, Double, Int96, Single, Text, Whole32, Whole64};
    let fields = columns.iter().map(|(name, column)| {
        let (physical, logical) = match column {
            Boolean(_) => (Physical::BOOLEAN, None),
            Single(_) => (Physical::FLOAT, None),
            Double(_) => (Physical::DOUBLE, None),
            Whole32(_, logical) => (Physical::INT32, logical.clone()),
            Whole64(_, logical) => (Physical::INT64, logical.clone()),
            Int96(_) => (Physical::INT96, None),
            Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let (scale, precision) = match &logical {
            Some(LogicalType::Decimal(decimal)) => (decimal.scale, decimal.precision),
            _ => (-1, -1),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .with_scale(scale)
            .with_precision(precision);
        Arc::new(field.build().unwrap())
    });
    let schema = Type::group_type_builder("schema").with_fields(fields.collect());
    let properties = WriterProperties::builder().set_compression(compression);
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(
        &mut bytes,
        Arc::new(schema.build().unwrap()),
        Arc::new(properties.build()),
    )
    .unwrap();
    let rows = match &columns[0].1 {
        Double(values) => values.len(),
        Whole64(values, _) => values.len(),
        Int96(values) => values.len(),
        _ => unreachable!("the first column is one of times or of numbers"),
    };
    for first in (0..rows).step_by(10) {
        let mut group = file.next_row_group().unwrap();
        for (_, column) in columns {
            let mut writer = group.next_column().unwrap().unwrap();
            macro_rules! write {
                ($variant:ident, $values:expr) => {{
                    let rows = &$values[first..$values.len().min(first + 10)];
                    let levels: Vec<i16> = rows.iter().map(|row| row.is_some().into()).collect();
                    let known: Vec<_> = rows.iter().flatten().cloned().map(Into::into).collect();
                    let ColumnWriter::$variant(to) = writer.untyped() else {
                        unreachable!("the type of the schema")
                    };
                    to.write_batch(&known, Some(&levels), None).unwrap();
                }};
            }
            match column {
                Boolean(values) => write!(BoolColumnWriter, values),
                Single(values) => write!(FloatColumnWriter, values),
                Double(values) => write!(DoubleColumnWriter, values),
                Whole32(values, _) => write!(Int32ColumnWriter, values),
                Whole64(values, _) => write!(Int64ColumnWriter, values),
                Int96(values) => write!(Int96ColumnWriter, values),
                Text(values) => write!(ByteArrayColumnWriter, values),
            }
            writer.close().unwrap();
        }
        group.close().unwrap();
    }
    file.close().unwrap();
    bytes
}

fn timestamp(unit: ColumnUnit) -> Option<LogicalType> {
    Some(LogicalType::Timestamp(parquet::basic::TimestampType {
        is_adjusted_to_u_t_c: true,
        unit,
    }))
}

/// Thirty rows with a time, numbers, numbers with gaps, and a text.
fn columns() -> [(&'static str, Column); 4] {
    let rows = 0..30_i16;
    let times = rows
        .clone()
        .map(|row| Some(1_700_000_000_000 + i64::from(row) * 20));
    let y = rows.clone().map(|row| (row % 2 == 0).then_some(row.into()));
    [
        (
            "when",
            Column::Whole64(times.collect(), timestamp(ColumnUnit::MILLIS)),
        ),
        (
            "x",
            Column::Double(rows.map(|row| Some(row.into())).collect()),
        ),
        ("y", Column::Single(y.collect())),
        ("operator", Column::Text(vec![Some("a"); 30])),
    ]
}

fn thirty() -> Vec<u8> {
    parquet(&columns())
}

#[test]
fn times_that_are_too_coarse_for_the_rows_are_told() {
    let rows = |per_second: usize| -> String {
        let row = |row: usize| format!("2023-11-14 22:13:{:02},{row}\n", row / per_second);
        (0..20).map(row).collect()
    };
    for (per_second, is_coarse) in [(1, false), (10, true)] {
        let file = csv(&format!("time,x\n{}", rows(per_second)));
        let log = Log::open(&file.path).unwrap();
        let notes = &log.losses().notes;
        let is_told = notes.iter().any(|note| note.contains("18 of 20 rows"));
        assert_eq!(is_told, is_coarse, "{notes:?}");
    }
}

/// Times of rows (ms) that a logger writes in steps of so many, and what is read of them.
fn read_in_steps_of(step_ms: i64, times_ms: &[i64]) -> Vec<i64> {
    let row = |(at, time): (usize, &i64)| format!("{},{at}\n", time / step_ms * step_ms);
    let rows: String = times_ms.iter().enumerate().map(row).collect();
    let file = csv(&format!("time_ms,x\n{rows}"));
    let log = Log::open(&file.path).unwrap();
    let (times, values, _) = field(&log, "x");
    let in_order: Vec<f64> = (0..times_ms.len()).map(|at| at as f64).collect();
    assert_eq!(values, in_order);
    times
}

#[test]
fn rows_of_one_time_are_spread_over_its_step() {
    let of_ms = |times: &[i64]| -> Vec<i64> { times.iter().map(|ms| ms * 1_000_000).collect() };
    // whole seconds and tenths; the table begins and ends within a step
    for (step_ms, period_ms, first_ms) in [(1000, 100, 1500), (1000, 20, 400), (100, 50, 0)] {
        let times: Vec<i64> = (0..200_i64).map(|row| first_ms + row * period_ms).collect();
        assert_eq!(read_in_steps_of(step_ms, &times), of_ms(&times));
    }
    // a gap is no step
    let times: Vec<i64> = (0..40_i64)
        .map(|row| row * 100 + if row < 20 { 0 } else { 60_000 })
        .collect();
    assert_eq!(read_in_steps_of(1000, &times), of_ms(&times));
    let rows = 0..40_i64;
    let seconds = rows.clone().map(|row| Some(row / 10 * 1_000_000_000));
    let numbers = rows.clone().map(|row| Some(row as f64)).collect();
    let unit = timestamp(ColumnUnit::NANOS);
    let file = TempLog::new(
        "table",
        &parquet(&[
            ("time", Column::Whole64(seconds.collect(), unit)),
            ("x", Column::Double(numbers)),
        ]),
    );
    let (times, ..) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times, rows.map(|row| row * 100_000_000).collect::<Vec<_>>());
}

#[test]
fn rows_of_one_time_that_complete_or_repeat_each_other_keep_it() {
    for text in [
        "time_s,x,y\n0,1,\n0,,5\n1,2,\n1,,6\n2,3,\n2,,7\n",
        "time_s,x,y\n0,1,5\n0,1,5\n1,2,6\n1,2,6\n2,3,7\n2,3,7\n",
    ] {
        let file = csv(text);
        let (times, ..) = field(&Log::open(&file.path).unwrap(), "y");
        assert!(times.iter().all(|time| time % 1_000_000_000 == 0), "{text}");
    }
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
    let x = || Column::Double(vec![Some(1.0), Some(2.0)]);
    let by_name = parquet(&[
        ("t_us", Column::Whole64(vec![Some(5), Some(6)], None)),
        ("x", x()),
    ]);
    let file = TempLog::new("table", &by_name);
    assert_eq!(
        field(&Log::open(&file.path).unwrap(), "x").0,
        [5_000, 6_000]
    );
    // a name says more than a type
    let stored = [1_700_000_000_000, 1_700_000_000_050].map(Some).to_vec();
    let two = parquet(&[
        (
            "stored_at",
            Column::Whole64(stored, timestamp(ColumnUnit::MILLIS)),
        ),
        ("time_s", Column::Double(vec![Some(5.0), Some(6.0)])),
        ("x", x()),
    ]);
    let file = TempLog::new("table", &two);
    let (times, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times, [5_000_000_000, 6_000_000_000]);
    assert!(
        notes.iter().any(|note| note.contains("stored_at")),
        "{notes:?}"
    );
    let without = parquet(&[("x", x())]);
    let file = TempLog::new("table", &without);
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(
        error.contains("no column of time") && error.contains("found \"x\""),
        "{error}"
    );
}

#[test]
fn times_of_parquet_are_texts_dates_and_times_of_day_too() {
    const FIRST_NS: i64 = 1_700_000_000_500_000_000;
    let rows = |time: Vec<(&'static str, Column)>| {
        let x = Column::Double(vec![Some(1.0), Some(2.0)]);
        let columns: Vec<_> = std::iter::once(("x", x)).chain(time).collect();
        TempLog::new("table", &parquet(&columns))
    };
    let text = |first, second| Column::Text(vec![Some(first), Some(second)]);
    let of_day = |unit, factor: i64| {
        let times = [80_000_500, 80_000_520].map(|time_ms: i64| Some(time_ms * factor));
        Column::Whole64(times.to_vec(), Some(LogicalType::time(false, unit)))
    };
    let day = || Column::Whole32(vec![Some(19_675); 2], Some(LogicalType::Date));
    let cases = [
        (
            vec![(
                "time",
                text("2023-11-14T22:13:20.5Z", "2023-11-14T22:13:20.52Z"),
            )],
            false,
        ),
        (
            vec![(
                "time",
                text("2023-11-14 23:13:20.5 CET", "2023-11-15 00:13:20.52 CEST"),
            )],
            false,
        ),
        (
            vec![(
                "Zeit",
                text("14.11.2023 22:13:20,500", "14.11.2023 22:13:20,520"),
            )],
            true,
        ),
        (
            vec![("timestamp", text("1700000000.5", "1700000000.52"))],
            false,
        ),
        (
            vec![("date", day()), ("time", of_day(ColumnUnit::MICROS, 1000))],
            true,
        ),
        (
            vec![
                ("date", text("14.11.2023", "14.11.2023")),
                ("time", of_day(ColumnUnit::NANOS, 1_000_000)),
            ],
            true,
        ),
    ];
    for (time, lacks_zone) in cases {
        let file = rows(time);
        let (times, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
        assert_eq!(times, [FIRST_NS, FIRST_NS + 20_000_000], "{notes:?}");
        let is_told = notes.iter().any(|note| note.contains("UTC is assumed"));
        assert_eq!(is_told, lacks_zone, "{notes:?}");
    }
    // over midnight
    let times = [80_000_500_000_000, 500_000_000].map(Some).to_vec();
    let time = Column::Whole64(times, Some(LogicalType::time(false, ColumnUnit::NANOS)));
    let file = rows(vec![("time", time)]);
    let (times, ..) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times, [80_000_500_000_000, 86_400_500_000_000]);
    for (time, expected) in [
        (vec![("date", day())], "without a time of day"),
        (
            vec![(
                "time",
                text("2023-11-14 22:13:20 IST", "2023-11-14 22:13:21 IST"),
            )],
            "\"IST\"",
        ),
    ] {
        let error = Log::open(&rows(time).path).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// Beside a date, 1000 ms were ten o'clock, and one readable row of many was enough.
#[test]
fn a_count_beside_a_date_is_no_time_of_day() {
    let day = || Column::Whole32(vec![Some(19_675); 2], Some(LogicalType::Date));
    let text = || Column::Text(vec![Some("2023-11-14"); 2]);
    let count = || Column::Whole64(vec![Some(1000), Some(1020)], None);
    for date in [day(), text()] {
        let file = TempLog::new(
            "table",
            &parquet(&[("elapsed_ms", count()), ("date", date), ("x", count())]),
        );
        let (times, ..) = field(&Log::open(&file.path).unwrap(), "x");
        assert_eq!(times, [1_000_000_000, 1_020_000_000]);
    }
    let mut rows = "date,time_s,recordtime,x\n2023-11-14,1,22:13:20,1\n".to_owned();
    for row in 2..6 {
        rows += &format!("2023-11-14,{row},by hand,{row}\n");
    }
    let file = csv(&rows);
    let (times, ..) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times[1], 2_000_000_000);
}

/// A text that is no time was a row without a time: a remark, and no loss.
#[test]
fn a_text_of_parquet_that_is_no_time_is_a_lost_row() {
    let texts = vec![
        Some("2023-11-14 22:13:20"),
        None,
        Some("power failure"),
        Some("2023-11-14 22:13:21"),
    ];
    let x = Column::Double((0..4_i16).map(|row| Some(row.into())).collect());
    let bytes = parquet(&[("x", x), ("time", Column::Text(texts))]);
    let file = TempLog::new("table", &bytes);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(field(&log, "x").1, [0.0, 3.0]);
    let [lost] = log.losses().ranges.as_slice() else {
        panic!("{:?}", log.losses());
    };
    assert_eq!(
        (lost.part, lost.message_count),
        (LostPart::Records, Some(1))
    );
    let span_ns = lost.first_time_ns.zip(lost.last_time_ns);
    assert_eq!(
        span_ns.map(|(first, last)| last - first),
        Some(1_000_000_000)
    );
    assert!(lost.reason.contains("power failure"), "{lost:?}");
}

#[test]
fn parquet_files_in_any_usual_compression_are_read() {
    let compressions = [
        Compression::SNAPPY,
        Compression::GZIP(GzipLevel::default()),
        Compression::LZ4_RAW,
        Compression::ZSTD(ZstdLevel::default()),
    ];
    for compression in compressions {
        let file = TempLog::new("table", &packed(&columns(), compression));
        let log = Log::open(&file.path).unwrap();
        assert_eq!(field(&log, "x").1.len(), 30, "{compression}");
        assert_eq!(field(&log, "y").1[14], 28.0, "{compression}");
    }
}

#[test]
fn numbers_of_every_type_are_read_with_their_sign() {
    let unsigned = |bits| Some(LogicalType::integer(bits, false));
    let date = Some(LogicalType::Date);
    let mut day_and_time = Int96::new();
    // noon of the day 2,440,588 of the Julian calendar, 1970-01-01
    day_and_time.set_data(0xbbd6_0000, 0x2746, 2_440_588);
    let bytes = parquet(&[
        ("stamp", Column::Int96(vec![Some(day_and_time), None])),
        ("on", Column::Boolean(vec![Some(true), Some(false)])),
        ("negative", Column::Whole32(vec![Some(-1), Some(-1)], None)),
        (
            "count",
            Column::Whole32(vec![Some(-1), Some(-1)], unsigned(32)),
        ),
        (
            "large",
            Column::Whole64(vec![Some(-1), Some(-1)], unsigned(64)),
        ),
        ("day", Column::Whole32(vec![Some(7), Some(7)], date)),
    ]);
    let file = TempLog::new("table", &bytes);
    let log = Log::open(&file.path).unwrap();
    let (times, on, notes) = field(&log, "on");
    assert_eq!((times.len(), on), (1, vec![1.0]));
    let expected = i64::from(0x2746) * (1 << 32) + 0xbbd6_0000;
    assert_eq!(times[0], expected);
    assert_eq!(field(&log, "negative").1, [-1.0]);
    assert_eq!(field(&log, "count").1, [f64::from(u32::MAX)]);
    assert_eq!(field(&log, "large").1, [u64::MAX as f64]);
    assert!(
        notes.iter().any(|note| note.contains("not read: day")),
        "{notes:?}"
    );
    assert!(
        notes
            .iter()
            .any(|note| note.contains("1 rows have no time")),
        "{notes:?}"
    );
}

#[test]
fn repeated_values_are_not_numbers_and_lose_no_row() {
    let message = "message schema { required int64 t_ns; repeated double ranges; }";
    let schema = Arc::new(parse_message_type(message).unwrap());
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut times = group.next_column().unwrap().unwrap();
    let typed = times.typed::<Int64Type>();
    typed.write_batch(&[1, 2], None, None).unwrap();
    times.close().unwrap();
    let mut ranges = group.next_column().unwrap().unwrap();
    let typed = ranges.typed::<DoubleType>();
    let (definition, repetition) = ([1, 1, 0], [0, 1, 0]);
    typed
        .write_batch(&[5.0, 6.0], Some(&definition), Some(&repetition))
        .unwrap();
    ranges.close().unwrap();
    group.close().unwrap();
    file.close().unwrap();
    let file = TempLog::new("table", &bytes);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.topics()[0].message_count, Some(2));
    let notes = &log.losses().notes;
    assert!(
        notes.iter().any(|note| note.contains("not read: ranges")),
        "{notes:?}"
    );
}

#[test]
fn damaged_parquet_files_give_their_intact_row_groups() {
    let bytes = thirty();
    let (mut fewer, mut in_the_middle) = (0, 0);
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
            let last = log.span_ns().map(|(_, last)| last);
            let is_last = last == Some(1_700_000_000_000_000_000 + 29 * 20_000_000);
            in_the_middle += u32::from(is_last && !log.losses().is_empty());
            assert!(!is_last || !log.losses().end_is_lost(), "byte {at}");
            assert!(
                !log.losses().is_empty() || !log.losses().notes.is_empty(),
                "byte {at}"
            );
        }
    }
    assert!(fewer > 0 && in_the_middle > 0);
    let file = TempLog::new("table", &bytes[..bytes.len() - 20]);
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(error.contains("damaged"), "{error}");
}

fn with(text: &str, table: TableOptions) -> Log {
    let file = csv(text);
    let options = ReadOptions {
        table,
        ..ReadOptions::default()
    };
    Log::open_with(&file.path, &options).unwrap()
}

#[test]
fn tables_of_common_loggers_are_read_as_they_are() {
    const START: i64 = 1_700_000_000_000_000_000;
    let cases = [
        ("Time,x\n1700000000,1\n1700000001,2\n", 1_000_000_000),
        (
            "timestamp,x\n1700000000000,1\n1700000000010,2\n",
            10_000_000,
        ),
        ("t,x\n1700000000000000,1\n1700000000000010,2\n", 10_000),
        (
            "Epoch,x\n1700000000000000000,1\n1700000000000000010,2\n",
            10,
        ),
        (
            "%time,field.x\n1700000000000000000,1\n1700000000000000010,2\n",
            10,
        ),
        (
            "__time,/imu/x\n1700000000.0,1\n1700000000.5,2\n",
            500_000_000,
        ),
        (
            "Date,Time,x\n14.11.2023,22:13:20,1\n14.11.2023,22:13:21,2\n",
            1_000_000_000,
        ),
        (
            "datetime;x\n14.11.2023 22:13:20;1,0\n14.11.2023 22:13:20,5;2,0\n",
            500_000_000,
        ),
        ("time_s,x,\n1700000000,1\n1700000001,2\n", 1_000_000_000),
        ("time_s,x\n1700000000,1,\n1700000001,2,\n", 1_000_000_000),
        (
            "Logger 7\nSerial,0815\n\nTime\tx\n[s]\t[m/s^2]\n1700000000\t1\n1700000001\t2\n",
            1_000_000_000,
        ),
        (
            "\u{feff}\"Time [s]\",\"x\"\n\"1700000000\",\"1,0\"\n\"1700000001\",\"2,0\"\n",
            1_000_000_000,
        ),
        ("sec,nanosec,x\n1700000000,0,1\n1700000000,7,2\n", 7),
    ];
    for (text, step_ns) in cases {
        let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let marked = [&[0xff, 0xfe][..], &utf16].concat();
        for bytes in [text.as_bytes(), &marked] {
            let file = TempLog::new("table", bytes);
            let log = Log::open(&file.path).unwrap();
            let (contents, losses) = topic_contents(&log).unwrap();
            assert!(losses.is_empty(), "{text}: {losses:?}");
            let [contents] = contents.as_slice() else {
                panic!("{text}: {contents:?}");
            };
            let span = contents.start_ns.zip(contents.end_ns);
            assert_eq!(span, Some((START, START + step_ns)), "{text}");
            let [field] = contents.fields.as_slice() else {
                panic!("{text}: {contents:?}");
            };
            assert_eq!((field.first, field.last), (Some(1.0), Some(2.0)), "{text}");
        }
    }
}

/// As pandas writes the times by which it finds rows.
#[test]
fn times_in_a_first_column_without_a_name_are_the_time() {
    for (name, first, second) in [
        ("", "2023-11-14 22:13:20", "2023-11-14 22:13:20.020"),
        (
            "Unnamed: 0",
            "2023-11-14 22:13:20+00:00",
            "2023-11-14 22:13:20.020000+00:00",
        ),
        ("", "1700000000.00", "1700000000.02"),
        ("index", "1700000000000", "1700000000020"),
    ] {
        let file = csv(&format!("{name},x\n{first},1\n{second},2\n"));
        let (times, values, _) = field(&Log::open(&file.path).unwrap(), "x");
        let expected = [1_700_000_000_000_000_000, 1_700_000_000_020_000_000];
        assert_eq!(
            (&times[..], &values[..]),
            (&expected[..], &[1.0, 2.0][..]),
            "{name}"
        );
    }
    // a column with the name of a time counts, and numbers of rows are no time
    let file = csv(",time_s,x\n1700000000,0.5,1\n1700000001,0.6,2\n");
    let (times, _, _) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times, [500_000_000, 600_000_000]);
    let file = csv(",x\n0,1\n1,2\n");
    assert!(matches!(Log::open(&file.path), Err(Error::NotALog { .. })));
}

/// LabVIEW names a column of comments that most rows do not reach.
#[test]
fn rows_that_end_with_their_last_value_are_whole() {
    let file =
        csv("X_Value\tx\ty\tComment\n0.0\t1\t5\tbegin\n0.1\t2\t6\n0.2\t3\t7\n0.3\t4\t8\n0.4\t5\n");
    let log = Log::open(&file.path).unwrap();
    let (times, values, _) = field(&log, "x");
    assert_eq!((times.len(), &values[..]), (4, &[1.0, 2.0, 3.0, 4.0][..]));
    assert_eq!(field(&log, "y").1, [5.0, 6.0, 7.0, 8.0]);
    assert_eq!(log.losses().ranges[0].message_count, Some(1));
}

#[test]
fn what_a_table_does_not_state_can_be_stated() {
    let unit = TableOptions {
        time_unit: Some(TimeUnit::Milliseconds),
        ..TableOptions::default()
    };
    let log = with("time,x\n10,1\n20,2\n", unit);
    assert_eq!(log.span_ns(), Some((10_000_000, 20_000_000)));
    let order = TableOptions {
        date_order: Some(DateOrder::Dmy),
        ..TableOptions::default()
    };
    let log = with("time,x\n01/02/1970 00:00:00,1\n", order);
    assert_eq!(log.span_ns().unwrap().0, 31 * 86_400_000_000_000);
    let without_names = TableOptions {
        no_header: true,
        ..TableOptions::default()
    };
    let log = with(
        "1700000000,5000000,base,1.5\n1700000000,7000000,base,2.5\n",
        without_names,
    );
    assert_eq!(
        log.span_ns(),
        Some((1_700_000_000_005_000_000, 1_700_000_000_007_000_000))
    );
    let fields = log.topics()[0].definition.clone().unwrap();
    assert!(fields.contains("float64 c4"), "{fields}");
    let column = TableOptions {
        time_column: Some("clock".to_owned()),
        ..TableOptions::default()
    };
    let log = with("clock,time\n1700000000,1\n", column);
    assert!(
        log.topics()[0]
            .definition
            .clone()
            .unwrap()
            .contains("float64 time")
    );
}

#[test]
fn a_unit_that_contradicts_the_table_is_told() {
    let unit = TableOptions {
        time_unit: Some(TimeUnit::Milliseconds),
        ..TableOptions::default()
    };
    for (text, is_told) in [
        ("time_s,x\n10,1\n20,2\n", true),
        ("time,x\n[us],[]\n10,1\n20,2\n", true),
        ("time_ms,x\n10,1\n20,2\n", false),
        ("time,x\n10,1\n20,2\n", false),
    ] {
        let log = with(text, unit.clone());
        assert_eq!(log.span_ns(), Some((10_000_000, 20_000_000)));
        let notes = &log.losses().notes;
        let told = notes.iter().any(|note| note.contains("--time-unit"));
        assert_eq!(told, is_told, "{text}: {notes:?}");
    }
}

#[test]
fn every_kind_of_line_end_is_read() {
    for end in ["\n", "\r", "\r\n"] {
        // more than is looked at to find the layout
        let mut text = format!("Logger 7{end}time_s,x{end}[s],[m]{end}");
        for row in 0..20_000 {
            text += &format!("{row},{}{end}", 2 * row);
        }
        let log = Log::open(&csv(&text).path).unwrap();
        assert!(log.losses().is_empty(), "{:?}", log.losses());
        assert_eq!(log.topics()[0].message_count, Some(20_000), "{end:?}");
    }
}

#[test]
fn the_numbers_of_a_sparse_table_are_all_listed() {
    let text = "time_s,a,b,c,d\n0,,,,\n1,5,,,\n2,,6,,\n3,7,,,\n4,,,8,\n5,,,,\n";
    let (contents, _) = topic_contents(&Log::open(&csv(text).path).unwrap()).unwrap();
    let fields = contents[0].fields.iter();
    let found: Vec<_> = fields
        .map(|it| (it.field.as_str(), it.first, it.last))
        .collect();
    assert_eq!(
        found,
        [
            ("a", Some(5.0), Some(7.0)),
            ("b", Some(6.0), Some(6.0)),
            ("c", Some(8.0), Some(8.0)),
        ]
    );
}

#[test]
fn lost_rows_are_told_once_for_each_kind() {
    let mut text = "time_s,x\n".to_owned();
    for row in 0..1000 {
        text += &match row % 10 {
            3 => format!("{row}\n"),
            7 => "never,1\n".to_owned(),
            _ => format!("{row},1\n"),
        };
    }
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    let ranges = &log.losses().ranges;
    assert_eq!(ranges.len(), 2, "{ranges:?}");
    assert!(ranges.iter().all(|range| range.message_count == Some(100)));
    assert!(
        ranges[0]
            .reason
            .contains("the first in line 5, the last in line 995"),
        "{ranges:?}"
    );
    assert_eq!(log.topics()[0].message_count, Some(800));
}

#[test]
fn decimal_columns_of_parquet_are_numbers() {
    let decimal = Some(LogicalType::decimal(2, 9));
    let bytes = parquet(&[
        ("time_ms", Column::Whole64(vec![Some(5), Some(6)], None)),
        ("load", Column::Whole32(vec![Some(150), Some(-25)], decimal)),
    ]);
    let file = TempLog::new("table", &bytes);
    assert_eq!(
        field(&Log::open(&file.path).unwrap(), "load").1,
        [1.5, -0.25]
    );
}

#[test]
fn a_table_with_one_signal_in_each_row_has_a_field_for_each() {
    let text = "time_s;signal;unit;value\n1;lift angle;deg;1,5\n1;load;N;200\n1,01;lift angle;;1,6\n1,01;load;;bad\n\
                1,02;lift angle;;1,7\n1,02;lift angle;;1,8\n";
    let file = csv(text);
    let log = Log::open(&file.path).unwrap();
    // two values of one time and signal are two rows
    assert_eq!(log.topics()[0].message_count, Some(4));
    let definition = log.topics()[0].definition.clone().unwrap();
    assert!(
        definition.contains("float64 lift_angle # lift angle deg"),
        "{definition}"
    );
    let (times, values, notes) = field(&log, "lift_angle");
    assert_eq!(values, [1.5, 1.6, 1.7, 1.8]);
    assert_eq!(times[1], 1_010_000_000);
    assert_eq!(field(&log, "load").1, [200.0]);
    assert!(
        notes
            .iter()
            .any(|note| note.contains("column \"load\": 1 cells")),
        "{notes:?}"
    );
}

#[test]
fn signals_that_follow_each_other_are_refused() {
    let text = "time_s,signal,value\n1,lift,1\n2,lift,2\n1,load,3\n2,load,4\n";
    let error = Log::open(&csv(text).path).unwrap_err().to_string();
    assert!(error.contains("sort the rows by their times"), "{error}");
    // a recorder that starts again is not that
    let text = "time_s,signal,value\n1,lift,1\n1,load,2\n0,lift,3\n0,load,4\n";
    let log = Log::open(&csv(text).path).unwrap();
    assert_eq!(log.topics()[0].message_count, Some(2));
}

#[test]
fn a_name_beside_numbers_is_a_column_of_text() {
    // no value, or names that are numbers
    for text in [
        "time_s,signal,x\n1,lift,1\n",
        "time_s,channel,value\n1,4,1\n2,4,1\n",
    ] {
        let file = csv(text);
        let log = Log::open(&file.path).unwrap();
        let name = if text.contains("channel") {
            "value"
        } else {
            "x"
        };
        assert_eq!(field(&log, name).1[0], 1.0, "{text}");
    }
}

#[test]
fn times_of_day_go_on_over_midnight() {
    let file = csv("Uhrzeit;x\n23:59:59,9;1\n23:59:59,8;2\n00:00:00,1;3\n");
    let log = Log::open(&file.path).unwrap();
    let (times, ..) = field(&log, "x");
    let day = 86_400_000_000_000;
    assert_eq!(
        times,
        [day - 100_000_000, day - 200_000_000, day + 100_000_000]
    );
    assert_eq!(log.span_ns(), Some((day - 200_000_000, day + 100_000_000)));
}

#[test]
fn numbers_with_one_unit_behind_them_are_read() {
    let file = csv("time_s,angle,force\n0,12.5 deg,900 N\n1,0,1.2 kN\n2,-3.5 deg,800 N\n");
    let log = Log::open(&file.path).unwrap();
    let (_, values, notes) = field(&log, "angle");
    assert_eq!(values, [12.5, 0.0, -3.5]);
    let is_told = |text: &str| notes.iter().any(|note| note.contains(text));
    assert!(
        is_told("the unit \"deg\"") && is_told("found \"N\" and others"),
        "{notes:?}"
    );
    // a number of another unit is no number
    let force = record_fields(&log, &[FieldRequest::raw("table", "force")], None);
    assert!(
        matches!(
            force,
            Err(Error::Binding(BindingError::NoNumber { messages: 3, .. }))
        ),
        "{force:?}"
    );
}

#[test]
fn counters_of_time_that_begin_again_go_on() {
    // milliseconds in 16 bits, microseconds in 32 bits, the seconds of a day and of a GPS week
    for (name, holds, step, unit_ns) in [
        ("time_ms", 1_i64 << 16, 20, 1_000_000),
        ("time_ms", 1 << 32, 20, 1_000_000),
        ("micros", 1 << 32, 20_000, 1000),
        ("time_s", 86_400, 1, 1_000_000_000),
        ("time_s", 604_800, 1, 1_000_000_000),
    ] {
        let counts = (0..60_i64).map(|row| holds - 50 * step + row * step + 7 % step);
        let row = |count: i64| format!("{},1\n", count % holds);
        let rows: String = counts.clone().map(row).collect();
        let file = csv(&format!("{name},x\n{rows}"));
        let (times, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
        let expected: Vec<i64> = counts.map(|count| count * unit_ns).collect();
        assert_eq!(times, expected, "{name}");
        let is_told = notes
            .iter()
            .any(|note| note.contains("(1 times): its times go on"));
        assert!(is_told, "{notes:?}");
    }
    // local times at the end of summer time
    let file = csv(
        "time,x\n2024-10-27 02:59:57,1\n2024-10-27 02:59:58,1\n2024-10-27 02:59:59,1\n2024-10-27 02:00:00,1\n2024-10-27 02:00:01,1\n",
    );
    let (times, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
    assert_eq!(times[4] - times[0], 4_000_000_000, "{notes:?}");
    // one wrong time, of which the fall back is no turn
    let file = csv("time_ms,x\n0,1\n20,1\n40,1\n40000,1\n60,1\n80,1\n");
    let (_, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
    assert!(
        !notes.iter().any(|note| note.contains("its times go on")),
        "{notes:?}"
    );
    // a recorder that starts again
    let file = csv("time_ms,x\n60000,1\n60020,1\n60040,1\n0,1\n20,1\n");
    let (_, _, notes) = field(&Log::open(&file.path).unwrap(), "x");
    assert!(
        !notes.iter().any(|note| note.contains("its times go on")),
        "{notes:?}"
    );
}

#[test]
fn the_dates_of_a_spreadsheet_can_be_stated() {
    let file = csv("Datum;x\n45244,925925926;1\n");
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(error.contains("days"), "{error}");
    let mut days = ReadOptions::default();
    days.table.time_unit = Some(TimeUnit::Days);
    let log = Log::open_with(&file.path, &days).unwrap();
    // 14 November 2023, 22:13:20, to the last digit that is written
    let (times, _, notes) = field(&log, "x");
    assert!(
        (times[0] - 1_700_000_000_000_000_000).abs() < 100_000,
        "{times:?}"
    );
    assert!(
        notes.iter().any(|note| note.contains("UTC is assumed")),
        "{notes:?}"
    );
}

#[test]
fn a_line_that_names_other_columns_ends_the_rows_that_are_read() {
    // the same names again cost nothing, others what follows them, up to the first ones
    let file = csv(
        "time_s,x,y\n1,10,20\ntime_s,x,y\n2,11,21\ntime_s,y,x\n3,22,12\n4,23,13\ntime_s,x,y\n5,14,24\n",
    );
    let log = Log::open(&file.path).unwrap();
    let (times, values, _) = field(&log, "x");
    assert_eq!(values, [10.0, 11.0, 14.0]);
    assert_eq!(times[2], 5_000_000_000);
    assert_eq!(log.losses().ranges.len(), 1);
}

#[test]
fn an_open_quotation_mark_costs_its_line() {
    let rows: String = (2..60).map(|row| format!("{row},{row},ok\n")).collect();
    for (first, lost) in [("1,\"1,ok", 1), ("1,1,\"ok", 1), ("1,1,\"two\nlines\"", 0)] {
        let file = csv(&format!("time_s,x,remark\n0,0,ok\n{first}\n{rows}"));
        let log = Log::open(&file.path).unwrap();
        let (_, values, _) = field(&log, "x");
        assert_eq!(values.len(), 60 - lost, "{first}");
        assert_eq!(log.losses().ranges.len(), lost, "{first}");
    }
}

#[test]
fn sensors_and_axes_in_rows_of_their_own_are_signals_of_their_own() {
    let axis = |text: &mut String, at: usize, sensor: &str, axis: &str, value: f64| {
        *text += &format!("{}.5,{sensor},good,{axis},{value}\n", at / 10);
    };
    let mut text = String::from("time_s,device,quality,direction,measured\n");
    for at in (0..200).step_by(10) {
        for (sensor, factor) in [("acc", 1.0), ("gyro", 100.0)] {
            for (of, name) in ["x", "y", "z"].iter().enumerate() {
                axis(&mut text, at, sensor, name, factor * (at + of) as f64);
            }
        }
    }
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.topics()[0].message_count, Some(20));
    for (name, first) in [("acc_x", 0.0), ("acc_z", 2.0), ("gyro_y", 100.0)] {
        let (times, values, notes) = field(&log, name);
        assert_eq!((times[1], values.len()), (1_500_000_000, 20), "{name}");
        let step = if first < 100.0 { 10.0 } else { 1000.0 };
        assert_eq!(values[..2], [first, first + step], "{name}");
        let told = "its name in \"device\", \"direction\", its value in \"measured\"";
        assert!(notes.iter().any(|note| note.contains(told)), "{notes:?}");
    }
    // several values of each sensor; then names that are numbers
    let mut text = String::from("time_s,node,x,y\n");
    for at in 0..20 {
        text += &format!("{at},left,{at},2\n{at},right,{at},3\n");
    }
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(field(&log, "left_y").1, [2.0; 20]);
    assert_eq!(field(&log, "right_y").1, [3.0; 20]);
    let mut text = String::from("time_s,signal,value\n");
    for at in 0..20 {
        text += &format!("{at},101,{at}\n{at},102,-1\n");
    }
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(field(&log, "column_102").1, [-1.0; 20]);
}

#[test]
fn texts_beside_coarse_times_name_no_signals() {
    // ten rows a second under stamps of whole seconds, with a state and with a text that never comes again
    let mut text = String::from("time_s,state,remark,x\n");
    for at in 0..200 {
        let state = ["idle", "drive"][at / 7 % 2];
        text += &format!("{},{state},r{at}a,{at}\n", at / 10);
    }
    let file = csv(&text);
    let log = Log::open(&file.path).unwrap();
    assert_eq!(field(&log, "x").1.len(), 200);
}

fn fields(bytes: &[u8]) -> (Log, TempLog, Vec<String>) {
    let file = TempLog::new("table", bytes);
    let log = Log::open(&file.path).unwrap();
    let (contents, _) = topic_contents(&log).unwrap();
    let fields = contents.iter().flat_map(|of| &of.fields);
    let names = fields.map(|field| field.field.clone()).collect();
    (log, file, names)
}

#[test]
fn lines_of_json_are_rows() {
    let text = "{\"ts\":1700000000.5,\"imu\":{\"az\":9.81,\"g\":[0.1,0.2]},\"state\":\"up\"}\n\
                {\"ts\":1700000001.5,\"boom\":0.25,\"imu\":{\"az\":9.7,\"g\":[0.3]}}\n{\"ts\":17000\n\
                {\"ts\":1700000002.5,\"boom\":0.5}\n";
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(text.as_bytes()).unwrap();
    for bytes in [text.as_bytes(), &packed.finish().unwrap()] {
        let (log, _file, names) = fields(bytes);
        assert_eq!(names, ["imu_az", "imu_g_0", "imu_g_1", "boom"]);
        let (times, values, notes) = field(&log, "imu_az");
        assert_eq!(values, [9.81, 9.7]);
        assert_eq!(
            times,
            [1_700_000_000_500_000_000, 1_700_000_001_500_000_000]
        );
        assert!(
            notes.iter().any(|note| note.contains("JSON object")),
            "{notes:?}"
        );
        assert_eq!(field(&log, "boom").1, [0.25, 0.5]);
        assert_eq!(log.losses().ranges[0].message_count, Some(1));
    }
    // one signal in each line
    let text = "{\"time\":1700000000,\"name\":\"boom\",\"value\":1}\n{\"time\":1700000000,\"name\":\"az\",\"value\":2}\n\
                {\"time\":1700000001,\"name\":\"boom\",\"value\":3}\n{\"time\":1700000001,\"name\":\"az\",\"value\":4}\n";
    let (log, _file, names) = fields(text.as_bytes());
    assert_eq!(names, ["boom", "az"]);
    assert_eq!(field(&log, "az").1, [2.0, 4.0]);
}

#[test]
fn lines_of_json_do_not_fill_the_disk_with_empty_cells() {
    let keys: Vec<String> = (0..4000).map(|key| format!("\"c{key}\":1")).collect();
    let row = "{\"ts\":1700000000.5,\"x\":1}\n".to_owned();
    let wide = format!("{{\"ts\":1700000001.5,{}}}\n", keys.join(","));
    let text = row + &wide + &"{\"c1\":1}\n".repeat(4000);
    let (log, _file, _names) = fields(text.as_bytes());
    let ranges = &log.losses().ranges;
    let tail = ranges.iter().filter(|range| range.part == LostPart::Tail);
    assert_eq!(tail.count(), 1, "{ranges:?}");
}

/// Of one signal in each row, Parquet has the names as texts, which are not read: the values of all would be one signal.
#[test]
fn signals_in_rows_of_parquet_are_refused() {
    let names = ["boom", "az"].map(Some).to_vec();
    let times = vec![Some(1_700_000_000), Some(1_700_000_000)];
    let bytes = parquet(&[
        ("timestamp", Column::Whole64(times, None)),
        ("name", Column::Text(names)),
        ("value", Column::Double(vec![Some(1.0), Some(2.0)])),
    ]);
    let error = Log::open(&TempLog::new("table", &bytes).path).unwrap_err();
    assert!(error.to_string().contains("pivot_table"), "{error}");
}

#[test]
fn annotated_csv_of_influxdb_has_a_field_for_each_series() {
    let series = |index: usize, kind: &str, name: &str, values: [&str; 2]| {
        let row = |second: usize, value: &str| {
            format!(
                ",,{index},2023-11-14T22:00:00Z,2023-11-14T22:13:2{second}.5Z,{value},{name},m1\r\n"
            )
        };
        format!(
            "#group,false,false,true,false,false,true,true\r\n#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,{kind},\
             string,string\r\n#default,_result,,,,,,\r\n,result,table,_start,_time,_value,_field,machine\r\n{}{}\r\n",
            row(0, values[0]),
            row(1, values[1])
        )
    };
    let text = series(0, "double", "boom", ["1.5", "2.5"]) + &series(1, "long", "gear", ["3", "4"]);
    let (log, _file, names) = fields(text.as_bytes());
    assert_eq!(names, ["boom", "gear"]);
    let expected = [1_700_000_000_500_000_000, 1_700_000_001_500_000_000];
    for (name, values) in [("boom", [1.5, 2.5]), ("gear", [3.0, 4.0])] {
        let (times, found, _) = field(&log, name);
        assert_eq!(
            (&times[..], &found[..]),
            (&expected[..], &values[..]),
            "{name}"
        );
    }
    assert!(log.losses().is_empty(), "{:?}", log.losses());
}

#[test]
fn what_has_no_reader_is_refused_with_the_way_out() {
    for (bytes, expected) in [
        (&b"PK\x03\x04\x14\0"[..], "CSV"),
        (b"ARROW1\0\0", "Parquet"),
        (
            b"***BUSMASTER Ver 3.2.2***\n***PROTOCOL CAN***\n",
            "Vector ASC",
        ),
        (b"[{\"time\":1,\"x\":2},{\"time\":2,\"x\":3}]", "jq"),
        (b"{\n  \"time\": 1\n}\n", "jq"),
        (b"{\"boom\":1,\"az\":2}\n{\"boom\":2,\"az\":3}\n", "jq"),
        (
            b"Time,Channel,ID,Flags,DLC,Data0\n0.5,0,257,0,1,10\n",
            "candump",
        ),
        (b"\x0a\x0d\x0d\x0a\x1c\0\0\0", "candump"),
    ] {
        let file = TempLog::new("other", bytes);
        let error = Log::open(&file.path).unwrap_err();
        assert!(
            matches!(error, Error::Unsupported { .. } | Error::Table { .. }),
            "{error}"
        );
        assert!(error.to_string().contains(expected), "{error}");
    }
}
