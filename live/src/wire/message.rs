//! What every message on the wire has: a head, a checksum, and a layout that both ends compare.

use std::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

/// "TIPWATCH" and the version of the wire: the first number of every message.
pub const MAGIC: u64 = u64::from_le_bytes(*b"TIPWAT\x00\x02");

/// A message type: its layout, its head and its checksum.
pub trait Wire: ZeroCopySend + Debug + Copy + 'static {
    /// Name of the type on the wire, with its version.
    const TYPE_NAME: &'static str;
    /// FNV-1a over name, place and size of each field.
    const LAYOUT: u64;
    /// The fields in their order.
    const FIELDS: &'static [Field];
    /// What it is for.
    const DOC: &'static [&'static str];

    /// All numbers zero: no message yet.
    #[must_use]
    fn blank() -> Self;

    /// The head.
    fn head(&self) -> Head;

    /// Sets the head and the checksum: the last thing before a message is sent.
    fn seal(&mut self, head: Head);

    /// Whether magic number and checksum are right: the message is whole and of this version.
    fn is_whole(&self) -> bool;
}

/// What every message begins with, after the magic number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Head {
    /// Counts the messages of a source from zero: a jump is a loss.
    pub sequence: u64,
    /// Tells this source from every other one: a producer's session, or a run of the monitor.
    pub source: u64,
    /// Hash of machine file and URDF.
    pub machine_hash: u64,
    /// When what it says holds (ns), by the clock of the sensors.
    pub time_ns: i64,
    /// When it was published (ns), by CLOCK_MONOTONIC of this computer.
    pub published_ns: i64,
}

/// A field, for the C header.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its type without dimensions, in C.
    pub c_type: &'static str,
    /// Its dimensions, outermost first.
    pub dimensions: &'static [usize],
    /// Where it is (bytes).
    pub offset: usize,
    /// What it means.
    pub doc: &'static [&'static str],
}

/// A type that a field may have.
pub trait FieldType {
    /// Its name in C, without dimensions.
    const C_TYPE: &'static str;
    /// Its dimensions, outermost first.
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
                /// Counts the messages of a source from zero: a jump is a loss.
                pub sequence: u64,
                /// Tells this source from every other one.
                pub source: u64,
                /// Hash of machine file and URDF.
                pub machine_hash: u64,
                /// When what it says holds (ns), by the clock of the sensors.
                pub time_ns: i64,
                /// When it was published (ns), by CLOCK_MONOTONIC of this computer.
                pub published_ns: i64,
                $($(#[doc = $field_doc])* pub $field: $type,)*
                /// CRC-32 (the one of zlib) of all bytes before this number.
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
                // SAFETY: all fields are numbers or arrays of them, for which zero bits are a value.
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

            fn is_whole(&self) -> bool {
                self.magic == MAGIC && self.checksum == own_checksum(self)
            }
        }

        // Without padding every byte that is shared is initialised.
        const _: () = assert!(size_of::<$name>() == 0 $(+ size_of::<$type>())*);
    };
}

/// CRC-32 (IEEE 802.3, the one of zlib) of the bytes of a message before its checksum.
#[allow(
    unsafe_code,
    reason = "the bytes of a message are what its checksum is of"
)]
pub(crate) fn own_checksum<T: Wire>(message: &T) -> u64 {
    let bytes = size_of::<T>() - size_of::<u64>();
    // SAFETY: the bytes are within the message, and initialised: `wire!` refuses types with padding.
    let bytes = unsafe { std::slice::from_raw_parts(std::ptr::from_ref(message).cast(), bytes) };
    u64::from(crc32fast::hash(bytes))
}

pub(crate) use wire;
