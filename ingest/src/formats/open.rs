//! Opens one file with the reader of its format.

use tipwatch_can::ContainerFormat;

use super::reader::FileReader;
use crate::{
    file::{Format, LogFile, ReadOptions},
    formats::{
        bag::Bag,
        can_container::CanReader,
        mcap::Mcap,
        records::RecordReader,
        rosbag2_sqlite::SqliteReader,
        table::{CsvReader, ParquetReader},
    },
    message::{Error, Losses, TopicTable},
};

/// Opens one file of a log with the reader of its format.
pub(crate) fn open(
    format: Format,
    file: &LogFile,
    options: &ReadOptions,
    topics: &mut TopicTable,
    losses: &mut Losses,
) -> Result<Box<dyn FileReader>, Error> {
    let table = &options.table;
    if !matches!(format, Format::Mcap | Format::Ros1Bag) {
        file.require_whole(&format!("a {format} file, which is read as a whole"))?;
    }
    Ok(match format {
        Format::Mcap => Box::new(RecordReader::<Mcap>::open(file, topics, losses)?),
        Format::Ros1Bag => Box::new(RecordReader::<Bag>::open(file, topics, losses)?),
        Format::Rosbag2Sqlite => Box::new(SqliteReader::open(file, topics, losses)?),
        Format::Csv => Box::new(CsvReader::open(file, table, topics, losses)?),
        Format::Parquet => Box::new(ParquetReader::open(file, table, topics, losses)?),
        Format::Candump => can(ContainerFormat::Candump, file, topics, losses)?,
        Format::Asc => can(ContainerFormat::Asc, file, topics, losses)?,
        Format::Blf => can(ContainerFormat::Blf, file, topics, losses)?,
        Format::Trc => can(ContainerFormat::Trc, file, topics, losses)?,
        Format::Mf4 => can(ContainerFormat::Mf4, file, topics, losses)?,
    })
}

fn can(
    format: ContainerFormat,
    file: &LogFile,
    topics: &mut TopicTable,
    losses: &mut Losses,
) -> Result<Box<dyn FileReader>, Error> {
    Ok(Box::new(CanReader::open(format, file, topics, losses)?))
}
