//! Measures estimates from another source: marker positions of several seeds, compared with the true ones.
//!
//! ```sh
//! cargo run --release --example measure_estimates
//! ```

use std::error::Error;

use skiagraph::nalgebra::Vector3;
use skiagraph_core::body::{LANDMARKS, Markers, shipped};
use skiagraph_eval::{SeedRun, Sequence, evaluate, summarise};

fn main() -> Result<(), Box<dyn Error>> {
    let body = shipped("tracker25")?;
    // the truth: a body that moves at 1 m/s, 60 frames a second
    let markers_at = |metres: f64| -> Markers {
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.vector = Vector3::new(metres, 0.0, 0.95);
        body.markers(&body.link_frames(&pose))
    };
    let truth: Vec<Markers> = (0..60).map(|frame| markers_at(frame as f64 / 60.0)).collect();

    // estimates of four seeds, each of which lags behind; one frame has no estimate
    let mut evaluations = Vec::new();
    for seed in 0..4_u64 {
        let lag_m = 0.010 + 0.002 * seed as f64;
        let mut estimate: Vec<Markers> = (0..60).map(|frame| markers_at(frame as f64 / 60.0 - lag_m)).collect();
        estimate[7] = [None; LANDMARKS.len()];
        evaluations.push(evaluate(&Sequence::from_markers(60.0, &truth, &estimate))?);
    }

    let runs: Vec<SeedRun<'_>> =
        (0..).zip(&evaluations).map(|(seed, e)| SeedRun { clip: "slide", seed, evaluation: e }).collect();
    let summary = summarise(&runs)?;
    let error = &summary.metrics["humaneva_mm"];
    println!("HumanEva error {:.1} mm", error.mean);
    if let Some(interval) = error.ci95 {
        println!("95 % interval over seeds {:.1} to {:.1} mm", interval.low, interval.high);
    }
    println!("answered frames: {:.1} %", 100.0 * error.coverage);
    Ok(())
}
