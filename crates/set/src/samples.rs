//! Samples of a tar shard in the format of WebDataset: files with the same key are consecutive.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom, Write};

use nalgebra::Point3;
use serde::Serialize;

use crate::camera::Camera;
use crate::scene::TruthFrame;

/// Writes a shard.
pub(super) struct ShardWriter<W: Write>(tar::Builder<W>);

impl<W: Write> ShardWriter<W> {
    pub(super) fn new(to: W) -> Self {
        Self(tar::Builder::new(to))
    }

    /// Adds a file; its header depends only on its name and size.
    pub(super) fn add(&mut self, name: &str, bytes: impl Read, size: u64) -> io::Result<()> {
        self.0.append_data(&mut header_of_size(size), name, bytes)
    }

    /// Completes the shard.
    pub(super) fn finish(self) -> io::Result<W> {
        self.0.into_inner()
    }
}

/// A header without a name.
fn header_of_size(size: u64) -> tar::Header {
    let mut header = tar::Header::new_ustar();
    header.set_size(size);
    header.set_mode(0o644);
    header.set_mtime(0);
    header
}

/// The header of a file in a shard.
///
/// # Errors
/// [`io::Error`] for a name that is too long for a header.
pub(super) fn tar_header(name: &str, size: u64) -> io::Result<Vec<u8>> {
    let mut header = header_of_size(size);
    header.set_path(name)?;
    header.set_cksum();
    Ok(header.as_bytes().to_vec())
}

/// The bytes after the last file of a shard.
pub(super) fn tar_end() -> Vec<u8> {
    vec![0; 2 * BLOCK as usize]
}

/// Offset and size of every file of a shard by name, bytes.
pub(super) type TarPlaces = BTreeMap<String, (u64, u64)>;

/// Block size of tar files, bytes.
const BLOCK: u64 = 512;

/// The offsets of the files of a shard. Only headers are read.
///
/// # Errors
/// [`io::ErrorKind::UnexpectedEof`] if it is truncated, [`io::ErrorKind::InvalidData`] for an invalid header.
pub(super) fn tar_places(shard: &mut (impl Read + Seek)) -> io::Result<TarPlaces> {
    let length = shard.seek(SeekFrom::End(0))?;
    let (mut places, mut at) = (TarPlaces::new(), 0_u64);
    loop {
        let mut block = [0; BLOCK as usize];
        shard.seek(SeekFrom::Start(at))?;
        shard.read_exact(&mut block)?;
        if block == [0; BLOCK as usize] {
            return Ok(places);
        }
        let header = tar::Header::from_byte_slice(&block);
        // the sum of all bytes, with the checksum itself replaced by spaces
        let sum = block.iter().enumerate().map(|(i, byte)| if (148..156).contains(&i) { 32 } else { u32::from(*byte) });
        if header.cksum().ok() != Some(sum.sum()) {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!("at byte {at}: expected the header of a file"),
            ));
        }
        let (first, size) = (at + BLOCK, header.entry_size()?);
        let end = first.checked_add(size).filter(|end| *end <= length).ok_or(io::ErrorKind::UnexpectedEof)?;
        let name = String::from_utf8_lossy(&header.path_bytes()).into_owned();
        if let Some((before, _)) = places.insert(name, (first, size)) {
            let detail = format!("the files at bytes {before} and {first} have the same name");
            return Err(io::Error::new(io::ErrorKind::InvalidData, detail));
        }
        at = end.next_multiple_of(BLOCK);
    }
}

/// The key of a sample, the common prefix of its files.
pub(super) fn key(camera: usize, frame: usize) -> String {
    format!("{frame:06}_cam{camera:02}")
}

/// The JSON of a sample: OpenCV's camera, joints and markers in the world and in the image. A marker that the body
/// lacks is null; so are its pixels, also out of view.
#[derive(Serialize)]
pub(super) struct SampleFacts<'a> {
    camera: &'a str,
    frame: usize,
    time_s: f64,
    width: u32,
    height: u32,
    #[serde(rename = "K")]
    matrix: [[f64; 3]; 3],
    #[serde(rename = "R")]
    rotation: [[f64; 3]; 3],
    #[serde(rename = "t")]
    translation: [f64; 3],
    distortion: [f64; 5],
    joints: Vec<[f64; 3]>,
    markers: Vec<Option<[f64; 3]>>,
    markers_2d: Vec<Option<[f64; 2]>>,
    visible: &'a [bool],
}

impl<'a> SampleFacts<'a> {
    /// Of the image of a camera and frame.
    pub(super) fn new(camera: &'a Camera, truth: &'a TruthFrame, camera_index: usize, frame: usize) -> Self {
        let pixel = |(marker, in_view): (&Option<Point3<f64>>, &bool)| {
            let pixel = marker.filter(|_| *in_view).and_then(|marker| camera.project(&marker));
            pixel.map(|pixel| [pixel.x - 0.5, pixel.y - 0.5])
        };
        let place = |point: &Point3<f64>| [point.x, point.y, point.z];
        Self {
            camera: &camera.name,
            frame,
            time_s: truth.time_s,
            width: camera.pinhole.width,
            height: camera.pinhole.height,
            matrix: camera.opencv_matrix(),
            rotation: camera.opencv_rotation(),
            translation: camera.opencv_translation(),
            distortion: camera.distortion.coefficients(),
            joints: truth.joint_positions.iter().map(place).collect(),
            markers: truth.markers.iter().map(|marker| marker.as_ref().map(place)).collect(),
            markers_2d: truth.markers.iter().zip(&truth.in_view[camera_index]).map(pixel).collect(),
            visible: &truth.visible[camera_index],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    fn shard(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut shard = ShardWriter::new(Vec::new());
        files.iter().for_each(|(name, bytes)| shard.add(name, *bytes, bytes.len() as u64).unwrap());
        shard.finish().unwrap()
    }

    #[test]
    fn files_of_a_shard_are_at_the_offsets_that_the_tar_crate_finds() {
        let long = vec![7; 1500];
        let bytes = shard(&[("a.json", b"one"), ("a.png", &long), ("empty", b""), ("deep/er/b.png", &long[..512])]);
        let places = tar_places(&mut Cursor::new(&bytes)).unwrap();
        assert!(bytes.starts_with(&tar_header("a.json", 3).unwrap()) && bytes.ends_with(&tar_end()));
        let last = places.values().map(|(at, size)| (at + size).next_multiple_of(BLOCK)).max().unwrap();
        assert_eq!(last as usize + tar_end().len(), bytes.len());
        let mut archive = tar::Archive::new(&bytes[..]);
        let known = archive.entries().unwrap().map(|entry| {
            let entry = entry.unwrap();
            (entry.path().unwrap().display().to_string(), (entry.raw_file_position(), entry.size()))
        });
        assert_eq!(places, known.collect());
        let (at, size) = places["a.png"];
        assert_eq!(bytes[at as usize..(at + size) as usize], long);
    }

    #[test]
    fn truncated_and_invalid_shards_are_refused() {
        let whole = shard(&[("a", &[1; 700]), ("b", &[2; 40])]);
        let kind = |bytes: &[u8]| tar_places(&mut Cursor::new(bytes)).unwrap_err().kind();
        // within a header, within a file, after the last file
        for length in [0, 100, 1000, 1600, 2200, 2560] {
            assert_eq!(kind(&whole[..length]), io::ErrorKind::UnexpectedEof, "{length} of {}", whole.len());
        }
        assert_eq!(kind(&[b'x'; 600]), io::ErrorKind::InvalidData);
        let mut other = whole.clone();
        other[3] ^= 1;
        assert_eq!(kind(&other), io::ErrorKind::InvalidData);
        assert_eq!(kind(&shard(&[("a", b"1"), ("a", b"2")])), io::ErrorKind::InvalidData);
    }

    proptest! {
        #[test]
        fn files_of_any_changed_shard_are_within_it(changes in prop::collection::vec((0_usize..4096, any::<u8>()), 0..9)) {
            let mut bytes = shard(&[("a.json", b"one"), ("a.png", &[3; 900]), ("b", &[])]);
            for (at, value) in changes {
                let length = bytes.len();
                bytes[at % length] = value;
            }
            if let Ok(places) = tar_places(&mut Cursor::new(&bytes)) {
                prop_assert!(places.values().all(|(at, size)| at + size <= bytes.len() as u64));
            }
        }
    }
}
