//! Joint centres and segment orientations from skin markers, in one frame.
//!
//! * **Hips**: Harrington's regression on the width and depth of the pelvis (`[Harrington 2007]`).
//! * **Knees and ankles**: the midpoint of the lateral and medial markers if both exist; else the chord function of
//!   Plug-in Gait: the centre lies half a joint's breadth from the lateral marker, where the directions to that marker
//!   and to the joint above are perpendicular, in the plane of the thigh or shank marker.
//! * **Elbows** likewise, in the plane perpendicular to the arm's plane of flexion; **wrists** at the midpoint of their
//!   two markers.
//! * **Shoulders** below the acromion, the neck in front of the C7 marker, the top of the head above the head band.
//!
//! Parts without markers are placed by the proportions of adults for the stature that the legs have: an upright trunk,
//! hanging arms, a head above the neck.
//!
//! Breadths and offsets are round values for adults chosen by this project ([`HALF_KNEE`] and the others), since files
//! seldom give the subject's. They are the largest source of error, one to two centimetres.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Half the breadth of a knee plus half a marker's diameter, metres.
pub(super) const HALF_KNEE: f64 = 0.058;
/// The same for an ankle.
pub(super) const HALF_ANKLE: f64 = 0.042;
/// The same for an elbow.
pub(super) const HALF_ELBOW: f64 = 0.045;
/// Distance of the shoulder's centre below the acromion marker, metres.
const BELOW_ACROMION: f64 = 0.055;
/// Distance of the neck joint in front of the marker on the seventh vertebra, metres.
const INTO_NECK: f64 = 0.04;
/// Height of the crown above the middle of the head band and of the temples, metres.
const ABOVE_BAND: f64 = 0.10;
/// A point called hip is on the thigh if it is farther from the hip by the markers of the pelvis, metres.
const ON_THIGH: f64 = 0.2;
/// Cosine of the tilt from which on a pelvis is lying: 45 degrees.
const LYING: f64 = 0.7;
/// Closer points define no direction, metres.
const MIN_LENGTH: f64 = 1e-4;
/// Two directions with a smaller sine between them define no frame.
const MIN_SINE: f64 = 0.02;

/// Length of a leg from hip to ankle, share of the stature (`[Drillis 1966]`, as all of these).
pub(super) const LEG: f64 = 0.48;
/// From the hips to the base of the neck.
const TRUNK: f64 = 0.314;
/// From the middle to a shoulder, and how far the shoulders are below the base of the neck.
const SHOULDER: (f64, f64) = (0.103, 0.023);
/// From shoulder to elbow.
const UPPER_ARM: f64 = 0.166;
/// From elbow to wrist.
const FOREARM: f64 = 0.148;
/// From the base of the neck to the crown.
const NECK_TO_CROWN: f64 = 0.16;

/// Markers and landmarks of one frame.
pub(super) struct MarkerFrame<'a> {
    /// Metres, Z up, by name.
    pub(super) points: &'a BTreeMap<String, Point3<f64>>,
    /// The stature that gives parts without markers, metres; without it there are none.
    pub(super) stature: Option<f64>,
}

/// One side of a body.
#[derive(Clone, Copy)]
pub(super) struct Side {
    /// `left` or `right`.
    pub(super) word: &'static str,
    /// `L` or `R`.
    pub(super) letter: &'static str,
    /// 1 to the left, -1 to the right.
    pub(super) sign: f64,
}

pub(super) const SIDES: [Side; 2] =
    [Side { word: "left", letter: "L", sign: 1.0 }, Side { word: "right", letter: "R", sign: -1.0 }];

/// A frame with X forward, Y left, Z up: Y exactly along `left`, Z as close to `up` as possible.
pub(super) fn upright(left: Vector3<f64>, up: Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let (y, up) = (left.try_normalize(MIN_LENGTH)?, up.try_normalize(MIN_LENGTH)?);
    let z = (up - y * y.dot(&up)).try_normalize(MIN_SINE)?;
    Some(rotation(y.cross(&z), y, z))
}

/// A frame with Z exactly along `up`, Y as close to `left` as possible.
pub(super) fn along(up: Vector3<f64>, left: Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let (z, left) = (up.try_normalize(MIN_LENGTH)?, left.try_normalize(MIN_LENGTH)?);
    let y = (left - z * z.dot(&left)).try_normalize(MIN_SINE)?;
    Some(rotation(y.cross(&z), y, z))
}

fn rotation(x: Vector3<f64>, y: Vector3<f64>, z: Vector3<f64>) -> UnitQuaternion<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
    UnitQuaternion::new_normalize(UnitQuaternion::from_rotation_matrix(&rotation).into_inner())
}

/// The centre of a joint at half a breadth from its lateral marker, where the directions to the marker and to the joint
/// above are perpendicular; `outside` is the direction from the centre to the marker's side.
fn chord(above: Point3<f64>, marker: Point3<f64>, outside: Vector3<f64>, half: f64) -> Option<Point3<f64>> {
    let line = above - marker;
    let length = line.norm();
    let (ahead, outside) = (line.try_normalize(MIN_LENGTH)?, outside.try_normalize(MIN_LENGTH)?);
    let outside = (outside - ahead * ahead.dot(&outside)).try_normalize(MIN_SINE)?;
    let along = half * half / length;
    Some(marker + ahead * along - outside * libm::sqrt((half * half - along * along).max(0.0)))
}

impl MarkerFrame<'_> {
    pub(super) fn get(&self, name: &str) -> Option<Point3<f64>> {
        self.points.get(name).copied()
    }

    fn sided(&self, side: Side, name: &str) -> Option<Point3<f64>> {
        self.get(&format!("{}{name}", side.letter))
    }

    fn landmark(&self, side: Side, name: &str) -> Option<Point3<f64>> {
        self.get(&format!("{}_{name}", side.word))
    }

    fn middle(&self, name: &str) -> Option<Point3<f64>> {
        Some(nalgebra::center(&self.sided(SIDES[0], name)?, &self.sided(SIDES[1], name)?))
    }

    fn pelvis_by_markers(&self) -> Option<UnitQuaternion<f64>> {
        let (left, right) = (self.sided(SIDES[0], "ASI")?, self.sided(SIDES[1], "ASI")?);
        let back = self.middle("PSI").or_else(|| self.get("SACR"))?;
        let across = left - right;
        upright(across, (nalgebra::center(&left, &right) - back).cross(&across))
    }

    /// Orientation of the pelvis from its markers, else from hips and trunk.
    pub(super) fn pelvis(&self) -> Option<UnitQuaternion<f64>> {
        if let Some(pelvis) = self.pelvis_by_markers() {
            return Some(pelvis);
        }
        let (left, right) = (self.landmark(SIDES[0], "hip")?, self.landmark(SIDES[1], "hip")?);
        upright(left - right, self.neck()? - nalgebra::center(&left, &right))
    }

    /// The centre of a hip.
    pub(super) fn hip(&self, side: Side) -> Option<Point3<f64>> {
        let by_markers = || {
            let (left, right) = (self.sided(SIDES[0], "ASI")?, self.sided(SIDES[1], "ASI")?);
            let back = self.middle("PSI").or_else(|| self.get("SACR"))?;
            let front = nalgebra::center(&left, &right);
            let (width, depth) = ((left - right).norm(), (front - back).norm());
            let behind = 0.24 * depth + 0.0099;
            let below = 0.30 * width + 0.0109;
            let aside = 0.33 * width + 0.0073;
            Some(front + self.pelvis()? * Vector3::new(-behind, side.sign * aside, -below))
        };
        let is_hip = |hip: &Point3<f64>| by_markers().is_none_or(|own| (own - hip).norm() < ON_THIGH);
        self.landmark(side, "hip").filter(is_hip).or_else(by_markers)
    }

    /// The base of the neck.
    pub(super) fn neck(&self) -> Option<Point3<f64>> {
        let by_markers = || {
            let back = self.get("C7")?;
            Some(self.thorax_by_markers().map_or(back, |thorax| back + thorax * Vector3::x() * INTO_NECK))
        };
        // the acromia are as high as the base of the neck
        self.get("thorax").or_else(by_markers).or_else(|| self.middle("SHO")).or_else(|| self.neck_by_proportion())
    }

    /// The neck above the shoulders, or that of a trunk that is upright, unless the pelvis is lying.
    fn neck_by_proportion(&self) -> Option<Point3<f64>> {
        let stature = self.stature?;
        let [left, right] = SIDES.map(|side| self.hip(side));
        if let [Some(a), Some(b)] = SIDES.map(|side| self.landmark(side, "shoulder")) {
            let (shoulders, hips) = (nalgebra::center(&a, &b), nalgebra::center(&left?, &right?));
            return Some(shoulders + (shoulders - hips).try_normalize(MIN_LENGTH)? * (SHOULDER.1 * stature));
        }
        let of_pelvis = self.pelvis_by_markers().map_or(Vector3::z(), |pelvis| pelvis * Vector3::z());
        let up = if of_pelvis.z > LYING { Vector3::z() } else { of_pelvis };
        Some(nalgebra::center(&left?, &right?) + up * (TRUNK * stature))
    }

    fn thorax_by_markers(&self) -> Option<UnitQuaternion<f64>> {
        let (c7, t10, clav, strn) = (self.get("C7")?, self.get("T10")?, self.get("CLAV")?, self.get("STRN")?);
        let up = nalgebra::center(&c7, &clav) - nalgebra::center(&t10, &strn);
        let ahead = nalgebra::center(&clav, &strn) - nalgebra::center(&c7, &t10);
        along(up, up.cross(&ahead))
    }

    /// Orientation of the thorax.
    pub(super) fn thorax(&self) -> Option<UnitQuaternion<f64>> {
        if let Some(thorax) = self.thorax_by_markers() {
            return Some(thorax);
        }
        let across = |name: &str| Some(self.sided(SIDES[0], name)? - self.sided(SIDES[1], name)?);
        let hips = nalgebra::center(&self.hip(SIDES[0])?, &self.hip(SIDES[1])?);
        let joints = || Some(self.landmark(SIDES[0], "shoulder")? - self.landmark(SIDES[1], "shoulder")?);
        let hip_joints = || Some(self.hip(SIDES[0])? - self.hip(SIDES[1])?).filter(|_| self.stature.is_some());
        upright(across("SHO").or_else(joints).or_else(hip_joints)?, self.neck()? - hips)
    }

    /// The centre of a shoulder.
    pub(super) fn shoulder(&self, side: Side) -> Option<Point3<f64>> {
        let by_marker = || Some(self.sided(side, "SHO")? - self.thorax()? * Vector3::z() * BELOW_ACROMION);
        let by_proportion = || {
            let (aside, below) = SHOULDER;
            Some(self.neck()? + self.thorax()? * Vector3::new(0.0, side.sign * aside, -below) * self.stature?)
        };
        self.landmark(side, "shoulder").or_else(by_marker).or_else(by_proportion)
    }

    /// The centre of a knee.
    pub(super) fn knee(&self, side: Side) -> Option<Point3<f64>> {
        let by_markers = || {
            let lateral = self.sided(side, "KNE")?;
            if let Some(medial) = self.sided(side, "KNM") {
                return Some(nalgebra::center(&lateral, &medial));
            }
            let outside = match self.sided(side, "THI") {
                Some(thigh) => thigh - lateral,
                None => self.pelvis()? * Vector3::y() * side.sign,
            };
            chord(self.hip(side)?, lateral, outside, HALF_KNEE)
        };
        self.landmark(side, "knee").or_else(by_markers)
    }

    /// The centre of an ankle.
    pub(super) fn ankle(&self, side: Side) -> Option<Point3<f64>> {
        let by_markers = || {
            let lateral = self.sided(side, "ANK")?;
            if let Some(medial) = self.sided(side, "ANM") {
                return Some(nalgebra::center(&lateral, &medial));
            }
            let outside = match (self.sided(side, "TIB"), self.sided(side, "KNE")) {
                (Some(shank), _) => shank - lateral,
                (None, Some(knee)) => knee - self.knee(side)?,
                (None, None) => self.pelvis()? * Vector3::y() * side.sign,
            };
            chord(self.knee(side)?, lateral, outside, HALF_ANKLE)
        };
        self.landmark(side, "ankle").or_else(by_markers)
    }

    /// The centre of a wrist.
    pub(super) fn wrist(&self, side: Side) -> Option<Point3<f64>> {
        self.wrist_by_markers(side).or_else(|| {
            // in line with the upper arm
            let (shoulder, elbow) = (self.shoulder(side)?, self.elbow(side).filter(|_| self.stature.is_some())?);
            Some(elbow + (elbow - shoulder).try_normalize(MIN_LENGTH)? * (FOREARM * self.stature?))
        })
    }

    fn wrist_by_markers(&self, side: Side) -> Option<Point3<f64>> {
        let by_markers = || match (self.sided(side, "WRA"), self.sided(side, "WRB")) {
            (Some(a), Some(b)) => Some(nalgebra::center(&a, &b)),
            (one, other) => one.or(other),
        };
        self.landmark(side, "wrist").or_else(by_markers)
    }

    /// The centre of an elbow.
    pub(super) fn elbow(&self, side: Side) -> Option<Point3<f64>> {
        let by_markers = || {
            let lateral = self.sided(side, "ELB")?;
            if let Some(medial) = self.sided(side, "ELM") {
                return Some(nalgebra::center(&lateral, &medial));
            }
            let shoulder = self.shoulder(side)?;
            let Some(wrist) = self.wrist_by_markers(side) else {
                return Some(lateral - self.thorax()? * Vector3::y() * (side.sign * HALF_ELBOW));
            };
            let up = (shoulder - lateral).try_normalize(MIN_LENGTH)?;
            let ahead = (wrist - lateral).try_normalize(MIN_LENGTH)?;
            // a nearly straight arm defines no plane: the lateral direction of the body decides
            let outside = up.cross(&ahead) * side.sign + self.thorax()? * Vector3::y() * (0.1 * side.sign);
            chord(shoulder, lateral, outside, HALF_ELBOW)
        };
        self.landmark(side, "elbow").or_else(by_markers).or_else(|| self.elbow_by_proportion(side))
    }

    /// The elbow of a hanging arm, or behind the line from the shoulder to a wrist.
    fn elbow_by_proportion(&self, side: Side) -> Option<Point3<f64>> {
        let (stature, shoulder, thorax) = (self.stature?, self.shoulder(side)?, self.thorax()?);
        let Some(wrist) = self.wrist_by_markers(side) else {
            return Some(shoulder - thorax * Vector3::z() * (UPPER_ARM * stature));
        };
        let half = 0.5 * (wrist - shoulder).norm();
        let behind = libm::sqrt((UPPER_ARM * FOREARM * stature * stature - half * half).max(0.0));
        Some(nalgebra::center(&shoulder, &wrist) - thorax * Vector3::x() * behind)
    }

    /// Orientation of the head from its markers.
    fn head_by_markers(&self) -> Option<UnitQuaternion<f64>> {
        let (front, back) = (self.middle("FHD")?, self.middle("BHD")?);
        let across = self.sided(SIDES[0], "FHD")? - self.sided(SIDES[1], "FHD")?;
        upright(across, (front - back).cross(&across))
    }

    pub(super) fn head_top(&self) -> Option<Point3<f64>> {
        let by_markers = || {
            let middle = nalgebra::center(&self.middle("FHD")?, &self.middle("BHD")?);
            Some(middle + self.head_by_markers()? * Vector3::z() * ABOVE_BAND)
        };
        let by_temples = || Some(self.middle("TEM")? + self.thorax()? * Vector3::z() * ABOVE_BAND);
        let by_proportion = || Some(self.neck()? + self.thorax()? * Vector3::z() * (NECK_TO_CROWN * self.stature?));
        let by_marker = self.get("head_top").or_else(|| self.get("ARIEL")).or_else(by_markers);
        by_marker.or_else(by_temples).or_else(by_proportion)
    }

    /// Orientation of the head.
    pub(super) fn head(&self) -> Option<UnitQuaternion<f64>> {
        let by_neck = || along(self.head_top()? - self.neck()?, self.thorax()? * Vector3::y());
        self.head_by_markers().or_else(by_neck)
    }

    /// The ball of a foot.
    pub(super) fn toes(&self, side: Side) -> Option<Point3<f64>> {
        let (inner, outer) = (self.sided(side, "MT1"), self.sided(side, "MT5"));
        let metatarsals = inner.zip(outer).map(|(inner, outer)| nalgebra::center(&inner, &outer));
        self.landmark(side, "toes").or_else(|| self.sided(side, "TOE")).or(metatarsals).or(inner).or(outer)
    }

    /// Orientation of a foot from heel and toes, else that of the shank.
    pub(super) fn foot(&self, side: Side, shank: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let by_markers = || {
            let (toes, back) = (self.toes(side)?, self.sided(side, "HEE").or_else(|| self.ankle(side))?);
            let ahead = (toes - back).try_normalize(MIN_LENGTH)?;
            let left = (shank * Vector3::z()).cross(&ahead);
            upright(left, ahead.cross(&left))
        };
        by_markers().unwrap_or(shank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chord_centre_is_half_a_breadth_from_the_marker_and_perpendicular_to_the_segment() {
        let (hip, centre) = (Point3::new(0.0, 0.09, 0.93), Point3::new(0.02, 0.1, 0.5));
        // the marker is beside the centre, perpendicular to the thigh
        let thigh = (hip - centre).normalize();
        let aside = (Vector3::y() - thigh * thigh.y).normalize();
        let found = chord(hip, centre + aside * HALF_KNEE, aside + thigh * 0.3, HALF_KNEE).unwrap();
        assert!((found - centre).norm() < 1e-9, "{found}");
    }

    #[test]
    fn hips_follow_harringtons_regression() {
        // a level pelvis of 240 mm by 160 mm facing +X, computed by hand
        let mut markers = BTreeMap::new();
        for (name, x, y) in [("LASI", 0.08, 0.12), ("RASI", 0.08, -0.12), ("LPSI", -0.08, 0.05), ("RPSI", -0.08, -0.05)]
        {
            markers.insert(name.to_owned(), Point3::new(x, y, 1.0));
        }
        let hip = MarkerFrame { points: &markers, stature: None }.hip(SIDES[1]).unwrap();
        let expected = Point3::new(0.08 - 0.0483, -0.0865, 1.0 - 0.0829);
        assert!((hip - expected).norm() < 1e-12, "{hip}");
        // a marker on the thigh was the hip
        markers.insert("right_hip".to_owned(), Point3::new(0.0, -0.15, 0.65));
        assert_eq!(MarkerFrame { points: &markers, stature: None }.hip(SIDES[1]), Some(hip));
    }
}
