//! SHA-256, by which files are known.

use std::io::{self, Read};

use sha2::{Digest, Sha256};

/// SHA-256 of these bytes, in small hexadecimal digits.
pub(crate) fn hex_sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// The same of all that can still be read, a part at a time.
pub(crate) fn hex_sha256_of(mut from: impl Read) -> io::Result<String> {
    let (mut digest, mut part) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match from.read(&mut part)? {
            0 => return Ok(hex(&digest.finalize())),
            length => digest.update(&part[..length]),
        }
    }
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_that_of_the_standard_and_the_same_in_parts() {
        // FIPS 180-2, appendix B.1
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hex_sha256(b"abc"), abc);
        assert_eq!(hex_sha256_of(b"abc".as_slice()).unwrap(), abc);
        let long = vec![7; 200_000];
        assert_eq!(hex_sha256_of(long.as_slice()).unwrap(), hex_sha256(&long));
    }
}
