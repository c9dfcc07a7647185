//! CDR payloads and rmw_zenoh attachments.

use std::borrow::Cow;

use byteorder::{BigEndian, LittleEndian};
use hiroz_cdr::{CdrBuffer, CdrReader, CdrWriter, ZBUF_DESER_SOURCE};
use zenoh::bytes::ZBytes;
use zenoh::shm::ZShmMut;

use crate::topics::Message;

/// Encapsulation header of little-endian CDR (DDS-XTypes 7.6.2.1.2).
const CDR_LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
const CDR_BIG_ENDIAN: [u8; 4] = [0, 0, 0, 0];

/// Bytes of a message on the wire, header included.
pub(crate) fn encoded_len<M: Message>(message: &M) -> usize {
    CDR_LITTLE_ENDIAN.len() + message.cdr_serialized_size(0)
}

/// Encodes into fresh memory.
pub(crate) fn encode<M: Message>(message: &M) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(encoded_len(message));
    bytes.extend_from_slice(&CDR_LITTLE_ENDIAN);
    message.cdr_serialize(&mut CdrWriter::<LittleEndian>::new(&mut bytes));
    bytes
}

/// Encodes into shared memory of exactly `encoded_len` bytes; `false` if the message did not fit.
pub(crate) fn encode_into<M: Message>(message: &M, memory: &mut ZShmMut) -> bool {
    let mut cursor = Cursor { bytes: memory, len: 0, overflowed: false };
    cursor.extend_from_slice(&CDR_LITTLE_ENDIAN);
    message.cdr_serialize(&mut CdrWriter::<LittleEndian, Cursor<'_>>::new(&mut cursor));
    !cursor.overflowed && cursor.len == cursor.bytes.len()
}

/// Decodes a whole payload; trailing bytes beyond CDR's padding, and lengths beyond the payload, are refused.
pub(crate) fn decode<M: Message>(payload: &ZBytes) -> Result<M, String> {
    // A payload in several pieces is put together once; byte arrays then refer to it instead of being copied again.
    let whole = match payload.to_bytes() {
        Cow::Borrowed(_) => payload.clone(),
        Cow::Owned(bytes) => bytes.into(),
    };
    let bytes = whole.to_bytes();
    let Some((header, body)) = bytes.split_first_chunk::<4>() else {
        return Err(format!("{} bytes are too few for a CDR header", bytes.len()));
    };
    ZBUF_DESER_SOURCE.with(|source| *source.borrow_mut() = Some(whole.clone().into()));
    let decoded = match *header {
        CDR_LITTLE_ENDIAN => decode_body::<M, LittleEndian>(body),
        CDR_BIG_ENDIAN => decode_body::<M, BigEndian>(body),
        other => Err(format!("unknown CDR header {other:02x?}")),
    };
    ZBUF_DESER_SOURCE.with(|source| *source.borrow_mut() = None);
    decoded
}

/// Least bytes of a transform in a TFMessage: two headers' worth of lengths, seven doubles.
const TRANSFORM_BYTES_MIN: usize = 76;

/// The decoder makes room for as many transforms as the count claims before it reads one: a count that cannot be is
/// refused here. No other message of ours holds a sequence of messages.
fn check_count<M: Message, B: byteorder::ByteOrder>(body: &[u8]) -> Result<(), String> {
    let Some(count) = body.first_chunk::<4>().map(|c| B::read_u32(c) as usize) else { return Ok(()) };
    if M::type_name().starts_with("tf2_msgs") && count.saturating_mul(TRANSFORM_BYTES_MIN) > body.len() {
        return Err(format!("{count} transforms are claimed in {} bytes", body.len()));
    }
    Ok(())
}

fn decode_body<M: Message, B: byteorder::ByteOrder>(body: &[u8]) -> Result<M, String> {
    check_count::<M, B>(body)?;
    let mut reader = CdrReader::<B>::new(body);
    let message = M::cdr_deserialize(&mut reader).map_err(|e| e.to_string())?;
    // Encoders may pad to a multiple of four or eight.
    if reader.remaining() >= 8 {
        return Err(format!("{} bytes are left over after the message", reader.remaining()));
    }
    Ok(message)
}

/// rmw_zenoh's attachment: sequence, source time, and the sender's 16-byte id with its length.
pub(crate) fn attachment(sequence: i64, source_time_ns: i64, gid: &[u8; 16]) -> [u8; 33] {
    let mut bytes = [0; 33];
    bytes[..8].copy_from_slice(&sequence.to_le_bytes());
    bytes[8..16].copy_from_slice(&source_time_ns.to_le_bytes());
    bytes[16] = 16;
    bytes[17..].copy_from_slice(gid);
    bytes
}

/// Sequence and source time of an attachment, if there is one of the right form.
pub(crate) fn read_attachment(bytes: &[u8]) -> Option<(i64, i64)> {
    let sequence = bytes.first_chunk::<8>()?;
    let source_time = bytes.get(8..16)?.first_chunk::<8>()?;
    Some((i64::from_le_bytes(*sequence), i64::from_le_bytes(*source_time)))
}

struct Cursor<'a> {
    bytes: &'a mut [u8],
    len: usize,
    overflowed: bool,
}

impl CdrBuffer for Cursor<'_> {
    fn extend_from_slice(&mut self, data: &[u8]) {
        match self.bytes.get_mut(self.len..self.len + data.len()) {
            Some(room) => room.copy_from_slice(data),
            None => self.overflowed = true,
        }
        self.len += data.len();
    }

    fn push(&mut self, byte: u8) {
        self.extend_from_slice(&[byte]);
    }

    fn len(&self) -> usize {
        self.len
    }

    fn reserve(&mut self, _additional: usize) {}

    fn clear(&mut self) {
        self.len = 0;
    }
}
