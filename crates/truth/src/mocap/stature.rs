//! The stature of a skeleton, and the file's unit and up axis derived from it.
//!
//! The rest pose of a file may be standing, lying, or not a pose at all (every bone along its own axis). The unit is
//! therefore derived from quantities independent of it: the body's reach in the recorded frames, and the length of its
//! bones. The up axis is the one along which the body is longer in the frames, unless the lowest point stays at one
//! level along the other axis and moves along the longer one, and the rest pose indicates the other axis, or the body
//! is often short along the longer one: then it lies or crawls. Of a single pose the rest pose decides.
//!
//! Stride length is not used. Of the common units only a decimetre and CMU's unit can both give a body of 1.2 to 2.3 m;
//! the strides of a small child and of a very tall adult overlap there as well, and many recordings have no steps.

use nalgebra::{Isometry3, Vector3};

use super::body_length::{Body, bounds, quantile, sampled};
use super::options::UpAxis;
use super::{Clip, MocapError};

/// Typical height of a standing skeleton's joints and tips, metres.
const ADULT_STATURE: f64 = 1.7;

/// Statures accepted when guessing the unit, metres: from a six-year-old child to the tallest adults.
const PLAUSIBLE_STATURES: std::ops::RangeInclusive<f64> = 1.2..=2.3;

/// A unit that makes a body taller is taken only if no other does: it may as well be CMU's and a small adult.
const TALL: f64 = 2.1;

/// Common units of recordings. CMU's unit is an inch divided by 0.45.
const UNITS: [(&str, f64); 7] = [
    ("metre", 1.0),
    ("decimetre", 0.1),
    ("centimetre", 0.01),
    ("millimetre", 0.001),
    ("inch", 0.0254),
    ("foot", 0.3048),
    ("CMU's inch/0.45", 0.0254 / 0.45),
];

/// Least ratio of the extents along the two candidate axes for the rest pose to decide.
const DECISIVE_RATIO: f64 = 1.5;

/// Least ratio of the lowest point's movements along the two candidate axes for the floor to decide.
const STEADINESS_RATIO: f64 = 3.0;

/// If the lowest point moves along an axis by more than this share of the body's length, the body does not stand along
/// that axis.
const MOVING_SHARE: f64 = 0.1;

/// The same for a floor that holds, whatever the rest pose: LAFAN1's crawling has 0.025, its walks 0.003 to 0.03.
const HOLDING_SHARE: f64 = 0.05;

/// A body that stands along an axis, if only on stairs or ladders, is longer along it in three of four frames; a rest
/// pose, too, unless its bones all lie along another one.
const STANDING_SHARE: f64 = 0.6;

/// Measurements of a skeleton, file units.
pub(super) struct Stature {
    /// Extents along the axes in the rest pose.
    rest: Vector3<f64>,
    /// Extents along the axes in the recorded frames: 75th percentile.
    moved: Vector3<f64>,
    /// The same: 25th percentile.
    shortest: Vector3<f64>,
    /// Movement of the lowest point along each axis: first to ninth decile.
    floor: Vector3<f64>,
    /// The length of all joints, in any posture.
    extent: f64,
    /// The body's length; the extent until limbs are found.
    pub(super) length: f64,
}

impl Stature {
    pub(super) fn measure(clip: &Clip, rest_offsets: &[Vector3<f64>]) -> Self {
        let body = Body::from_clip(clip);
        let extent = body.length(clip);
        let rest: Vec<_> = rest_offsets.iter().map(|o| Isometry3::translation(o.x, o.y, o.z)).collect();
        let (low, high) = bounds(&body.points(clip, &rest));
        let boxes: Vec<_> = sampled(clip).map(|frame| bounds(&body.points(clip, frame))).collect();
        type BoxEdge<'a> = &'a dyn Fn(&(Vector3<f64>, Vector3<f64>), usize) -> f64;
        let quantiles = |of: BoxEdge<'_>, share: f64| {
            Vector3::from_fn(|axis, _| quantile(boxes.iter().map(|b| of(b, axis)).collect(), share))
        };
        let lowest = |b: &(Vector3<f64>, Vector3<f64>), axis: usize| b.0[axis];
        let extent_of = |b: &(Vector3<f64>, Vector3<f64>), axis: usize| b.1[axis] - b.0[axis];
        Self {
            rest: high - low,
            moved: quantiles(&extent_of, 0.75),
            shortest: quantiles(&extent_of, 0.25),
            floor: quantiles(&lowest, 0.9) - quantiles(&lowest, 0.1),
            extent,
            length: extent,
        }
    }

    /// Guesses Y or Z, with a note.
    pub(super) fn guess_up(&self, notes: &mut Vec<String>) -> UpAxis {
        let by_motion = longer(&self.moved);
        let other = if by_motion == UpAxis::Y { UpAxis::Z } else { UpAxis::Y };
        let is_other_at_rest = other.along(&self.rest) > DECISIVE_RATIO * by_motion.along(&self.rest);
        // a straight walk is steady sideways too, so a lying body must also move along the other axis
        let [moves, stays] = [by_motion.along(&self.floor), other.along(&self.floor)];
        let has_floor = moves > (MOVING_SHARE * self.length).max(STEADINESS_RATIO * stays);
        let is_on_floor = has_floor
            && stays < HOLDING_SHARE * self.length
            && by_motion.along(&self.shortest) < STANDING_SHARE * self.length;
        // one pose has no floor that holds, and may be any; its skeleton was made upright
        let is_built_so = is_other_at_rest
            && self.floor.amax() + (self.moved - self.shortest).amax() < 1e-3 * self.length
            && other.along(&self.rest) > STANDING_SHARE * self.length.max(self.rest.x);
        let guess = if is_built_so || is_on_floor || has_floor && is_other_at_rest { other } else { by_motion };
        notes.push(format!("up axis guessed: {guess:?}"));
        if guess == other {
            notes.push(format!(
                "in most frames the body is longer along {by_motion:?}: it is lying down, or `up` must be set"
            ));
        } else if is_other_at_rest {
            notes.push(format!(
                "the rest pose is longest along {other:?}, the motion along {by_motion:?}; if this is wrong, set `up`"
            ));
        }
        guess
    }

    /// Guesses the common unit that gives the stature nearest to an adult's, with a note.
    pub(super) fn guess_unit(&self, file: &str, notes: &mut Vec<String>) -> Result<f64, MocapError> {
        // a figure of a child's size may have a common unit by its hat
        let Some((name, unit)) = nearest_unit(self.length).or_else(|| nearest_unit(self.extent)) else {
            return Err(unknown_unit(file, self.length));
        };
        let stature = self.length * unit;
        notes.push(format!("unit guessed: {name} ({unit:.6} m), which makes the body {stature:.2} m tall"));
        Ok(unit)
    }

    /// Accepts a known unit, with a note on an implausible stature.
    pub(super) fn accept_unit(&self, unit: f64, notes: &mut Vec<String>) -> f64 {
        let stature = self.length * unit;
        if !PLAUSIBLE_STATURES.contains(&stature) {
            notes.push(format!("the body is {stature:.3} m tall with 1 unit = {unit:.6} m: check the unit"));
        }
        unit
    }
}

/// The common unit that makes a length the stature nearest to an adult's.
fn nearest_unit(length: f64) -> Option<(&'static str, f64)> {
    let misfit = |unit: f64| libm::log(length * unit / ADULT_STATURE).abs();
    let mut fitting: Vec<_> =
        UNITS.into_iter().filter(|(_, unit)| PLAUSIBLE_STATURES.contains(&(length * unit))).collect();
    if fitting.iter().any(|(_, unit)| length * unit <= TALL) {
        fitting.retain(|(_, unit)| length * unit <= TALL);
    }
    fitting.into_iter().min_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)))
}

fn unknown_unit(file: &str, length: f64) -> MocapError {
    if length == 0.0 {
        let found = "no joint from which limbs branch: an animation without a skeleton?";
        return MocapError::at(file, "a body", found);
    }
    MocapError::at(
        file,
        "a body 1.2 to 2.3 m tall in a common unit (mm, cm, dm, m, inch, foot or CMU's inch/0.45)",
        format!(
            "a height of {length:.4} units; set the length of the file's unit (`metres_per_unit` in a scenario, \
             --metres-per-unit on the command line, --units of evaluate)"
        ),
    )
}

fn longer(extent: &Vector3<f64>) -> UpAxis {
    if extent.y >= extent.z { UpAxis::Y } else { UpAxis::Z }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn standing(length: f64) -> Stature {
        let extent = Vector3::new(length, length, 0.2 * length);
        Stature { rest: extent, moved: extent, shortest: 0.9 * extent, floor: Vector3::zeros(), extent: length, length }
    }

    fn guess(length: f64) -> Result<(f64, String), String> {
        let mut notes = Vec::new();
        let unit = standing(length).guess_unit("a.bvh", &mut notes).map_err(|e| e.to_string())?;
        Ok((unit, notes.join("; ")))
    }

    #[test]
    fn common_units_are_guessed_for_small_and_tall_bodies() {
        for (_, unit) in UNITS {
            for height in [1.45, 1.7, 1.95] {
                let (guessed, notes) = guess(height / unit).unwrap();
                assert_relative_eq!(guessed, unit);
                assert!(notes.contains(&format!("{height:.2} m tall")), "{notes}");
            }
        }
    }

    // Copies of CMU's recordings: as decimetres they were 2.24 m tall.
    #[test]
    fn a_body_is_not_tall_if_another_unit_makes_it_usual() {
        assert_relative_eq!(guess(22.4).unwrap().0, 0.0254 / 0.45);
        assert_relative_eq!(guess(2.2).unwrap().0, 1.0);
    }

    #[test]
    fn a_skeleton_without_a_plausible_unit_is_refused() {
        for length in [0.3, 9.0, 300.0, 16_000.0] {
            let error = guess(length).unwrap_err();
            assert!(error.starts_with("a.bvh: ") && error.contains("`metres_per_unit`"), "{error}");
        }
        assert!(guess(0.0).unwrap_err().contains("an animation without a skeleton?"));
    }

    #[test]
    fn a_lying_rest_pose_does_not_rotate_a_standing_body() {
        let mut notes = Vec::new();
        let lying_rest =
            Stature { rest: Vector3::new(1.7, 0.3, 1.7), moved: Vector3::new(0.6, 1.7, 0.4), ..standing(1.7) };
        assert_eq!(lying_rest.guess_up(&mut notes), UpAxis::Y);
        assert!(notes[1].contains("rest pose is longest along Z"), "{notes:?}");
        // A rest pose with every bone along x is uninformative.
        let straight =
            Stature { rest: Vector3::new(9.0, 0.1, 0.1), moved: Vector3::new(0.5, 0.5, 1.7), ..standing(1.7) };
        assert_eq!(straight.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    #[test]
    fn the_floor_distinguishes_a_lying_body_from_a_lying_rest_pose() {
        let floor = Vector3::new(0.5, 0.01, 0.4);
        let (rest, moved) = (Vector3::new(1.7, 1.7, 0.3), Vector3::new(0.5, 0.4, 1.7));
        let lying = Stature { rest, moved, floor, ..standing(1.7) };
        let mut notes = Vec::new();
        assert_eq!(lying.guess_up(&mut notes), UpAxis::Y);
        assert!(notes[1].contains("lying down"), "{notes:?}");
        let standing = Stature { floor: Vector3::new(0.5, 0.4, 0.01), ..lying };
        assert_eq!(standing.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    #[test]
    fn a_straight_walk_is_not_taken_for_lying() {
        let (rest, moved) = (Vector3::new(1.7, 1.8, 0.3), Vector3::new(0.8, 0.6, 1.7));
        let walk = Stature { rest, moved, floor: Vector3::new(3.0, 0.005, 0.06), ..standing(1.7) };
        assert_eq!(walk.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    // LAFAN1's bones all lie along X at rest; it was turned on its side, with feet from -3 to 4 m high.
    #[test]
    fn who_crawls_about_has_the_floor_below_whatever_the_rest_pose() {
        let (rest, floor) = (Vector3::new(1.5, 0.06, 0.2), Vector3::new(3.0, 0.04, 7.0));
        let (moved, shortest) = (Vector3::new(1.5, 0.65, 1.4), Vector3::new(0.7, 0.3, 0.8));
        let crawl = Stature { rest, moved, shortest, floor, ..standing(1.7) };
        assert_eq!(crawl.guess_up(&mut Vec::new()), UpAxis::Y);
        let stairs = Stature { shortest: Vector3::new(0.5, 0.3, 1.6), ..crawl };
        assert_eq!(stairs.guess_up(&mut Vec::new()), UpAxis::Z, "a climber stands along what changes");
        // one pose on all fours has the up axis of its skeleton, if that has one
        let moved = Vector3::new(0.7, 0.7, 1.6);
        let pose = Stature { rest: Vector3::new(1.7, 1.7, 0.2), moved, shortest: moved, ..standing(1.7) };
        assert_eq!(pose.guess_up(&mut Vec::new()), UpAxis::Y);
        let of_bones_along_x = Stature { rest: Vector3::new(1.5, 0.2, 0.06), ..pose };
        assert_eq!(of_bones_along_x.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    #[test]
    fn an_implausible_stature_with_a_known_unit_is_accepted_with_a_note() {
        let mut notes = Vec::new();
        assert_eq!(standing(170.0).accept_unit(1.0, &mut notes), 1.0);
        assert!(notes[0].contains("170.000 m"), "{notes:?}");
        notes.clear();
        standing(170.0).accept_unit(0.01, &mut notes);
        assert!(notes.is_empty());
    }
}
