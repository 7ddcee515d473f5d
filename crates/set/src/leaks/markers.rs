//! Data in a JPEG file other than its image.

/// Markers of the segments that an image needs: JFIF's header, tables, the frame, its scan.
const NEEDED: [u8; 5] = [0xe0, 0xdb, 0xc0, 0xc4, 0xda];
const START_OF_SCAN: u8 = 0xda;
const END_OF_IMAGE: u8 = 0xd9;
/// Length of JFIF's header without a thumbnail, bytes.
const HEADER: usize = 16;

/// Description of data in a JPEG other than its image.
pub(super) fn unknown_segment(bytes: &[u8]) -> Option<String> {
    let Some(mut rest) = bytes.strip_prefix(b"\xff\xd8") else { return Some("no JPEG image".to_owned()) };
    loop {
        let (marker, after) = match rest {
            [0xff, END_OF_IMAGE, after @ ..] => {
                return (!after.is_empty()).then(|| format!("{} bytes after the image", after.len()));
            }
            [0xff, marker, after @ ..] => (*marker, after),
            _ => return Some(format!("{} bytes beside the image", rest.len())),
        };
        let length = after.first_chunk::<2>().map_or(0, |length| usize::from(u16::from_be_bytes(*length)));
        if !NEEDED.contains(&marker) || (marker == NEEDED[0] && length != HEADER) {
            return Some(format!("a segment FF{marker:02X} of {length} bytes in addition to the image"));
        }
        // a segment that leads beyond the file is a damaged image
        rest = after.get(length.max(2)..)?;
        if marker == START_OF_SCAN {
            rest = rest.get(scan_length(rest)..)?;
        }
    }
}

/// Length of the coded image, up to the next marker other than a restart.
fn scan_length(bytes: &[u8]) -> usize {
    let is_marker = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 0xd0..=0xd7);
    bytes.windows(2).position(is_marker).unwrap_or(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG file of this program without its tables.
    fn image() -> Vec<u8> {
        let header = [&b"\xff\xe0\x00\x10JFIF\0"[..], &[1, 2, 0, 0, 1, 0, 1, 0, 0]].concat();
        [&b"\xff\xd8"[..], &header, b"\xff\xda\x00\x03\x01", b"coded\xff\x00\xff\xd3more", b"\xff\xd9"].concat()
    }

    #[test]
    fn comments_thumbnails_and_bytes_after_the_image_are_found() {
        assert_eq!(unknown_segment(&image()), None);
        let comment = [&image()[..20], b"\xff\xfe\x00\x06pose", &image()[20..]].concat();
        assert!(unknown_segment(&comment).unwrap().contains("FFFE of 6 bytes"));
        let thumbnail = [&b"\xff\xd8\xff\xe0\x00\x13JFIF\0"[..], &[0; 12], &image()[20..]].concat();
        assert!(unknown_segment(&thumbnail).unwrap().contains("FFE0 of 19 bytes"));
        let longer = [&image()[..], b"pose"].concat();
        assert_eq!(unknown_segment(&longer).unwrap(), "4 bytes after the image");
        assert!(unknown_segment(b"pose").is_some());
    }
}
