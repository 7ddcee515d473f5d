//! Mirrored motion: left and right exchanged.
//!
//! In the rest pose all joint frames are parallel to the file's axes, so the body has the same plane of symmetry in
//! every joint's frame: a joint takes its counterpart's transform, reflected at that plane. The world is reflected as
//! well, so that rotations stay proper.

use std::fmt::Display;

use nalgebra::{Isometry3, Quaternion, Unit, Vector3};
use skiagraph_core::input::plain;

use super::rotation::make_signs_continuous;
use super::{Clip, MocapError, Skeleton};

/// Least share of the distance between left and right joints that must lie along one axis of the file.
const MIN_SHARE_ALONG_AXIS: f64 = 0.8;

/// The world is reflected at the plane y = 0.
const WORLD_AXIS: usize = 1;

impl Clip {
    /// The mirrored motion: left and right limbs exchange their motions, a left turn becomes a right turn, and the path
    /// over the ground is reflected at the plane y = 0. Mirroring twice restores the clip.
    ///
    /// # Errors
    /// [`MocapError::Refused`] if the joint names do not pair left and right.
    pub fn mirrored(&self) -> Result<Self, MocapError> {
        let pairs = self.pairs()?;
        let axis = self.lateral_axis(&pairs)?;
        let mirrored_frame = |frame: &Vec<Isometry3<f64>>| -> Vec<Isometry3<f64>> {
            let of_joint = |(joint, &counterpart): (usize, &usize)| match joint {
                0 => reflected_root(&frame[0], axis),
                _ => reflected(&frame[counterpart], axis),
            };
            pairs.iter().enumerate().map(of_joint).collect()
        };
        let mut frames: Vec<_> = self.frames.iter().map(mirrored_frame).collect();
        make_signs_continuous(&mut frames);
        let mut skeleton = self.skeleton.clone();
        for (joint, &counterpart) in skeleton.joints.iter_mut().zip(&pairs) {
            joint.tip = self.skeleton.joints[counterpart].tip.map(|tip| flipped(&tip, axis));
        }
        Ok(Self { skeleton, frames, ..self.clone() })
    }

    /// Undoes the mirror image of a file in left-handed axes: the world and all joint frames are reflected, names stay.
    pub(crate) fn reflect(&mut self) {
        for transform in self.frames.iter_mut().flatten() {
            *transform = reflected(transform, WORLD_AXIS);
        }
        for tip in self.skeleton.joints.iter_mut().filter_map(|joint| joint.tip.as_mut()) {
            *tip = flipped(tip, WORLD_AXIS);
        }
    }

    /// Exchanges the names of left and right.
    pub(crate) fn exchange_names(&mut self) -> Result<(), MocapError> {
        let pairs = self.pairs()?;
        let names: Vec<String> = pairs.iter().map(|&other| self.skeleton.joints[other].name.clone()).collect();
        for (joint, name) in self.skeleton.joints.iter_mut().zip(names) {
            joint.name = name;
        }
        Ok(())
    }

    /// For every joint its counterpart on the other side; a joint on the midline is its own counterpart.
    fn pairs(&self) -> Result<Vec<usize>, MocapError> {
        let joints = &self.skeleton.joints;
        let mut pairs = Vec::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            pairs.push(match counterpart(&self.skeleton, &joint.name) {
                Counterpart::Joint(other) => other,
                Counterpart::Midline => index,
                Counterpart::Missing(wanted) => {
                    return Err(self.asymmetric(format!("`{}` has no counterpart `{wanted}`", joint.name)));
                }
            });
        }
        if pairs.iter().enumerate().all(|(index, other)| *other == index) {
            return Err(self.asymmetric("no joint name contains left or right"));
        }
        for (index, &other) in pairs.iter().enumerate() {
            let expected = joints[index].parent.map(|parent| pairs[parent]);
            if joints[other].parent != expected {
                let (a, b) = (&joints[index].name, &joints[other].name);
                return Err(self.asymmetric(format!("`{a}` and `{b}` have parents that are not counterparts")));
            }
        }
        Ok(pairs)
    }

    /// The file's lateral axis.
    fn lateral_axis(&self, pairs: &[usize]) -> Result<usize, MocapError> {
        let mut distances = Vector3::zeros();
        if let Some(frame) = self.frames.first() {
            for (index, &other) in pairs.iter().enumerate().filter(|(index, other)| *index < **other) {
                // both parents' frames have the same axes, since those of all joints do in the rest pose
                distances += (frame[index].translation.vector - frame[other].translation.vector).abs();
            }
        }
        let axis = distances.imax();
        if distances[axis] > MIN_SHARE_ALONG_AXIS * distances.norm() && distances[axis] > 0.0 {
            return Ok(axis);
        }
        let detail = "its left and right joints are not on opposite sides of a coordinate plane in the rest pose";
        Err(self.asymmetric(detail))
    }

    fn asymmetric(&self, detail: impl Display) -> MocapError {
        MocapError::Refused(format!("clip `{}` cannot be mirrored: {}", plain(&self.name), plain(detail)))
    }
}

/// The counterpart of a joint.
enum Counterpart {
    Joint(usize),
    Midline,
    /// The name contains left or right, but this counterpart does not exist.
    Missing(String),
}

fn counterpart(skeleton: &Skeleton, name: &str) -> Counterpart {
    for (side, other) in [("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")] {
        for (from, to) in [(side, other), (other, side)] {
            if let Some(at) = name.find(from) {
                let wanted = format!("{}{to}{}", &name[..at], &name[at + from.len()..]);
                return match skeleton.find(&wanted) {
                    Some(other) => Counterpart::Joint(other),
                    None => Counterpart::Missing(wanted),
                };
            }
        }
    }
    // a single letter at either end: `lfemur`, `LThigh`, `thigh_l`, `Thigh.L`
    let ends = |from: &str, to: &str| {
        let front = name.strip_prefix(from).map(|rest| format!("{to}{rest}"));
        let back = ['_', '.', '-'].into_iter().find_map(|separator| {
            let stem = name.strip_suffix(from)?.strip_suffix(separator)?;
            Some(format!("{stem}{separator}{to}"))
        });
        front.into_iter().chain(back).find_map(|wanted| skeleton.find(&wanted))
    };
    let letters = [("l", "r"), ("r", "l"), ("L", "R"), ("R", "L")];
    letters.into_iter().find_map(|(from, to)| ends(from, to)).map_or(Counterpart::Midline, Counterpart::Joint)
}

fn flipped(vector: &Vector3<f64>, axis: usize) -> Vector3<f64> {
    let mut vector = *vector;
    vector[axis] = -vector[axis];
    vector
}

/// The transform with both frames reflected at the plane normal to `axis`: the rotation axis is a pseudovector and
/// keeps its component along `axis`.
fn reflected(transform: &Isometry3<f64>, axis: usize) -> Isometry3<f64> {
    let mut imaginary = -transform.rotation.imag();
    imaginary[axis] = -imaginary[axis];
    let rotation = Unit::new_unchecked(Quaternion::from_parts(transform.rotation.w, imaginary));
    Isometry3::from_parts(flipped(&transform.translation.vector, axis).into(), rotation)
}

/// The root's transform: the world is reflected along [`WORLD_AXIS`], the root's frame along `axis`.
fn reflected_root(world_from_root: &Isometry3<f64>, axis: usize) -> Isometry3<f64> {
    let both = reflected(world_from_root, WORLD_AXIS);
    if axis == WORLD_AXIS {
        return both;
    }
    // reflections along two axes are a half turn about the third
    let third = Vector3::ith(3 - axis - WORLD_AXIS, 1.0);
    let half_turn = Unit::new_unchecked(Quaternion::from_parts(0.0, third));
    Isometry3::from_parts(both.translation, both.rotation * half_turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mocap::{ReadOptions, SkeletonJoint, parse_deepmimic};

    fn walk() -> Clip {
        let text = include_str!("../../../../scenarios/motions/humanoid3d_walk.txt");
        parse_deepmimic(text, "walk.txt", &ReadOptions::default()).unwrap()
    }

    #[test]
    fn every_joint_takes_its_counterparts_reflected_position() {
        let clip = walk();
        let mirrored = clip.mirrored().unwrap();
        for frame in [0, 7, 20] {
            let (was, now) = (clip.joint_positions(frame), mirrored.joint_positions(frame));
            for (index, joint) in clip.skeleton.joints.iter().enumerate() {
                let other = match joint.name.split_once('_') {
                    Some(("left", part)) => clip.skeleton.find(&format!("right_{part}")).unwrap(),
                    Some(("right", part)) => clip.skeleton.find(&format!("left_{part}")).unwrap(),
                    _ => index,
                };
                let expected = flipped(&was[other].coords, WORLD_AXIS);
                assert!((now[index].coords - expected).norm() < 1e-9, "{} in frame {frame}", joint.name);
            }
        }
    }

    #[test]
    fn mirroring_twice_restores_the_clip() {
        let clip = walk();
        let twice = clip.mirrored().unwrap().mirrored().unwrap();
        for (a, b) in clip.frames.iter().flatten().zip(twice.frames.iter().flatten()) {
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-12);
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7);
        }
        assert_eq!(clip.skeleton, twice.skeleton);
    }

    #[test]
    fn skeletons_that_do_not_pair_left_and_right_are_refused_naming_the_joint() {
        let renamed = |from: &str, to: &str| {
            let mut clip = walk();
            let joint = clip.skeleton.find(from).unwrap();
            clip.skeleton.joints[joint].name = to.to_owned();
            clip.mirrored().unwrap_err().to_string()
        };
        let message = renamed("left_knee", "left_shin");
        let is_named = message.contains("`left_shin` has no counterpart") || message.contains("`right_knee` has no");
        assert!(is_named, "{message}");
        let mut plain = walk();
        for (index, joint) in plain.skeleton.joints.iter_mut().enumerate() {
            *joint = SkeletonJoint { name: format!("j{index}"), ..joint.clone() };
        }
        assert!(plain.mirrored().unwrap_err().to_string().contains("no joint name contains left or right"));
    }

    #[test]
    fn a_letter_at_either_end_of_a_name_is_a_side_only_if_its_counterpart_exists() {
        let names = ["root", "lowerback", "lfemur", "rfemur", "Thigh.L", "Thigh.R"];
        let joint = |name: &&str| SkeletonJoint { name: (*name).to_owned(), parent: None, tip: None };
        let skeleton = Skeleton { joints: names.iter().map(joint).collect() };
        let other = |name: &str| match counterpart(&skeleton, name) {
            Counterpart::Joint(index) => names[index],
            Counterpart::Midline => "midline",
            Counterpart::Missing(_) => "missing",
        };
        assert_eq!(names.map(other), ["midline", "midline", "rfemur", "lfemur", "Thigh.R", "Thigh.L"]);
    }
}
