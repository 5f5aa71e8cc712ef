//! The types that fields of a message can have.

/// Begins every message in CDR, little endian: the identifier of the encoding, and its options.
pub const CDR: [u8; 4] = [0, 1, 0, 0];

/// The dialect of a definition. The languages are nearly the same, the encodings differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dialect {
    /// `ros2msg`, encoded as CDR.
    Ros2,
    /// `ros1msg`, encoded without padding.
    Ros1,
}

/// A numeric type of fixed width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberType {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl NumberType {
    pub(crate) fn from_name(name: &str, dialect: Dialect) -> Option<Self> {
        Some(match name {
            "byte" if dialect == Dialect::Ros1 => Self::I8,
            "bool" => Self::Bool,
            "int8" => Self::I8,
            "uint8" | "byte" | "char" => Self::U8,
            "int16" => Self::I16,
            "uint16" => Self::U16,
            "int32" => Self::I32,
            "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in bytes, which is also the alignment.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FieldType {
    Number(NumberType),
    Text,
    WideText,
    /// A nested message, by its normalised name.
    Message(String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Repetition {
    Once,
    Fixed(u32),
    /// Preceded by its length, bounded or not.
    Sequence,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) field_type: FieldType,
    pub(crate) repetition: Repetition,
}

/// `sensor_msgs/msg/Imu`, `sensor_msgs/Imu` and the `sensor_msgs.Imu` of protobuf are one type.
pub(crate) fn normal_type_name(name: &str) -> String {
    name.replace('.', "/").replacen("/msg/", "/", 1)
}

impl Dialect {
    /// The dialect of definitions that accompanies a message encoding.
    pub(crate) fn of_encoding(encoding: &str) -> Option<Self> {
        match encoding {
            "cdr" => Some(Self::Ros2),
            "ros1" => Some(Self::Ros1),
            _ => None,
        }
    }
}
