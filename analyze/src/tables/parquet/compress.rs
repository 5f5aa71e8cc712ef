//! Compresses the pages of columns.
//!
//! Each thread keeps its compressor and the memory of it. The format's own writer would make one for each column of a
//! row group, and one to decompress, which takes as long as compressing a page.

use std::cell::RefCell;

use bytes::Bytes;
use parquet::basic::{Compression, ZstdLevel};
use parquet::column::page::{CompressedPage, Page, PageWriteSpec, PageWriter};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::{ParquetError, Result};
use zstd::bulk::Compressor;

const LEVEL: i32 = 1;

thread_local! {
    static COMPRESSOR: RefCell<Option<Compressor<'static>>> = const { RefCell::new(None) };
}

/// Compresses pages that were not, and passes them on.
pub(super) struct CompressingWriter<W> {
    pages: W,
}

impl<W: PageWriter> CompressingWriter<W> {
    pub(super) fn new(pages: W) -> Self {
        Self { pages }
    }
}

impl<W: PageWriter> PageWriter for CompressingWriter<W> {
    fn write_page(&mut self, page: CompressedPage) -> Result<PageWriteSpec> {
        let mut packed = page.compressed_page().clone();
        match &mut packed {
            Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. } => *buf = compress(buf)?,
            Page::DataPageV2 { .. } => {
                let text = "expected pages of version 1, which are compressed as a whole";
                return Err(ParquetError::General(text.into()));
            }
        }
        let unpacked_bytes = page.uncompressed_size();
        self.pages
            .write_page(CompressedPage::new(packed, unpacked_bytes))
    }

    fn close(&mut self) -> Result<()> {
        self.pages.close()
    }
}

fn compress(bytes: &[u8]) -> Result<Bytes> {
    COMPRESSOR.with_borrow_mut(|kept| {
        let compressor = match kept {
            Some(compressor) => compressor,
            None => kept.insert(Compressor::new(LEVEL)?),
        };
        Ok(compressor.compress(bytes)?.into())
    })
}

/// States in the metadata of a column that its pages are compressed.
pub(super) fn stated(closed: ColumnCloseResult) -> Result<ColumnCloseResult> {
    let compression = Compression::ZSTD(ZstdLevel::try_new(LEVEL)?);
    let metadata = closed.metadata.into_builder();
    Ok(ColumnCloseResult {
        metadata: metadata.set_compression(compression).build()?,
        ..closed
    })
}
