//! The memory of `render` that `check` estimates.

use serde_json::Value;
use std::fs;
use std::time::Duration;

use crate::sandbox::Sandbox;

/// Peak memory of a successful command, bytes, as reported by the system.
fn peak_of(room: &Sandbox, arguments: &str) -> f64 {
    let mut child = room.start(arguments);
    let mut peak = 0.0;
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok());
        peak = kib.map_or(peak, |kib| 1024.0 * kib);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{arguments}");
            return peak;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Of segmented silhouettes, within a quarter, at sizes that the formula was not fitted to.
#[cfg(target_os = "linux")]
#[test]
fn memory_is_predicted() {
    let room = Sandbox::tiny();
    // the estimate was fitted at 640 x 480 and 1280 x 960 pixels and 6 background frames
    for (size, cameras, frames) in [("[800,600]", 4, 6), ("[1120,840]", 2, 12)] {
        let settings = format!(
            "tiny.toml observation.silhouette=segmented observation.images.background_frames={frames} rig.ring.count={cameras} \
             rig.ring.size_px={size} motion.last_frame=2 --threads 2"
        );
        let told: Value = room.json_of(&format!("check {settings} --json"));
        let told = told["cost"]["render_memory_bytes"].as_f64().unwrap();
        let peak = peak_of(&room, &format!("render {settings} --quiet --out set{cameras}"));
        assert!((told / peak - 1.0).abs() < 0.25, "{size} x {cameras}: told {told:e}, was {peak:e}");
    }
}
