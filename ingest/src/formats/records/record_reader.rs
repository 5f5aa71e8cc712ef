//! Reads one file of records: opens its index, then walks its messages.

use std::ops::ControlFlow;

use tipwatch_language::say;

use super::{
    contents::{ChunkDirectory, Contents, ExtraPlace},
    delivery::Delivery,
    extras,
    grammar::{Grammar, Kind},
    head_window::HeadWindow,
    intake::Intake,
    read_ahead::KeptChunk,
    routes::{ChannelTable, Routes},
    scan, walk,
};
use crate::{
    file::{FileBytes, LogFile},
    formats::reader::{FileReader, Request},
    message::{Error, Extra, Losses, TopicTable},
};

/// One file of records.
pub(crate) struct RecordReader<G> {
    file: FileBytes,
    chunks: ChunkDirectory,
    channels: ChannelTable,
    span_ns: Option<(i64, i64)>,
    /// Whether the index states that nothing was recorded: then no record marks the end.
    is_empty: bool,
    /// Attachments and metadata records, if the index lists them all.
    extras: Option<Vec<ExtraPlace>>,
    /// The first messages of several topics are looked at before all are read, and they are in one chunk as a rule.
    kept: KeptChunk,
    grammar: std::marker::PhantomData<G>,
}

impl<G: Grammar> RecordReader<G> {
    pub(crate) fn open(
        named: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let (mut file, written) = FileBytes::of(named)?;
        if let Some(written) = written {
            let whole_bytes = written.bytes + written.unwritten;
            let mut note = written.note();
            if ends_with_a_record::<G>(&file, whole_bytes)? {
                file = file.cut_at(whole_bytes);
                let (count, fill) = (written.unwritten, format!("0x{:02x}", written.fill));
                note = Some(say!(
                    "{count} bytes at the end of the file, each {fill}, may never have been written: the last record ends with them"
                ));
            }
            let note = note.unwrap_or_default();
            losses.note(format!("{}: {note}", named.path().display()));
        }
        let by_index = G::contents(&file)?;
        let is_empty =
            |contents: &Contents| contents.chunks.is_empty() && contents.channels.is_empty();
        let is_empty = by_index.as_ref().is_some_and(is_empty);
        let mut contents = match by_index {
            Some(contents) => contents,
            None => {
                file.require_whole("without an intact index")?;
                losses.note(say!(
                    "{}: no intact index: the whole file was scanned for its topics",
                    named.path().display()
                ));
                scan::read::<G>(&file, losses)?
            }
        };
        // Of a file in a bucket, those that are read are checked then.
        if !file.is_partial() {
            drop_wrong_places::<G>(&mut contents.chunks, &file, losses)?;
        }
        let extras = contents.extras.take();
        let channels = ChannelTable::register(&contents, topics);
        let span_ns = contents.whole_span_ns();
        Ok(Self {
            file,
            chunks: contents.chunks,
            channels,
            span_ns,
            is_empty,
            extras,
            kept: KeptChunk::default(),
            grammar: std::marker::PhantomData,
        })
    }
}

impl<G: Grammar> FileReader for RecordReader<G> {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        // The walk and the visitor both record losses; those of the walk are merged afterwards.
        let mut losses = Losses::default();
        if self.file.is_partial() && self.chunks.is_empty() {
            self.file.require_whole("without chunks")?;
        }
        let routes = Routes::new(&self.channels, request.wanted);
        let intake = request.batches;
        let intake = intake.map(|batches| Intake::new(&routes, batches.empty));
        let mut delivery = Delivery::new(&routes, &self.chunks, request);
        let flow = walk::walk::<G, _>(
            &self.file,
            &self.chunks,
            self.is_empty,
            intake.as_ref(),
            &self.kept,
            &mut delivery,
            &mut losses,
        )?;
        if flow.is_continue() {
            delivery.report_missing(&mut losses);
        }
        request.losses.merge(&losses);
        // `merge` does not add them up over the files of a log
        request.losses.integrity.chunks_passed_over += losses.integrity.chunks_passed_over;
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.span_ns
    }

    fn extras(&self, with_attachments: bool, take: &mut dyn FnMut(Extra<'_>)) -> Result<(), Error> {
        let mut places = extras::ExtraRanges::default();
        match self.extras.as_ref().filter(|_| self.file.is_partial()) {
            Some(listed) => {
                let listed = listed.iter().filter(|place| {
                    let length = place.bytes.end - place.bytes.start;
                    length <= extras::RECORD_LIMIT_BYTES
                        && (with_attachments || !place.is_attachment)
                });
                places.0.extend(listed.map(|place| place.bytes.clone()));
            }
            None => {
                self.file
                    .require_whole("without an index of its metadata")?;
                self.find_extras(&mut places)?;
            }
        }
        self.file.plan(places.0.clone());
        for bytes in places.0 {
            let record = self.file.read_vec(bytes.start, bytes.end - bytes.start)?;
            if let Some(extra) = G::extra(&record) {
                take(extra);
            }
        }
        Ok(())
    }
}

impl<G: Grammar> RecordReader<G> {
    fn find_extras(&self, places: &mut extras::ExtraRanges) -> Result<(), Error> {
        // Reading reports the damage.
        let _ = walk::walk::<G, _>(
            &self.file,
            &self.chunks,
            self.is_empty,
            None,
            &self.kept,
            places,
            &mut Losses::default(),
        )?;
        Ok(())
    }
}

/// Whether a record that begins in what was written ends where the whole file does: then equal bytes behind may be its content.
fn ends_with_a_record<G: Grammar>(written: &FileBytes, whole_bytes: u64) -> Result<bool, Error> {
    let mut window = HeadWindow::new(written);
    let mut at = G::FIRST_RECORD;
    while at < written.len() {
        let head = window.bytes(at, G::HEAD_BYTES as u64)?;
        let Some(frame) = G::frame(head) else {
            return Ok(false);
        };
        at = at.saturating_add(frame.length_bytes);
    }
    Ok(at == whole_bytes)
}

/// Drops chunks that are not where the index places them, and notes whether the first one has a checksum.
fn drop_wrong_places<G: Grammar>(
    chunks: &mut ChunkDirectory,
    file: &FileBytes,
    losses: &mut Losses,
) -> Result<(), Error> {
    let mut window = HeadWindow::new(file);
    let mut wrong = Vec::new();
    let mut is_first = true;
    for &offset in chunks.keys() {
        let head = window.bytes(offset, G::HEAD_BYTES as u64)?;
        let is_chunk = G::frame(head).is_some_and(|frame| frame.kind == Kind::Chunk);
        match G::chunk(head).filter(|_| is_chunk) {
            Some(chunk) if is_first => losses.saw_checksum(chunk.has_checksum()),
            Some(_) => {}
            None => wrong.push(offset),
        }
        is_first = false;
    }
    if let Some(first) = wrong.first() {
        losses.note(say!(
            "{}: {} chunks of the index are not at their offsets, the first at byte {first}",
            file.path().display(),
            wrong.len(),
        ));
    }
    chunks.retain(|offset, _| !wrong.contains(offset));
    Ok(())
}
