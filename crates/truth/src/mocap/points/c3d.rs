//! C3D, the binary marker format of motion capture systems (`www.c3d.org`, user guide): blocks of 512 bytes with a
//! header, groups of parameters, then frames of points and of analogue samples, which are skipped. Intel, DEC and SGI
//! numbers, integer or floating point.
//!
//! Existing crates that read C3D panic on damaged files, so they are not used.

use super::{MOST_POINTS, PointFile, metres_per_unit};
use crate::mocap::UpAxis;
use skiagraph_core::input::excerpt;

const BLOCK: usize = 512;
/// Limit on the parameters and groups of a file.
const MAX_PARAMETERS: usize = 10_000;

/// Number format.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Processor {
    Intel,
    Dec,
    Sgi,
}

impl Processor {
    fn word(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Intel | Self::Dec => u16::from_le_bytes(bytes),
            Self::Sgi => u16::from_be_bytes(bytes),
        }
    }

    fn float(self, [a, b, c, d]: [u8; 4]) -> f64 {
        f64::from(match self {
            Self::Intel => f32::from_le_bytes([a, b, c, d]),
            Self::Sgi => f32::from_be_bytes([a, b, c, d]),
            // words swapped, and an exponent greater by two
            Self::Dec => 0.25 * f32::from_le_bytes([c, d, a, b]),
        })
    }
}

/// The bytes of a file, and its number format.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    all: &'a [u8],
    processor: Processor,
}

impl Bytes<'_> {
    fn byte(self, at: usize) -> Option<u8> {
        self.all.get(at).copied()
    }

    fn word(self, at: usize) -> Option<u16> {
        Some(self.processor.word(*self.all.get(at..)?.first_chunk()?))
    }

    fn float(self, at: usize) -> Option<f64> {
        Some(self.processor.float(*self.all.get(at..)?.first_chunk()?))
    }
}

/// A parameter of a group.
struct C3dParameter {
    group: String,
    name: String,
    /// -1 text, 1 byte, 2 integer, 4 float.
    kind: i8,
    dimensions: Vec<usize>,
    data: Vec<u8>,
}

struct C3dParameters {
    all: Vec<C3dParameter>,
    processor: Processor,
}

impl C3dParameters {
    /// Reads the section that begins at `start`.
    fn read(bytes: Bytes<'_>, start: usize) -> Result<Self, String> {
        let cut = || "the parameter section is truncated".to_owned();
        let mut groups: Vec<(u8, String)> = Vec::new();
        let mut found: Vec<(u8, C3dParameter)> = Vec::new();
        let mut at = start + 4;
        // the section may end with its last block, without a mark
        let blocks = bytes.byte(start + 2).map(usize::from).filter(|blocks| *blocks > 0);
        let end = blocks.map_or(bytes.all.len(), |blocks| start + blocks * BLOCK);
        while at < end && found.len() + groups.len() < MAX_PARAMETERS {
            // a negative length marks a locked parameter; 0 ends the section
            let Some(length) = bytes.byte(at).map(|length| usize::from((length as i8).unsigned_abs())) else { break };
            if length == 0 {
                break;
            }
            let id = bytes.byte(at + 1).ok_or_else(cut)? as i8;
            let name = bytes.all.get(at + 2..at + 2 + length).ok_or_else(cut)?;
            let name = String::from_utf8_lossy(name).trim().to_ascii_uppercase();
            let behind = at + 2 + length;
            let step = usize::from(bytes.word(behind).ok_or_else(cut)?);
            if id < 0 {
                groups.push((id.unsigned_abs(), name));
            } else {
                found.push((id.unsigned_abs(), C3dParameter::read(bytes, behind + 2, name).ok_or_else(cut)?));
            }
            if step == 0 {
                break;
            }
            at = behind + step;
        }
        for (id, parameter) in &mut found {
            let group = groups.iter().find(|(known, _)| known == id);
            parameter.group = group.map_or_else(String::new, |(_, name)| name.clone());
        }
        let all = found.into_iter().map(|(_, parameter)| parameter).collect();
        Ok(Self { all, processor: bytes.processor })
    }

    fn find(&self, group: &str, name: &str) -> Option<&C3dParameter> {
        self.all.iter().find(|parameter| parameter.group == group && parameter.name == name)
    }

    /// The numbers of a parameter; empty if there is none.
    fn numbers(&self, group: &str, name: &str) -> Vec<f64> {
        let Some(parameter) = self.find(group, name) else { return Vec::new() };
        match parameter.kind {
            1 => parameter.data.iter().map(|byte| f64::from(*byte)).collect(),
            2 => parameter.data.as_chunks().0.iter().map(|word| f64::from(self.processor.word(*word))).collect(),
            4 => parameter.data.as_chunks().0.iter().map(|float| self.processor.float(*float)).collect(),
            _ => Vec::new(),
        }
    }

    /// The texts of a parameter, trimmed.
    fn texts(&self, group: &str, name: &str) -> Vec<String> {
        let Some(parameter) = self.find(group, name).filter(|p| p.kind == -1) else { return Vec::new() };
        let length = parameter.dimensions.first().copied().unwrap_or(parameter.data.len()).max(1);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned();
        parameter.data.chunks(length).map(text).collect()
    }
}

impl C3dParameter {
    fn read(bytes: Bytes<'_>, at: usize, name: String) -> Option<Self> {
        let kind = bytes.byte(at)? as i8;
        let count = usize::from(bytes.byte(at + 1)?);
        let dimensions: Vec<usize> = bytes.all.get(at + 2..at + 2 + count)?.iter().map(|d| usize::from(*d)).collect();
        let size = usize::from(kind.unsigned_abs());
        // at most seven dimensions of a byte each
        let elements = dimensions.iter().try_fold(1_usize, |all, d| all.checked_mul(*d))?;
        let start = at + 2 + count;
        let data = bytes.all.get(start..start.checked_add(elements.checked_mul(size)?)?)?.to_vec();
        Some(Self { group: String::new(), name, kind, dimensions, data })
    }
}

/// Parses the bytes of a C3D file.
pub fn parse(all: &[u8]) -> Result<PointFile, String> {
    let first = all.first().copied().map(usize::from);
    let Some(start) = first.filter(|block| *block > 0 && all.get(1) == Some(&0x50)).map(|block| (block - 1) * BLOCK)
    else {
        return Err("expected a C3D file, whose second byte is 0x50".to_owned());
    };
    let processor = match all.get(start + 3) {
        Some(84) => Processor::Intel,
        Some(85) => Processor::Dec,
        Some(86) => Processor::Sgi,
        Some(other) => return Err(format!("expected processor type 84, 85 or 86, found {other}")),
        None => return Err("the file ends before its parameters".to_owned()),
    };
    let bytes = Bytes { all, processor };
    let parameters = C3dParameters::read(bytes, start)?;
    let layout = Layout::of(bytes, &parameters)?;
    let names = labels(&parameters, layout.points);
    let rate = parameters.numbers("POINT", "RATE").first().copied().filter(|rate| rate.is_finite() && *rate > 0.0);
    let of_header = bytes.float(20).filter(|rate| rate.is_finite() && *rate > 0.0);
    let mut notes = Vec::new();
    if let (Some(rate), Some(header)) = (rate, of_header)
        && (rate / header - 1.0).abs() > 0.02
    {
        notes.push(format!(
            "POINT:RATE is {rate} frames a second, but the header has {header}: read at {rate}; else set `source_hz`"
        ));
    }
    let rate = rate.or(of_header);
    let Layout { declared, frames: held, .. } = layout;
    if declared > held {
        notes.push(format!("{declared} frames are declared, but the file has {held}, which were read"));
    }
    if let Some([header, parameter, read]) = layout.blocks {
        notes.push(format!(
            "the data begin in block {header} by the header and in block {parameter} by POINT:DATA_START: read by the {}",
            if read == header { "header" } else { "parameter" }
        ));
    }
    let metres_per_unit = unit(&parameters, &mut notes)?;
    let frames = (0..layout.frames).map(|frame| layout.frame(bytes, frame)).collect::<Result<_, String>>()?;
    let time = |frame: usize| Some((layout.first + frame) as f64 / rate?);
    Ok(PointFile {
        names,
        frames_per_second: rate,
        times_s: (0..layout.frames).map_while(time).collect(),
        metres_per_unit,
        up: up(&parameters),
        up_is_usual: false,
        frames,
        notes,
    })
}

/// Labels of all points; those beyond 255 are in LABELS2 and so on.
fn labels(parameters: &C3dParameters, points: usize) -> Vec<String> {
    let mut labels = parameters.texts("POINT", "LABELS");
    for number in 2..=99 {
        let more = parameters.texts("POINT", &format!("LABELS{number}"));
        if more.is_empty() || labels.len() >= points {
            break;
        }
        labels.extend(more);
    }
    labels.resize(points, String::new());
    labels
}

fn unit(parameters: &C3dParameters, notes: &mut Vec<String>) -> Result<Option<f64>, String> {
    let units = [parameters.texts("POINT", "UNITS"), parameters.texts("POINT", "UNIT")].concat();
    let mut words: Vec<&str> = units.iter().map(|unit| unit.trim()).filter(|unit| !unit.is_empty()).collect();
    if words.is_empty() {
        notes.push("POINT:UNITS is missing: millimetres assumed".to_owned());
        return Ok(Some(0.001));
    }
    // some programs write one for each point, with those of angles and forces
    let mut lengths: Vec<f64> = words.iter().filter_map(|unit| metres_per_unit(unit)).collect();
    lengths.dedup();
    if let [length] = *lengths {
        return Ok(Some(length));
    }
    words.dedup();
    let found = words.join(", ");
    Err(format!("POINT:UNITS: expected one of mm, cm, m, in or ft for all points, found {:?}", excerpt(&found)))
}

/// The axis that points up on a screen.
fn up(parameters: &C3dParameters) -> Option<UpAxis> {
    match parameters.texts("POINT", "Y_SCREEN").concat().trim().to_ascii_uppercase().as_str() {
        "+Z" | "Z" => Some(UpAxis::Z),
        "+Y" | "Y" => Some(UpAxis::Y),
        _ => None,
    }
}

/// Layout of the frame data.
struct Layout {
    start: usize,
    points: usize,
    /// The number of the first frame, from 0.
    first: usize,
    /// Whole frames in the file.
    frames: usize,
    /// Frames that the file declares.
    declared: usize,
    /// Bytes per number.
    size: usize,
    /// Numbers per frame, points and samples.
    numbers: usize,
    scale: f64,
    /// The first block of the data by header and by parameter, if they differ, and the one that was read.
    blocks: Option<[usize; 3]>,
}

impl Layout {
    fn of(bytes: Bytes<'_>, parameters: &C3dParameters) -> Result<Self, String> {
        let word = |at: usize| bytes.word(at).map(usize::from).ok_or_else(|| "the header is truncated".to_owned());
        let number = |name: &str| parameters.numbers("POINT", name).first().copied();
        let points = number("USED").map_or(word(2)?, |used| used as usize);
        let samples = word(4)?;
        let scale = number("SCALE").map_or_else(|| bytes.float(12), Some).filter(|scale| scale.is_finite());
        let scale = scale.ok_or("POINT:SCALE: expected a number")?;
        let size = if scale < 0.0 { 4 } else { 2 };
        let numbers = 4 * points + samples;
        let (first, last) = (word(6)?, word(8)?);
        let said = match (actual_frames(parameters), number("LONG_FRAMES")) {
            (Some(frames), _) => frames,
            (None, Some(frames)) if frames >= 1.0 => frames as usize,
            _ => (last + 1).saturating_sub(first),
        };
        // the header is what other readers follow, unless only the parameter puts the last frame at the end of the file
        let parameter = number("DATA_START").map(|block| block as usize).filter(|block| *block > 0);
        let header = word(16)?;
        let is_at_end = |block: &usize| {
            let data = said.saturating_mul(numbers * size).div_ceil(BLOCK);
            (block - 1).saturating_add(data) == bytes.all.len().div_ceil(BLOCK)
        };
        let block = match parameter {
            Some(parameter) if header == 0 || is_at_end(&parameter) && !is_at_end(&header) => parameter,
            _ => header,
        };
        let blocks =
            parameter.filter(|parameter| header > 0 && *parameter != header).map(|other| [header, other, block]);
        if points == 0 || block == 0 {
            return Err("expected points, found none".to_owned());
        }
        let start = (block - 1) * BLOCK;
        let held = bytes.all.len().saturating_sub(start) / (numbers * size);
        // files with more frames than 16 bits can count may declare 65535
        let declared = if said == 0 || (last >= 65_535 && said < held) { held } else { said };
        let frames = declared.min(held);
        // a file cut short is no single pose
        if frames <= 1 && declared > frames {
            return Err(format!(
                "expected {declared} frames of {points} points, found {frames}: the file is truncated"
            ));
        }
        if frames.saturating_mul(points) > MOST_POINTS {
            return Err(format!("expected at most {MOST_POINTS} points, found {frames} frames of {points} points"));
        }
        let first = first.saturating_sub(1);
        Ok(Self { start, points, first, frames, declared, size, numbers, scale: scale.abs(), blocks })
    }

    fn frame(&self, bytes: Bytes<'_>, frame: usize) -> Result<Vec<Option<[f64; 3]>>, String> {
        let begin = self.start + frame * self.numbers * self.size;
        let number = |index: usize| {
            let at = begin + index * self.size;
            match self.size {
                4 => bytes.float(at),
                _ => bytes.word(at).map(|word| f64::from(word as i16)),
            }
        };
        let point = |point: usize| {
            let own = [0, 1, 2, 3].map(|i| number(4 * point + i).unwrap_or(f64::NAN));
            let [x, y, z, residual] = own;
            let place = if self.size == 2 { [x, y, z].map(|c| c * self.scale) } else { [x, y, z] };
            // missing: a negative residual, or not a number
            if residual < 0.0 || place.iter().any(|c| c.is_nan()) {
                return Ok(None);
            }
            if place.iter().all(|c| c.abs() < 1e9) {
                Ok(Some(place))
            } else {
                Err(format!("frame {}, point {}: expected a position, found {place:?}", frame + 1, point + 1))
            }
        };
        (0..self.points).map(point).collect()
    }
}

/// The number of frames from TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD, 32 bits in two words each.
fn actual_frames(parameters: &C3dParameters) -> Option<usize> {
    let field = |name: &str| match parameters.numbers("TRIAL", name).as_slice() {
        [low, high] => Some(*low as usize + 65_536 * *high as usize),
        _ => None,
    };
    let (first, last) = (field("ACTUAL_START_FIELD")?, field("ACTUAL_END_FIELD")?);
    (last + 1).checked_sub(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Behind parameters that fill their blocks, the data were read as parameters.
    #[test]
    fn parameters_end_with_their_last_block() {
        let mut bytes = vec![1, 0x50, 1, 86];
        bytes.extend([&[5, 255][..], b"POINT", &[0, 3, 0]].concat());
        // a text of 2 x 244 letters in big-endian numbers fills the block
        bytes.extend([&[1, 1, b'F', 1, 239, 255, 2, 244, 2][..], &[b' '; 488], &[0]].concat());
        assert_eq!(bytes.len(), BLOCK);
        bytes.extend([65; BLOCK]);
        let found = C3dParameters::read(Bytes { all: &bytes, processor: Processor::Sgi }, 0).unwrap();
        assert_eq!(found.all.len(), 1);
    }

    // Units cut to four letters, or one for each point, were refused.
    #[test]
    fn units_may_be_cut_or_given_for_each_point() {
        let units = |width: usize, text: &str| {
            let dimensions = vec![width, text.len() / width];
            let (group, name, data) = ("POINT".to_owned(), "UNITS".to_owned(), text.as_bytes().to_vec());
            let all = vec![C3dParameter { group, name, kind: -1, dimensions, data }];
            unit(&C3dParameters { all, processor: Processor::Intel }, &mut Vec::new())
        };
        for (width, text, metres) in [(4, "mete", 1.0), (4, "mill", 0.001), (4, "inch", 0.0254), (2, "mmmmmm", 0.001)] {
            assert_eq!(units(width, text), Ok(Some(metres)), "{text}");
        }
        assert_eq!(units(4, "mm  deg N   mm  "), Ok(Some(0.001)), "angles and forces among the points");
        assert!(units(2, "mmm ").unwrap_err().contains("for all points, found \"mm, m\""));
    }
}
