//! Every fault changes what trackers are given, and only what it says; a report tells which are noticed.

use super::*;
use crate::common::NoProgress;
use crate::rendering::draw;
use crate::scenario::ScenarioFile;
use skiagraph_core::camera::Camera;
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_core::rng::{Purpose, normal, stream};

fn set() -> BlindSet {
    let overrides = [
        "motion.loop_to_s=1.0",
        "rig.ring.count=3",
        "rig.ring.size_px=[80, 60]",
        "tracker_body.calibrate=false",
        "observation.keypoints={ layout = \"coco17\", missing = 0.1 }",
    ]
    .map(str::to_owned);
    let set = draw(&ScenarioFile::built_in(&overrides).unwrap(), None, &NoProgress).unwrap().0.blind;
    let lens = |_: usize, camera: &mut Camera| camera.distortion.k1 = -0.1;
    let with_lens = BlindChange { camera: &lens, shown: &|at| at, silhouette: None, keypoints: &|_, _| {} };
    set.changed(&with_lens).unwrap()
}

fn settings(smallest: bool) -> TrackerSettings {
    let named = TrackerSettings::named(if smallest { "frozen" } else { "keypoints" }).unwrap();
    named.overridden(&[]).unwrap()
}

#[test]
fn every_fault_changes_what_trackers_are_given_and_planting_twice_gives_the_same() {
    let set = set();
    let seen = |set: &BlindSet| -> Vec<Observation> {
        (0..set.frame_count).map(|frame| set.observation(frame).unwrap()).collect()
    };
    let before = seen(&set);
    for fault in &FAULTS {
        assert_eq!(fault.obstacle(&set), None, "{}", fault.name);
        let changed = planted(&set, fault).unwrap();
        let after = seen(&changed);
        let cameras = changed.rig != set.rig;
        assert_eq!(cameras, matches!(fault.change, FaultChange::Camera(_)), "{}", fault.name);
        assert_eq!(after != before, !cameras, "{}", fault.name);
        assert_eq!(changed.set_hash, planted(&set, fault).unwrap().set_hash, "{}", fault.name);
        assert_eq!(changed.start.pose, set.start.pose);
    }
    assert_eq!(seen(&set), before);
}

#[test]
fn silhouettes_are_mirrored_transposed_and_reflected_pixel_by_pixel() {
    let mask = Mask::from_fn(9, 7, |x, y| (x, y) == (2, 1) || (x, y) == (3, 2));
    let change = |name: &str| match FAULTS.iter().find(|fault| fault.name == name).unwrap().change {
        FaultChange::Silhouette(change) | FaultChange::Image(change, _) => change(&mask).pixels().collect::<Vec<_>>(),
        _ => Vec::new(),
    };
    assert_eq!(change("mirrored-image"), [(6, 1), (5, 2)]);
    assert_eq!(change("transposed"), [(1, 2), (2, 3)]);
    assert_eq!(change("mirrored-floor"), [(2, 1), (3, 2), (3, 3), (2, 4)]);
}

#[test]
fn a_report_tells_silent_faults_from_those_without_effect_and_names_unknown_ones() {
    let (set, keypoints) = (set(), settings(false));
    let only = ["millimetres", "left-right", "mirrored-floor", "lens-ignored"].map(str::to_owned);
    let report = plant_faults(&set, &keypoints, &[0, 1], &only, &NoProgress).unwrap();
    let of = |name: &str| report.faults.iter().find(|fault| fault.fault == name).unwrap();
    assert_eq!(report.faults.len(), 4);
    assert_eq!(report.noise_mm, 0.0);
    assert_eq!(of("mirrored-floor").verdict, FaultVerdict::NoEffect);
    assert!(of("millimetres").verdict == FaultVerdict::Silent && of("millimetres").change_mm.unwrap() > 300.0);
    assert!(of("lens-ignored").change_mm.unwrap() > 0.5);
    let text = faults_text(&report);
    assert!(text.contains("millimetres") && text.contains("SILENT") && text.contains("no effect"), "{text}");
    // the share lost with a fault says nothing of a tracker that dies anyway
    assert!(text.contains("lost: frames without an estimate, 0 % without a fault"), "{text}");
    let page = faults_markdown(&report, &faults_source(&report.set_hash, &keypoints, &[0, 1], &only));
    assert!(!page.contains(&faults_source(&report.set_hash, &keypoints, &[0], &only)), "{page}");
    assert!(page.contains("| `left-right` |") && page.contains(&report.set_hash), "{page}");
    let refused = plant_faults(&set, &keypoints, &[0], &["late-camra".to_owned()], &NoProgress).unwrap_err();
    assert!(refused.to_string().contains("did you mean `late-camera`?"), "{refused}");
    let oracle = TrackerSettings::named("oracle").unwrap();
    assert!(plant_faults(&set, &oracle, &[0], &[], &NoProgress).unwrap_err().to_string().contains("given the truth"));
    let frozen = plant_faults(&set, &settings(true), &[0], &[], &NoProgress).unwrap();
    assert!(frozen.faults.iter().all(|fault| fault.verdict == FaultVerdict::NoEffect));
}

/// A filter of few particles: its seeds are 98 mm apart, and a fault that moved the estimates by 79 mm had "no effect".
#[test]
fn a_change_smaller_than_between_seeds_is_silent() {
    let settings = TrackerSettings::named("annealed_particle_filter").unwrap();
    let settings = settings.overridden(&["paper=true", "particles=4"].map(str::to_owned)).unwrap();
    let set = set();
    let seeds = Answers::new(track(&set, &settings, &[0, 1], None, &mut Models::default(), &NoProgress).unwrap());
    let between_seeds = apart_mm(&seeds.markers[0], &seeds.markers[1]).unwrap();
    let report = plant_faults(&set, &settings, &[0, 1], &["late-camera".to_owned()], &NoProgress).unwrap();
    let change = report.faults[0].change_mm.unwrap();
    assert!(change > 10.0 && change < 1.5 * between_seeds, "{change} {between_seeds}");
    assert_eq!((report.noise_mm, report.faults[0].verdict), (0.0, FaultVerdict::Silent));
}

/// A run of a tracker that does not repeat is as far from the mean over runs as a log-normal number (0.5), by which it
/// differs in all markers alike; a fault moves the mean by a multiple of the median distance.
#[test]
fn noise_alone_is_seldom_called_silent() {
    const TRACKERS: u64 = 500;
    for seeds in [1, 2, 5] {
        for (column, moved) in [0.0, 8.0].into_iter().enumerate() {
            let silent = (0..TRACKERS).filter(|tracker| {
                let mut rng = stream(*tracker, Purpose::Oracle, column as u64, seeds, 0);
                let (mut noise, mut change) = (0.0_f64, 0.0);
                for _ in 0..seeds {
                    let [sound, again, faulty] = [0; 3].map(|_| libm::exp(0.5 * normal(&mut rng)));
                    noise = noise.max(sound.hypot(again));
                    change += sound.hypot(faulty).hypot(moved) / seeds as f64;
                }
                silent_verdict(Some(change), noise) == FaultVerdict::Silent
            });
            let share = 100.0 * silent.count() as f64 / TRACKERS as f64;
            let expected = if moved > 0.0 { 90.0..=100.0 } else { 0.0..=7.0 };
            assert!(expected.contains(&share), "{seeds} seeds, moved by {moved}: {share} %");
        }
    }
}
