//! Whether the landmarks of a skin are those of an upright body, and whether a robot comes near them.

use super::Fit;
use crate::body::{LANDMARKS, Landmark, Markers};

/// A body whose markers stay farther than this from the mesh's landmarks is another one, metres, root mean square.
const WORST_FIT: f64 = 0.06;

/// Farthest that any one landmark of the mesh may stay from the body's, as a share of the way from ankles to crown:
/// about 0.15 m of a person of 1.7 m.
const FARTHEST_LANDMARK: f64 = 0.09;

/// Landmarks that are farther than this share of the same way on average get a note: about 25 mm of 1.7 m.
const NOTED_MEAN: f64 = 0.0155;

/// The crown of a body that does not lie is above its ankles by at least this share of the way from ankles to crown.
const LEAST_RISE: f64 = 0.6;

/// From the ankle over knee, hip and neck to the crown, on the side of the shorter leg, metres.
pub(super) fn way_to_crown(places: &Markers) -> f64 {
    use Landmark as L;
    let long = |[a, b]: [L; 2]| places[a as usize].zip(places[b as usize]).map_or(0.0, |(a, b)| (a - b).norm());
    let left = long([L::LeftAnkle, L::LeftKnee]) + long([L::LeftKnee, L::LeftHip]);
    let right = long([L::RightAnkle, L::RightKnee]) + long([L::RightKnee, L::RightHip]);
    left.min(right) + long([L::Pelvis, L::Thorax]) + long([L::Thorax, L::HeadTop])
}

/// Refuses landmarks of a body that lies or stands on its head.
pub(super) fn check_upright(places: &Markers, way: f64) -> Result<(), String> {
    let [crown, left, right] =
        [Landmark::HeadTop, Landmark::LeftAnkle, Landmark::RightAnkle].map(|l| places[l as usize].map(|p| p.z));
    let (Some(crown), Some(left), Some(right)) = (crown, left, right) else { return Ok(()) };
    let rise = crown - 0.5 * (left + right);
    match rise >= LEAST_RISE * way {
        true => Ok(()),
        false => Err(format!(
            "lies: its landmark head_top is {rise:.2} m above its ankles along Z, expected at least {:.2} m, {LEAST_RISE} \
             of the way along its bones; check `up`",
            LEAST_RISE * way
        )),
    }
}

/// Refuses fits that are poor, at all landmarks together or at one; a note on one that is only not good.
pub(super) fn check_fit(body: &str, fit: &Fit, way: f64) -> Result<Option<String>, String> {
    if fit.residual_rms_m > WORST_FIT {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmarks (root mean square), expected {:.0}: the mesh must be metres, X \
             forward, Y left, Z up, and its landmarks those of a human in a pose that the body can take, left and right not \
             swapped",
            1000.0 * fit.residual_rms_m,
            1000.0 * WORST_FIT
        ));
    }
    let away: Vec<(&str, f64)> =
        LANDMARKS.iter().zip(fit.per_marker).filter_map(|(l, away)| Some((l.name(), away?))).collect();
    let Some((worst, farthest)) = away.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(None) };
    if farthest > FARTHEST_LANDMARK * way {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmark {worst}, expected {:.0}: correct that landmark or its neighbours; \
             they must be those of a human in a pose that the body can take, left and right not swapped",
            1000.0 * farthest,
            1000.0 * FARTHEST_LANDMARK * way
        ));
    }
    let mean = away.iter().map(|(_, away)| away).sum::<f64>() / away.len() as f64;
    Ok((mean > NOTED_MEAN * way).then(|| {
        format!(
            "the body `{body}` comes within {:.0} mm of its landmarks on average, at worst {worst} {:.0} mm: look at the \
             picture of `inspect`",
            1000.0 * mean,
            1000.0 * farthest
        )
    }))
}

/// Left and right bones between landmarks.
const BONES: [(&str, [[Landmark; 2]; 2]); 6] = [
    ("hip from the pelvis", [[Landmark::Pelvis, Landmark::LeftHip], [Landmark::Pelvis, Landmark::RightHip]]),
    ("thigh", [[Landmark::LeftHip, Landmark::LeftKnee], [Landmark::RightHip, Landmark::RightKnee]]),
    ("shank", [[Landmark::LeftKnee, Landmark::LeftAnkle], [Landmark::RightKnee, Landmark::RightAnkle]]),
    (
        "shoulder from the thorax",
        [[Landmark::Thorax, Landmark::LeftShoulder], [Landmark::Thorax, Landmark::RightShoulder]],
    ),
    ("upper arm", [[Landmark::LeftShoulder, Landmark::LeftElbow], [Landmark::RightShoulder, Landmark::RightElbow]]),
    ("forearm", [[Landmark::LeftElbow, Landmark::LeftWrist], [Landmark::RightElbow, Landmark::RightWrist]]),
];

/// A bone that is longer than the other side's by more than this factor and [`UNEQUAL`] comes of a landmark at a wrong
/// place: the fit of lengths would follow it.
const MOST_UNEQUAL: f64 = 1.5;

/// As a share of the way from ankles to crown: about 0.1 m of 1.7 m.
const UNEQUAL: f64 = 0.06;

/// A bone that is longer than the other side's by more than this factor gets a note.
const NOTED_UNEQUAL: f64 = 1.15;

/// Bones that differ by less than this share of the way from ankles to crown are equal: about 25 mm of 1.7 m.
const EQUAL: f64 = 0.0155;

/// Refuses landmarks whose bones on both sides are far from equal; notes on those that are not quite.
pub(super) fn check_sides(places: &Markers, way: f64) -> Result<Vec<String>, String> {
    let mut notes = Vec::new();
    for (what, sides) in BONES {
        let [left, right] = sides.map(|[a, b]| Some((places[a as usize]? - places[b as usize]?).norm()));
        let (Some(left), Some(right)) = (left, right) else { continue };
        let (longer, shorter) = (left.max(right), left.min(right));
        if longer - shorter <= EQUAL * way || longer <= NOTED_UNEQUAL * shorter {
            continue;
        }
        let [_, [from, to]] = sides;
        let ends = [from, to].map(|end| end.name().trim_start_matches("right_"));
        let told = format!(
            "by its landmarks the left {what} is {left:.2} m long and the right {right:.2} m: correct {} or {} of a side, \
             unless the body is so",
            ends[0], ends[1]
        );
        if longer > MOST_UNEQUAL * shorter && longer - shorter > UNEQUAL * way {
            return Err(told.replace(", unless the body is so", ""));
        }
        notes.push(told);
    }
    Ok(notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{shipped, shipped_skin};
    use nalgebra::Vector3;

    /// A root mean square over fifteen landmarks hides one.
    #[test]
    fn one_landmark_that_is_far_from_the_bodys_is_refused_and_a_poor_mean_is_noted() {
        let body = shipped("actor").unwrap();
        let fit = |away: [f64; 15]| Fit {
            pose: body.zero_pose(),
            residual_rms_m: libm::sqrt(away.iter().map(|d| d * d).sum::<f64>() / 15.0),
            iterations: 1,
            per_marker: away.map(Some),
        };
        let mut away = [0.005; 15];
        assert_eq!(check_fit("actor", &fit(away), 1.6), Ok(None));
        away[Landmark::LeftKnee as usize] = 0.2;
        assert!(fit(away).residual_rms_m < WORST_FIT);
        let told = check_fit("actor", &fit(away), 1.6).unwrap_err();
        assert!(told.contains("within 200 mm of its landmark left_knee, expected 144"), "{told}");
        let noted = check_fit("actor", &fit([0.04; 15]), 1.6).unwrap().unwrap();
        assert!(noted.contains("within 40 mm of its landmarks on average"), "{noted}");
        assert!(check_fit("actor", &fit([0.02; 15]), 0.8).unwrap().is_some(), "a child's landmarks are nearer");
    }

    /// Lengths followed a landmark at a wrong place, and the mesh was bound there.
    #[test]
    fn a_landmark_at_a_wrong_place_is_seen_by_the_bones_of_the_other_side() {
        let mesh = shipped_skin("person_coarse").unwrap();
        let places: Markers = LANDMARKS.map(|landmark| mesh.landmarks.get(landmark.name()).copied());
        let way = way_to_crown(&places);
        assert_eq!(check_sides(&places, way), Ok(Vec::new()));
        for (landmark, by, part) in [
            (Landmark::LeftKnee, Vector3::new(0.0, 0.0, 0.3), "correct hip or knee"),
            (Landmark::LeftHip, Vector3::new(0.2, 0.0, 0.0), "correct pelvis or hip"),
            (Landmark::RightElbow, Vector3::new(0.0, -0.3, 0.0), "correct shoulder or elbow"),
            (Landmark::LeftWrist, Vector3::new(0.3, 0.0, 0.0), "correct elbow or wrist"),
            (Landmark::Thorax, Vector3::new(0.0, 0.25, 0.0), "correct thorax or shoulder"),
        ] {
            let mut moved = places;
            if let Some(place) = &mut moved[landmark as usize] {
                *place += by;
            }
            let told = check_sides(&moved, way).unwrap_err();
            assert!(told.contains(part), "{}: {told}", landmark.name());
            moved[landmark as usize] = places[landmark as usize].map(|place| place + 0.2 * by);
            assert!(check_sides(&moved, way).is_ok(), "{}", landmark.name());
        }
    }
}
