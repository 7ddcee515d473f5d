//! How tall a skeleton stands, and what that says about the file's up axis and unit.

use nalgebra::{Isometry3, Vector3};

use super::Clip;
use super::read::UpAxis;

/// A skeleton's joints and tips stand about this high, metres.
const ADULT: f64 = 1.7;

/// Heights that an adult's (or a tall child's) skeleton may have, metres.
const HUMAN: std::ops::RangeInclusive<f64> = 1.25..=2.1;

/// Units that recordings are written in. CMU's is an inch over 0.45.
const UNITS: [(&str, f64); 7] = [
    ("metre", 1.0),
    ("decimetre", 0.1),
    ("centimetre", 0.01),
    ("millimetre", 0.001),
    ("inch", 0.0254),
    ("foot", 0.3048),
    ("CMU's inch/0.45", 0.0254 / 0.45),
];

/// How much longer the up axis must be than the other for the rest pose alone to decide.
const DECISIVE: f64 = 1.5;

/// Frames that are measured, spread over the clip.
const SAMPLES: usize = 101;

/// Extents of a skeleton along the file's axes, file units.
pub(super) struct Stature {
    /// With every joint unrotated.
    rest: Vector3<f64>,
    /// As moved: the median over frames, axis by axis.
    moved: Vector3<f64>,
}

impl Stature {
    pub(super) fn measure(clip: &Clip, rest_offsets: &[Vector3<f64>]) -> Self {
        let rest: Vec<_> = rest_offsets.iter().map(|o| Isometry3::translation(o.x, o.y, o.z)).collect();
        let step = clip.frames.len().div_ceil(SAMPLES);
        let moved: Vec<_> = clip.frames.iter().step_by(step).map(|frame| extent(clip, frame)).collect();
        let median = |axis: usize| {
            let mut lengths: Vec<f64> = moved.iter().map(|e| e[axis]).collect();
            lengths.sort_by(f64::total_cmp);
            lengths.get(lengths.len() / 2).copied().unwrap_or(0.0)
        };
        Self { rest: extent(clip, &rest), moved: Vector3::new(median(0), median(1), median(2)) }
    }

    /// Y or Z, whichever the resting skeleton stands along; where its rest pose is no standing one, the moved one says.
    pub(super) fn guess_up(&self, notes: &mut Vec<String>) -> UpAxis {
        let longer = |extent: &Vector3<f64>| if extent.y >= extent.z { UpAxis::Y } else { UpAxis::Z };
        let by_motion = longer(&self.moved);
        let guess = if self.rest_decides() { longer(&self.rest) } else { by_motion };
        notes.push(format!("up axis guessed: {guess:?}"));
        if guess != by_motion {
            notes.push(format!("in most frames the body is longer along {by_motion:?}: lying down, or set `up`"));
        }
        guess
    }

    /// The usual unit that makes this skeleton's height nearest to an adult's, said in `notes`; where none makes a human
    /// height, the unit that makes it 1.7 m.
    pub(super) fn guess_unit(&self, up: UpAxis, notes: &mut Vec<String>) -> f64 {
        let height = self.height(up);
        let misfit = |unit: f64| libm::log(height * unit / ADULT).abs();
        let nearest = UNITS
            .into_iter()
            .filter(|(_, unit)| HUMAN.contains(&(height * unit)))
            .min_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
        match nearest {
            Some((name, unit)) => {
                notes.push(format!(
                    "unit guessed: {name} ({unit:.6} m); the skeleton then stands {:.2} m high",
                    height * unit
                ));
                unit
            }
            None if height > 0.0 => {
                let unit = ADULT / height;
                notes.push(format!(
                    "no usual unit makes this skeleton human (height {height:.4} units): scaled to {ADULT} m, \
                     1 unit = {unit:.6} m; set `metres_per_unit` if you know better"
                ));
                unit
            }
            None => {
                notes.push("the skeleton has no height: unit taken as the metre".to_owned());
                1.0
            }
        }
    }

    /// A unit that is known; a height that no human has is said in `notes`.
    pub(super) fn accept_unit(&self, up: UpAxis, unit: f64, notes: &mut Vec<String>) -> f64 {
        let height = self.height(up) * unit;
        if !HUMAN.contains(&height) {
            notes.push(format!("the skeleton stands {height:.3} m high with 1 unit = {unit:.6} m: is that meant?"));
        }
        unit
    }

    fn height(&self, up: UpAxis) -> f64 {
        let extent = if self.rest_decides() { &self.rest } else { &self.moved };
        match up {
            UpAxis::Y => extent.y,
            UpAxis::Z => extent.z,
        }
    }

    fn rest_decides(&self) -> bool {
        self.rest.y > DECISIVE * self.rest.z || self.rest.z > DECISIVE * self.rest.y
    }
}

/// Edge lengths of the box around all joints and tips.
fn extent(clip: &Clip, frame: &[Isometry3<f64>]) -> Vector3<f64> {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for (joint, world_from_joint) in clip.skeleton.joints.iter().zip(clip.skeleton.joint_frames(frame)) {
        let position = world_from_joint.translation.vector;
        let tip = joint.tip.map_or(position, |tip| position + world_from_joint.rotation * tip);
        low = low.inf(&position).inf(&tip);
        high = high.sup(&position).sup(&tip);
    }
    high - low
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn guess(height: f64) -> (f64, String) {
        let stature = Stature { rest: Vector3::new(height, height, 0.2 * height), moved: Vector3::repeat(height) };
        let mut notes = Vec::new();
        let up = stature.guess_up(&mut notes);
        assert_eq!(up, UpAxis::Y);
        (stature.guess_unit(up, &mut notes), notes.join("; "))
    }

    #[test]
    fn the_usual_units_are_told_apart_by_height_from_a_child_to_a_giant() {
        for (_, unit) in UNITS {
            for height in [1.45, 1.7, 1.95] {
                let (guessed, notes) = guess(height / unit);
                assert_relative_eq!(guessed, unit);
                assert!(notes.contains(&format!("stands {height:.2} m")), "{notes}");
            }
        }
    }

    #[test]
    fn an_unusual_unit_is_scaled_to_an_adult_and_said() {
        let (unit, notes) = guess(38.2);
        assert_relative_eq!(unit * 38.2, 1.7, epsilon = 1e-12);
        assert!(notes.contains("set `metres_per_unit`"), "{notes}");
    }

    #[test]
    fn a_skeleton_without_extent_is_taken_in_metres() {
        assert_eq!(guess(0.0).0, 1.0);
    }

    #[test]
    fn the_resting_skeleton_says_what_is_up_even_of_somebody_lying() {
        let lying = Stature { rest: Vector3::new(1.7, 1.7, 0.3), moved: Vector3::new(0.5, 0.4, 1.7) };
        let mut notes = Vec::new();
        assert_eq!(lying.guess_up(&mut notes), UpAxis::Y);
        assert!(notes[1].contains("lying down"), "{notes:?}");
        // A rest pose with every bone along x says nothing.
        let straight = Stature { rest: Vector3::new(9.0, 0.1, 0.1), moved: Vector3::new(0.5, 0.5, 1.7) };
        assert_eq!(straight.guess_up(&mut Vec::new()), UpAxis::Z);
        assert_relative_eq!(straight.guess_unit(UpAxis::Z, &mut Vec::new()), 1.0);
    }

    #[test]
    fn a_known_unit_that_makes_a_giant_is_taken_and_questioned() {
        let stature = Stature { rest: Vector3::new(1.0, 170.0, 1.0), moved: Vector3::zeros() };
        let mut notes = Vec::new();
        assert_eq!(stature.accept_unit(UpAxis::Y, 1.0, &mut notes), 1.0);
        assert!(notes[0].contains("170.000 m"), "{notes:?}");
        notes.clear();
        stature.accept_unit(UpAxis::Y, 0.01, &mut notes);
        assert!(notes.is_empty());
    }
}
