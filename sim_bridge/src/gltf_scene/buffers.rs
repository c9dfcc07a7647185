//! The bytes behind a document: embedded, in data addresses, or in files beside it.

use std::path::Path;

use gltf::{Accessor, Document, buffer};

use super::{FILE_BYTES_MAX, SceneError, check_size};

/// All buffers of a document, each at least as long as it says.
pub fn read(
    name: &str,
    document: &Document,
    mut blob: Option<Vec<u8>>,
    folder: Option<&Path>,
) -> Result<Vec<Vec<u8>>, SceneError> {
    let one = |buffer: gltf::Buffer<'_>| {
        let bytes = match buffer.source() {
            buffer::Source::Bin => blob.take().unwrap_or_default(),
            buffer::Source::Uri(uri) => fetch(name, uri, folder)?,
        };
        if bytes.len() < buffer.length() {
            let what = format!("buffer {}", buffer.index());
            return Err(truncated(name, what, buffer.length() as u64, bytes.len() as u64));
        }
        Ok(bytes)
    };
    document.buffers().map(one).collect()
}

fn truncated(name: &str, what: String, needed: u64, found: u64) -> SceneError {
    SceneError::Truncated { name: name.into(), what, needed, found }
}

/// Bytes at a `data:` address or in a file beside the document.
pub fn fetch(name: &str, uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, SceneError> {
    let refused = || SceneError::Address { name: name.into(), uri: uri.chars().take(60).collect() };
    if let Some(data) = uri.strip_prefix("data:") {
        return data.split_once(";base64,").and_then(|(_, text)| decode_base64(text)).ok_or_else(refused);
    }
    let relative = decode_percent(uri).ok_or_else(refused)?;
    let inside = Path::new(&relative).components().all(|c| matches!(c, std::path::Component::Normal(_)));
    let Some(folder) = folder.filter(|_| inside && !relative.contains(':')) else { return Err(refused()) };
    let path = folder.join(relative);
    let failed = |source| SceneError::Read { path: path.clone(), source };
    check_size(name, std::fs::metadata(&path).map_err(failed)?.len())?;
    std::fs::read(&path).map_err(failed)
}

/// Bytes of a view, or what is missing.
pub fn view<'a>(name: &str, view: &gltf::buffer::View<'_>, buffers: &'a [Vec<u8>]) -> Result<&'a [u8], SceneError> {
    let buffer = buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
    let end = (view.offset() as u64).saturating_add(view.length() as u64);
    usize::try_from(end)
        .ok()
        .and_then(|end| buffer.get(view.offset()..end))
        .ok_or_else(|| truncated(name, format!("buffer view {}", view.index()), end, buffer.len() as u64))
}

/// Refuses accessors that reach beyond their view.
pub fn check(name: &str, accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<(), SceneError> {
    let what = || format!("accessor {}", accessor.index());
    let count = accessor.count() as u64;
    if let Some(part) = accessor.view() {
        let found = view(name, &part, buffers)?.len() as u64;
        let stride = part.stride().unwrap_or(accessor.size()) as u64;
        let needed = reach(accessor.offset() as u64, stride, count, accessor.size() as u64);
        if needed > found {
            return Err(truncated(name, what(), needed, found));
        }
    } else if count.saturating_mul(accessor.size() as u64) > FILE_BYTES_MAX {
        return Err(truncated(name, what(), count, 0));
    }
    if let Some(sparse) = accessor.sparse() {
        let n = sparse.count() as u64;
        let (indices, values) = (sparse.indices(), sparse.values());
        let needed = [
            (indices.view(), reach(indices.offset() as u64, indices.index_type().size() as u64, n, 1)),
            (values.view(), reach(values.offset() as u64, accessor.size() as u64, n, 1)),
        ];
        for (part, needed) in needed {
            let found = view(name, &part, buffers)?.len() as u64;
            if needed > found {
                return Err(truncated(name, what(), needed, found));
            }
        }
    }
    Ok(())
}

fn reach(offset: u64, stride: u64, count: u64, size: u64) -> u64 {
    if count == 0 {
        return offset;
    }
    offset.saturating_add(stride.saturating_mul(count - 1)).saturating_add(size.max(1))
}

/// RFC 4648, padding optional. `None` for other characters.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut pending, mut bits) = (0_u32, 0);
    for character in text.trim_end_matches('=').bytes() {
        let six = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        pending = (pending << 6) | u32::from(six);
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((pending >> bits) as u8);
            pending &= (1 << bits) - 1;
        }
    }
    Some(bytes)
}

/// Percent escapes of a relative address. `None` where they are malformed.
fn decode_percent(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            bytes.push(u8::from_str_radix(core::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn embedded_text_decodes() {
        assert_eq!(decode_base64("SG9taW5n"), Some(b"Homing".to_vec()));
        assert_eq!(decode_base64("SG9taQ=="), Some(b"Homi".to_vec()));
        assert_eq!(decode_base64("S*9t"), None);
        assert_eq!(decode_percent("a%20b.bin"), Some("a b.bin".into()));
        assert_eq!(decode_percent("a%2"), None);
    }

    #[test]
    fn addresses_outside_the_folder_are_refused() {
        for uri in ["../secret.bin", "/etc/hosts", "https://example.org/a.bin", "file:///a.bin"] {
            let found = fetch("scene", uri, Some(Path::new(".")));
            assert!(matches!(found, Err(SceneError::Address { .. })), "{uri}");
        }
    }
}
