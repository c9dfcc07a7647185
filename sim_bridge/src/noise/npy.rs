//! Arrays of floats in NumPy's .npy format (NumPy Enhancement Proposal 1), versions 1 and 2.

use thiserror::Error;

const MAGIC: &[u8] = b"\x93NUMPY";

/// Why bytes are no array of floats.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NpyError {
    /// The file begins otherwise.
    #[error("this is no .npy file: it does not begin with \\x93NUMPY")]
    Magic,
    /// A version that is not read.
    #[error("version {major} of the .npy format is not read; 1 and 2 are")]
    Version {
        /// The version found.
        major: u8,
    },
    /// The file ends early.
    #[error("the .npy file ends early: {what} needs {needed} bytes, {found} are left")]
    Truncated {
        /// What is cut off.
        what: &'static str,
        /// Bytes needed.
        needed: usize,
        /// Bytes left.
        found: usize,
    },
    /// The header lacks something or is not as NumPy writes it.
    #[error("the header of the .npy file says nothing of {key} that can be read: {header}")]
    Header {
        /// The key.
        key: &'static str,
        /// The header as found.
        header: String,
    },
    /// Numbers of another kind.
    #[error("the .npy file holds {descr}; little-endian floats are read: <f4 or <f8")]
    Kind {
        /// NumPy's name of the kind.
        descr: String,
    },
    /// Columns first.
    #[error("the .npy file is in Fortran order; save it with numpy.ascontiguousarray")]
    FortranOrder,
    /// More numbers than the shape has room for.
    #[error("{found} bytes follow the numbers of the .npy file's shape")]
    Surplus {
        /// Bytes too many.
        found: usize,
    },
}

/// An array of floats, the last axis fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyArray {
    /// Length along each axis.
    pub shape: Vec<usize>,
    /// As many numbers as the product of the shape.
    pub values: Vec<f32>,
}

/// Reads a .npy file of float32 or float64 in C order.
///
/// # Errors
/// [`NpyError`] for anything else.
pub fn read(bytes: &[u8]) -> Result<NpyArray, NpyError> {
    let after_magic = bytes.strip_prefix(MAGIC).ok_or(NpyError::Magic)?;
    let (version, rest) = take(after_magic, 2, "the version")?;
    let (length, rest) = match version[0] {
        1 => take(rest, 2, "the header's length")?,
        2 => take(rest, 4, "the header's length")?,
        major => return Err(NpyError::Version { major }),
    };
    let length = length.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte));
    let (header, data) = take(rest, length, "the header")?;
    let header = String::from_utf8_lossy(header);
    if word(&header, "fortran_order")? != "False" {
        return Err(NpyError::FortranOrder);
    }
    let shape = shape(&header)?;
    let descr = word(&header, "descr")?.trim_matches(['\'', '"']);
    let values = match descr {
        "<f4" => numbers(data, &shape, |b: [u8; 4]| f32::from_le_bytes(b))?,
        "<f8" => numbers(data, &shape, |b: [u8; 8]| f64::from_le_bytes(b) as f32)?,
        other => return Err(NpyError::Kind { descr: other.to_owned() }),
    };
    Ok(NpyArray { shape, values })
}

fn take<'a>(bytes: &'a [u8], needed: usize, what: &'static str) -> Result<(&'a [u8], &'a [u8]), NpyError> {
    bytes.split_at_checked(needed).ok_or(NpyError::Truncated { what, needed, found: bytes.len() })
}

/// What stands behind `'key':`.
fn after<'a>(header: &'a str, key: &'static str) -> Result<&'a str, NpyError> {
    let value = header.split_once(&format!("'{key}':")).map(|(_, value)| value.trim_start());
    value.ok_or_else(|| NpyError::Header { key, header: header.trim().to_owned() })
}

fn word<'a>(header: &'a str, key: &'static str) -> Result<&'a str, NpyError> {
    let end = |value: &'a str| value.split([',', '}']).next().map(str::trim).unwrap_or_default();
    after(header, key).map(end)
}

fn shape(header: &str) -> Result<Vec<usize>, NpyError> {
    let unreadable = || NpyError::Header { key: "shape", header: header.trim().to_owned() };
    let inside = after(header, "shape")?.strip_prefix('(').and_then(|s| s.split_once(')')).ok_or_else(unreadable)?.0;
    let lengths = inside.split(',').map(str::trim).filter(|s| !s.is_empty());
    lengths.map(|s| s.parse().map_err(|_| unreadable())).collect()
}

fn numbers<const N: usize>(
    data: &[u8],
    shape: &[usize],
    number: impl Fn([u8; N]) -> f32,
) -> Result<Vec<f32>, NpyError> {
    let needed = shape.iter().fold(N, |product, length| product.saturating_mul(*length));
    let (data, surplus) = take(data, needed, "the array")?;
    if !surplus.is_empty() {
        return Err(NpyError::Surplus { found: surplus.len() });
    }
    Ok(data.as_chunks().0.iter().map(|chunk| number(*chunk)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file as NumPy writes it, but for the padding.
    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [MAGIC, &[version, 0], length, header.as_bytes(), data].concat()
    }

    const HEADER: &str = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }          \n";

    fn six() -> Vec<u8> {
        [1.0_f32, -2.0, 0.5, 1e9, 0.0, 3.25].iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn floats_of_four_and_eight_bytes_in_both_versions() {
        let expected = NpyArray { shape: vec![2, 3], values: vec![1.0, -2.0, 0.5, 1e9, 0.0, 3.25] };
        assert_eq!(read(&file(1, HEADER, &six())), Ok(expected.clone()));
        assert_eq!(read(&file(2, HEADER, &six())), Ok(expected));
        let eight = "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }\n";
        let one = read(&file(1, eight, &0.125_f64.to_le_bytes()));
        assert_eq!(one, Ok(NpyArray { shape: vec![1], values: vec![0.125] }));
    }

    #[test]
    fn what_is_cut_off_is_named() {
        let whole = file(1, HEADER, &six());
        for (length, what) in
            [(7, "the version"), (9, "the header's length"), (30, "the header"), (whole.len() - 1, "the array")]
        {
            match read(&whole[..length]) {
                Err(NpyError::Truncated { what: named, .. }) => assert_eq!(named, what),
                other => assert!(matches!(other, Err(NpyError::Truncated { .. })), "{length} bytes: {other:?}"),
            }
        }
        assert_eq!(read(b"\x93NUM"), Err(NpyError::Magic));
        assert_eq!(read(b"PK\x03\x04 a zip"), Err(NpyError::Magic));
    }

    #[test]
    fn other_kinds_orders_and_versions_are_refused() {
        let with = |from: &str, to: &str| read(&file(1, &HEADER.replace(from, to), &six()));
        assert_eq!(with("<f4", "<i8"), Err(NpyError::Kind { descr: "<i8".to_owned() }));
        assert_eq!(with("<f4", ">f4"), Err(NpyError::Kind { descr: ">f4".to_owned() }));
        assert_eq!(with("False", "True"), Err(NpyError::FortranOrder));
        assert!(matches!(with("'shape'", "'form'"), Err(NpyError::Header { key: "shape", .. })));
        assert!(matches!(with("(2, 3)", "(2, -3)"), Err(NpyError::Header { key: "shape", .. })));
        assert!(matches!(with("'descr'", "'kind'"), Err(NpyError::Header { key: "descr", .. })));
        assert_eq!(with("(2, 3)", "(2, 2)"), Err(NpyError::Surplus { found: 8 }));
        // A shape whose product does not fit into memory asks for no memory.
        let huge = with("(2, 3)", "(9999999999, 9999999999)");
        assert!(matches!(huge, Err(NpyError::Truncated { what: "the array", .. })), "{huge:?}");
        assert_eq!(read(&file(3, HEADER, &six())), Err(NpyError::Version { major: 3 }));
    }
}
