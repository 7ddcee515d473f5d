//! The shipped scenarios, their documentation, and output about them.

use std::path::PathBuf;

use serde_json::Value;

use crate::sandbox::{Sandbox, shipped};

fn toml_files(folders: &[&str]) -> Vec<PathBuf> {
    let of = |folder: &&str| std::fs::read_dir(shipped(folder)).unwrap().map(|entry| entry.unwrap().path());
    let found: Vec<PathBuf> =
        folders.iter().flat_map(of).filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    assert!(found.len() >= 6, "{found:?}");
    found
}

fn shipped_scenarios() -> Vec<PathBuf> {
    toml_files(&["scenarios", "scenarios/smoke", "scenarios/cmu", "scenarios/plausibility", "scenarios/monocular"])
}

#[test]
fn every_shipped_sweep_is_valid() {
    let room = Sandbox::new();
    for sweep in toml_files(&["scenarios/sweeps", "scenarios/suites/hard"]) {
        room.says(&format!("check {}", sweep.display()), &[" is valid: "]);
    }
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
fn the_oracle_is_measured_exactly() {
    let room = Sandbox::new();
    room.succeed(&format!("run {} --out oracle", shipped("scenarios/smoke/oracle.toml").display()));
    assert!((room.mean("oracle", "humaneva_mm") - 50.0).abs() < 1e-9);
    assert!(room.mean("oracle", "mpjpe_root_mm") < 1e-9);
    assert_eq!(room.json("oracle/run.json")["matched"], true);
}

#[test]
fn filter_beats_standing_still() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/smoke/matched.toml").display().to_string();
    let record = room.json_of(&format!("run {scenario} --json --out matched"));
    let error = record["metrics"]["humaneva_mm"]["mean"].as_f64().unwrap();
    let frozen = record["frozen"]["humaneva_mm"].as_f64().unwrap();
    assert!(error < 60.0 && frozen > 2.0 * error, "{error} mm against {frozen} mm");
}

#[test]
fn methods_are_complete_runs() {
    let room = Sandbox::new();
    let scenario = shipped("scenarios/smoke/latent.toml").display().to_string();
    let comparison = room.json_of(&format!("run {scenario} --json --quiet --out all"));
    assert_eq!(comparison["schema"], "skiagraph.comparison/1");
    let methods = comparison["methods"].as_object().unwrap();
    assert_eq!(methods["graph_oracle_roots"]["given_roots"], true);
    for (name, method) in methods {
        let record: Value = room.json(&format!("all/{name}/run.json"));
        assert_eq!(record["metrics"], method["metrics"], "{name}");
        assert!(room.path(format!("all/{name}/report.html")).exists());
    }
    let page = room.text("all/comparison.html");
    assert!(methods.keys().all(|name| page.contains(&format!("{name}&#x2f;report.html"))));
    room.succeed(&format!("render {scenario} --out set"));
    room.succeed("track set --tracker gpdm_graph particles=50 model.training.rounds=2 --out alone");
    room.succeed("evaluate set alone");
    let alone: Value = room.json("alone/run.json");
    assert_eq!(alone["metrics"], methods["graph"]["metrics"], "blindfolded, by way of a set on disk");
}

#[test]
fn results_go_to_standard_output() {
    let room = Sandbox::tiny();
    let answer = room.succeed("run tiny.toml --json --quiet");
    assert_eq!(answer.stderr, "");
    assert_eq!(answer.json()["schema"], "skiagraph.run/1");
    assert_eq!(answer.stdout.trim_end().as_bytes(), room.read("runs/tiny/run.json").trim_ascii_end());
}
