//! NumPy's `.npz`: named arrays in a zip archive.
//!
//! The bytes depend on the arrays alone: entries in the order given, not compressed, every date 1980-01-01.
//! `numpy.load(path)` reads them with `allow_pickle=False`. The reader takes what `numpy.savez` and
//! `numpy.savez_compressed` write; encrypted and 64-bit archives (4 GiB and more) are refused with advice.

use std::borrow::Cow;

use miniz_oxide::inflate::decompress_to_vec_with_limit;

use super::{Array, NpzError, Values};
use crate::input::excerpt;

const LOCAL: u32 = 0x0403_4b50;
const CENTRAL: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
/// MS-DOS date of 1980-01-01, the earliest that zip can represent.
const DATE: u16 = 0x0021;
/// Greatest distance of the end record from the end of the file: its own length plus a comment of 65535 bytes.
const END_REACH: usize = 22 + 65_535;
const MOST_ENTRIES: usize = 1_000;
/// Greatest number of bytes in an entry's name.
const LONGEST_NAME: usize = 200;
/// Limit of the total expanded size of compressed arrays: a few kilobytes can expand to gigabytes.
const MOST_EXPANDED: usize = 256 << 20;

/// Named arrays in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Npz {
    arrays: Vec<(String, Array)>,
}

impl<'a> FromIterator<(&'a str, Array)> for Npz {
    fn from_iter<I: IntoIterator<Item = (&'a str, Array)>>(arrays: I) -> Self {
        Self { arrays: arrays.into_iter().map(|(name, array)| (name.to_string(), array)).collect() }
    }
}

impl Npz {
    /// Appends an array.
    pub fn push(&mut self, name: &str, array: Array) {
        self.arrays.push((name.to_string(), array));
    }

    /// The array with this name.
    pub fn get(&self, name: &str) -> Option<&Array> {
        self.arrays.iter().find(|(n, _)| n == name).map(|(_, array)| array)
    }

    /// Names and arrays in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Array)> {
        self.arrays.iter().map(|(name, array)| (name.as_str(), array))
    }

    /// The archive's bytes. `file` names it in errors.
    ///
    /// # Errors
    /// [`NpzError`] when values do not fill their shape or an array takes 4 GiB or more.
    pub fn to_bytes(&self, file: &str) -> Result<Vec<u8>, NpzError> {
        let mut bytes = Vec::new();
        self.write_to(file, &mut |part| {
            bytes.extend(part);
            Ok(())
        })?;
        Ok(bytes)
    }

    /// Writes the bytes of the archive array by array, so only one array at a time is held as bytes.
    #[doc(hidden)]
    pub fn write_to<E: From<NpzError>>(
        &self,
        file: &str,
        put: &mut dyn FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let too_large = |name: &str| NpzError::new(file, format!("{name}: more than 4 GiB do not fit in an .npz"));
        let (mut written, mut directory) = (0, Vec::new());
        for (name, array) in &self.arrays {
            let npy = array.to_npy().map_err(|e| NpzError::new(file, format!("{name}: {e}")))?;
            let offset = u32::try_from(written).map_err(|_| too_large(name))?;
            let size = u32::try_from(npy.len()).map_err(|_| too_large(name))?;
            let entry = entry_fields(name, crc32fast::hash(&npy), size).ok_or_else(|| too_large(name))?;
            let head = [&LOCAL.to_le_bytes(), &entry[..], name.as_bytes(), b".npy"].concat();
            put(&head)?;
            put(&npy)?;
            written += head.len() + npy.len();
            directory.extend(CENTRAL.to_le_bytes());
            directory.extend(20_u16.to_le_bytes()); // made by: MS-DOS attributes, version 2.0
            directory.extend(&entry);
            directory.extend([0; 10]); // no comment, disk 0, no attributes
            directory.extend(offset.to_le_bytes());
            directory.extend(format!("{name}.npy").as_bytes());
        }
        let count = u16::try_from(self.arrays.len()).map_err(|_| NpzError::new(file, "more than 65535 arrays"))?;
        let start = u32::try_from(written).map_err(|_| too_large("all arrays"))?;
        let length = u32::try_from(directory.len()).map_err(|_| too_large("the directory"))?;
        directory.extend(END.to_le_bytes());
        directory.extend([0; 4]);
        directory.extend(count.to_le_bytes());
        directory.extend(count.to_le_bytes());
        directory.extend(length.to_le_bytes());
        directory.extend(start.to_le_bytes());
        directory.extend([0; 2]);
        put(&directory)
    }

    /// Reads the arrays of an archive. `file` names it in errors.
    ///
    /// # Errors
    /// [`NpzError`] for anything except a complete, unpickled `.npz`, and for compressed arrays of more than 256 MiB.
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Result<Self, NpzError> {
        read_archive(bytes, None).map_err(|detail| NpzError::new(file, detail))
    }

    /// Reads the arrays of these names alone, those that there are: the others may be of any type.
    pub fn some_from_bytes(file: &str, bytes: &[u8], names: &[&str]) -> Result<Self, NpzError> {
        read_archive(bytes, Some(names)).map_err(|detail| NpzError::new(file, detail))
    }

    /// The values of the float array `name`, which must have this shape (`None`: any length along that axis).
    pub fn f64s(&self, file: &str, name: &str, shape: &[Option<usize>]) -> Result<&[f64], NpzError> {
        match &self.shaped(file, name, shape)?.values {
            Values::F64(values) => Ok(values),
            _ => Err(NpzError::new(file, format!("{name}: expected element type <f8"))),
        }
    }

    /// The values of the numeric array `name` as floats; it must have this shape.
    #[doc(hidden)]
    pub fn numbers(&self, file: &str, name: &str, shape: &[Option<usize>]) -> Result<Vec<f64>, NpzError> {
        match &self.shaped(file, name, shape)?.values {
            Values::F64(values) => Ok(values.clone()),
            Values::F32(values) => Ok(values.iter().map(|v| f64::from(*v)).collect()),
            Values::I64(values) => Ok(values.iter().map(|v| *v as f64).collect()),
            _ => Err(NpzError::new(file, format!("{name}: expected numbers"))),
        }
    }

    /// The integers of array `name`, which must be one-dimensional.
    #[doc(hidden)]
    pub fn whole_numbers(&self, file: &str, name: &str) -> Result<Vec<i64>, NpzError> {
        match &self.shaped(file, name, &[None])?.values {
            Values::I64(values) => Ok(values.clone()),
            Values::U8(values) => Ok(values.iter().map(|v| i64::from(*v)).collect()),
            _ => Err(NpzError::new(file, format!("{name}: expected whole numbers"))),
        }
    }

    /// The strings of array `name`, which must be one-dimensional; `None` if there is no such array.
    #[doc(hidden)]
    pub fn names(&self, file: &str, name: &str) -> Result<Option<&[String]>, NpzError> {
        if self.get(name).is_none() {
            return Ok(None);
        }
        match &self.shaped(file, name, &[None])?.values {
            Values::Text(values) => Ok(Some(values)),
            _ => Err(NpzError::new(file, format!("{name}: expected strings"))),
        }
    }

    /// The values of the boolean array `name`, which must have this shape.
    #[doc(hidden)]
    pub fn bools(&self, file: &str, name: &str, shape: &[Option<usize>]) -> Result<&[bool], NpzError> {
        match &self.shaped(file, name, shape)?.values {
            Values::Bool(values) => Ok(values),
            _ => Err(NpzError::new(file, format!("{name}: expected element type |b1"))),
        }
    }

    fn shaped(&self, file: &str, name: &str, shape: &[Option<usize>]) -> Result<&Array, NpzError> {
        let array = self.get(name).ok_or_else(|| NpzError::new(file, format!("has no array {name:?}")))?;
        let fits = array.shape.len() == shape.len()
            && array.shape.iter().zip(shape).all(|(n, expected)| expected.is_none_or(|e| e == *n));
        if fits {
            return Ok(array);
        }
        let expected: Vec<String> = shape.iter().map(|n| n.map_or("any".to_string(), |n| n.to_string())).collect();
        let detail = format!("{name}: shape {:?}, expected [{}]", array.shape, expected.join(", "));
        Err(NpzError::new(file, detail))
    }
}

/// The fields shared by local and central headers, from "version needed" to "extra length"; `None` if the name is too
/// long.
fn entry_fields(name: &str, crc: u32, size: u32) -> Option<Vec<u8>> {
    let name_length = u16::try_from(name.len() + ".npy".len()).ok()?;
    let mut fields = Vec::with_capacity(26);
    for half in [20, 0, 0, 0, DATE] {
        fields.extend(half.to_le_bytes()); // version needed, flags, method "stored", time, date
    }
    for word in [crc, size, size] {
        fields.extend(word.to_le_bytes());
    }
    fields.extend(name_length.to_le_bytes());
    fields.extend([0, 0]);
    Some(fields)
}

fn read_archive(bytes: &[u8], names: Option<&[&str]>) -> Result<Npz, String> {
    let truncated = || "not a complete .npz archive (truncated, or not a zip file)".to_string();
    let end = (bytes.len().saturating_sub(END_REACH)..bytes.len().saturating_sub(21))
        .rev()
        .find(|at| bytes[*at..].starts_with(&END.to_le_bytes()))
        .ok_or_else(truncated)?;
    let count = u16_at(bytes, end + 10).ok_or_else(truncated)?;
    let mut at = u32_at(bytes, end + 16).ok_or_else(truncated)? as usize;
    if usize::from(count) > MOST_ENTRIES {
        return Err(format!("the archive has {count} entries; expected at most {MOST_ENTRIES}"));
    }
    let mut npz = Npz::default();
    let mut taken = Vec::new();
    let mut expanded = 0;
    for _ in 0..count {
        if u32_at(bytes, at) != Some(CENTRAL) {
            return Err("the archive's directory is damaged, or the archive is 64-bit (4 GiB or more)".to_string());
        }
        let header = bytes.get(at..at + 46).ok_or_else(truncated)?;
        let half = |offset| u16_at(header, offset).map_or(0, usize::from);
        let word = |offset| u32_at(header, offset).unwrap_or(0);
        let entry_name = bytes.get(at + 46..at + 46 + half(28)).ok_or_else(truncated)?;
        let entry_name =
            std::str::from_utf8(entry_name).map_err(|_| "the name of an entry is not UTF-8".to_string())?;
        if entry_name.len() > LONGEST_NAME {
            let length = entry_name.len();
            return Err(format!("the name of an entry has {length} bytes; expected at most {LONGEST_NAME}"));
        }
        at += 46 + half(28) + half(30) + half(32);
        if names.is_some_and(|names| entry_name.strip_suffix(".npy").is_none_or(|name| !names.contains(&name))) {
            continue;
        }
        let entry = ArchiveEntry {
            offset: word(42) as usize,
            stored: word(20) as usize,
            size: word(24) as usize,
            flags: half(8),
            method: half(10),
        };
        let npy = entry.bytes(bytes, &mut expanded).map_err(|e| format!("{}: {e}", excerpt(entry_name)))?;
        taken.push(entry.offset..entry.offset.saturating_add(entry.length()));
        if crc32fast::hash(&npy) != word(16) {
            return Err(format!("{}: wrong checksum; the file was changed or damaged", excerpt(entry_name)));
        }
        let name =
            entry_name.strip_suffix(".npy").ok_or_else(|| format!("{}: expected NAME.npy", excerpt(entry_name)))?;
        if npz.get(name).is_some() {
            return Err(format!("{}: appears twice", excerpt(entry_name)));
        }
        npz.push(name, Array::from_npy(&npy).map_err(|e| format!("{}: {e}", excerpt(name)))?);
    }
    taken.sort_by_key(|range| range.start);
    if taken.windows(2).any(|pair| pair[0].end > pair[1].start) {
        return Err("two entries overlap; expected consecutive entries".to_string());
    }
    Ok(npz)
}

/// An entry of the archive, as its directory lists it.
struct ArchiveEntry {
    /// Offset of its local header.
    offset: usize,
    /// Size in the archive, bytes.
    stored: usize,
    /// Uncompressed size, bytes.
    size: usize,
    flags: usize,
    method: usize,
}

impl ArchiveEntry {
    /// Length of its contents in the archive, bytes.
    fn length(&self) -> usize {
        if self.method == 0 { self.size } else { self.stored }
    }

    /// The uncompressed bytes. `expanded` accumulates the total of all compressed files.
    fn bytes<'a>(&self, archive: &'a [u8], expanded: &mut usize) -> Result<Cow<'a, [u8]>, String> {
        if self.flags & 1 != 0 {
            return Err("is encrypted".to_string());
        }
        match self.method {
            0 => self.slice(archive, self.size).map(Cow::from),
            8 => self.inflated(archive, expanded).map(Cow::from),
            other => Err(format!(
                "compression method {other} is not supported; save it with numpy.savez or numpy.savez_compressed"
            )),
        }
    }

    /// Inflates deflated data (RFC 1951); memory grows with the actual data, not with the claimed size.
    fn inflated(&self, archive: &[u8], expanded: &mut usize) -> Result<Vec<u8>, String> {
        *expanded = expanded.saturating_add(self.size);
        if *expanded > MOST_EXPANDED {
            let most = MOST_EXPANDED >> 20;
            return Err(format!(
                "compressed arrays of more than {most} MiB in total are not supported; save them with numpy.savez"
            ));
        }
        let found = decompress_to_vec_with_limit(self.slice(archive, self.stored)?, self.size)
            .map_err(|e| format!("cannot be expanded to the {} bytes stated in the archive: {e}", self.size))?;
        if found.len() != self.size {
            return Err(format!("expands to {} bytes, but the archive states {}", found.len(), self.size));
        }
        Ok(found)
    }

    fn slice<'a>(&self, archive: &'a [u8], length: usize) -> Result<&'a [u8], String> {
        let truncated = || "is truncated".to_string();
        if u32_at(archive, self.offset) != Some(LOCAL) {
            return Err(truncated());
        }
        let name_length = u16_at(archive, self.offset + 26).ok_or_else(truncated)?;
        let extra_length = u16_at(archive, self.offset + 28).ok_or_else(truncated)?;
        let start = self.offset + 30 + usize::from(name_length) + usize::from(extra_length);
        archive.get(start..).and_then(|rest| rest.get(..length)).ok_or_else(truncated)
    }
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|b| u16::from_le_bytes(*b))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> Npz {
        Npz::from_iter([
            ("root", Array::new(&[2, 2], vec![1.5, -0.0, f64::INFINITY, 1e-310])),
            ("depth", Array::new(&[1], vec![0.25_f32])),
            ("seeds", Array::new(&[3], vec![1_i64, -2, i64::MAX])),
            ("mask", Array::new(&[2], vec![0_u8, 255])),
            ("seen", Array::new(&[2, 1], vec![true, false])),
            ("names", Array::names(["pelvis", "", "épaule", "😀"])),
            ("empty", Array::new(&[0, 3], Vec::<f64>::new())),
        ])
    }

    #[test]
    fn written_arrays_are_read_back() {
        let bytes = sample().to_bytes("x").unwrap();
        assert_eq!(Npz::from_bytes("x", &bytes).unwrap(), sample());
        assert_eq!(bytes, sample().to_bytes("x").unwrap());
    }

    #[test]
    fn truncation_and_flipped_bytes_cause_errors_or_change_no_value() {
        let bytes = sample().to_bytes("x").unwrap();
        for length in 0..bytes.len() {
            assert!(Npz::from_bytes("x", &bytes[..length]).is_err(), "cut at {length}");
        }
        for at in 0..bytes.len() {
            let mut broken = bytes.clone();
            broken[at] ^= 0x41;
            // checksums cover the values, but not dates, attributes and names
            if let Ok(read) = Npz::from_bytes("x", &broken) {
                for (name, array) in &read.arrays {
                    assert!(sample().get(name).is_none_or(|a| a == array), "byte {at} changed {name}");
                }
            }
        }
    }

    /// An archive with one deflated entry; `size` is what the directory claims.
    fn compressed(npy: &[u8], size: u32) -> Vec<u8> {
        let deflated = miniz_oxide::deflate::compress_to_vec(npy, 9);
        let mut fields = entry_fields("a", crc32fast::hash(npy), size).unwrap();
        fields[4..6].copy_from_slice(&8_u16.to_le_bytes());
        fields[14..18].copy_from_slice(&u32::try_from(deflated.len()).unwrap().to_le_bytes());
        let mut bytes = LOCAL.to_le_bytes().to_vec();
        bytes.extend([&fields, b"a.npy".as_slice(), &deflated].concat());
        let start = u32::try_from(bytes.len()).unwrap();
        bytes.extend([&CENTRAL.to_le_bytes(), [20, 0].as_slice(), &fields, &[0; 14], b"a.npy"].concat());
        let length = u32::try_from(bytes.len()).unwrap() - start;
        bytes.extend(END.to_le_bytes());
        bytes.extend([0, 0, 0, 0, 1, 0, 1, 0]);
        bytes.extend([length.to_le_bytes(), start.to_le_bytes()].concat());
        bytes.extend([0; 2]);
        bytes
    }

    #[test]
    fn compressed_arrays_are_read_and_their_claims_are_checked() {
        let array = Array::new(&[50_000], vec![0.25; 50_000]);
        let npy = array.to_npy().unwrap();
        let size = u32::try_from(npy.len()).unwrap();
        let whole = compressed(&npy, size);
        assert!(whole.len() < npy.len() / 50);
        assert_eq!(Npz::from_bytes("x", &whole).unwrap().get("a"), Some(&array));
        for (claim, words) in [
            (size - 1, "cannot be expanded to the 400127 bytes"),
            (size + 1, "expands to 400128 bytes"),
            (u32::MAX, "more than 256 MiB"),
        ] {
            let message = Npz::from_bytes("poses.npz", &compressed(&npy, claim)).unwrap_err().to_string();
            assert!(message.starts_with("poses.npz: a.npy: ") && message.contains(words), "{message}");
        }
        let mut broken = whole;
        broken[40] ^= 0xff;
        assert!(Npz::from_bytes("x", &broken).is_err());
    }

    /// Without bounds these would exhaust memory.
    #[test]
    fn claimed_sizes_are_bounded() {
        let one = || Array::new(&[1], vec![0.5]);
        let many: Vec<String> = (0..=MOST_ENTRIES).map(|index| format!("a{index}")).collect();
        let archive = |npz: Npz| npz.to_bytes("x").unwrap();
        let mut shared = archive(Npz::from_iter([("a", one()), ("b", one())]));
        // the second entry of the directory points to the bytes of the first
        let offset = shared.len() - 22 - "b.npy".len() - 4;
        shared[offset..offset + 4].copy_from_slice(&[0; 4]);
        for (bytes, words) in [
            (archive(many.iter().map(|name| (name.as_str(), one())).collect()), "1001 entries; expected at most 1000"),
            (archive(Npz::from_iter([("x".repeat(300).as_str(), one())])), "has 304 bytes; expected at most 200"),
            (shared, "two entries overlap"),
        ] {
            let message = Npz::from_bytes("x", &bytes).unwrap_err().to_string();
            assert!(message.contains(words), "{words}: {message}");
        }
    }

    #[test]
    fn other_compression_is_refused_with_advice() {
        let mut bytes = sample().to_bytes("x").unwrap();
        let directory = bytes.windows(4).position(|w| w == CENTRAL.to_le_bytes()).unwrap();
        bytes[directory + 10] = 12;
        let message = Npz::from_bytes("run/poses.npz", &bytes).unwrap_err().to_string();
        assert!(message.starts_with("run/poses.npz: root.npy: compression method 12"), "{message}");
        assert!(message.contains("numpy.savez"), "{message}");
    }

    #[test]
    fn a_wrong_shape_names_the_array_and_both_shapes() {
        let npz = sample();
        assert_eq!(npz.f64s("x", "root", &[None, Some(2)]).unwrap().len(), 4);
        let message = npz.f64s("x", "root", &[None, Some(7)]).unwrap_err().to_string();
        assert_eq!(message, "x: root: shape [2, 2], expected [any, 7]");
        assert!(npz.f64s("x", "seeds", &[None]).is_err());
        assert!(npz.bools("x", "nothing", &[]).unwrap_err().to_string().contains("no array"));
    }

    proptest! {
        #[test]
        fn numbers_and_strings_survive_unchanged(
            numbers in proptest::collection::vec(any::<i64>(), 0..40),
            floats in proptest::collection::vec(any::<f64>().prop_filter("NaN differs from itself", |x| !x.is_nan()), 0..40),
            texts in proptest::collection::vec("[^\0]{0,12}", 0..8),
        ) {
            let npz = Npz::from_iter([
                ("numbers", Array::new(&[numbers.len()], numbers)),
                ("floats", Array::new(&[1, floats.len(), 1], floats)),
                ("texts", Array::names(texts.iter().map(String::as_str))),
            ]);
            let bytes = npz.to_bytes("x").unwrap();
            prop_assert_eq!(Npz::from_bytes("x", &bytes).unwrap(), npz);
        }
    }
}
