//! ASF: an Acclaim skeleton. Bones with a rest direction, a length and rotation axes.
//!
//! A bone becomes a joint at the bone's start, which is its parent's end (Lander, "Working with Motion Capture File
//! Formats", Game Developer, January 1998). At rest every joint's frame is parallel to the world; a bone's rotation is
//! `C M C^-1`, where `C` is its `axis` and `M` the rotation by the motion file's angles.

use nalgebra::{UnitQuaternion, Vector3};

use super::recording::MAX_JOINTS;
use super::rotation::CoordinateAxis;
use super::text_cursor::{TextCursor, quoted};
use super::{MocapError, Skeleton, SkeletonJoint};

/// A skeleton from an ASF file, in file units. Joint 0 is the root, the others are named after their bones.
#[derive(Clone, Debug, PartialEq)]
pub struct AcclaimSkeleton {
    pub(super) skeleton: Skeleton,
    /// Rest position and channels of each joint.
    pub(super) joints: Vec<AcclaimJoint>,
    /// The file's `length`, see [`Self::metres_per_unit`].
    pub(super) length: Option<f64>,
    /// Whether angles are in degrees, here and in motion files that do not define their unit.
    pub(super) degrees: bool,
}

/// Rest position and channels of an Acclaim joint.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AcclaimJoint {
    /// Offset from the parent's start, file units; the position of the root.
    pub(super) offset: Vector3<f64>,
    /// The frame in which the motion's angles rotate the joint.
    pub(super) parent_from_axis: UnitQuaternion<f64>,
    /// Meaning of the motion file's numbers, in its order.
    pub(super) channels: Vec<AcclaimChannel>,
}

/// One number of a motion file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AcclaimChannel {
    /// `tx`, `ty`, `tz`.
    Translation(CoordinateAxis),
    /// `rx`, `ry`, `rz`.
    Rotation(CoordinateAxis),
}

impl AcclaimSkeleton {
    /// 0.0254 / `length`: Acclaim's files use scaled inches (0.45 in CMU's files, so 0.05644 m).
    pub fn metres_per_unit(&self) -> Option<f64> {
        self.length.map(|length| 0.0254 / length)
    }
}

/// Parses the text of an ASF file; `file` is its name, used for messages.
pub fn parse_asf(text: &str, file: &str) -> Result<AcclaimSkeleton, MocapError> {
    let mut parser = Parser::new(text, file);
    parser.run()?;
    parser.into_skeleton()
}

/// A bone, from its `begin … end` block.
struct AsfBone {
    name: String,
    line: usize,
    start_to_end: Vector3<f64>,
    parent_from_axis: UnitQuaternion<f64>,
    channels: Vec<AcclaimChannel>,
    /// Index of the parent bone; the inner `None` is the root. Set by the hierarchy.
    parent: Option<Option<usize>>,
}

struct Parser<'a> {
    cursor: TextCursor<'a>,
    /// The line that opens the next section.
    section: Option<&'a str>,
    length: Option<f64>,
    degrees: bool,
    root: Option<AcclaimJoint>,
    bones: Vec<AsfBone>,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str, file: &'a str) -> Self {
        let cursor = TextCursor::new(text, file);
        Self { cursor, section: None, length: None, degrees: true, root: None, bones: Vec::new() }
    }

    fn run(&mut self) -> Result<(), MocapError> {
        if let Some(line) = self.line_in_section() {
            return Err(self.cursor.unexpected("a section such as `:version`", Some(line)));
        }
        self.cursor.set_recognised();
        while let Some(section) = self.section.take() {
            match section.to_ascii_lowercase().split_whitespace().next() {
                Some(":units") => self.units()?,
                Some(":root") => self.root()?,
                Some(":bonedata") => self.bones()?,
                Some(":hierarchy") => self.hierarchy()?,
                _ => while self.line_in_section().is_some() {},
            }
        }
        Ok(())
    }

    /// The next line, unless it opens another section.
    fn line_in_section(&mut self) -> Option<&'a str> {
        let line = self.cursor.next_line()?;
        if line.starts_with(':') {
            self.section = Some(line);
            return None;
        }
        Some(line)
    }

    fn units(&mut self) -> Result<(), MocapError> {
        while self.line_in_section().is_some() {
            match self.key().as_str() {
                "length" => {
                    let length = self.cursor.number_in_line("the unit of length")?;
                    if !(1e-6..=1e6).contains(&length) {
                        return Err(self.cursor.error("a unit of length > 0", length));
                    }
                    self.length = Some(length);
                }
                "angle" => {
                    let word = self.cursor.word_in_line();
                    self.degrees = match word.map(str::to_ascii_lowercase).as_deref() {
                        Some("deg") => true,
                        Some("rad") => false,
                        _ => return Err(self.cursor.unexpected("`deg` or `rad`", word)),
                    };
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn root(&mut self) -> Result<(), MocapError> {
        let mut offset = Vector3::zeros();
        let mut angles = Vector3::zeros();
        let mut order = [CoordinateAxis::X, CoordinateAxis::Y, CoordinateAxis::Z];
        let mut channels = Vec::new();
        while self.line_in_section().is_some() {
            match self.key().as_str() {
                "order" => channels = self.channels()?,
                "axis" => order = self.axis_order()?,
                "position" => offset = self.cursor.vector_in_line("the root's position")?,
                "orientation" => angles = self.cursor.vector_in_line("the root's orientation")?,
                _ => {}
            }
        }
        self.root = Some(AcclaimJoint { offset, parent_from_axis: self.rotation(&angles, order), channels });
        Ok(())
    }

    fn bones(&mut self) -> Result<(), MocapError> {
        while let Some(line) = self.line_in_section() {
            if !line.eq_ignore_ascii_case("begin") {
                return Err(self.cursor.unexpected("`begin` of a bone", Some(line)));
            }
            let bone = self.bone()?;
            if bone.name == "root" || self.bones.iter().any(|other| other.name == bone.name) {
                return Err(self.cursor.error("a unique bone name", format!("a second {}", quoted(&bone.name))));
            }
            self.bones.push(bone);
            if self.bones.len() >= MAX_JOINTS {
                return Err(self.cursor.error(format!("fewer than {MAX_JOINTS} bones"), "more"));
            }
        }
        Ok(())
    }

    fn bone(&mut self) -> Result<AsfBone, MocapError> {
        let line = self.cursor.line();
        let (mut name, mut direction, mut length) = (None, None, None);
        let mut parent_from_axis = UnitQuaternion::identity();
        let mut channels = Vec::new();
        loop {
            if self.line_in_section().is_none() {
                return Err(self.cursor.error("`end` of the bone", "the end of the section"));
            }
            match self.key().as_str() {
                "end" => break,
                "name" => name = self.cursor.word_in_line().map(str::to_owned),
                "direction" => direction = Some(self.cursor.vector_in_line("a direction")?),
                "length" => length = Some(self.cursor.number_in_line("a bone's length")?),
                "axis" => {
                    let angles = self.cursor.vector_in_line("an axis' angle")?;
                    let order = self.axis_order()?;
                    parent_from_axis = self.rotation(&angles, order);
                }
                "dof" => channels = self.channels()?,
                _ => {}
            }
        }
        let missing = |what: &str| self.cursor.error(format!("the bone's {what} before its `end`"), "none");
        let name = name.ok_or_else(|| missing("name"))?;
        let direction: Vector3<f64> = direction.ok_or_else(|| missing("direction"))?;
        let length: f64 = length.ok_or_else(|| missing("length"))?;
        let start_to_end = match direction.try_normalize(1e-12) {
            Some(unit) => unit * length,
            None if length == 0.0 => Vector3::zeros(),
            None => return Err(missing("nonzero direction")),
        };
        Ok(AsfBone { name, line, start_to_end, parent_from_axis, channels, parent: None })
    }

    fn hierarchy(&mut self) -> Result<(), MocapError> {
        while let Some(line) = self.line_in_section() {
            let Some(parent) = self.cursor.word_in_line() else { continue };
            if line.eq_ignore_ascii_case("begin") || line.eq_ignore_ascii_case("end") {
                continue;
            }
            let parent = if parent.eq_ignore_ascii_case("root") { None } else { Some(self.bone_index(parent)?) };
            while let Some(child) = self.cursor.word_in_line() {
                let child = self.bone_index(child)?;
                let bone = &mut self.bones[child];
                if bone.parent.replace(parent).is_some() {
                    let found = format!("a second one for {}", quoted(&bone.name));
                    return Err(self.cursor.error("one parent per bone", found));
                }
            }
        }
        Ok(())
    }

    fn bone_index(&self, name: &str) -> Result<usize, MocapError> {
        let index = self.bones.iter().position(|bone| bone.name == name);
        index.ok_or_else(|| self.cursor.unexpected("the name of a bone in `:bonedata`", Some(name)))
    }

    /// The first word of the current line, in lower case.
    fn key(&mut self) -> String {
        self.cursor.word_in_line().unwrap_or_default().to_ascii_lowercase()
    }

    /// The rest of the line as channels.
    fn channels(&mut self) -> Result<Vec<AcclaimChannel>, MocapError> {
        let mut channels = Vec::new();
        while let Some(word) = self.cursor.word_in_line() {
            match AcclaimChannel::from_name(word).filter(|channel| !channels.contains(channel)) {
                Some(channel) => channels.push(channel),
                None => return Err(self.cursor.unexpected("rx, ry, rz, tx, ty or tz, each once", Some(word))),
            }
        }
        Ok(channels)
    }

    /// The next word as an order of three different axes.
    fn axis_order(&mut self) -> Result<[CoordinateAxis; 3], MocapError> {
        let word = self.cursor.word_in_line();
        let axes: Option<Vec<CoordinateAxis>> =
            word.unwrap_or_default().chars().map(CoordinateAxis::from_letter).collect();
        match axes.as_deref() {
            Some(&[a, b, c]) if a != b && b != c && a != c => Ok([a, b, c]),
            _ => Err(self.cursor.unexpected("an order of axes such as XYZ", word)),
        }
    }

    /// Rotations about fixed axes, the first of `order` applied first.
    fn rotation(&self, angles: &Vector3<f64>, order: [CoordinateAxis; 3]) -> UnitQuaternion<f64> {
        let radians = if self.degrees { angles.map(f64::to_radians) } else { *angles };
        order.iter().zip(radians.iter()).fold(UnitQuaternion::identity(), |turned, (axis, &a)| axis.turn(a) * turned)
    }

    /// Orders parents first, siblings as in the file.
    fn into_skeleton(self) -> Result<AcclaimSkeleton, MocapError> {
        let Some(root) = self.root else { return Err(self.cursor.error("a section `:root`", "none")) };
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.bones.len()];
        let mut pending = Vec::new();
        for (index, bone) in self.bones.iter().enumerate().rev() {
            match bone.parent {
                Some(Some(parent)) => children[parent].push(index),
                Some(None) => pending.push((index, 0)),
                None => {}
            }
        }
        let mut skeleton =
            Skeleton { joints: vec![SkeletonJoint { name: "root".to_owned(), parent: None, tip: None }] };
        let mut joints = vec![root];
        let mut is_placed = vec![false; self.bones.len()];
        while let Some((index, parent)) = pending.pop() {
            let bone = &self.bones[index];
            let offset = match bone.parent {
                Some(Some(parent)) => self.bones[parent].start_to_end,
                _ => Vector3::zeros(),
            };
            let tip = children[index].is_empty().then_some(bone.start_to_end);
            let joint = skeleton.joints.len();
            pending.extend(children[index].iter().map(|&child| (child, joint)));
            skeleton.joints.push(SkeletonJoint { name: bone.name.clone(), parent: Some(parent), tip });
            let (parent_from_axis, channels) = (bone.parent_from_axis, bone.channels.clone());
            joints.push(AcclaimJoint { offset, parent_from_axis, channels });
            is_placed[index] = true;
        }
        match self.bones.iter().zip(is_placed).find(|(_, is_placed)| !is_placed) {
            Some((bone, _)) => Err(self.cursor.error(
                "every bone connected to the root in `:hierarchy`",
                format!("{} (line {}) unconnected", quoted(&bone.name), bone.line),
            )),
            None => Ok(AcclaimSkeleton { skeleton, joints, length: self.length, degrees: self.degrees }),
        }
    }
}

impl AcclaimChannel {
    fn from_name(name: &str) -> Option<Self> {
        let mut letters = name.chars();
        let kind = letters.next()?.to_ascii_lowercase();
        let axis = CoordinateAxis::from_letter(letters.next()?)?;
        match (kind, letters.next()) {
            ('t', None) => Some(Self::Translation(axis)),
            ('r', None) => Some(Self::Rotation(axis)),
            _ => None,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// A head, and a trunk listed after it; the head rotates about tilted axes.
    pub(in crate::mocap) const TINY: &str = "# made by hand
:version 1.10
:name tiny
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   begin of no bone
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name head
     direction 0 1 0
     length 4
     axis 90 0 0 XYZ
    dof rx ry
    limits (-160.0 20.0)
           (-70.0 70.0)
  end
  begin
     id 2
     name trunk
     direction 0 2 0
     length 10
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root trunk
    trunk head
  end
";

    fn message(text: &str) -> String {
        parse_asf(text, "tiny.asf").unwrap_err().to_string()
    }

    #[test]
    fn a_joint_sits_at_its_parents_end_and_a_leaf_has_a_tip() {
        let skeleton = parse_asf(TINY, "tiny.asf").unwrap();
        let joints = &skeleton.skeleton.joints;
        let names: Vec<_> = joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
        assert_eq!(names, [("root", None), ("trunk", Some(0)), ("head", Some(1))]);
        assert_eq!(skeleton.joints[1].offset, Vector3::zeros());
        assert_eq!(skeleton.joints[2].offset, Vector3::new(0.0, 10.0, 0.0));
        assert_eq!((joints[1].tip, joints[2].tip), (None, Some(Vector3::new(0.0, 4.0, 0.0))));
        assert_relative_eq!(skeleton.metres_per_unit().unwrap(), 0.056444, epsilon = 1e-6);
    }

    #[test]
    fn axis_angles_rotate_about_fixed_axes_first_letter_first() {
        let skeleton = parse_asf(&TINY.replace("axis 90 0 0 XYZ", "axis 90 90 0 XYZ"), "t").unwrap();
        // X rotates Y to Z, then Y rotates Z to X
        assert_relative_eq!(skeleton.joints[2].parent_from_axis * Vector3::y(), Vector3::x(), epsilon = 1e-15);
    }

    #[test]
    fn a_broken_skeleton_is_refused_with_its_line() {
        crate::mocap::check_broken("tiny.asf:", TINY, message);
        assert!(message(":version 1\n").ends_with("expected a section `:root`, found none"));
    }
}
