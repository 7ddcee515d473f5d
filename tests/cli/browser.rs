//! The pages in headless Chromium.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};
use crate::support::{python_with_numpy, skip};

/// `$SKIAGRAPH_TEST_CHROMIUM`, else the first browser found; `None` (with the message of `skip`) if there is none.
fn chromium() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let folders: Vec<PathBuf> =
        std::env::var_os("PATH").map(|paths| std::env::split_paths(&paths).collect()).unwrap_or_default();
    let places = folders.iter().flat_map(|folder| names.map(|name| folder.join(name)));
    let found = std::env::var_os("SKIAGRAPH_TEST_CHROMIUM").map(PathBuf::from).into_iter().chain(places);
    let found = found.into_iter().find(|path| path.is_file());
    if found.is_none() {
        skip("no Chromium (apt-get install chromium, or set SKIAGRAPH_TEST_CHROMIUM)");
    }
    found
}

/// Browses pages; returns one object per page.
pub(super) fn browse(room: &Sandbox, pages: &[&str]) -> Option<Vec<Value>> {
    let (chromium, python) = (chromium()?, python_with_numpy()?);
    let output = Command::new(&python)
        .arg(shipped("tests/interop/browse_report.py"))
        .arg(&chromium)
        .args(pages.iter().map(|page| room.path(page)))
        .output()
        .unwrap();
    if output.status.code() == Some(3) {
        skip(&format!("no Playwright for {} (pip install playwright)", python.display()));
        return None;
    }
    let (said, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}\n{errors}");
    Some(said.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

/// Without network, error or sideways scrolling.
#[test]
fn pages_work_in_a_browser() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY.replace("last_frame = 3", "last_frame = 12"));
    room.succeed("run tiny.toml --out run");
    let methods = TINY
        .replace("[tracker.annealed_particle_filter]", "[methods.a.frozen]\n[methods.filter.annealed_particle_filter]");
    room.write("methods.toml", methods);
    room.succeed("run methods.toml --seeds 3 --out methods");
    room.succeed("run tiny.toml particles=20 --out other");
    room.succeed("compare run other --html difference.html");
    room.succeed("sweep tiny.toml particles=6,12,18 rig.ring.count=1,2 --out sweep -j 2");
    room.succeed("report sweep");
    let all = ["run/report.html", "methods/comparison.html", "difference.html", "sweep/report.html"];
    let Some(pages) = browse(&room, &all) else { return };
    for page in &pages {
        assert_eq!(page["wrong"], serde_json::json!([]), "{page}");
    }
    let run: Value = room.json("run/run.json");
    for size in ["playback_broad", "playback_phone"] {
        assert_eq!(pages[0][size]["frames"], run["frames"], "every frame of the run: {}", pages[0]);
        assert_eq!(pages[0][size]["views"], 2);
        assert!(pages[0][size]["plots"].as_u64().unwrap() >= 3, "{}", pages[0]);
    }
}
