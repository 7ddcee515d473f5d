//! `skiagraph train`: models are written atomically, and bad input is refused with one message.

use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use skiagraph::artefacts::{ArtefactError, Destination};
use skiagraph::common::{ExperimentError, NoProgress, Progress, Stage};
use skiagraph::train::{ClipOptions, TrainingInput, train};
use skiagraph_track::motion_model::gpdm_graph::GraphSettings;

use crate::sandbox::{Sandbox, TINY};

#[test]
fn training_repeats_its_bytes() {
    let room = Sandbox::new();
    let train = "train embedded:walk --model gpdm-graph --out walk.model --json";
    let said = room.json_of(train);
    assert_eq!(said["facts"]["schema"], "skiagraph.model/1");
    assert_eq!(said["facts"]["robot"]["name"], "tracker40");
    assert_eq!(said["facts"]["learned_from"][0]["clip"], "embedded:walk");
    let bytes = room.read("walk.model");
    // a model of ours is replaced
    room.succeed(train);
    assert_eq!(room.read("walk.model"), bytes);
    assert_eq!(room.entries().len(), 1, "{:?}", room.entries());
}

#[test]
fn graphs_compare_with_single_models() {
    let room = Sandbox::new();
    let train = |clip: &str, kind: &str, out: &str| {
        room.succeed(&format!("train {clip} --model {kind} --threshold 1e-6 --out {out}"));
    };
    train("embedded:walk", "gpdm-graph", "graph.model");
    train("embedded:walk", "gpdm", "single.model");
    let said = room.json_of("inspect graph.model --against single.model --json");
    let models = said["models"].as_array().unwrap();
    let frames: u64 = models.iter().map(|m| m["frames"].as_u64().unwrap()).sum();
    assert_eq!(Some(frames), said["facts"]["learned_from"][0]["frames"].as_u64());
    assert!(models.len() > 1, "a threshold of nothing cuts at every clip");
    let mean = |v: &serde_json::Value| v["reconstruction_error_rad2"]["mean"].as_f64().unwrap();
    let ratio = said["against"]["ratio"].as_f64().unwrap();
    assert!((ratio - mean(&said) / mean(&said["against"])).abs() < 1e-12);
    assert!(room.ask("inspect graph.model").stdout.contains("gpdm-graph"));
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

/// With the same settings only.
#[test]
fn interrupted_training_is_resumed() {
    let room = Sandbox::new();
    let options = ClipOptions {
        robot: "tracker40".into(),
        frames_per_second: 60.0,
        first_frame: None,
        last_frame: None,
        metres_per_unit: None,
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

fn tiny_with(tracker: &str) -> String {
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    format!("{before}{tracker}")
}

#[test]
fn trained_models_are_used() {
    let room = Sandbox::new();
    room.write("tiny.toml", tiny_with(ON_A_MODEL));
    room.succeed("train embedded:run --model gpdm-graph --out run.model");
    let models = |run: &str| {
        let record: serde_json::Value = room.json(&format!("{run}/track.json"));
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
