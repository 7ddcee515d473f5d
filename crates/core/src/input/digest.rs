//! SHA-256 digests, which identify files.

use std::io::{self, Read, Write};

use sha2::{Digest, Sha256};

/// SHA-256 of the bytes, in lowercase hexadecimal.
pub fn hex_sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 of everything that can still be read from a reader, in chunks.
pub fn hex_sha256_of(mut from: impl Read) -> io::Result<String> {
    let (mut digest, mut part) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match from.read(&mut part)? {
            0 => return Ok(hex(&digest.finalize())),
            length => digest.update(&part[..length]),
        }
    }
}

/// A writer that forwards bytes and computes their SHA-256.
pub struct HashingWriter<W> {
    to: W,
    digest: Sha256,
}

impl<W: Write> HashingWriter<W> {
    pub fn new(to: W) -> Self {
        Self { to, digest: Sha256::new() }
    }

    /// The inner writer, and the SHA-256 of everything written, in lowercase hexadecimal.
    pub fn finish(self) -> (W, String) {
        (self.to, hex(&self.digest.finalize()))
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.digest.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

fn hex(digest: &[u8]) -> String {
    const DIGITS: [char; 16] = ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'];
    digest.iter().flat_map(|byte| [DIGITS[usize::from(byte >> 4)], DIGITS[usize::from(byte & 15)]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_matches_the_standard_and_is_the_same_in_parts() {
        // FIPS 180-2, appendix B.1
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hex_sha256(b"abc"), abc);
        assert_eq!(hex_sha256_of(b"abc".as_slice()).unwrap(), abc);
        let long = vec![7; 200_000];
        assert_eq!(hex_sha256_of(long.as_slice()).unwrap(), hex_sha256(&long));
        let mut through = HashingWriter::new(Vec::new());
        long.chunks(999).for_each(|part| through.write_all(part).unwrap());
        assert_eq!(through.finish(), (long.clone(), hex_sha256(&long)));
    }
}
