//! Messages as bytes: what stands between the network and the decoders of logs.

use std::convert::Infallible;

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};

/// A message with the four bytes of its encapsulation, as a recorder writes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Payload(pub(super) Vec<u8>);

/// Reads and writes messages as they are.
#[derive(Debug, Clone, Copy)]
pub(super) struct AsBytes;

const BIG_ENDIAN: [u8; 4] = [0, 0, 0, 0];
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

impl DeserializerAdapter<Payload> for AsBytes {
    type Error = Infallible;
    type Decoded = Payload;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[
            RepresentationIdentifier::CDR_LE,
            RepresentationIdentifier::CDR_BE,
        ]
    }

    fn transform_decoded(decoded: Payload) -> Payload {
        decoded
    }
}

impl DefaultDecoder<Payload> for AsBytes {
    type Decoder = Self;
    const DECODER: Self = Self;
}

impl Decode<'_, Payload> for AsBytes {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Payload, Infallible> {
        let head = match encoding == RepresentationIdentifier::CDR_BE {
            true => BIG_ENDIAN,
            false => LITTLE_ENDIAN,
        };
        Ok(Payload([&head, bytes].concat()))
    }
}

impl SerializerAdapter<Payload> for AsBytes {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(payload: &Payload) -> Result<Bytes, Infallible> {
        let body = payload.0.get(LITTLE_ENDIAN.len()..).unwrap_or_default();
        Ok(Bytes::copy_from_slice(body))
    }
}
