use nalgebra::Point2;

use super::*;
use crate::scene::Distractor;
use crate::test_bodies::{person, walk};
use crate::test_cameras::rig;
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::CameraTiming;

const POINTS: usize = 26;

fn truth(frames: usize) -> GroundTruth {
    GroundTruth::from_motion(person(), &walk(frames), &rig()).unwrap()
}

fn exact() -> KeypointSettings {
    KeypointSettings::exact(KeypointLayout::Halpe26)
}

fn detect(truth: &GroundTruth, settings: KeypointSettings, corruption: Corruption) -> SequenceKeypoints {
    KeypointDetector::new(truth, &TimedRig::from(&rig()), settings, corruption, 4.into()).detect()
}

fn noisy() -> KeypointSettings {
    KeypointSettings {
        slow_percent: 1.0,
        white_percent: 0.2,
        gross: 0.1,
        missing: 0.1,
        inversion: 0.1,
        bias_mm: 10.0,
        occluded_error: 1.0,
        occluded_rate: 1.0,
        confidence_noise: 0.3,
        ..exact()
    }
}

/// Equal, where missing numbers equal each other.
fn is_same(a: &SequenceKeypoints, b: &SequenceKeypoints) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

#[test]
fn points_of_another_person_are_those_of_the_distractor_and_missing_without_one() {
    let rig = rig();
    let poses = vec![walk(9).poses[8].clone()];
    let other = Distractor { name: "passer-by".into(), body: person(), poses };
    let links = other.body.link_frames(&other.poses[0]);
    let among = GroundTruth::among(person(), &walk(3), &rig, Vec::new(), vec![other]).unwrap();
    let settings = KeypointSettings { other_person: 1.0, ..exact() };
    let seen = detect(&among, settings, Corruption::default());
    let places = person().keypoint_places(settings.layout);
    let mut found = 0;
    for (index, view) in seen.views.iter().enumerate() {
        let (camera, place) = (&rig.cameras[index / POINTS % 3], places[index % POINTS].unwrap().point);
        let pixel = camera.project(&(links[place.link] * place.point_in_link));
        match pixel.filter(|pixel| camera.pinhole.contains(pixel)) {
            Some(pixel) => assert!((pixel - Point2::from(view.found)).norm() < 1e-9, "{index}"),
            None => assert!(view.found[0].is_nan() && view.confidence == 0.0, "{index}"),
        }
        found += usize::from(!view.found[0].is_nan());
        assert!(view.is_others);
    }
    assert!(found > 100, "{found}");
    let half = KeypointSettings { other_person: 0.5, stretch_s: 0.1, ..exact() };
    let views = detect(&among, half, Corruption::default()).views;
    assert!(views.chunks(POINTS).all(|image| image.iter().all(|view| view.is_others == image[0].is_others)));
    let alone = detect(&truth(2), settings, Corruption::default());
    assert!(alone.views.iter().all(|view| view.found[0].is_nan()));
}

#[test]
fn without_errors_points_are_the_projections_of_their_places_through_the_lens() {
    let (truth, rig) = (truth(3), rig());
    let seen = detect(&truth, exact(), Corruption::default());
    assert_eq!((seen.places.len(), seen.views.len()), (3 * POINTS, 3 * 3 * POINTS));
    let knee = Keypoint::LeftKnee as usize;
    let marker = truth.frames[2].markers[Landmark::LeftKnee as usize].unwrap();
    assert_eq!(Point3::from(seen.places[2 * POINTS + knee]), marker);
    let mut inside = 0;
    for (index, view) in seen.views.iter().enumerate() {
        let (frame, camera, point) = (index / (3 * POINTS), index / POINTS % 3, index % POINTS);
        let expected = rig.cameras[camera].project(&seen.places[frame * POINTS + point].into()).unwrap();
        assert_eq!(view.exact, [expected.x, expected.y]);
        assert!(!view.is_missed && !view.is_gross && !view.is_inverted);
        if view.sight == Sight::OutOfView {
            assert!(view.found[0].is_nan() && view.confidence == 0.0);
        } else {
            assert!((view.found, view.confidence) == (view.exact, 1.0));
            inside += 1;
        }
    }
    assert!(inside > 200, "{inside}");
}

#[test]
fn errors_are_the_same_on_any_threads_and_independent_of_other_cameras() {
    let truth = truth(40);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| detect(&truth, noisy(), Corruption::default()))
    };
    let all = on(3);
    assert!(is_same(&on(1), &all));
    let alone = skiagraph_core::camera::CameraRig { cameras: rig().cameras[..1].to_vec() };
    let lone_truth = GroundTruth::from_motion(person(), &walk(40), &alone).unwrap();
    let lone = KeypointDetector::new(&lone_truth, &TimedRig::from(&alone), noisy(), Corruption::default(), 4.into());
    let first = all.views.chunks(POINTS).step_by(3).flatten().copied().collect();
    let lone = lone.detect();
    assert!(is_same(&lone, &SequenceKeypoints { views: first, places: all.places.clone() }));
}

#[test]
fn exchanged_points_are_those_of_the_other_side_and_what_was_drawn_is_told() {
    let truth = truth(60);
    let plain = detect(&truth, KeypointSettings { inversion: 0.0, ..noisy() }, Corruption::default());
    let seen = detect(&truth, noisy(), Corruption::default());
    let mirrored = KeypointLayout::Halpe26.mirrored();
    let (mut inverted, mut missed, mut gross) = (0, 0, 0);
    for (index, view) in seen.views.iter().enumerate() {
        let own = index / POINTS * POINTS;
        let source = if view.is_inverted { own + mirrored[index % POINTS] } else { index };
        let said = &plain.views[source];
        assert_eq!(view.exact, plain.views[index].exact);
        assert_eq!(format!("{:?}", view.found), format!("{:?}", said.found));
        assert_eq!((view.confidence, view.is_missed, view.is_gross), (said.confidence, said.is_missed, said.is_gross));
        assert_eq!(said.found[0].is_nan(), said.is_missed || said.sight == Sight::OutOfView);
        inverted += usize::from(view.is_inverted);
        missed += usize::from(view.is_missed);
        gross += usize::from(view.is_gross);
    }
    assert!(inverted > 50 && missed > 200 && gross > 200, "{inverted} {missed} {gross}");
}

#[test]
fn a_bias_is_constant_in_the_body_mirrored_and_of_the_stated_size() {
    let settings = KeypointSettings { bias_mm: 10.0, ..exact() };
    let offsets = |seed: u64| {
        settings.layout.keypoints().iter().map(|point| bias_m(&settings, *point, seed.into())).collect::<Vec<_>>()
    };
    let one = offsets(1);
    for (index, other) in settings.layout.mirrored().into_iter().enumerate() {
        assert_eq!(one[index], Vector3::new(one[other].x, -one[other].y, one[other].z));
    }
    let hip = Keypoint::LeftHip as usize;
    let squares: f64 = (0..2000).map(|seed| offsets(seed)[hip].norm_squared() / 3.0).sum();
    let (found, expected) = ((squares / 2000.0).sqrt(), 0.010 * 0.107 / (1.138 / 17.0));
    assert!((found - expected).abs() < 0.05 * expected, "{found} {expected}");
    // in the image it moves with the body: the same place on the link in every frame
    let truth = truth(30);
    let biased = biased(&truth.actor, &settings, &truth.actor.keypoint_places(settings.layout), 4.into());
    let seen = detect(&truth, settings, Corruption::default());
    let place = biased[hip].unwrap().point;
    for frame in [0, 12, 29] {
        let point = truth.frames[frame].link_frames[place.link] * place.point_in_link;
        let expected = rig().cameras[1].project(&point).unwrap();
        assert_eq!(seen.views[(frame * 3 + 1) * POINTS + hip].found, [expected.x, expected.y]);
    }
}

#[test]
fn points_are_seen_when_the_silhouettes_are() {
    let truth = truth(12);
    let late = Corruption { desynchronisation_ms: 30.0, ..Corruption::default() };
    let lost = Corruption { dropped_frames: 0.5, ..Corruption::default() };
    let (plain, late) = (detect(&truth, exact(), Corruption::default()), detect(&truth, exact(), late));
    assert_eq!(late.places.len(), plain.places.len());
    assert!(late.views.iter().zip(&plain.views).any(|(a, b)| (a.exact[0] - b.exact[0]).abs() > 0.5));
    let held = detect(&truth, exact(), lost);
    let of = |seen: &SequenceKeypoints, frame: usize| seen.views[frame * 3 * POINTS].found;
    let same = (1..12).filter(|frame| of(&held, *frame) == of(&held, frame - 1)).count();
    assert!((1..11).contains(&same) && held.views[0] == plain.views[0], "{same}");
    // a camera with every second image has no points between them
    let timing = CameraTiming { every: 2, ..CameraTiming::default() };
    let half = TimedRig::new(rig(), Vec::new(), vec![timing; 3]).unwrap();
    let seen = KeypointDetector::new(&truth, &half, exact(), Corruption::default(), 4.into()).detect();
    assert!(seen.views[3 * POINTS..6 * POINTS].iter().all(|view| view.found[0].is_nan() && !view.is_missed));
    assert_eq!(of(&seen, 2), of(&plain, 2));
}
