//! Breakdown of the error: the markers' error by phase of gait, by speed and by the number of cameras that see them.

use serde::{Deserialize, Serialize};

use super::Sequence;
use skiagraph_core::body::{LANDMARKS, Landmark};

/// Knee and ankle of each leg, in the order of the feet of contact truth: left, right.
const LEGS: [[Landmark; 2]; 2] =
    [[Landmark::LeftKnee, Landmark::LeftAnkle], [Landmark::RightKnee, Landmark::RightAnkle]];
/// Limits between slow, medium and fast markers of the actor, metres per second: a walker's trunk and a walker's
/// swinging foot.
const SPEEDS: [f64; 2] = [0.5, 2.0];
const MOST_CAMERAS: usize = 4;

/// Mean error of a group of markers in one sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BreakdownGroup {
    /// The kind of group: `phase of gait`, `speed`, `cameras that see the marker`.
    pub by: String,
    /// The group.
    pub group: String,
    /// Mean distance from the truth, millimetres.
    pub mean_mm: f64,
    /// Difference between the error of a marker in this group and the error of the same marker in other groups of this
    /// kind, millimetres: the mean over markers, weighted by `n m / (n + m)` for n and m frames. Unlike the means of
    /// the groups, it does not depend on which markers are in a group: hands are hidden more often than the trunk and
    /// have greater errors. Absent if no marker is in two groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_marker_mm: Option<f64>,
    /// Share of the markers of all groups of the same kind.
    pub share: f64,
}

/// Distances of some markers from the truth.
#[derive(Clone, Copy, Default)]
struct Distances {
    sum_mm: f64,
    count: usize,
}

impl Distances {
    fn mean_mm(self) -> Option<f64> {
        (self.count > 0).then(|| self.sum_mm / self.count as f64)
    }

    fn total(all: impl IntoIterator<Item = Self>) -> Self {
        let add = |one: Self, other: Self| Self { sum_mm: one.sum_mm + other.sum_mm, count: one.count + other.count };
        all.into_iter().fold(Self::default(), add)
    }
}

/// Distances of one group, marker by marker.
struct Errors {
    by: &'static str,
    group: String,
    of_markers: [Distances; LANDMARKS.len()],
}

/// All groups with a marker, as far as contacts and cameras are known.
pub(super) fn breakdown(sequence: &Sequence<'_>) -> Vec<BreakdownGroup> {
    let kinds = [by_phase(sequence), by_speed(sequence), by_cameras(sequence)];
    kinds.into_iter().flat_map(as_groups).collect()
}

fn as_groups(kind: Vec<Errors>) -> Vec<BreakdownGroup> {
    let total = Distances::total(kind.iter().flat_map(|group| group.of_markers)).count;
    let group = |(index, errors): (usize, &Errors)| {
        let all = Distances::total(errors.of_markers);
        Some(BreakdownGroup {
            by: errors.by.to_owned(),
            group: errors.group.clone(),
            mean_mm: all.mean_mm()?,
            same_marker_mm: within_markers(&kind, index),
            share: all.count as f64 / total as f64,
        })
    };
    kind.iter().enumerate().filter_map(group).collect()
}

/// Mean difference of a group's markers from the same markers in the other groups.
fn within_markers(kind: &[Errors], group: usize) -> Option<f64> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for landmark in 0..LANDMARKS.len() {
        let own = kind[group].of_markers[landmark];
        let others = kind.iter().enumerate().filter(|(index, _)| *index != group);
        let others = Distances::total(others.map(|(_, errors)| errors.of_markers[landmark]));
        if let (Some(mean), Some(other)) = (own.mean_mm(), others.mean_mm()) {
            let weight = (own.count * others.count) as f64 / (own.count + others.count) as f64;
            sum += weight * (mean - other);
            weights += weight;
        }
    }
    (weights > 0.0).then(|| sum / weights)
}

/// Knees and ankles of the actor's standing and swinging legs.
fn by_phase(sequence: &Sequence<'_>) -> Vec<Errors> {
    let Some(contacts) = sequence.contacts else { return vec![] };
    let feet = &contacts.truth.ground.feet;
    sort_into(sequence, "phase of gait", &["standing leg", "swinging leg"].map(str::to_owned), |frame, landmark| {
        let leg = LEGS.iter().position(|leg| leg.iter().any(|part| *part as usize == landmark))?;
        Some(usize::from(!feet.get(leg)?.frames[frame].in_contact))
    })
}

/// By the speed of the true marker between its neighbouring frames.
fn by_speed(sequence: &Sequence<'_>) -> Vec<Errors> {
    let groups = [
        format!("below {} m/s", SPEEDS[0]),
        format!("{} to {} m/s", SPEEDS[0], SPEEDS[1]),
        format!("above {} m/s", SPEEDS[1]),
    ];
    sort_into(sequence, "speed", &groups, |frame, landmark| {
        let (before, after) = (frame.checked_sub(1)?, frame + 1);
        let [from, to] = [before, after].map(|frame| sequence.truth_markers.get(frame, landmark));
        let speed = 0.5 * (to? - from?).norm() * sequence.frames_per_second;
        Some(SPEEDS.iter().filter(|limit| speed > **limit).count())
    })
}

/// By the number of cameras in which the true marker is in view and not occluded.
fn by_cameras(sequence: &Sequence<'_>) -> Vec<Errors> {
    let Some(views) = sequence.views else { return vec![] };
    let most = views.cameras.len().min(MOST_CAMERAS);
    let name = |count: usize| match count {
        0 => "none".to_owned(),
        count if count == most && views.cameras.len() > most => format!("{count} or more"),
        count => count.to_string(),
    };
    let groups: Vec<String> = (0..=most).map(name).collect();
    sort_into(sequence, "cameras that see the marker", &groups, |frame, landmark| {
        Some(views.visible[frame].iter().filter(|camera| camera[landmark]).count().min(most))
    })
}

/// The distances of all scored markers, in the groups given by `index(frame, landmark)`.
fn sort_into(
    sequence: &Sequence<'_>,
    by: &'static str,
    names: &[String],
    index: impl Fn(usize, usize) -> Option<usize>,
) -> Vec<Errors> {
    let empty = |name: &String| Errors { by, group: name.clone(), of_markers: Default::default() };
    let mut groups: Vec<Errors> = names.iter().map(empty).collect();
    for frame in sequence.scored() {
        for (landmark, truth, estimate) in sequence.pairs(frame) {
            if let Some(group) = index(frame, landmark).and_then(|index| groups.get_mut(index)) {
                let of_marker = &mut group.of_markers[landmark];
                of_marker.sum_mm += 1000.0 * (estimate - truth).norm();
                of_marker.count += 1;
            }
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_fixture::contacts;
    use crate::sequence::{ContactMeasures, ContactPair, Views};
    use crate::test_figure::{standing, translated};
    use crate::{SeedRun, evaluate, summarise};
    use nalgebra::{Point3, Vector3};
    use skiagraph_core::camera::{Camera, FieldOfView};

    fn found(sequence: &Sequence<'_>, by: &str) -> Vec<(String, f64, f64)> {
        let groups = breakdown(sequence).into_iter().filter(|group| group.by == by);
        groups.map(|group| (group.group, group.mean_mm, group.share)).collect()
    }

    fn camera(name: &str) -> Camera {
        let (eye, target) = (Point3::new(4.0, 0.0, 1.0), Point3::new(0.0, 0.0, 1.0));
        Camera::look_at(name, eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 64, 48).unwrap()
    }

    #[test]
    fn legs_count_as_standing_and_swinging_by_the_contact_truth() {
        let truth = vec![standing(); 4];
        let mut estimate = truth.clone();
        for frame in &mut estimate {
            for landmark in LEGS[1] {
                frame[landmark as usize] = truth[0][landmark as usize].map(|p| p + Vector3::new(0.03, 0.0, 0.0));
            }
        }
        // the left foot is in stance throughout, the right one in frame 1 of the three scored frames
        let stands = (true, 0.0, 0.0);
        let swings = (false, 50.0, 0.0);
        let ground = contacts(&[stands; 4], &[stands, stands, swings, swings]);
        let depth = [0.0; 4];
        let measures = ContactMeasures { ground: &ground, self_depth_m: &depth, prop_depth_m: None, known: None };
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.contacts = Some(ContactPair { truth: measures, estimate: None });
        let phases = found(&sequence, "phase of gait");
        assert_eq!(phases[0].0, "standing leg");
        // six markers of the left leg are right, two of the standing right leg are 30 mm off
        assert!((phases[0].1 - 60.0 / 8.0).abs() < 1e-9 && (phases[0].2 - 8.0 / 12.0).abs() < 1e-12, "{phases:?}");
        assert!((phases[1].1 - 30.0).abs() < 1e-9 && (phases[1].2 - 4.0 / 12.0).abs() < 1e-12, "{phases:?}");
    }

    #[test]
    fn markers_are_fast_by_the_truth_and_the_last_frame_has_no_speed() {
        // at 60 frames per second, 1 m per frame is 60 m/s
        let at = |x: f64| translated(&standing(), Vector3::new(x, 0.0, 0.0));
        let truth = [at(0.0), at(0.0), at(0.02), at(0.04), at(1.0)];
        let estimate: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.0, 0.01, 0.0))).collect();
        let speeds = found(&Sequence::from_markers(60.0, &truth, &estimate), "speed");
        let names: Vec<&str> = speeds.iter().map(|(name, ..)| name.as_str()).collect();
        // frame 1: 0.6 m/s, frame 2: 1.2 m/s, frame 3: 29.4 m/s
        assert_eq!(names, ["0.5 to 2 m/s", "above 2 m/s"]);
        assert!((speeds[0].2 - 2.0 / 3.0).abs() < 1e-12 && (speeds[0].1 - 10.0).abs() < 1e-9, "{speeds:?}");
    }

    /// The wrist is hidden in most frames and far off in all; the pelvis is visible in most and near. Pooled, hidden
    /// markers look worse; yet each marker is 10 mm better when hidden.
    #[test]
    fn hidden_markers_are_compared_with_the_same_markers() {
        let truth = vec![standing(); 9];
        let mut estimate = truth.clone();
        let cameras = [camera("a")];
        let mut seen = [[[true; 15]]; 9];
        let [wrist, pelvis] = [Landmark::LeftWrist, Landmark::Pelvis].map(|landmark| landmark as usize);
        for frame in 1..9 {
            let others = estimate[frame].iter_mut().enumerate().filter(|(m, _)| ![wrist, pelvis].contains(m));
            others.for_each(|(_, m)| *m = None);
            for (marker, hidden, millimetres) in [(wrist, frame <= 6, 80.0), (pelvis, frame == 8, 30.0)] {
                seen[frame][0][marker] = !hidden;
                let error = millimetres - if hidden { 10.0 } else { 0.0 };
                estimate[frame][marker] = truth[frame][marker].map(|p| p + Vector3::new(0.0, 0.0, 0.001 * error));
            }
        }
        let all: Vec<&[[bool; 15]]> = seen.iter().map(<[_; 1]>::as_slice).collect();
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &all, visible: &all });
        let groups = breakdown(&sequence);
        let of = |name: &str| groups.iter().find(|g| g.by.starts_with("cameras") && g.group == name).unwrap();
        assert!((of("none").mean_mm - (6.0 * 70.0 + 20.0) / 7.0).abs() < 1e-9);
        assert!((of("1").mean_mm - (2.0 * 80.0 + 7.0 * 30.0) / 9.0).abs() < 1e-9, "pooled, hidden markers look worse");
        assert!((of("none").same_marker_mm.unwrap() + 10.0).abs() < 1e-9);
        assert!((of("1").same_marker_mm.unwrap() - 10.0).abs() < 1e-9);
        let evaluation = evaluate(&sequence).unwrap();
        let summary = summarise(&[SeedRun { clip: "walk", seed: 0, evaluation: &evaluation }]).unwrap();
        let hidden = summary.breakdown.iter().find(|group| group.group == "none").unwrap();
        assert!((hidden.same_marker_mm.unwrap() + 10.0).abs() < 1e-9 && hidden.same_marker_ci95.is_none());
    }

    #[test]
    fn markers_seen_by_fewer_cameras_have_their_own_group() {
        let truth = vec![standing(); 2];
        let mut estimate = truth.clone();
        estimate[1][0] = truth[1][0].map(|p| p + Vector3::new(0.0, 0.0, 0.09));
        let cameras = ["a", "b"].map(camera);
        let mut seen = [[true; 15], [true; 15]];
        seen[0][0] = false;
        let all: Vec<&[[bool; 15]]> = vec![&seen; 2];
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimate);
        sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &all, visible: &all });
        let groups = found(&sequence, "cameras that see the marker");
        assert_eq!(groups.iter().map(|(name, ..)| name.as_str()).collect::<Vec<_>>(), ["1", "2"]);
        assert!((groups[0].1 - 90.0).abs() < 1e-9 && groups[1].1 == 0.0, "{groups:?}");
        let evaluation = evaluate(&sequence).unwrap();
        let run = |seed| SeedRun { clip: "walk", seed, evaluation: &evaluation };
        let summary = summarise(&[run(0), run(1)]).unwrap();
        let one = summary.breakdown.iter().find(|group| group.group == "1").unwrap();
        assert!((one.mean_mm - 90.0).abs() < 1e-9 && (one.share - 1.0 / 15.0).abs() < 1e-12);
        assert_eq!(one.same_marker_mm, None, "the marker is in no other group");
        assert_eq!(summary.per_camera.iter().map(|c| c.camera.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    }
}
