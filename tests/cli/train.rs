//! `skiagraph train`: models are written atomically, and bad input is refused with one message.

use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use skiagraph::artefacts::{ArtefactError, Destination};
use skiagraph::common::{ExperimentError, NoProgress, Progress, Stage};
use skiagraph::motion_model::gpdm_graph::GraphSettings;
use skiagraph::train::{ClipOptions, TrainingInput, train};

use crate::sandbox::{Sandbox, TINY};

const WALK: [&str; 6] = ["train", "embedded:walk", "--model", "gpdm-graph", "--out", "walk.model"];

#[test]
fn the_same_training_gives_the_same_bytes() {
    let room = Sandbox::new();
    let answer = room.skiagraph(WALK.iter().chain(&["--json"]));
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    let said: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(said["facts"]["schema"], "skiagraph.model/1");
    assert_eq!(said["facts"]["robot"]["name"], "tracker40");
    assert_eq!(said["facts"]["learned_from"][0]["clip"], "embedded:walk");
    let bytes = fs::read(room.path("walk.model")).unwrap();
    assert_eq!(room.skiagraph(WALK.iter()).code, 0, "a model of ours is replaced");
    assert_eq!(fs::read(room.path("walk.model")).unwrap(), bytes);
    assert_eq!(room.entries().len(), 1, "{:?}", room.entries());
}

#[test]
fn a_graph_is_compared_only_with_a_model_of_the_same_motion() {
    let room = Sandbox::new();
    let train = |clip: &str, kind: &str, out: &str| {
        let answer = room.skiagraph(["train", clip, "--model", kind, "--threshold", "1e-6", "--out", out]);
        assert_eq!(answer.code, 0, "{}", answer.stderr);
    };
    train("embedded:walk", "gpdm-graph", "graph.model");
    train("embedded:walk", "gpdm", "single.model");
    train("embedded:run", "gpdm", "run.model");
    let answer = room.skiagraph(["inspect", "graph.model", "--against", "single.model", "--json"]);
    let said: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    let models = said["models"].as_array().unwrap();
    let frames: u64 = models.iter().map(|m| m["frames"].as_u64().unwrap()).sum();
    assert_eq!(Some(frames), said["facts"]["learned_from"][0]["frames"].as_u64());
    assert!(models.len() > 1, "a threshold of nothing cuts at every clip");
    let mean = |v: &serde_json::Value| v["reconstruction_error_rad2"]["mean"].as_f64().unwrap();
    let ratio = said["against"]["ratio"].as_f64().unwrap();
    assert!((ratio - mean(&said) / mean(&said["against"])).abs() < 1e-12);
    assert!(room.skiagraph(["inspect", "graph.model"]).stdout.contains("gpdm-graph"));
    let refused = room.skiagraph(["inspect", "graph.model", "--against", "run.model"]);
    assert!(refused.code == 2 && refused.stderr.contains("other motions"), "{}", refused.stderr);
    let whole = room.read("graph.model");
    room.write("cut.model", &whole[..whole.len() / 2]);
    let refused = room.skiagraph(["inspect", "cut.model"]);
    assert!(refused.code == 2 && refused.stderr.contains("cut.model"), "{}", refused.stderr);
}

#[test]
fn bad_input_is_refused_with_one_message_and_leaves_nothing() {
    let room = Sandbox::new();
    room.write("mine.txt", "years of work");
    let before = room.entries();
    let cases: [(&[&str], &str); 9] = [
        (&["embedded:walk", "--out", "x.model", "--clip-length", "2"], "--clip-length: expected 4 to"),
        (
            &["embedded:walk", "--out", "x.model", "--threshold", "0"],
            "--threshold: expected a number above zero (rad^2)",
        ),
        (
            &["embedded:walk", "--out", "x.model", "--first-frame", "5", "--last-frame", "12"],
            "expected at least 30 frames",
        ),
        (&["embedded:wolk", "--out", "x.model"], "did you mean `embedded:walk`"),
        (&["nothing.bvh", "--out", "x.model"], "error: CLIP: `nothing.bvh` is not in"),
        (
            &["embedded:walk", "--out", "x.model", "--last-frame", "999"],
            "error: --last-frame: embedded:walk: expected a frame of the clip",
        ),
        (&["embedded:walk", "--out", "x.model", "--fps", "0"], "found 0"),
        (&["embedded:walk", "--out", "x.model", "--robot", "r2d2"], "neither a built-in robot"),
        (&["embedded:walk", "--out", "mine.txt"], "not an unchanged skiagraph result"),
    ];
    for (arguments, words) in cases {
        let answer = room.skiagraph(["train", "--model", "gpdm-graph"].iter().chain(arguments));
        assert_eq!(answer.code, 2, "{arguments:?}: {}", answer.stderr);
        assert_eq!(answer.stderr.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{}", answer.stderr);
        assert!(answer.stderr.contains(words), "{arguments:?}: {}", answer.stderr);
        assert_eq!(room.entries(), before, "{arguments:?}");
    }
}

/// Interrupts after a number of frames, and records progress.
struct Onlooker {
    patience: usize,
    done: AtomicUsize,
    heard: Mutex<Vec<String>>,
}

impl Onlooker {
    fn new(patience: usize) -> Self {
        Self { patience, done: AtomicUsize::new(0), heard: Mutex::new(Vec::new()) }
    }
}

impl Progress for Onlooker {
    fn begin(&self, _: Stage, _: usize) {}

    fn advance(&self) {
        self.done.fetch_add(1, Ordering::SeqCst);
    }

    fn note(&self, note: &str) {
        self.heard.lock().unwrap().push(note.to_owned());
    }

    fn interrupted(&self) -> bool {
        self.done.load(Ordering::SeqCst) >= self.patience
    }
}

#[test]
fn an_interrupted_training_resumes_only_with_the_same_settings() {
    let room = Sandbox::new();
    let options = ClipOptions {
        robot: "tracker40".into(),
        frames_per_second: 60.0,
        first_frame: None,
        last_frame: None,
        metres_per_unit: None,
        allow_outside: false,
    };
    let input = TrainingInput::from_clips(&["embedded:walk".into()], &options, None).unwrap();
    let settings = GraphSettings { threshold_per_joint: 1e-6, ..GraphSettings::default() };
    let learn = |name: &str, settings: &GraphSettings, patience: usize| {
        let onlooker = Onlooker::new(patience);
        let learned = train(&input, settings, Destination { path: &room.path(name), force: false }, &onlooker);
        (learned, onlooker.heard.into_inner().unwrap())
    };
    let (at_once, heard) = learn("at_once.model", &settings, usize::MAX);
    assert!(at_once.unwrap().model.graph.segments.len() > 1 && heard.is_empty(), "{heard:?}");
    let stopped = learn("walk.model", &settings, 1).0.unwrap_err();
    assert!(
        matches!(stopped, ExperimentError::Artefact(ArtefactError::ProgressSaved { .. })) && stopped.exit_code() == 130,
        "{stopped}"
    );
    assert!(!room.path("walk.model").exists() && room.path("walk.model.partial").exists());
    fs::copy(room.path("walk.model.partial"), room.path("other.model.partial")).unwrap();
    let (learned, heard) = learn("walk.model", &settings, usize::MAX);
    learned.unwrap();
    assert!(heard.len() == 1 && heard[0].contains("resuming with 1 model saved"), "{heard:?}");
    assert_eq!(room.read("walk.model"), room.read("at_once.model"));
    let other = GraphSettings { threshold_per_joint: 1e-5, ..settings };
    let refused = learn("other.model", &other, usize::MAX).0.unwrap_err();
    let words =
        "other.model.partial: an interrupted command with other settings saved its progress here (settings.threshold";
    assert!(refused.to_string().contains(words) && refused.exit_code() == 2, "{refused}");
    let forced = train(&input, &other, Destination { path: &room.path("other.model"), force: true }, &NoProgress);
    forced.unwrap();
    assert!(room.entries().iter().all(|name| !name.contains("partial")), "{:?}", room.entries());
}

const ON_A_MODEL: &str = r#"
[tracker.gpdm_graph]
model_file = "run.model"
particles = 20
"#;

/// The tiny scenario with another tracker.
fn tiny_with(tracker: &str) -> String {
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    format!("{before}{tracker}")
}

#[test]
fn a_tracker_uses_a_trained_model_like_one_learned_during_the_run() {
    let room = Sandbox::new();
    room.write("tiny.toml", tiny_with(ON_A_MODEL));
    room.succeed("train embedded:run --model gpdm-graph --out run.model");
    let models = |run: &str| {
        let record: serde_json::Value = serde_json::from_slice(&room.read(&format!("{run}/track.json"))).unwrap();
        assert_eq!(record["tracker"]["gpdm_graph"]["model_file"], "run.model");
    };
    room.succeed("run tiny.toml --out runs/file");
    models("runs/file");
    room.succeed("render tiny.toml --out set");
    room.succeed("track set --tracker gpdm_graph model_file=run.model particles=20 --seeds 2 --out runs/apart");
    models("runs/apart");
    // poses.npz of `run` contains the truth and the estimates
    assert!(room.read("runs/file/search.npz") == room.read("runs/apart/search.npz"));
}

#[test]
fn a_mismatched_model_is_refused_with_the_reason_and_leaves_nothing() {
    let room = Sandbox::new();
    let train = |arguments: &str| room.succeed(&format!("train {arguments} --quiet"));
    train("embedded:run --model gpdm-graph --out run.model");
    train("embedded:run --model gpdm --out single.model");
    train("embedded:run --model gpdm-graph --robot actor --out actor.model");
    train("embedded:run --model gpdm-graph --fps 30 --out slow.model");
    train("embedded:walk --model gpdm-graph --out walk.model");
    room.write("cut.model", &room.read("run.model")[..999]);
    let cases = [
        ("nowhere.model", "nowhere.model: cannot be read"),
        ("cut.model", "not a complete skiagraph model"),
        ("single.model", "train one with --model gpdm-graph"),
        ("actor.model", "whose joints differ from those of"),
        ("slow.model", "learned at 30 frames a second, needed at 60"),
        ("walk.model", "of `embedded:walk`, which are also frames of"),
        ("run.model\"\nmodel.clip_s = 0.7 # \"", "model_file: expected no training keys of `model`"),
    ];
    for (file, words) in cases {
        room.write("tiny.toml", tiny_with(&ON_A_MODEL.replace("run.model", file)));
        let answer = room.skiagraph(["run", "tiny.toml", "--out", "run"]);
        assert_eq!(answer.code, 2, "{file}: {}", answer.stderr);
        assert!(answer.stderr.contains(words), "{file}: {}", answer.stderr);
        assert!(!room.path("run").exists(), "{file}");
    }
}
