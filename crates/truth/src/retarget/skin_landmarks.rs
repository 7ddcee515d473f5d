//! Checks that the landmarks of a skin are those of an upright body, and that a robot fits them.

use super::Fit;
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};

/// Maximum root mean square distance of the body's markers from the mesh's landmarks, metres.
const MAX_RMS: f64 = 0.06;

/// Maximum distance of any landmark from the body's marker, as a share of the path from ankles to crown: about 0.15 m
/// for a person 1.7 m tall.
const MAX_LANDMARK_DISTANCE: f64 = 0.09;

/// A larger mean distance, as a share of the same path, gives a note: about 25 mm at 1.7 m.
const NOTED_MEAN: f64 = 0.0155;

/// A larger distance of any landmark, which a mean hides, gives the same note: about 50 mm at 1.7 m.
const NOTED_LANDMARK_DISTANCE: f64 = 0.03;

/// Least height of an upright body's crown above its ankles, as a share of the path from ankles to crown.
const MIN_RISE: f64 = 0.6;

/// Length of the path from ankle to crown via knee, hip and neck, on the side of the shorter leg, metres.
pub(super) fn ankle_to_crown_path(places: &Markers) -> f64 {
    use Landmark as L;
    let length = |[a, b]: [L; 2]| places[a as usize].zip(places[b as usize]).map_or(0.0, |(a, b)| (a - b).norm());
    let left = length([L::LeftAnkle, L::LeftKnee]) + length([L::LeftKnee, L::LeftHip]);
    let right = length([L::RightAnkle, L::RightKnee]) + length([L::RightKnee, L::RightHip]);
    left.min(right) + length([L::Pelvis, L::Thorax]) + length([L::Thorax, L::HeadTop])
}

/// Rejects landmarks of a lying or upside-down body.
pub(super) fn check_upright(places: &Markers, path: f64) -> Result<(), String> {
    let [crown, left, right] =
        [Landmark::HeadTop, Landmark::LeftAnkle, Landmark::RightAnkle].map(|l| places[l as usize].map(|p| p.z));
    let (Some(crown), Some(left), Some(right)) = (crown, left, right) else { return Ok(()) };
    let rise = crown - 0.5 * (left + right);
    if rise >= MIN_RISE * path {
        return Ok(());
    }
    Err(format!(
        "is not upright: its landmark head_top is {rise:.2} m above its ankles along Z, expected at least {:.2} m \
         ({MIN_RISE} times the length along its bones); check `up`",
        MIN_RISE * path
    ))
}

/// Rejects poor fits, of all landmarks together or of a single one; a note for a mediocre fit.
pub(super) fn check_fit(body: &str, fit: &Fit, path: f64) -> Result<Option<String>, String> {
    if fit.residual_rms_m > MAX_RMS {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmarks (root mean square), expected {:.0}: the mesh must be in metres, \
             X forward, Y left, Z up, and its landmarks those of a human in a pose that the body can take, left and right \
             not swapped",
            1000.0 * fit.residual_rms_m,
            1000.0 * MAX_RMS
        ));
    }
    let away: Vec<(&str, f64)> =
        LANDMARKS.iter().zip(fit.per_marker).filter_map(|(l, away)| Some((l.name(), away?))).collect();
    let Some((worst, farthest)) = away.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(None) };
    if farthest > MAX_LANDMARK_DISTANCE * path {
        return Err(format!(
            "`{body}` comes within {:.0} mm of its landmark {worst}, expected {:.0}: correct that landmark or its neighbours; \
             landmarks must be those of a human in a pose that the body can take, left and right not swapped",
            1000.0 * farthest,
            1000.0 * MAX_LANDMARK_DISTANCE * path
        ));
    }
    let mean = away.iter().map(|(_, away)| away).sum::<f64>() / away.len() as f64;
    let is_noted = mean > NOTED_MEAN * path || farthest > NOTED_LANDMARK_DISTANCE * path;
    Ok(is_noted.then(|| {
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

/// A bone longer than the other side's by more than this factor and [`MAX_SIDE_DIFFERENCE`] indicates a misplaced
/// landmark, which the fit of lengths would follow.
const MAX_SIDE_RATIO: f64 = 1.5;

/// As a share of the path from ankles to crown: about 0.1 m at 1.7 m.
const MAX_SIDE_DIFFERENCE: f64 = 0.06;

/// A bone longer than the other side's by more than this factor gives a note.
const NOTED_SIDE_RATIO: f64 = 1.15;

/// Smaller differences between sides, as a share of the path from ankles to crown, are ignored: about 25 mm at 1.7 m.
const NOTED_SIDE_DIFFERENCE: f64 = 0.0155;

/// Rejects landmarks whose bones are very different on both sides; notes for smaller differences.
pub(super) fn check_sides(places: &Markers, path: f64) -> Result<Vec<String>, String> {
    let mut notes = Vec::new();
    for (what, sides) in BONES {
        let [left, right] = sides.map(|[a, b]| Some((places[a as usize]? - places[b as usize]?).norm()));
        let (Some(left), Some(right)) = (left, right) else { continue };
        let (longer, shorter) = (left.max(right), left.min(right));
        if longer - shorter <= NOTED_SIDE_DIFFERENCE * path || longer <= NOTED_SIDE_RATIO * shorter {
            continue;
        }
        let [_, [from, to]] = sides;
        let ends = [from, to].map(|end| end.name().trim_start_matches("right_"));
        let message = format!(
            "by its landmarks the left {what} is {left:.2} m long and the right {right:.2} m: correct {} or {} on one side",
            ends[0], ends[1]
        );
        if longer > MAX_SIDE_RATIO * shorter && longer - shorter > MAX_SIDE_DIFFERENCE * path {
            return Err(message);
        }
        notes.push(message + ", unless the body is asymmetric");
    }
    Ok(notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use skiagraph_core::body::{shipped, shipped_skin};

    /// A root mean square over fifteen landmarks can hide a single misplaced one.
    #[test]
    fn a_single_distant_landmark_is_refused_or_noted_and_a_poor_mean_is_noted() {
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
        assert!(fit(away).residual_rms_m < MAX_RMS);
        let message = check_fit("actor", &fit(away), 1.6).unwrap_err();
        assert!(message.contains("within 200 mm of its landmark left_knee, expected 144"), "{message}");
        let noted = check_fit("actor", &fit([0.04; 15]), 1.6).unwrap().unwrap();
        assert!(noted.contains("within 40 mm of its landmarks on average"), "{noted}");
        // the robot of pybullet: its wrists fit, its neck does not
        let mut away = [0.012; 15];
        away[Landmark::Thorax as usize] = 0.059;
        let noted = check_fit("actor", &fit(away), 1.6).unwrap().unwrap();
        assert!(noted.contains("within 15 mm of its landmarks on average, at worst thorax 59 mm"), "{noted}");
        assert!(check_fit("actor", &fit([0.02; 15]), 0.8).unwrap().is_some(), "tolerances scale with the body");
    }

    #[test]
    fn a_misplaced_landmark_is_found_by_comparing_sides() {
        let mesh = shipped_skin("person_coarse").unwrap();
        let places: Markers = LANDMARKS.map(|landmark| mesh.landmarks.get(landmark.name()).copied());
        let path = ankle_to_crown_path(&places);
        assert_eq!(check_sides(&places, path), Ok(Vec::new()));
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
            let message = check_sides(&moved, path).unwrap_err();
            assert!(message.contains(part), "{}: {message}", landmark.name());
            moved[landmark as usize] = places[landmark as usize].map(|place| place + 0.2 * by);
            assert!(check_sides(&moved, path).is_ok(), "{}", landmark.name());
        }
    }
}
