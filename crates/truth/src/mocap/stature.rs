//! The stature of a skeleton, and the file's unit and up axis derived from it.
//!
//! The rest pose of a file need not be standing: it may be lying, or no pose at all (bones along their own axes). So
//! the unit is derived from quantities independent of it: the body's reach in the recorded frames, and the total length
//! of its bones. The up axis is the one along which the body is longer in the frames. If the rest pose indicates
//! another axis, that one is used only if the lowest point stays at one level along it and moves along the longer one:
//! then the subject is lying.
//!
//! Strides do not count. Two units are in question only where both make a body of 1.2 to 2.3 m, which of the usual ones
//! just a decimetre and CMU's unit can; the gaits of a small child and of a very tall adult overlap there as well, and
//! a stride says nothing of a recording without steps. Such bodies get a note that asks for `metres_per_unit`.

use nalgebra::{Isometry3, Vector3};

use super::body_length::{Body, bounds, quantile, sampled};
use super::options::UpAxis;
use super::{Clip, MocapError};

/// Typical height of a standing skeleton's joints and tips, metres.
const ADULT: f64 = 1.7;

/// Statures that a guessed unit may lead to, metres: from a child of six to the tallest.
const HUMAN: std::ops::RangeInclusive<f64> = 1.2..=2.3;

/// Statures outside this range give a note, metres.
const USUAL: std::ops::RangeInclusive<f64> = 1.4..=2.1;

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

/// How much steadier the lowest point must be along the up axis than along the other for the floor to decide.
const STEADIER: f64 = 3.0;

/// Along an axis on which the lowest point moves by more than this share of the body's length, the body is not
/// standing.
const WANDERING: f64 = 0.1;

/// A skeleton's measures, file units.
pub(super) struct Stature {
    /// Extents along the axes with every joint unrotated.
    rest: Vector3<f64>,
    /// As moved: extents that three quarters of the frames do not exceed, axis by axis.
    moved: Vector3<f64>,
    /// By how much the lowest point moves along each axis: from its first to its ninth decile.
    floor: Vector3<f64>,
    /// The body's length, standing or not.
    length: f64,
}

impl Stature {
    pub(super) fn measure(clip: &Clip, rest_offsets: &[Vector3<f64>]) -> Self {
        let body = Body::from_clip(clip);
        let rest: Vec<_> = rest_offsets.iter().map(|o| Isometry3::translation(o.x, o.y, o.z)).collect();
        let (low, high) = bounds(&body.points(clip, &rest));
        let boxes: Vec<_> = sampled(clip).map(|frame| bounds(&body.points(clip, frame))).collect();
        type BoxEdge<'a> = &'a dyn Fn(&(Vector3<f64>, Vector3<f64>), usize) -> f64;
        let quantiles = |of: BoxEdge<'_>, share: f64| {
            Vector3::from_fn(|axis, _| quantile(boxes.iter().map(|b| of(b, axis)).collect(), share))
        };
        let lowest = |b: &(Vector3<f64>, Vector3<f64>), axis: usize| b.0[axis];
        Self {
            rest: high - low,
            moved: quantiles(&|b, axis| b.1[axis] - b.0[axis], 0.75),
            floor: quantiles(&lowest, 0.9) - quantiles(&lowest, 0.1),
            length: body.length(clip),
        }
    }

    /// Y or Z, with a note.
    pub(super) fn guess_up(&self, notes: &mut Vec<String>) -> UpAxis {
        let by_motion = longer(&self.moved);
        let by_rest = self.rest_decides().then(|| longer(&self.rest)).filter(|axis| *axis != by_motion);
        let Some(by_rest) = by_rest else {
            notes.push(format!("up axis guessed: {by_motion:?}"));
            return by_motion;
        };
        // a straight walk is also steady sideways, so a lying body must also move along the other axis
        let leaves_place = along(&self.floor, by_motion) > WANDERING * self.length;
        let guess = if leaves_place && self.steadier() == Some(by_rest) { by_rest } else { by_motion };
        notes.push(format!("up axis guessed: {guess:?}"));
        notes.push(match guess == by_motion {
            true => {
                format!(
                    "the rest pose is longest along {by_rest:?}, the motion along {by_motion:?}; if this is wrong, \
                    set `up`"
                )
            }
            false => format!(
                "in most frames the body is longer along {by_motion:?}: it is lying down, or `up` must be \
                set"
            ),
        });
        guess
    }

    /// An axis defined by the format; notes a body that seems to stand along the other one.
    pub(super) fn accept_up(&self, up: UpAxis, notes: &mut Vec<String>) -> UpAxis {
        let by_motion = longer(&self.moved);
        if by_motion != up && self.steadier() == Some(by_motion) {
            notes.push(format!(
                "the body is longer along {by_motion:?} than along {up:?}, the format's up axis: it is lying down, or \
                `up` must be set"
            ));
        }
        up
    }

    /// The usual unit with the stature nearest to an adult's, with a note.
    ///
    /// # Errors
    /// [`MocapError::UnknownUnit`] where none makes it human.
    pub(super) fn guess_unit(&self, file: &str, notes: &mut Vec<String>) -> Result<f64, MocapError> {
        let misfit = |unit: f64| libm::log(self.length * unit / ADULT).abs();
        let nearest = UNITS
            .into_iter()
            .filter(|(_, unit)| HUMAN.contains(&(self.length * unit)))
            .min_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
        let Some((name, unit)) = nearest else {
            return Err(MocapError::UnknownUnit { file: file.to_owned(), length: self.length });
        };
        let stature = self.length * unit;
        notes.push(format!("unit guessed: {name} ({unit:.6} m), which makes the body {stature:.2} m tall"));
        if !USUAL.contains(&stature) {
            notes.push(format!("{stature:.2} m is unusual: set `metres_per_unit` if another unit is meant"));
        }
        Ok(unit)
    }

    /// A known unit; notes an unusual stature.
    pub(super) fn accept_unit(&self, unit: f64, notes: &mut Vec<String>) -> f64 {
        let stature = self.length * unit;
        if !HUMAN.contains(&stature) {
            notes.push(format!("the body is {stature:.3} m tall with 1 unit = {unit:.6} m: check the unit"));
        }
        unit
    }

    fn rest_decides(&self) -> bool {
        self.rest.y > DECISIVE * self.rest.z || self.rest.z > DECISIVE * self.rest.y
    }

    /// The axis along which the lowest point stays at one level, if one of the two is clearly steadier.
    fn steadier(&self) -> Option<UpAxis> {
        let [y, z] = [self.floor.y, self.floor.z];
        (y > STEADIER * z || z > STEADIER * y).then_some(if y < z { UpAxis::Y } else { UpAxis::Z })
    }
}

fn along(extent: &Vector3<f64>, axis: UpAxis) -> f64 {
    match axis {
        UpAxis::Y => extent.y,
        UpAxis::Z => extent.z,
    }
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
        Stature { rest: extent, moved: extent, floor: Vector3::zeros(), length }
    }

    fn guess(length: f64) -> Result<(f64, String), String> {
        let mut notes = Vec::new();
        let unit = standing(length).guess_unit("a.bvh", &mut notes).map_err(|e| e.to_string())?;
        Ok((unit, notes.join("; ")))
    }

    #[test]
    fn the_usual_units_are_told_apart_by_height_from_a_child_to_a_giant() {
        for (_, unit) in UNITS {
            for height in [1.45, 1.7, 1.95] {
                let (guessed, notes) = guess(height / unit).unwrap();
                assert_relative_eq!(guessed, unit);
                assert!(notes.contains(&format!("{height:.2} m tall")), "{notes}");
            }
        }
    }

    #[test]
    fn a_skeleton_that_no_unit_makes_human_asks_for_its_unit() {
        for length in [0.0, 0.3, 9.0, 300.0, 16_000.0] {
            let error = guess(length).unwrap_err();
            assert!(error.starts_with("a.bvh: ") && error.contains("`metres_per_unit`"), "{error}");
        }
    }

    #[test]
    fn an_unusual_stature_is_questioned() {
        let (unit, notes) = guess(38.2).unwrap();
        assert_relative_eq!(unit, 0.0254 / 0.45);
        assert!(notes.contains("2.16 m is unusual"), "{notes}");
    }

    #[test]
    fn a_rest_pose_that_lies_does_not_turn_a_standing_body() {
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
    fn the_floor_tells_somebody_lying_from_a_rest_pose_that_lies() {
        let floor = Vector3::new(0.5, 0.01, 0.4);
        let (rest, moved) = (Vector3::new(1.7, 1.7, 0.3), Vector3::new(0.5, 0.4, 1.7));
        let lying = Stature { rest, moved, floor, length: 1.7 };
        let mut notes = Vec::new();
        assert_eq!(lying.guess_up(&mut notes), UpAxis::Y);
        assert!(notes[1].contains("lying down"), "{notes:?}");
        let standing = Stature { floor: Vector3::new(0.5, 0.4, 0.01), ..lying };
        assert_eq!(standing.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    #[test]
    fn a_walk_along_a_line_is_not_lying_though_it_is_steady_sideways() {
        let (rest, moved) = (Vector3::new(1.7, 1.8, 0.3), Vector3::new(0.8, 0.6, 1.7));
        let walk = Stature { rest, moved, floor: Vector3::new(3.0, 0.005, 0.06), length: 1.7 };
        assert_eq!(walk.guess_up(&mut Vec::new()), UpAxis::Z);
    }

    #[test]
    fn a_known_unit_that_makes_a_giant_is_taken_and_questioned() {
        let mut notes = Vec::new();
        assert_eq!(standing(170.0).accept_unit(1.0, &mut notes), 1.0);
        assert!(notes[0].contains("170.000 m"), "{notes:?}");
        notes.clear();
        standing(170.0).accept_unit(0.01, &mut notes);
        assert!(notes.is_empty());
    }
}
