//! A model's bytes, checked before anything looks into them: hash first, then the operator set.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::error::ModelError;

/// Operator sets that the oldest ONNX Runtime in use (1.24) knows, and that exporters of the last years write.
pub const OPSETS: RangeInclusive<i64> = 9..=25;

/// Bytes read at most: larger models do not belong on a robot.
const BYTES_MAX: u64 = 2 << 30;

/// A model file and what it must hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its sha256, 64 hexadecimal digits.
    pub sha256: String,
}

/// Bytes that are what their hash says.
#[derive(Clone)]
pub struct VerifiedModel {
    /// Where they came from.
    pub path: PathBuf,
    /// The file, whole.
    pub bytes: Arc<[u8]>,
    /// Operator set of the standard domain.
    pub opset: i64,
}

impl ModelFile {
    /// Reads the file and checks hash and operator set. Nothing is handed to ONNX Runtime before.
    ///
    /// # Errors
    /// [`ModelError`] with path, expected and found.
    pub fn verify(&self) -> Result<VerifiedModel, ModelError> {
        let expected = self.sha256.to_ascii_lowercase();
        if expected.len() != 64 || !expected.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err(ModelError::BadHash { path: self.path.clone(), found: self.sha256.clone() });
        }
        let bytes = read(&self.path).map_err(|source| ModelError::Unreadable {
            path: self.path.clone(),
            expected_sha256: expected.clone(),
            source,
        })?;
        let found = sha256_hex(&bytes);
        if found != expected {
            return Err(ModelError::WrongHash { path: self.path.clone(), expected, found, bytes: bytes.len() });
        }
        let opset = standard_opset(&bytes).map_err(|reason| ModelError::NotOnnx { path: self.path.clone(), reason })?;
        if !OPSETS.contains(&opset) {
            let (oldest, newest) = (*OPSETS.start(), *OPSETS.end());
            return Err(ModelError::Opset { path: self.path.clone(), oldest, newest, found: opset });
        }
        Ok(VerifiedModel { path: self.path.clone(), bytes: bytes.into(), opset })
    }
}

fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let length = std::fs::metadata(path)?.len();
    if length > BYTES_MAX {
        return Err(std::io::Error::other(format!("{length} bytes are more than {BYTES_MAX}")));
    }
    std::fs::read(path)
}

/// The sha256 of some bytes, as 64 hexadecimal digits.
#[must_use]
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// ModelProto's field 8, `opset_import`: OperatorSetIdProto with domain (1) and version (2).
const OPSET_IMPORT: u64 = 8;
/// ModelProto's field 7, the graph.
const GRAPH: u64 = 7;

/// Version of the standard operator set that a serialised ModelProto asks for.
fn standard_opset(model: &[u8]) -> Result<i64, &'static str> {
    let (mut opset, mut has_graph) = (None, false);
    for field in Fields(model) {
        match field? {
            (OPSET_IMPORT, Value::Bytes(import)) => {
                let (mut domain, mut version) = (&b""[..], 0);
                for part in Fields(import) {
                    match part? {
                        (1, Value::Bytes(name)) => domain = name,
                        (2, Value::Number(number)) => version = number.cast_signed(),
                        _ => {}
                    }
                }
                if domain.is_empty() || domain == b"ai.onnx" {
                    opset = Some(version);
                }
            }
            (GRAPH, Value::Bytes(_)) => has_graph = true,
            _ => {}
        }
    }
    if !has_graph {
        return Err("there is no graph");
    }
    opset.ok_or("there is no standard operator set")
}

enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    Skipped,
}

/// The fields of one protobuf message, in order. Ends after the first error.
struct Fields<'a>(&'a [u8]);

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u64, Value<'a>), &'static str>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_err() {
            self.0 = &[];
        }
        Some(field)
    }
}

impl<'a> Fields<'a> {
    fn field(&mut self) -> Result<(u64, Value<'a>), &'static str> {
        let key = self.varint()?;
        let value = match key & 7 {
            0 => Value::Number(self.varint()?),
            1 => self.take(8).map(|_| Value::Skipped)?,
            2 => {
                let length = self.varint()?;
                Value::Bytes(self.take(length)?)
            }
            5 => self.take(4).map(|_| Value::Skipped)?,
            _ => return Err("a field has a wire type that does not exist"),
        };
        Ok((key >> 3, value))
    }

    fn varint(&mut self) -> Result<u64, &'static str> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let (&byte, rest) = self.0.split_first().ok_or("a number is cut short")?;
            self.0 = rest;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number is longer than 64 bits")
    }

    fn take(&mut self, length: u64) -> Result<&'a [u8], &'static str> {
        let length = usize::try_from(length).map_err(|_| "a field is longer than memory")?;
        let (taken, rest) = self.0.split_at_checked(length).ok_or("a field is cut short")?;
        self.0 = rest;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_is_the_published_one() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(sha256_hex(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn the_operator_set_is_read_from_the_bytes() {
        // ir_version 8; graph, empty; opset_import { version 17 }; opset_import { domain "x", version 3 }.
        let model = [8, 8, 58, 0, 66, 2, 16, 17, 66, 5, 10, 1, b'x', 16, 3];
        assert_eq!(standard_opset(&model), Ok(17));
        assert_eq!(standard_opset(&model[..7]), Err("a field is cut short"));
        assert_eq!(standard_opset(&[8, 8]), Err("there is no graph"));
        assert_eq!(standard_opset(&[58, 0]), Err("there is no standard operator set"));
        assert!(standard_opset(b"<html>not found</html>").is_err());
        assert!(standard_opset(&[0xff; 40]).is_err());
    }
}
