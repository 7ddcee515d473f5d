//! An estimate beside a reference: what another system recorded of the same motion, with a clock, a place and errors of
//! its own. It is no truth, so clock and place are estimated, and what it is off by itself is said.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::procrustes::Similarity;
use super::statistics::{mean, standard_deviation};
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};

/// An estimate is compared with at least this share of its frames, or of the reference's if these are fewer.
const LEAST_SHARE: f64 = 0.5;
/// It is compared in at least this time, seconds.
const LEAST_S: f64 = 0.5;
/// Frames of the estimate that are compared at every offset; of longer ones, frames at equal intervals.
const MOST_COMPARED: usize = 400;
/// Another offset is a rival if its correlation is within this of the best one's, this far away (seconds).
const RIVAL: (f64, f64) = (0.03, 0.3);

/// Segments that are rigid in a person.
const RIGID: [[Landmark; 2]; 8] = [
    [Landmark::LeftHip, Landmark::LeftKnee],
    [Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::RightHip, Landmark::RightKnee],
    [Landmark::RightKnee, Landmark::RightAnkle],
    [Landmark::LeftShoulder, Landmark::LeftElbow],
    [Landmark::LeftElbow, Landmark::LeftWrist],
    [Landmark::RightShoulder, Landmark::RightElbow],
    [Landmark::RightElbow, Landmark::RightWrist],
];

/// An estimate beside a reference, once its time and place are those of the estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgainstReference {
    /// Time of the reference at the estimate's first frame, seconds; negative if the reference began later.
    pub offset_s: f64,
    /// Another offset that fits nearly as well, as the motion repeats itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rival_s: Option<f64>,
    /// Correlation of the distances between markers over time, at this offset; 1 is the same motion.
    pub correlation: f64,
    /// By how much the reference was turned about the vertical axis, and tilted, degrees.
    pub turned_deg: [f64; 2],
    /// By how much the reference was moved after turning, metres.
    pub moved_m: [f64; 3],
    /// Size of the estimate's body in the reference's. It is not taken out.
    pub scale: f64,
    /// Frames that are compared.
    pub frames: usize,
    /// Mean distance of the markers, millimetres.
    pub mean_mm: f64,
    /// The same without what is constant for each marker in the axes of the trunk: systems disagree about where in the
    /// body a joint is.
    pub without_constant_mm: f64,
    /// By how much lengths of upper arms, forearms, thighs and shanks of the reference vary (standard deviation),
    /// millimetres: its own error, 0 for a fitted skeleton. `None` if it has no such segment.
    pub own_mm: Option<f64>,
    /// Every marker that both have.
    pub markers: BTreeMap<String, MarkerAgainstReference>,
}

/// One marker beside that of a reference, millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerAgainstReference {
    /// Mean distance.
    pub mean_mm: f64,
    /// Length of the part that is constant in the axes of the trunk.
    pub constant_mm: f64,
    /// Mean distance without that part.
    pub without_constant_mm: f64,
}

impl AgainstReference {
    /// Compares an estimate with a reference, both `[frame]` at the same rate; metres, Z up. Positions do not enter the
    /// search for the offset, only distances between markers do, so it needs no common axes. The place is the rigid
    /// motion of least squares. With an `offset_s`, that one is taken.
    ///
    /// # Errors
    /// What is missing, if they cannot be compared.
    pub fn new(
        estimate: &[Markers],
        reference: &[Markers],
        frames_per_second: f64,
        offset_s: Option<f64>,
    ) -> Result<Self, String> {
        let least = (LEAST_SHARE * estimate.len().min(reference.len()) as f64).max(LEAST_S * frames_per_second);
        let clock = Clock::new(estimate, reference, least.ceil() as usize);
        let (frames, correlation, rival) = match offset_s {
            Some(seconds) => {
                let frames = seconds * frames_per_second;
                clock.correlation(frames.round() as i64).map(|correlation| (frames, correlation, None))
            }
            None => clock.best(frames_per_second),
        }
        .ok_or_else(|| {
            format!(
                "expected half of the shorter one, and at least {LEAST_S} s, in which both move and have the same \
                 markers, found {} frames of the estimate and {} of the reference",
                estimate.len(),
                reference.len()
            )
        })?;
        // of each frame: marker, reference, estimate
        let mut common = Vec::new();
        for (frame, own) in estimate.iter().enumerate() {
            let other = between(reference, frame as f64 + frames);
            let both = own.iter().zip(other).enumerate();
            let both = both.filter_map(|(marker, (own, other))| Some((marker, other?, (*own)?)));
            common.push(both.collect::<Vec<(usize, Point3<f64>, Point3<f64>)>>());
        }
        let pairs: Vec<_> = common.iter().flatten().map(|(_, from, to)| (*from, *to)).collect();
        let fitted = Similarity::fit(&pairs).ok_or("expected frames in which both have markers, found none")?;
        let centre = pairs.iter().map(|(from, _)| from.coords).sum::<Vector3<f64>>() / pairs.len() as f64;
        // the same rotation and centre without the scale
        let moved = fitted.translation + (fitted.scale - 1.0) * (fitted.rotation * centre);
        let place = Similarity { scale: 1.0, translation: moved, ..fitted };
        // the way that a body goes has the same length whatever its size, so each frame has its own centre
        let of_size = Similarity::fit(&common.iter().flat_map(|of_frame| centred(of_frame)).collect::<Vec<_>>());
        let mut off: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); LANDMARKS.len()];
        for (frame, of_frame) in common.iter().enumerate() {
            let Some(trunk) = trunk(&estimate[frame]) else { continue };
            for (marker, reference, estimate) in of_frame {
                off[*marker].push(trunk.inverse() * (estimate - place.apply(reference)));
            }
        }
        let markers: BTreeMap<String, MarkerAgainstReference> = LANDMARKS
            .iter()
            .zip(&off)
            .filter(|(_, off)| !off.is_empty())
            .map(|(landmark, off)| (landmark.name().to_owned(), MarkerAgainstReference::new(off)))
            .collect();
        let over_markers = |value: fn(&MarkerAgainstReference) -> f64| {
            mean(&markers.values().map(value).collect::<Vec<_>>())
                .ok_or("expected hips and a neck in the estimate, found none")
        };
        let up = place.rotation * Vector3::z();
        let ahead = place.rotation * Vector3::x();
        Ok(Self {
            offset_s: frames / frames_per_second,
            rival_s: rival.map(|frames| frames / frames_per_second),
            correlation,
            turned_deg: [ahead.y.atan2(ahead.x), up.z.clamp(-1.0, 1.0).acos()].map(f64::to_degrees),
            moved_m: moved.into(),
            scale: of_size.ok_or("expected a body with an extent, found none")?.scale,
            frames: common.iter().filter(|of_frame| !of_frame.is_empty()).count(),
            mean_mm: over_markers(|marker| marker.mean_mm)?,
            without_constant_mm: over_markers(|marker| marker.without_constant_mm)?,
            own_mm: own_error(reference),
            markers,
        })
    }
}

impl MarkerAgainstReference {
    /// From differences in the axes of the trunk, metres.
    fn new(off: &[Vector3<f64>]) -> Self {
        let count = off.len() as f64;
        let constant = off.iter().sum::<Vector3<f64>>() / count;
        let mean_of = |centre: Vector3<f64>| 1000.0 * off.iter().map(|one| (one - centre).norm()).sum::<f64>() / count;
        Self {
            mean_mm: mean_of(Vector3::zeros()),
            constant_mm: 1000.0 * constant.norm(),
            without_constant_mm: mean_of(constant),
        }
    }
}

/// Distances between all pairs of markers, which do not depend on where and how a system's axes are.
struct Clock {
    /// `[frame]` of the frames that are compared, with the number of each.
    estimate: Vec<(usize, Vec<f64>)>,
    /// `[frame]`
    reference: Vec<Vec<f64>>,
    /// Offsets at which fewer frames would be compared are left out.
    least: usize,
    estimate_frames: usize,
}

impl Clock {
    fn new(estimate: &[Markers], reference: &[Markers], least: usize) -> Self {
        // of the shorter one, which all that is compared lies in
        let every = estimate.len().min(reference.len()).div_ceil(MOST_COMPARED).max(1);
        Self {
            estimate: estimate.iter().enumerate().step_by(every).map(|(frame, own)| (frame, distances(own))).collect(),
            reference: reference.iter().map(distances).collect(),
            least,
            estimate_frames: estimate.len(),
        }
    }

    /// Correlation of how all distances vary, if the estimate's first frame is this frame of the reference.
    fn correlation(&self, offset: i64) -> Option<f64> {
        let (first, last) = (0.max(-offset), (self.estimate_frames as i64).min(self.reference.len() as i64 - offset));
        if last - first < self.least.max(3) as i64 {
            return None;
        }
        let pairs = self.estimate.first()?.1.len();
        let mut sums = vec![[0.0; 6]; pairs];
        for (frame, own) in &self.estimate {
            let Some(other) = usize::try_from(*frame as i64 + offset).ok().and_then(|at| self.reference.get(at)) else {
                continue;
            };
            for ((sums, a), b) in sums.iter_mut().zip(own).zip(other) {
                // NaN: a marker is missing
                if (a + b).is_finite() {
                    let terms = [1.0, *a, *b, a * a, b * b, a * b];
                    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                }
            }
        }
        let (mut both, mut own, mut other) = (0.0, 0.0, 0.0);
        for [count, a, b, aa, bb, ab] in sums.into_iter().filter(|sums| sums[0] >= 3.0) {
            both += ab - a * b / count;
            own += aa - a * a / count;
            other += bb - b * b / count;
        }
        (own > 1e-9 && other > 1e-9).then(|| both / (own * other).sqrt())
    }

    /// The offset of the best correlation in frames, that correlation, and a rival.
    fn best(&self, frames_per_second: f64) -> Option<(f64, f64, Option<f64>)> {
        let offsets = -(self.estimate_frames as i64)..=self.reference.len() as i64;
        let all: Vec<(i64, f64)> = offsets.filter_map(|offset| Some((offset, self.correlation(offset)?))).collect();
        let (at, (best, correlation)) = all.iter().copied().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        let value = |index: usize| all.get(index).map(|one| one.1);
        let is_peak = |index: usize| {
            [index.checked_sub(1), Some(index + 1)].into_iter().flatten().all(|beside| value(beside) <= value(index))
        };
        let rivals = all.iter().enumerate().filter(|(index, (offset, value))| {
            let far = (offset - best).abs() as f64 >= RIVAL.1 * frames_per_second;
            far && correlation - value < RIVAL.0 && is_peak(*index)
        });
        let rival = rivals.max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(_, (offset, _))| *offset as f64);
        // between frames: the top of the parabola through three values
        let beside = at.checked_sub(1).and_then(value).zip(value(at + 1));
        let between = beside.map_or(0.0, |(before, after)| {
            let bend = before - 2.0 * correlation + after;
            if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        });
        Some((best as f64 + between, correlation, rival))
    }
}

/// Points of the reference and the estimate about their common centres.
fn centred(of_frame: &[(usize, Point3<f64>, Point3<f64>)]) -> Vec<(Point3<f64>, Point3<f64>)> {
    let count = of_frame.len().max(1) as f64;
    let from = of_frame.iter().map(|(_, from, _)| from.coords).sum::<Vector3<f64>>() / count;
    let to = of_frame.iter().map(|(_, _, to)| to.coords).sum::<Vector3<f64>>() / count;
    of_frame.iter().map(|(_, a, b)| (a - from, b - to)).collect()
}

fn distances(markers: &Markers) -> Vec<f64> {
    let mut all = Vec::new();
    for (index, a) in markers.iter().enumerate() {
        for b in &markers[..index] {
            all.push(a.zip(*b).map_or(f64::NAN, |(a, b)| (a - b).norm()));
        }
    }
    all
}

/// The markers at a time between frames; `None` where one of both frames lacks them.
fn between(frames: &[Markers], at: f64) -> Markers {
    let (before, share) = (at.floor(), at - at.floor());
    let of = |frame: f64| if frame >= 0.0 { frames.get(frame as usize) } else { None };
    std::array::from_fn(|marker| {
        let first = of(before)?[marker]?;
        if share < 1e-9 {
            return Some(first);
        }
        let second = of(before + 1.0)?[marker]?;
        Some(first + share * (second - first))
    })
}

/// The axes of the trunk: left from the right hip to the left one, up from between the hips to the neck.
fn trunk(markers: &Markers) -> Option<Rotation3<f64>> {
    let at = |landmark: Landmark| markers[landmark as usize];
    let (left, right) = (at(Landmark::LeftHip)?, at(Landmark::RightHip)?);
    let left_axis = (left - right).try_normalize(1e-6)?;
    let up = at(Landmark::Thorax)? - nalgebra::center(&left, &right);
    let up = (up - left_axis * up.dot(&left_axis)).try_normalize(1e-6)?;
    Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[left_axis.cross(&up), left_axis, up])))
}

/// Mean over the limbs' segments of the standard deviation of their lengths, millimetres.
fn own_error(frames: &[Markers]) -> Option<f64> {
    let spreads: Vec<f64> = RIGID
        .iter()
        .filter_map(|[a, b]| {
            let length = |markers: &Markers| Some(1000.0 * (markers[*a as usize]? - markers[*b as usize]?).norm());
            standard_deviation(&frames.iter().filter_map(length).collect::<Vec<_>>())
        })
        .collect();
    mean(&spreads)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::standing;

    const HZ: f64 = 60.0;

    /// A motion that never repeats itself, at a time in seconds.
    fn posture(seconds: f64) -> Markers {
        std::array::from_fn(|marker| {
            let swing = |rate: f64| 0.1 * (rate * seconds + marker as f64).sin();
            Some(standing()[marker]? + Vector3::new(swing(2.1) + 0.3 * seconds, swing(3.7), swing(1.3)))
        })
    }

    fn frames(count: usize, begin_s: f64) -> Vec<Markers> {
        (0..count).map(|frame| posture(begin_s + frame as f64 / HZ)).collect()
    }

    fn turned(markers: Markers) -> Markers {
        let turn = Rotation3::from_euler_angles(0.0, 0.0, 2.0);
        markers.map(|point| point.map(|point| turn * point + Vector3::new(3.0, -1.0, 0.2)))
    }

    #[test]
    fn clock_and_place_are_found_and_no_error_is_left() {
        // the reference begins 1.37 s before the estimate and lasts longer
        let estimate = frames(150, 1.37);
        let reference: Vec<Markers> = frames(400, 0.0).into_iter().map(turned).collect();
        let found = AgainstReference::new(&estimate, &reference, HZ, None).unwrap();
        assert!((found.offset_s - 1.37).abs() < 0.004, "{found:?}");
        assert!(found.correlation > 0.99 && found.rival_s.is_none(), "{found:?}");
        assert!((found.turned_deg[0] + 2_f64.to_degrees()).abs() < 0.2 && found.turned_deg[1] < 0.2, "{found:?}");
        assert!(found.mean_mm < 2.0 && (found.scale - 1.0).abs() < 0.01, "{found:?}");
        assert_eq!(found.frames, 150);
        // the other way round: the reference begins 1.37 s late
        let found = AgainstReference::new(&reference, &estimate, HZ, None).unwrap();
        assert!((found.offset_s + 1.37).abs() < 0.004 && found.frames <= 150, "{found:?}");
    }

    #[test]
    fn what_is_constant_in_the_body_is_told_from_what_moves() {
        let estimate = frames(200, 0.0);
        let mut reference = estimate.clone();
        for markers in &mut reference {
            let off = trunk(markers).unwrap() * Vector3::new(0.0, 0.0, 0.05);
            let wrist = &mut markers[Landmark::LeftWrist as usize];
            *wrist = wrist.map(|point| point + off);
            *markers = turned(*markers);
        }
        let found = AgainstReference::new(&estimate, &reference, HZ, None).unwrap();
        let own = found.markers["left_wrist"];
        // a fifteenth of it is taken for the place of the whole body
        assert!((own.constant_mm - 47.0).abs() < 4.0, "{own:?}");
        assert!(own.without_constant_mm < 4.0 && found.mean_mm < 10.0, "{found:?}");
    }

    #[test]
    fn a_motion_that_repeats_itself_has_a_rival() {
        let repeating = |count: usize, begin: usize| -> Vec<Markers> {
            (begin..begin + count).map(|frame| posture((frame % 60) as f64 / HZ)).collect()
        };
        let found = AgainstReference::new(&repeating(120, 0), &repeating(300, 0), HZ, None).unwrap();
        let rival = found.rival_s.unwrap();
        assert!((rival - found.offset_s).abs() >= 1.0 - 1e-9, "{found:?}");
        let given = AgainstReference::new(&repeating(120, 0), &repeating(300, 0), HZ, Some(2.0)).unwrap();
        assert!(given.offset_s == 2.0 && given.rival_s.is_none() && given.correlation > 0.999, "{given:?}");
    }

    // On a path of 5 m, a body that was 10 % too large was said to be 1 %.
    #[test]
    fn the_size_is_that_of_the_body_not_of_its_way() {
        let reference = frames(600, 0.0);
        let larger = |own: &Markers| {
            let centre = own[Landmark::Pelvis as usize].unwrap();
            own.map(|point| point.map(|point| centre + 1.1 * (point - centre)))
        };
        let estimate: Vec<Markers> = reference.iter().map(larger).collect();
        let found = AgainstReference::new(&estimate, &reference, HZ, None).unwrap();
        assert!((found.scale - 1.1).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn missing_markers_are_left_out_and_short_or_still_ones_refused() {
        let estimate = frames(150, 0.5);
        let mut reference = frames(300, 0.0);
        for (frame, markers) in reference.iter_mut().enumerate() {
            markers[Landmark::HeadTop as usize] = None;
            markers[frame % LANDMARKS.len()] = None;
        }
        let found = AgainstReference::new(&estimate, &reference, HZ, None).unwrap();
        assert!((found.offset_s - 0.5).abs() < 0.01 && !found.markers.contains_key("head_top"), "{found:?}");
        assert!(found.own_mm.unwrap() > 0.0);
        assert!(AgainstReference::new(&estimate, &reference, HZ, Some(4.9)).is_err(), "six frames overlap");
        assert!(AgainstReference::new(&estimate, &reference[..20], HZ, None).is_err());
        assert!(AgainstReference::new(&estimate, &vec![posture(0.0); 300], HZ, None).is_err());
    }
}
