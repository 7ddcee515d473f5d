//! C3D: marker trajectories in blocks of 512 bytes, little-endian, points as floats (`www.c3d.org`, user guide).

use super::folder::{Folder, millimetres};
use crate::{BenchmarkSet, SetError};
use skiagraph_core::body::LANDMARKS;
use skiagraph_truth::scene::GroundTruth;

const README: &str = "\
markers.c3d   HumanEva's 15 virtual markers, millimetres, the world's Z up (POINT:X_SCREEN +X, POINT:Y_SCREEN +Z), no analogue
              channels. A marker that the actor lacks has residual -1. Frames are numbered from 1.";

const BLOCK: usize = 512;

/// Greatest number of frames with 16 bits.
const MOST_FRAMES: usize = 65_535;

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let truth = &set.truth.ground_truth;
    let Ok(frames) = u16::try_from(truth.frames.len()) else {
        let detail = format!("{} frames; a C3D file allows at most {MOST_FRAMES}; use trc or npz", truth.frames.len());
        return Err(SetError::malformed("c3d", detail));
    };
    folder.readme(&set.blind, README)?;
    let rate = truth.frames_per_second as f32;
    // the number of blocks of the parameters does not depend on their values
    let blocks = parameters(frames, rate, 0).len().div_ceil(BLOCK);
    let data_start = 2 + blocks as u16;
    let mut bytes = header(frames, rate, data_start);
    let mut section = parameters(frames, rate, data_start);
    section[2] = blocks as u8;
    section.resize(blocks * BLOCK, 0);
    bytes.extend(section);
    bytes.extend(points(truth));
    bytes.resize(bytes.len().div_ceil(BLOCK) * BLOCK, 0);
    folder.write("markers.c3d", &bytes)
}

/// The first block: counts, rate, first block of the data.
fn header(frames: u16, rate: f32, data_start: u16) -> Vec<u8> {
    let mut bytes = vec![2, 0x50];
    for word in [LANDMARKS.len() as u16, 0, 1, frames, 0] {
        bytes.extend(word.to_le_bytes());
    }
    // a negative scale marks floating-point coordinates
    bytes.extend((-1.0_f32).to_le_bytes());
    bytes.extend(data_start.to_le_bytes());
    // analogue samples a frame: readers compare it with ANALOG:RATE over POINT:RATE, also without channels
    bytes.extend(1_u16.to_le_bytes());
    bytes.extend(rate.to_le_bytes());
    bytes.resize(BLOCK, 0);
    // event labels, if there were any, would have four characters
    bytes[298..300].copy_from_slice(&12345_u16.to_le_bytes());
    bytes
}

struct Parameter {
    name: &'static str,
    /// -1 text, 2 integer, 4 float.
    kind: i8,
    dimensions: Vec<u8>,
    data: Vec<u8>,
}

impl Parameter {
    fn whole(name: &'static str, value: u16) -> Self {
        Self { name, kind: 2, dimensions: Vec::new(), data: value.to_le_bytes().to_vec() }
    }

    fn float(name: &'static str, value: f32) -> Self {
        Self { name, kind: 4, dimensions: Vec::new(), data: value.to_le_bytes().to_vec() }
    }

    fn text(name: &'static str, text: &str) -> Self {
        Self { name, kind: -1, dimensions: vec![text.len() as u8], data: text.as_bytes().to_vec() }
    }

    /// Texts padded with blanks to equal length.
    fn texts(name: &'static str, texts: &[&str]) -> Self {
        let longest = texts.iter().map(|text| text.len()).max().unwrap_or(0);
        let data = texts.iter().flat_map(|text| format!("{text:<longest$}").into_bytes()).collect();
        Self { name, kind: -1, dimensions: vec![longest as u8, texts.len() as u8], data }
    }

    fn bytes(&self, group: i8) -> Vec<u8> {
        let mut bytes = vec![self.name.len() as u8, group as u8];
        bytes.extend(self.name.as_bytes());
        // offset to the next parameter: these two bytes, kind, dimensions, data, and an empty description
        let length = 2 + 1 + 1 + self.dimensions.len() + self.data.len() + 1;
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend([self.kind as u8, self.dimensions.len() as u8]);
        bytes.extend(&self.dimensions);
        bytes.extend(&self.data);
        bytes.push(0);
        bytes
    }
}

fn parameters(frames: u16, rate: f32, data_start: u16) -> Vec<u8> {
    let names = LANDMARKS.map(|landmark| landmark.name());
    let point = vec![
        Parameter::whole("USED", LANDMARKS.len() as u16),
        Parameter::whole("FRAMES", frames),
        Parameter::whole("DATA_START", data_start),
        Parameter::float("SCALE", -1.0),
        Parameter::float("RATE", rate),
        Parameter::texts("LABELS", &names),
        Parameter::texts("DESCRIPTIONS", &names.map(|_| "virtual marker")),
        Parameter::text("UNITS", "mm"),
        Parameter::text("X_SCREEN", "+X"),
        Parameter::text("Y_SCREEN", "+Z"),
    ];
    let analogue = vec![Parameter::whole("USED", 0), Parameter::float("RATE", rate)];
    // reserved, key, number of blocks (filled in later), Intel byte order
    let mut bytes = vec![1, 0x50, 0, 84];
    for (id, name, group) in [(1_i8, "POINT", point), (2, "ANALOG", analogue)] {
        bytes.extend([name.len() as u8, -id as u8]);
        bytes.extend(name.as_bytes());
        bytes.extend([3, 0, 0]);
        group.iter().for_each(|parameter| bytes.extend(parameter.bytes(id)));
    }
    // an empty name ends the section
    bytes.extend([0, 0]);
    bytes
}

/// x, y, z and residual of every marker in every frame.
fn points(truth: &GroundTruth) -> Vec<u8> {
    let of_marker = |marker: &Option<nalgebra::Point3<f64>>| match marker {
        Some(place) => {
            let [x, y, z] = [place.x, place.y, place.z].map(|metres| millimetres(metres) as f32);
            [x, y, z, 0.0]
        }
        None => [0.0, 0.0, 0.0, -1.0],
    };
    let numbers = truth.frames.iter().flat_map(|frame| frame.markers.iter().flat_map(of_marker));
    numbers.flat_map(f32::to_le_bytes).collect()
}
