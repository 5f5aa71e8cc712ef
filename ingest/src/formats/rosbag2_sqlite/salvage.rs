//! Reads the rows of a damaged database page by page, independent of interior pages.

use std::ops::{ControlFlow, Range};

use super::page::{self, Cell, Columns, PageKind, PageSize, Value};
use crate::{file::FileBytes, message::Error};

/// A longer payload is taken as a damaged length.
const PAYLOAD_LIMIT_BYTES: u64 = 1 << 30;
/// `id`, `topic_id`, `timestamp`, `data`.
const MESSAGE_COLUMNS: usize = 4;

/// A row of the table of messages.
pub(super) struct MessageRow<'s> {
    pub(super) id: i64,
    pub(super) topic: i64,
    pub(super) time_ns: i64,
    pub(super) data: &'s [u8],
    /// Whether the id fits between its neighbours.
    pub(super) is_in_order: bool,
    /// The byte range of the page on which it begins.
    pub(super) page: Range<u64>,
}

/// A row of the table of topics.
pub(super) struct TopicRow {
    pub(super) id: i64,
    pub(super) name: String,
    pub(super) type_name: String,
    pub(super) encoding: String,
    /// The quality of service that its writers offered, where it is known.
    pub(super) offered_qos: Option<String>,
}

/// Reads the pages of one file.
pub(super) struct Salvage<'f> {
    file: &'f FileBytes,
    size: PageSize,
    pages: u32,
    /// Whether the use of each page is known.
    is_known: Vec<bool>,
    page: Vec<u8>,
    payload: Vec<u8>,
}

impl<'f> Salvage<'f> {
    /// `None` if not even the page size is known.
    pub(super) fn open(file: &'f FileBytes) -> Result<Option<Self>, Error> {
        let header = file.read_vec(0, file.len().min(32))?;
        let Some(size) = PageSize::parse(&header) else {
            return Ok(None);
        };
        // An incomplete last page is omitted.
        let pages = u32::try_from(file.len() / size.bytes).unwrap_or(u32::MAX);
        Ok(Some(Self {
            file,
            size,
            pages,
            is_known: vec![false; pages as usize],
            page: Vec::new(),
            payload: Vec::new(),
        }))
    }

    /// All topics that can be found.
    pub(super) fn topics(&mut self) -> Result<Vec<TopicRow>, Error> {
        let mut topics: Vec<TopicRow> = Vec::new();
        for number in 0..self.pages {
            if self.load(number)? != PageKind::Leaf {
                continue;
            }
            let rows = page::cells(&self.page, number == 0, self.size);
            for topic in rows.filter_map(|cell| topic_row(&cell)) {
                if !topics.iter().any(|known| known.id == topic.id) {
                    topics.push(topic);
                }
            }
        }
        Ok(topics)
    }

    /// Passes every complete message to `take`, in the order of their ids.
    pub(super) fn messages(
        &mut self,
        visit: &mut dyn FnMut(&MessageRow<'_>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Error> {
        let mut leaves = self.message_leaves()?;
        leaves.sort_unstable();
        for (place, &(_, number)) in leaves.iter().enumerate() {
            self.load(number)?;
            let leaf = std::mem::take(&mut self.page);
            let next_id = leaves.get(place + 1).map_or(i64::MAX, |(first, _)| *first);
            let flow = self.leaf(&leaf, number, next_id, visit)?;
            self.page = leaf;
            if flow.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// The byte ranges whose use is unknown; call after [`messages`](Self::messages).
    pub(super) fn unknown_ranges(&self) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for (number, _) in self
            .is_known
            .iter()
            .enumerate()
            .filter(|(_, known)| !**known)
        {
            let start = number as u64 * self.size.bytes;
            let end = start + self.size.bytes;
            match ranges.last_mut() {
                Some(last) if last.end == start => last.end = end,
                _ => ranges.push(start..end),
            }
        }
        ranges
    }

    /// The leaves that hold messages, by the id of the first one.
    fn message_leaves(&mut self) -> Result<Vec<(i64, u32)>, Error> {
        let mut leaves = Vec::new();
        for number in 0..self.pages {
            let kind = self.load(number)?;
            let is_tree = kind != PageKind::NoTree;
            if let Some(known) = self.is_known.get_mut(number as usize) {
                *known |= is_tree;
            }
            if kind != PageKind::Leaf {
                continue;
            }
            let mut rows = page::cells(&self.page, number == 0, self.size);
            let first = rows.find(|cell| message_columns(cell).is_some());
            if let Some(cell) = first {
                leaves.push((cell.row_id, number));
            }
        }
        Ok(leaves)
    }

    fn leaf(
        &mut self,
        leaf: &[u8],
        number: u32,
        id_of_next_leaf: i64,
        visit: &mut dyn FnMut(&MessageRow<'_>) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Error> {
        let mut cells = page::cells(leaf, number == 0, self.size).peekable();
        let mut last_id = i64::MIN;
        let offset = u64::from(number) * self.size.bytes;
        let page = offset..offset + self.size.bytes;
        while let Some(cell) = cells.next() {
            let next_id = cells.peek().map_or(id_of_next_leaf, |next| next.row_id);
            let is_in_order = last_id < cell.row_id && cell.row_id < next_id;
            if is_in_order {
                last_id = cell.row_id;
            }
            let Some(columns) = message_columns(&cell) else {
                continue;
            };
            if !self.load_payload(&cell)? {
                continue;
            }
            let payload = match cell.overflow {
                Some(_) => self.payload.as_slice(),
                None => cell.local,
            };
            let value = |index| columns.value(index, payload);
            if let (
                Some(Value::Integer(topic)),
                Some(Value::Integer(time_ns)),
                Some(Value::Blob(data)),
            ) = (value(1), value(2), value(3))
            {
                let row = MessageRow {
                    id: cell.row_id,
                    topic,
                    time_ns,
                    data,
                    is_in_order,
                    page: page.clone(),
                };
                if visit(&row).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn load(&mut self, number: u32) -> Result<PageKind, Error> {
        let offset = u64::from(number) * self.size.bytes;
        self.file
            .read_into(&mut self.page, offset, self.size.bytes)?;
        Ok(page::kind(&self.page, number == 0))
    }

    /// Assembles a payload from its overflow pages; `false` if it is incomplete.
    fn load_payload(&mut self, cell: &Cell<'_>) -> Result<bool, Error> {
        let Some(mut next) = cell.overflow else {
            return Ok(true);
        };
        if cell.payload_bytes > PAYLOAD_LIMIT_BYTES.min(self.file.len()) {
            return Ok(false);
        }
        self.payload.clear();
        self.payload.extend_from_slice(cell.local);
        while (self.payload.len() as u64) < cell.payload_bytes {
            // Pages are numbered from one.
            let Some(number) = next.checked_sub(1).filter(|number| *number < self.pages) else {
                return Ok(false);
            };
            let kind = self.load(number)?;
            let is_tree = self.is_known.get(number as usize) == Some(&true);
            if is_tree && kind != PageKind::NoTree && !self.looks_like_overflow() {
                return Ok(false);
            }
            let Some((following, bytes)) = self.size.overflow(&self.page) else {
                return Ok(false);
            };
            let missing = cell.payload_bytes - self.payload.len() as u64;
            let taken = (bytes.len() as u64).min(missing) as usize;
            self.payload
                .extend_from_slice(bytes.get(..taken).unwrap_or_default());
            if let Some(known) = self.is_known.get_mut(number as usize) {
                *known = true;
            }
            next = following;
        }
        // The last page of a payload has no successor.
        Ok(next == 0)
    }

    /// Overflow pages begin with the number of the next page, whose first byte may look like a tree
    /// page.
    fn looks_like_overflow(&self) -> bool {
        let next = self
            .page
            .first_chunk()
            .map_or(0, |b| u32::from_be_bytes(*b));
        next <= self.pages
    }
}

/// The columns of a row with the shape of a message.
fn message_columns(cell: &Cell<'_>) -> Option<Columns> {
    let columns = Columns::parse(cell.local, cell.payload_bytes)?;
    if columns.count() != MESSAGE_COLUMNS || !columns.is_blob(3) {
        return None;
    }
    let value = |index| columns.value(index, cell.local);
    let is_message = value(0) == Some(Value::Null)
        && matches!(value(1), Some(Value::Integer(_)))
        && matches!(value(2), Some(Value::Integer(_)));
    is_message.then_some(columns)
}

fn topic_row(cell: &Cell<'_>) -> Option<TopicRow> {
    let columns = Columns::parse(cell.local, cell.payload_bytes)?;
    let text = |index| match columns.value(index, cell.local) {
        Some(Value::Text(text)) => String::from_utf8(text.to_vec()).ok(),
        _ => None,
    };
    let (name, type_name, encoding) = (text(1)?, text(2)?, text(3)?);
    let is_topic = name.starts_with('/') && type_name.contains('/') && !type_name.starts_with('/');
    (is_topic && columns.value(0, cell.local) == Some(Value::Null)).then_some(TopicRow {
        id: cell.row_id,
        name,
        type_name,
        encoding,
        offered_qos: text(4),
    })
}
