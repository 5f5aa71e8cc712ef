//! Tables read back as they were written, however they are divided into blocks.

use std::path::Path;

use super::read;
use super::write::{ROWS_OF_GROUP, TableWriter};
use crate::base::options::Precision;
use crate::tables::table::{Table, Value};

/// Rows from `first` on, of every type that our tables have.
fn block(first: i64, rows: i64) -> Table {
    let all = || first..first + rows;
    let mut table = Table::default();
    let times = all().map(|i| 1_700_000_000_123_456_789 + i * 10_000_001);
    table.add("time_ns", Some("ns"), times);
    let numbers: Vec<f64> = all()
        .map(|i| {
            if i % 7 == 3 {
                f64::NAN
            } else {
                (i as f64).sin()
            }
        })
        .collect();
    table.add_known("load_fl", "N", Precision::Double, &numbers);
    table.add_known("otf_fl", "N", Precision::Single, &numbers);
    table.add("valid", None, all().map(|i| i % 5 != 0));
    table.add(
        "verdict",
        None,
        all().map(|i| if i % 9 == 0 { "danger" } else { "safe" }),
    );
    table.add(
        "subject",
        None,
        all().map(|i| (i % 4 != 0).then(|| format!("wheel {}", i % 3))),
    );
    table.add("count", Some("draws"), all().map(|i| i as u32));
    let list = |i: i64| (i % 6 != 0).then(|| vec![Some(i as f64), None]);
    table.add("bins", Some("s"), all().map(list));
    let names = all().map(|i| (i % 8 != 0).then(|| vec!["a".to_string(); (i % 3) as usize]));
    table.add("reasons", None, names);
    table
}

/// Writes so many rows in blocks of such a size.
fn write_in_blocks(path: &Path, rows: i64, size: i64) {
    let mut writer = TableWriter::create(path, &block(0, 0), &[]).unwrap();
    for at in (0..rows).step_by(size as usize) {
        writer.write(&block(at, size.min(rows - at))).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn blocks_read_back_as_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blocks.parquet");
    let rows = ROWS_OF_GROUP as i64 + 1234;
    write_in_blocks(&path, rows, 5000);
    let (found, expected) = (read(&path).unwrap(), block(0, rows));
    assert_eq!(found.rows(), expected.rows());
    assert_eq!(found.columns().len(), expected.columns().len());
    for (found, expected) in found.columns().iter().zip(expected.columns()) {
        let name = expected.name();
        assert!(found.is_same(expected), "{} {name}", found.name());
        assert_eq!(found.unit(), expected.unit(), "{name}");
    }
    let mut values = found.column("bins").unwrap().values();
    assert_eq!(values.next(), Some(Value::Null));
    let Some(Value::List(list)) = values.next() else {
        panic!("expected a list");
    };
    assert!(list.iter().eq([Value::Float64(1.0), Value::Null]));
}

#[test]
fn the_division_into_blocks_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let path = |size: i64| folder.path().join(format!("{size}.parquet"));
    let sizes = [100_000, 4096, 777];
    for size in sizes {
        write_in_blocks(&path(size), 40_000, size);
    }
    let bytes = sizes.map(|size| std::fs::read(path(size)).unwrap());
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn a_block_with_other_columns_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blocks.parquet");
    let mut writer = TableWriter::create(&path, &block(0, 0), &[]).unwrap();
    let mut other = block(0, 10);
    other.add("more", None, std::iter::repeat_n(true, 10));
    let error = writer.write(&other).unwrap_err();
    assert!(error.to_string().contains("other columns"), "{error}");
}

#[test]
fn a_table_without_rows_keeps_its_columns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.parquet");
    let writer = TableWriter::create(&path, &block(0, 0), &[]).unwrap();
    writer.finish().unwrap();
    let found = read(&path).unwrap();
    assert_eq!(found.rows(), 0);
    assert_eq!(found.columns().len(), block(0, 0).columns().len());
}
