//! The shipped scenarios, their documentation, and output about them.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};

fn shipped_scenarios() -> Vec<PathBuf> {
    let toml_files = |folder: &Path| {
        let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
        files.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect::<Vec<_>>()
    };
    let scenarios: Vec<PathBuf> =
        ["scenarios", "scenarios/smoke", "scenarios/cmu", "scenarios/plausibility", "scenarios/monocular"]
            .iter()
            .flat_map(|f| toml_files(&shipped(f)))
            .collect();
    assert!(scenarios.len() >= 6, "{scenarios:?}");
    scenarios
}

#[test]
fn every_shipped_scenario_is_valid() {
    let room = Sandbox::new();
    let mocap = crate::support::test_data("mocap");
    for scenario in shipped_scenarios() {
        let mut arguments = vec!["check".to_owned(), scenario.display().to_string(), "--json".to_owned()];
        match &mocap {
            Some(folder) => arguments.extend(["--mocap-dir".to_owned(), folder.display().to_string()]),
            None if std::fs::read_to_string(&scenario).unwrap().contains(".amc") => continue,
            None => {}
        }
        let answer = room.skiagraph(&arguments);
        assert_eq!(answer.code, 0, "{}: {}", scenario.display(), answer.stderr);
        let said: Value = serde_json::from_str(&answer.stdout).unwrap();
        assert_eq!(said["schema"], "skiagraph.check/1");
        assert!(said["frames"].as_u64().unwrap() > 10);
        assert!(said["retarget_residual_mm"].as_f64().unwrap() < 30.0, "{said}");
    }
    assert!(room.entries().is_empty(), "check wrote {:?}", room.entries());
}

#[test]
fn the_default_scenario_is_the_shipped_walk_and_needs_no_file() {
    let room = Sandbox::new();
    let built_in = room.succeed("check").stdout;
    let file = room.succeed(&format!("check {}", shipped("scenarios/walk.toml").display())).stdout;
    // everything except the file's name and measured times
    let same = |said: &str| -> Vec<String> {
        said.lines().skip(1).filter(|line| !line.starts_with("  cost ")).map(str::to_owned).collect()
    };
    assert_eq!(same(&built_in), same(&file));
    assert!(built_in.contains("301 frames at 60 Hz, 5.02 s"), "{built_in}");
}

#[test]
fn the_schema_has_every_key_of_every_shipped_scenario() {
    let schema: Value = serde_json::from_str(&Sandbox::new().succeed("schema").stdout).unwrap();
    let known = schema.to_string();
    for scenario in shipped_scenarios() {
        let table: toml::Table = std::fs::read_to_string(&scenario).unwrap().parse().unwrap();
        for key in keys(&toml::Value::Table(table)) {
            assert!(known.contains(&format!("\"{key}\"")), "{}: {key}", scenario.display());
        }
    }
}

#[test]
fn the_readme_names_every_key_of_the_schema() {
    let schema: Value = serde_json::from_str(&Sandbox::new().succeed("schema").stdout).unwrap();
    let readme = std::fs::read_to_string(shipped("scenarios/README.md")).unwrap();
    for definition in schema["$defs"].as_object().unwrap().values().chain([&schema]) {
        for (key, property) in definition["properties"].as_object().into_iter().flatten() {
            assert!(readme.contains(key.as_str()), "scenarios/README.md does not name {key}");
            let described = property["description"].is_string() || property["$ref"].is_string();
            assert!(described, "{key} has no description in the schema");
        }
    }
}

fn keys(value: &toml::Value) -> Vec<String> {
    match value {
        toml::Value::Table(table) => {
            let within = |(key, value): (&String, &toml::Value)| match (key.as_str(), value) {
                // names of methods are free
                ("methods", toml::Value::Table(methods)) => methods.values().flat_map(keys).collect(),
                _ => [vec![key.clone()], keys(value)].concat(),
            };
            table.iter().flat_map(within).collect()
        }
        toml::Value::Array(array) => array.iter().flat_map(keys).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn the_oracle_is_measured_exactly() {
    let room = Sandbox::new();
    room.succeed(&format!("run {} --out oracle", shipped("scenarios/smoke/oracle.toml").display()));
    let record: Value = serde_json::from_slice(&room.read("oracle/run.json")).unwrap();
    let mean = |metric: &str| record["metrics"][metric]["mean"].as_f64().unwrap();
    assert!((mean("humaneva_mm") - 50.0).abs() < 1e-9);
    assert!(mean("mpjpe_root_mm") < 1e-9);
    assert_eq!(record["matched"], true);
}

#[test]
fn the_filter_is_better_than_a_tracker_that_never_moves() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/smoke/matched.toml").display().to_string();
    let said = room.succeed(&format!("run {scenario} --json --out matched")).stdout;
    let record: Value = serde_json::from_str(&said).unwrap();
    let error = record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    let frozen = record["frozen"]["humaneva_mm"].as_f64().unwrap();
    assert!(error < 60.0 && frozen > 2.0 * error, "{error} mm against {frozen} mm");
}

#[test]
fn methods_are_compared_and_each_is_a_complete_run() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/smoke/latent.toml").display().to_string();
    let said = room.succeed(&format!("run {scenario} --json --quiet --out all")).stdout;
    let comparison: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(comparison["schema"], "skiagraph.comparison/1");
    let methods = comparison["methods"].as_object().unwrap();
    assert_eq!(methods["graph_oracle_roots"]["given_roots"], true);
    for (name, method) in methods {
        let record: Value = serde_json::from_slice(&room.read(&format!("all/{name}/run.json"))).unwrap();
        assert_eq!(record["metrics"], method["metrics"], "{name}");
        assert!(room.path(&format!("all/{name}/report.html")).exists());
    }
    let page = String::from_utf8(room.read("all/comparison.html")).unwrap();
    assert!(methods.keys().all(|name| page.contains(&format!("{name}/report.html"))));
    room.succeed("report all --png all.png");
    assert!(room.read("all.png").starts_with(b"\x89PNG"));
    room.succeed(&format!("render {scenario} --out set"));
    room.succeed("track set --tracker gpdm_graph particles=50 model.training.rounds=2 --out alone");
    room.succeed("evaluate set alone");
    let alone: Value = serde_json::from_slice(&room.read("alone/run.json")).unwrap();
    assert_eq!(alone["metrics"], methods["graph"]["metrics"], "blindfolded, by way of a set on disk");
}

#[test]
fn a_model_is_never_learned_from_the_frames_of_the_test() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let without = room.skiagraph(["run", "tiny.toml", "tracker.gpdm_graph={}"]);
    assert_eq!(without.code, 2);
    assert!(without.stderr.contains("[[training.clips]]"), "{}", without.stderr);
    room.succeed("render tiny.toml --out set");
    let refused = room.skiagraph(["track", "set", "--tracker", "gpdm_graph", "--out", "alone"]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("the set has none"), "{}", refused.stderr);
    let shared = room.skiagraph(["run", "tiny.toml", "training.clips=[{clip=\"embedded:walk\"}]"]);
    assert_eq!(shared.code, 2);
    assert!(shared.stderr.contains("are also frames of [motion]"), "{}", shared.stderr);
}

#[test]
fn a_run_replaces_a_run_and_nothing_else() {
    let room = Sandbox::new();
    room.write(
        "tiny.toml",
        TINY.replace("[tracker.annealed_particle_filter]\nparticles = 12\nlayers = 2", "[tracker.frozen]"),
    );
    room.succeed("run tiny.toml");
    room.succeed("run tiny.toml");
    assert_eq!(room.entries(), ["runs", "tiny.toml"]);
    let thesis = room.write("runs/tiny/thesis.tex", "years of work");
    let refused = room.skiagraph(["run", "tiny.toml"]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("not an unchanged skiagraph result"), "{}", refused.stderr);
    assert!(thesis.exists());
    room.succeed("run tiny.toml --force");
    assert_eq!(room.read("runs/tiny~/thesis.tex"), b"years of work");
}

#[test]
fn a_set_is_replaced_only_with_force() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let hash = |answer: &str| serde_json::from_str::<Value>(answer).unwrap()["set_hash"].clone();
    let first = hash(&room.succeed("render tiny.toml --json --out set").stdout);
    let refused = room.skiagraph(["render", "tiny.toml", "rig.ring.radius_m=4.0", "--out", "set"]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("set: a benchmark set exists here"), "{}", refused.stderr);
    let there = room.succeed("track set --tracker frozen --json --out run").stdout;
    assert_eq!(hash(&there), first, "the set that was there is still there");
    let second = hash(&room.succeed("render tiny.toml rig.ring.radius_m=4.0 --json --force --out set").stdout);
    assert_ne!(first, second);
    // the run of the other scenario is kept
    assert_eq!(room.entries(), ["run", "set", "set~", "tiny.toml"]);
    room.succeed("evaluate set~ run -q");
}

#[test]
fn render_writes_the_layers_of_a_scenario() {
    let room = Sandbox::new();
    room.write("plain.toml", TINY);
    room.write("tiny.toml", TINY.replace("seeds = 2", "seeds = 2\nlayers = [\"depth\", \"parts\"]"));
    let hash = |answer: &str| serde_json::from_str::<Value>(answer).unwrap()["set_hash"].clone();
    let plain = hash(&room.succeed("render plain.toml --json --out plain").stdout);
    assert_eq!(hash(&room.succeed("render tiny.toml --json --out set").stdout), plain);
    assert!(!room.path("plain/truth/layers").exists());
    for camera in ["cam00", "cam01"] {
        let picture = room.read(&format!("set/truth/layers/{camera}/000003.exr"));
        assert_eq!(picture[..4], [0x76, 0x2f, 0x31, 0x01], "the magic number of OpenEXR");
        let names = |name: &[u8]| picture.windows(name.len()).any(|bytes| bytes == name);
        assert!(names(b"depth.Z\0") && names(b"id.part\0"));
    }
    room.succeed("track set --tracker frozen --out run");
    room.succeed("evaluate set run");
}

#[test]
fn results_go_to_stdout_and_quiet_suppresses_notes() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let answer = room.succeed("run tiny.toml --json --quiet");
    assert_eq!(answer.stderr, "");
    let record: Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(record["schema"], "skiagraph.run/1");
    assert_eq!(answer.stdout.trim_end().as_bytes(), room.read("runs/tiny/run.json").trim_ascii_end());
}
