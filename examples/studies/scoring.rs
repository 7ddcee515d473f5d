//! Time and memory for scoring a long estimate; prints only. `SKIAGRAPH_FRAMES` is the number of frames (default one
//! million). Takes a minute or two. The numbers are in `results/speed.md`.

use std::error::Error;
use std::time::Instant;

use nalgebra::Vector3;
use skiagraph::body::{Markers, shipped};
use skiagraph::evaluation::{PackedMarkers, Sequence, evaluate};

/// A body that walks in place, and an estimate whose error varies by centimetres.
pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let frames: usize = std::env::var("SKIAGRAPH_FRAMES").ok().map_or(Ok(1_000_000), |text| text.parse())?;
    let body = shipped("tracker25")?;
    let standing = body.markers(&body.link_frames(&body.zero_pose()));
    let moved = |frame: usize, error: f64| -> Markers {
        let (time, mut marker) = (frame as f64 / 60.0, 0.0);
        standing.map(|place| {
            marker += 1.0;
            let sway = 0.3 * libm::sin(6.0 * time + marker) + error * libm::sin(0.7 * time + 1.7 * marker);
            place.map(|place| place + Vector3::new(sway, error * libm::cos(0.9 * time + marker), 0.1 * sway))
        })
    };
    let truth: PackedMarkers = (0..frames).map(|frame| moved(frame, 0.0)).collect();
    let estimate: PackedMarkers = (0..frames).map(|frame| moved(frame, 0.02)).collect();
    let (given, begin) = (peak_memory_mib(), Instant::now());
    let evaluation = evaluate(&Sequence::from_markers(60.0, &truth, &estimate))?;
    println!(
        "{frames} frames: {} metrics in {:.1} s; markers of truth and estimate {given} MiB, at most {} MiB in all; HumanEva {:.3} mm",
        evaluation.metrics.len(),
        begin.elapsed().as_secs_f64(),
        peak_memory_mib(),
        evaluation.metrics["humaneva_mm"].mean
    );
    Ok(())
}

/// Peak memory of the process, MiB; 0 if the system does not report it.
fn peak_memory_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|number| number.parse::<u64>().ok()).unwrap_or(0) / 1024
}
