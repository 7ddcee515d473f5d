//! AMC: the motion of an Acclaim skeleton. A frame is a line with its number, then one line of angles per moving bone.

use std::collections::HashMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::asf::{AcclaimChannel, AcclaimJoint, AcclaimSkeleton};
use super::clip::clip_name;
use super::options::MAX_RATE;
use super::options::{ReadOptions, UpAxis};
use super::recording::{MAX_JOINT_FRAMES, ParsedRecording};
use super::text_cursor::{TextCursor, quoted};
use super::{Clip, MocapError};

/// CMU's frame rate; AMC files define none, except some with `:SAMPLES-PER-SECOND`.
const USUAL_RATE: f64 = 120.0;

/// Parses the text of an AMC file for its skeleton; `file` is its name, used for messages and the clip's name.
///
/// Frames must be numbered without gaps, and all have values for the same bones. Bones that the motion does not have
/// stay at rest, with a note: the skeleton file may have fingers that were not recorded.
pub fn parse_amc(
    text: &str,
    file: &str,
    skeleton: &AcclaimSkeleton,
    options: &ReadOptions,
) -> Result<Clip, MocapError> {
    options.check()?;
    let mut motion = AmcReader::new(text, file, skeleton);
    motion.run()?;
    let mut notes = Vec::new();
    let frames_per_second = options.frames_per_second.or(motion.frames_per_second).unwrap_or_else(|| {
        notes.push(format!("the file has no frame rate: {USUAL_RATE} frames a second assumed"));
        USUAL_RATE
    });
    notes.extend(motion.note_on_bones_at_rest());
    let clip = Clip {
        name: clip_name(file),
        skeleton: skeleton.skeleton.clone(),
        frames_per_second,
        frames: motion.frames,
        notes,
        ..Clip::default()
    };
    let recording = ParsedRecording {
        clip,
        rest_offsets: skeleton.joints.iter().map(|joint| joint.offset).collect(),
        empty_frames: motion.empty_frames,
        metres_per_unit: skeleton.metres_per_unit(),
        // Acclaim's skeletons are Y up
        up: Some(UpAxis::Y),
    };
    recording.into_clip(file, options)
}

struct AmcReader<'a> {
    cursor: TextCursor<'a>,
    skeleton: &'a AcclaimSkeleton,
    joint_by_name: HashMap<&'a str, usize>,
    degrees: bool,
    frames_per_second: Option<f64>,
    frames: Vec<Vec<Isometry3<f64>>>,
    empty_frames: Vec<usize>,
    /// Whether the first frame, and so the motion, lacks a joint; empty before its end.
    lacks: Vec<bool>,
}

/// The frame whose lines are being read.
struct OpenFrame {
    number: u64,
    frame: Vec<Isometry3<f64>>,
    is_set: Vec<bool>,
    is_empty: bool,
}

impl<'a> AmcReader<'a> {
    fn new(text: &'a str, file: &'a str, skeleton: &'a AcclaimSkeleton) -> Self {
        let joints = skeleton.skeleton.joints.iter();
        Self {
            cursor: TextCursor::new(text, file),
            skeleton,
            joint_by_name: joints.enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect(),
            degrees: skeleton.degrees,
            frames_per_second: None,
            frames: Vec::new(),
            empty_frames: Vec::new(),
            lacks: Vec::new(),
        }
    }

    fn note_on_bones_at_rest(&self) -> Option<String> {
        let joints = self.skeleton.skeleton.joints.iter().zip(&self.lacks);
        let names: Vec<&str> = joints.filter(|(_, lacks)| **lacks).map(|(joint, _)| joint.name.as_str()).collect();
        let words = "bones of the skeleton file that the motion does not have stay at rest";
        (!names.is_empty()).then(|| format!("{words}: {}", names.join(", ")))
    }

    fn run(&mut self) -> Result<(), MocapError> {
        let mut open: Option<OpenFrame> = None;
        while let Some(line) = self.cursor.next_line() {
            if line.starts_with(':') || line.parse::<u64>().is_ok() {
                self.cursor.set_recognised();
            }
            if let Ok(number) = line.parse::<u64>() {
                if let Some(open) = &open
                    && Some(number) != open.number.checked_add(1)
                {
                    let expected = format!("the frame after {}, or a bone with its angles", open.number);
                    return Err(self.cursor.unexpected(&expected, Some(line)));
                }
                self.close(open.take())?;
                open = Some(self.open(number));
                continue;
            }
            match &mut open {
                Some(open) => self.bone_line(open)?,
                None if line.starts_with(':') => self.header_line()?,
                None => return Err(self.cursor.unexpected("the first frame's number", Some(line))),
            }
        }
        self.close(open)
    }

    fn header_line(&mut self) -> Result<(), MocapError> {
        match self.cursor.word_in_line().map(str::to_ascii_uppercase).as_deref() {
            Some(":DEGREES") => self.degrees = true,
            Some(":RADIANS") => self.degrees = false,
            Some(":SAMPLES-PER-SECOND") => {
                let rate = self.cursor.number_in_line("frames per second")?;
                if !(1e-3..=MAX_RATE).contains(&rate) {
                    return Err(self.cursor.error("frames per second > 0", rate));
                }
                self.frames_per_second = Some(rate);
            }
            _ => {}
        }
        Ok(())
    }

    /// A new frame, every joint at rest.
    fn open(&self, number: u64) -> OpenFrame {
        let rest = |joint: &AcclaimJoint| Isometry3::translation(joint.offset.x, joint.offset.y, joint.offset.z);
        OpenFrame {
            number,
            frame: self.skeleton.joints.iter().map(rest).collect(),
            is_set: self.skeleton.joints.iter().map(|joint| joint.channels.is_empty()).collect(),
            is_empty: true,
        }
    }

    fn bone_line(&mut self, open: &mut OpenFrame) -> Result<(), MocapError> {
        let name = self.cursor.word_in_line();
        let Some(&index) = name.and_then(|name| self.joint_by_name.get(name)) else {
            return Err(self.cursor.unexpected("the name of a bone of the skeleton file", name));
        };
        let joint = &self.skeleton.joints[index];
        if self.lacks.get(index) == Some(&true) {
            return Err(self.cursor.unexpected("a bone that the first frame has", name));
        }
        if std::mem::replace(&mut open.is_set[index], true) {
            return Err(self.cursor.unexpected("a bone with degrees of freedom, once per frame", name));
        }
        let mut translation = joint.offset;
        let mut motion = UnitQuaternion::identity();
        for channel in &joint.channels {
            let value = self.cursor.number_in_line("one value for each degree of freedom of the bone")?;
            open.is_empty &= value == 0.0;
            match channel {
                AcclaimChannel::Translation(axis) => translation[axis.index()] += value,
                AcclaimChannel::Rotation(axis) => {
                    motion = axis.turn(if self.degrees { value.to_radians() } else { value }) * motion;
                }
            }
        }
        if let Some(extra) = self.cursor.word_in_line() {
            let expected = format!("{} values, as the skeleton file declares", joint.channels.len());
            return Err(self.cursor.unexpected(&expected, Some(extra)));
        }
        let rotation = joint.parent_from_axis * motion * joint.parent_from_axis.inverse();
        open.frame[index] = Isometry3::from_parts(Translation3::from(translation), rotation);
        Ok(())
    }

    fn close(&mut self, open: Option<OpenFrame>) -> Result<(), MocapError> {
        let Some(open) = open else { return Ok(()) };
        if self.lacks.is_empty() {
            self.lacks = open.is_set.iter().map(|is_set| !is_set).collect();
        }
        // a file that was cut off in its only frame, or has no place in the room
        let is_cut_off = self.lacks[0] || (self.frames.is_empty() && self.cursor.ended);
        let lacks = |joint: usize| self.lacks[joint] && !is_cut_off;
        if let Some(missing) = (0..open.is_set.len()).find(|joint| !open.is_set[*joint] && !lacks(*joint)) {
            let name = &self.skeleton.skeleton.joints[missing].name;
            return Err(self
                .cursor
                .error(format!("{} in frame {}", quoted(name), open.number), "the end of the frame"));
        }
        if (self.frames.len() + 1) * open.frame.len() > MAX_JOINT_FRAMES {
            return Err(self.cursor.error(format!("at most {MAX_JOINT_FRAMES} joints times frames"), "more"));
        }
        if open.is_empty {
            self.empty_frames.push(self.frames.len());
        }
        self.frames.push(open.frame);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::Vector3;

    use super::*;
    use crate::mocap::asf::tests::TINY as TINY_SKELETON;
    use crate::mocap::parse_asf;
    use crate::mocap::rotation::CoordinateAxis;

    const TINY: &str = "#!OML:ASF tiny
:FULLY-SPECIFIED
:DEGREES
7
root 1 2 3 10 20 30
head 40 50
8
root 1 2 3 10 20 30
head 40 50
";

    fn parse(text: &str) -> Result<Clip, MocapError> {
        let skeleton = parse_asf(TINY_SKELETON, "tiny.asf")?;
        parse_amc(text, "tiny.amc", &skeleton, &ReadOptions::default())
    }

    #[test]
    fn a_bone_rotates_about_its_own_axes_first_angle_first() {
        let clip = parse(TINY).unwrap();
        let turn = |axis: CoordinateAxis, degrees: f64| axis.turn(degrees.to_radians());
        let motion = turn(CoordinateAxis::Y, 50.0) * turn(CoordinateAxis::X, 40.0);
        let axes = turn(CoordinateAxis::X, 90.0);
        assert_relative_eq!(clip.frames[0][2].rotation, axes * motion * axes.inverse(), epsilon = 1e-15);
        let root = turn(CoordinateAxis::X, 90.0)
            * turn(CoordinateAxis::Z, 30.0)
            * turn(CoordinateAxis::Y, 20.0)
            * turn(CoordinateAxis::X, 10.0);
        assert_relative_eq!(clip.frames[0][0].rotation, root, epsilon = 1e-15);
        let position = Vector3::new(1.0, -3.0, 2.0) * 0.0254 / 0.45;
        assert_relative_eq!(clip.frames[0][0].translation.vector, position, epsilon = 1e-15);
    }

    #[test]
    fn the_rate_is_120_unless_the_file_or_the_options_define_it() {
        assert_eq!(parse(TINY).unwrap().frames_per_second, 120.0);
        let text = TINY.replace(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 60");
        assert_eq!(parse(&text).unwrap().frames_per_second, 60.0);
        let skeleton = parse_asf(TINY_SKELETON, "t").unwrap();
        let options = ReadOptions { frames_per_second: Some(30.0), ..ReadOptions::default() };
        assert_eq!(parse_amc(&text, "t", &skeleton, &options).unwrap().frames_per_second, 30.0);
    }

    #[test]
    fn radians_are_supported() {
        let clip = parse(&TINY.replace(":DEGREES", ":RADIANS").replace("head 40 50", "head 0.1 0")).unwrap();
        assert_relative_eq!(clip.frames[0][2].rotation.angle(), 0.1, epsilon = 1e-12);
    }

    #[test]
    fn a_broken_motion_is_refused_with_its_line() {
        crate::mocap::check_broken("tiny.amc:", TINY, |text| parse(text).unwrap_err().to_string());
    }

    #[test]
    fn bones_that_no_frame_has_stay_at_rest_with_a_note() {
        let clip = parse(&TINY.replace("head 40 50\n", "")).unwrap();
        let words = "bones of the skeleton file that the motion does not have stay at rest: head";
        assert!(clip.notes.contains(&words.to_owned()), "{:?}", clip.notes);
        assert_relative_eq!(clip.frames[1][2].rotation.angle(), 0.0);
        let cut_off = &TINY[..TINY.find("head").unwrap()];
        assert!(parse(cut_off).unwrap_err().to_string().contains("expected `head` in frame 7"));
    }
}
