//! Model files keep every bit, and damaged files are refused.

use super::*;
use skiagraph_core::body::Motion;
use skiagraph_track::motion_model::gpdm_graph::{GraphSegment, GraphSettings};

/// A model of two short motions, learned in one round.
fn model() -> LearnedModel {
    let body = Humanoid::tracker25().unwrap();
    let pose = |t: usize, phase: f64| {
        let mut pose = body.zero_pose();
        pose.joint_angles
            .iter_mut()
            .enumerate()
            .for_each(|(i, a)| *a = 0.2 * (0.3 * t as f64 + i as f64 + phase).sin());
        pose
    };
    let motion = |phase| Motion { frames_per_second: 60.0, poses: (0..36).map(|t| pose(t, phase)).collect() };
    let mut settings = GraphSettings { clip_s: 0.2, threshold_per_joint: 1e-9, ..GraphSettings::default() };
    settings.training.rounds = 1;
    let graph = GpdmGraph::learn(&body, &[motion(0.0), motion(1.0)], &settings).unwrap();
    assert!(graph.segments.len() >= 4 && !graph.candidates.is_empty());
    let from = |clip: &str| LearnedFrom {
        clip: clip.to_owned(),
        sha256: None,
        first_frame: Some(3),
        last_frame: None,
        frames: 36,
        poses_sha256: String::new(),
    };
    let facts = ModelFacts::new(&body, 60.0, vec![from("one"), from("two")], settings);
    let row = |t: usize| std::array::from_fn(|i| (t + i) as f32 / 7.0);
    let fingerprint = MotionFingerprint { rows: (0..36).map(row).collect() };
    LearnedModel { facts, body, graph, fingerprints: vec![Some(fingerprint), None] }
}

fn read(bytes: &[u8]) -> Result<LearnedModel, ExperimentError> {
    LearnedModel::from_bytes(Path::new("walk.model"), bytes)
}

#[test]
fn a_model_that_is_read_back_is_equal_and_predicts_the_same_bits() {
    let model = model();
    let bytes = model.to_bytes().unwrap();
    let again = read(&bytes).unwrap();
    assert_eq!(again, model);
    assert_eq!(again.to_bytes().unwrap(), bytes);
    let points = again.graph.segments[0].gpdm.latents();
    for (a, b) in model.graph.segments.iter().zip(&again.graph.segments) {
        let bits = |s: &GraphSegment| {
            let both = [s.gpdm.map_moments(points), s.gpdm.dynamics_moments(points)];
            let mean = both.iter().flat_map(|m| m.mean.col_iter().flat_map(|c| c.iter()));
            mean.chain(both.iter().flat_map(|m| &m.variance)).map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(a), bits(b));
    }
}

#[test]
fn every_cut_is_refused_and_a_flipped_byte_is_refused_or_changes_nothing() {
    let model = model();
    let bytes = model.to_bytes().unwrap();
    // every 97th byte of the arrays, and every byte of the archive's directory
    let places: Vec<usize> = (0..bytes.len()).filter(|at| at % 97 == 0 || *at + 1500 > bytes.len()).collect();
    for at in places {
        let error = read(&bytes[..at]).unwrap_err();
        assert!(error.to_string().starts_with("walk.model: "), "{error}");
        assert_eq!(error.exit_code(), 2);
        let mut broken = bytes.clone();
        broken[at] ^= 0x24;
        if let Ok(read) = read(&broken) {
            assert_eq!(read, model, "byte {at}");
        }
    }
}

#[test]
fn a_newer_version_and_other_files_have_different_errors() {
    let mut newer = model();
    newer.facts.schema = "skiagraph.model/9".to_owned();
    let message = read(&newer.to_bytes().unwrap()).unwrap_err().to_string();
    assert!(message.contains("skiagraph.model/9") && message.contains("update skiagraph"), "{message}");
    let other = Npz::from_iter([("fps", Array::new(&[], vec![60.0]))]).to_bytes("x").unwrap();
    assert!(read(&other).unwrap_err().to_string().contains("not a skiagraph model"));
    assert!(read(b"[motion]\n").unwrap_err().to_string().contains("not a complete skiagraph model"));
}

#[test]
fn another_robot_or_rate_is_refused_and_another_size_is_accepted() {
    let model = model();
    let path = Path::new("walk.model");
    let wider = skiagraph_core::body::BodyShape::random_mismatch(&model.body, 1, 0.05, 0.1);
    model.facts.check_fits(path, &model.body.reshaped(&wider), 60.0).unwrap();
    let message = model.facts.check_fits(path, &Humanoid::actor().unwrap(), 60.0).unwrap_err().to_string();
    assert!(message.starts_with("walk.model: learned for the robot"), "{message}");
    let message = model.facts.check_fits(path, &model.body, 30.0).unwrap_err().to_string();
    assert!(message.contains("60 frames a second, needed at 30"), "{message}");
}

#[test]
fn arrays_with_impossible_sizes_are_refused_before_they_are_used() {
    let bytes = model().to_bytes().unwrap();
    let with = |name: &str, array: Array| {
        let npz = Npz::from_bytes("x", &bytes).unwrap();
        let changed = npz.iter().map(|(n, own)| (n, if n == name { array.clone() } else { own.clone() }));
        let changed: Npz = changed.collect();
        read(&changed.to_bytes("x").unwrap()).unwrap_err().to_string()
    };
    for ranges in [vec![0, 0, i64::MAX], vec![0, 9, 3], vec![-1, 0, 3], vec![0, 0, 100_000]] {
        let message = with("segments", Array::new(&[1, 3], ranges));
        assert!(message.contains("segments: expected"), "{message}");
    }
    let message = with("candidates", Array::new(&[1, 2], vec![99_i64, 0]));
    assert!(message.contains("candidates: expected"), "{message}");
    let message = with("errors", Array::new(&[2], vec![0.0, 1.0]));
    assert!(message.contains("errors: shape [2]"), "{message}");
    let message = with("latents", Array::new(&[72, 3], vec![f64::NAN; 216]));
    assert!(message.contains("latents: number 0 is not finite"), "{message}");
}
