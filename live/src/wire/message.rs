//! Common parts of every message on the wire: a head, a checksum, and a layout that both sides compare.

use std::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

/// "TIPWAT" and the version of the wire format: the first number of every message.
pub const MAGIC: u64 = u64::from_le_bytes(*b"TIPWAT\x00\x03");

/// A message type: its layout, head and checksum.
pub trait Wire: ZeroCopySend + Debug + Copy + 'static {
    /// Name and version of the type on the wire.
    const TYPE_NAME: &'static str;
    /// FNV-1a hash over name, offset and size of each field.
    const LAYOUT: u64;
    /// The fields in order.
    const FIELDS: &'static [Field];
    /// Documentation of the type.
    const DOC: &'static [&'static str];

    /// A message of zeros, to be filled in.
    #[must_use]
    fn blank() -> Self;

    /// The head.
    fn head(&self) -> Head;

    /// Sets head and checksum: the last step before a message is sent.
    fn seal(&mut self, head: Head);

    /// Its bytes, as they are on the wire.
    fn bytes(&self) -> &[u8];

    /// The message of such bytes; `None` if they are not as many as its own.
    fn of_bytes(bytes: &[u8]) -> Option<Self>;

    /// Whether magic number and checksum are correct: the message is undamaged and of this version.
    fn is_whole(&self) -> bool;
}

/// The first fields of every message, after the magic number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Head {
    /// Sequence number, from zero for each source: a jump means lost messages.
    pub sequence: u64,
    /// Identifies the source: a producer's session, or a run of the monitor.
    pub source: u64,
    /// Hash of machine file and URDF.
    pub machine_hash: u64,
    /// Time to which the content applies (ns), by the sensors' clock.
    pub time_ns: i64,
    /// Publication time (ns), by this computer's CLOCK_MONOTONIC.
    pub published_ns: i64,
}

/// A field, for the C header.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// C type without dimensions.
    pub c_type: &'static str,
    /// Dimensions, outermost first.
    pub dimensions: &'static [usize],
    /// Offset (bytes).
    pub offset: usize,
    /// Documentation.
    pub doc: &'static [&'static str],
}

/// A type allowed for fields.
pub trait FieldType {
    /// C name without dimensions.
    const C_TYPE: &'static str;
    /// Dimensions, outermost first.
    const DIMENSIONS: &'static [usize];
}

macro_rules! scalar {
    ($($type:ty = $name:literal),*) => {
        $(impl FieldType for $type {
            const C_TYPE: &'static str = $name;
            const DIMENSIONS: &'static [usize] = &[];
        }
        impl<const N: usize> FieldType for [$type; N] {
            const C_TYPE: &'static str = $name;
            const DIMENSIONS: &'static [usize] = &[N];
        }
        impl<const N: usize, const M: usize> FieldType for [[$type; M]; N] {
            const C_TYPE: &'static str = $name;
            const DIMENSIONS: &'static [usize] = &[N, M];
        })*
    };
}

scalar!(
    u8 = "uint8_t",
    u32 = "uint32_t",
    u64 = "uint64_t",
    i64 = "int64_t",
    f64 = "double"
);

/// Defines the struct of a message: the head, the given fields and the checksum.
macro_rules! wire {
    (
        $(#[doc = $doc:literal])* $type_name:literal
        pub struct $name:ident { $($(#[doc = $field_doc:expr])* pub $field:ident: $type:ty,)* }
    ) => {
        wire! { @whole $(#[doc = $doc])* $type_name
            pub struct $name {
                /// [`MAGIC`]
                pub magic: u64,
                /// Sequence number, from zero for each source: a jump means lost messages.
                pub sequence: u64,
                /// Identifies the source.
                pub source: u64,
                /// Hash of machine file and URDF.
                pub machine_hash: u64,
                /// Time to which the content applies (ns), by the sensors' clock.
                pub time_ns: i64,
                /// Publication time (ns), by this computer's CLOCK_MONOTONIC.
                pub published_ns: i64,
                $($(#[doc = $field_doc])* pub $field: $type,)*
                /// CRC-32 (as in zlib) of all bytes before this field.
                pub checksum: u64,
            }
        }
    };
    (
        @whole $(#[doc = $doc:literal])* $type_name:literal
        pub struct $name:ident { $($(#[doc = $field_doc:expr])* pub $field:ident: $type:ty,)* }
    ) => {
        $(#[doc = $doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, ZeroCopySend)]
        #[type_name($type_name)]
        pub struct $name { $($(#[doc = $field_doc])* pub $field: $type,)* }

        impl Wire for $name {
            const TYPE_NAME: &'static str = $type_name;
            const LAYOUT: u64 = Fnv1a::new()
                $(.bytes(stringify!($field).as_bytes())
                    .number(std::mem::offset_of!($name, $field) as u64)
                    .number(size_of::<$type>() as u64))*
                .finish();
            const FIELDS: &'static [Field] = &[$(Field {
                name: stringify!($field),
                c_type: <$type as FieldType>::C_TYPE,
                dimensions: <$type as FieldType>::DIMENSIONS,
                offset: std::mem::offset_of!($name, $field),
                doc: &[$($field_doc),*],
            }),*];
            const DOC: &'static [&'static str] = &[$($doc),*];

            #[allow(unsafe_code, reason = "see inside")]
            fn blank() -> Self {
                // SAFETY: all fields are numbers or arrays of numbers, for which all bits zero are valid.
                unsafe { std::mem::zeroed() }
            }

            fn head(&self) -> Head {
                Head {
                    sequence: self.sequence,
                    source: self.source,
                    machine_hash: self.machine_hash,
                    time_ns: self.time_ns,
                    published_ns: self.published_ns,
                }
            }

            fn seal(&mut self, head: Head) {
                self.magic = MAGIC;
                self.sequence = head.sequence;
                self.source = head.source;
                self.machine_hash = head.machine_hash;
                self.time_ns = head.time_ns;
                self.published_ns = head.published_ns;
                self.checksum = own_checksum(self);
            }

            #[allow(unsafe_code, reason = "see inside")]
            fn bytes(&self) -> &[u8] {
                let size = size_of::<Self>();
                // SAFETY: they are those of the message, which has no padding: all are initialised.
                unsafe { std::slice::from_raw_parts(std::ptr::from_ref(self).cast(), size) }
            }

            #[allow(unsafe_code, reason = "see inside")]
            fn of_bytes(bytes: &[u8]) -> Option<Self> {
                // SAFETY: there are as many as are read, and all patterns of bits are valid: the fields are numbers.
                (bytes.len() == size_of::<Self>())
                    .then(|| unsafe { std::ptr::read_unaligned(bytes.as_ptr().cast()) })
            }

            fn is_whole(&self) -> bool {
                self.magic == MAGIC && self.checksum == own_checksum(self)
            }
        }

        // no padding: every shared byte is initialised
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$type>())*);
    };
}

/// CRC-32 (IEEE 802.3, as in zlib) of the bytes of a message before its checksum.
pub(crate) fn own_checksum<T: Wire>(message: &T) -> u64 {
    let covered = size_of::<T>() - size_of::<u64>();
    u64::from(crc32fast::hash(&message.bytes()[..covered]))
}

pub(crate) use wire;
