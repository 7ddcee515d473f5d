//! The functions at the root do what the commands do, and refuse what does not fit.

use nalgebra::DVector;
use skiagraph::{BenchmarkSet, Destination, ScenarioFile, Tracked, TrackerSettings};
use skiagraph::{compare, measure, render, track};
use skiagraph_set::{Articulation, EstimatedSequence, Estimates};

fn short_walk() -> BenchmarkSet {
    let short = ["last_frame=4".to_owned()];
    let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &short).unwrap();
    render(&scenario, None).unwrap().0
}

fn few_particles() -> TrackerSettings {
    let settings = TrackerSettings::named("annealed_particle_filter").unwrap();
    settings.overridden(&["particles=20", "layers=2"].map(str::to_owned)).unwrap()
}

fn estimates(set: &BenchmarkSet, seeds: Vec<u64>, sequences: Vec<EstimatedSequence>) -> Estimates {
    let frames_per_second = set.blind.frames_per_second;
    Estimates { frames_per_second, seeds, sequences, bodies: Vec::new(), notes: Vec::new() }
}

#[test]
fn a_saved_set_and_saved_runs_are_those_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let set = short_walk();
    let short = ["last_frame=4".to_owned()];
    let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &short).unwrap();
    let path = at("set");
    let (saved, _) = render(&scenario, Some(Destination { path: &path, force: false })).unwrap();
    assert_eq!(saved.blind.set_hash, set.blind.set_hash);

    let seeds = [0, 1, 2];
    let trackers = [TrackerSettings::named("frozen").unwrap(), few_particles()];
    let mut measured = Vec::new();
    for (name, settings) in ["base", "other"].into_iter().zip(&trackers) {
        let tracked = track(&set.blind, settings, &seeds).unwrap();
        let found = measure(&set, &tracked).unwrap();
        let path = at(name);
        let to = Destination { path: &path, force: false };
        found.save(&set, &tracked, to).unwrap();
        let refused = tracked.save(&set.blind, to).unwrap_err().to_string();
        assert!(refused.contains("--force"), "{refused}");
        assert_eq!(Tracked::read(&path, &set.blind.start.body).unwrap().estimates.seeds, seeds);
        measured.push(found);
    }
    let in_memory = compare(&measured[0], &measured[1]).unwrap();
    let on_disk = compare(at("base").as_path(), at("other").as_path()).unwrap();
    assert!(!in_memory.others[0].metrics.is_empty());
    assert_eq!(in_memory.others[0].metrics, on_disk.others[0].metrics);
}

#[test]
fn estimates_that_do_not_fit_the_set_are_refused() {
    let set = short_walk();
    let body = &set.blind.start.body;
    let poses = vec![set.blind.start.pose.clone(); set.blind.frame_count];
    let sequence = EstimatedSequence::from_poses(body, poses.clone());
    let of = |sequence: EstimatedSequence| estimates(&set, vec![3], vec![sequence]);
    let refusal = |estimates: Estimates| match measure(&set, &Tracked::from(estimates)) {
        Ok(_) => panic!("measured"),
        Err(error) => error.to_string(),
    };
    assert!(measure(&set, &Tracked::from(of(sequence.clone()))).is_ok());

    let short = refusal(of(EstimatedSequence::from_poses(body, poses[1..].to_vec())));
    let frames = set.blind.frame_count;
    assert!(short.contains(&format!("seed 3: it has {} frames, the set {frames}", frames - 1)), "{short}");
    let mut longer = sequence.clone();
    longer.articulation = Articulation::Roots(vec![None; 9]);
    assert!(refusal(of(longer)).contains("it has 9 frames"));
    let mut other_body = sequence.clone();
    let Articulation::Poses(poses) = &mut other_body.articulation else { panic!("it has poses") };
    poses[2].as_mut().unwrap().joint_angles = DVector::zeros(1);
    let refused = refusal(of(other_body));
    assert!(refused.contains("joint angles, the tracker's body"), "{refused}");
    let refused = refusal(Estimates { seeds: vec![0, 1], ..of(sequence.clone()) });
    assert!(refused.contains("2 seeds and 1 sequences"), "{refused}");
    let refused = refusal(Estimates { frames_per_second: f64::NAN, ..of(sequence.clone()) });
    assert!(refused.contains("frames a second"), "{refused}");
    let nothing = EstimatedSequence {
        articulation: Articulation::Unknown,
        markers: vec![Default::default(); set.blind.frame_count],
    };
    assert!(refusal(of(nothing)).contains("no estimate"));
}

/// Half of a body that never moves is neither better nor worse than a tracker that never moves.
#[test]
fn static_tracker_has_the_runs_own_markers() {
    let set = short_walk();
    let poses = vec![set.blind.start.pose.clone(); set.blind.frame_count];
    let whole = EstimatedSequence::from_poses(&set.blind.start.body, poses);
    let mut upper = EstimatedSequence { articulation: Articulation::Unknown, ..whole.clone() };
    for markers in &mut upper.markers {
        markers[8..14].fill(None);
    }
    let mut lost = whole.clone();
    lost.markers[3] = Default::default();
    let Articulation::Poses(poses) = &mut lost.articulation else { panic!("it has poses") };
    poses[3] = None;
    let measured = |sequences: Vec<EstimatedSequence>| {
        let seeds = (0..sequences.len() as u64).collect();
        measure(&set, &Tracked::from(estimates(&set, seeds, sequences))).unwrap()
    };
    let mut floors = Vec::new();
    for sequence in [whole.clone(), upper.clone(), lost] {
        let found = measured(vec![sequence]);
        let own = found.seeds[0].metrics["humaneva_mm"].mean;
        assert!(own > 1.0, "the actor moves: {own} mm");
        assert_eq!(found.frozen.metrics["humaneva_mm"].mean, own);
        floors.push(own);
    }
    assert!(floors[0] != floors[1], "legs move otherwise than arms");
    // each seed has its own
    let both = measured(vec![whole, upper]);
    assert!((both.frozen.metrics["humaneva_mm"].mean - (floors[0] + floors[1]) / 2.0).abs() < 1e-9);
}
