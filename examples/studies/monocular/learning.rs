//! Models learned from a scenario's training, how well they reconstruct it, and how long learning takes.

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use skiagraph::common::NoProgress;
use skiagraph::motion_model::gpdm_graph::GraphSettings;
use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;
use skiagraph::train::Models;

use super::best_latent::best_latent;

/// One GPDM of all training frames, and the graph.
#[derive(Serialize, Deserialize)]
pub(crate) struct Learning {
    pub(crate) frames: usize,
    pub(crate) recordings: usize,
    pub(crate) one: Learned,
    pub(crate) graph: Learned,
}

/// Models that were learned.
#[derive(Serialize, Deserialize)]
pub(crate) struct Learned {
    pub(crate) models: usize,
    /// Mean distance between recording and simulation (Eq. 9), rad^2 over all joints.
    pub(crate) reconstruction: f64,
    /// Processor time of the learning thread, seconds; wall-clock time if the system does not report it.
    pub(crate) seconds: f64,
    /// HumanEva error of the best latent point of every test frame at the true root, mm.
    pub(crate) best_latent_mm: f64,
}

/// Learns from a scenario's training.
pub(crate) fn learning(file: &ScenarioFile, mocap: &Path) -> Result<Learning, Box<dyn Error>> {
    let prepared = PreparedScene::new(file, Some(mocap))?;
    let one = GraphSettings { single: true, joint: true, ..GraphSettings::default() };
    let training = &prepared.start.training;
    Ok(Learning {
        frames: training.frames(),
        recordings: training.motions().len(),
        one: learned(&prepared, &one)?,
        graph: learned(&prepared, &GraphSettings::default())?,
    })
}

fn learned(prepared: &PreparedScene, settings: &GraphSettings) -> Result<Learned, Box<dyn Error>> {
    let begin = Stopwatch::start();
    let graph = Models::default().learn(settings, &prepared.start.body, &prepared.start.training, &NoProgress)?;
    let seconds = begin.elapsed().as_secs_f64();
    Ok(Learned {
        models: graph.segments.len(),
        reconstruction: graph.mean_reconstruction_error(),
        seconds,
        best_latent_mm: best_latent(prepared, &graph),
    })
}

/// Processor time of this thread; on a busy machine, wall-clock time means little.
struct Stopwatch {
    clock: Instant,
    processor: Option<Duration>,
}

impl Stopwatch {
    fn start() -> Self {
        Self { clock: Instant::now(), processor: processor_time() }
    }

    fn elapsed(&self) -> Duration {
        let processor = self.processor.zip(processor_time()).map(|(before, now)| now - before);
        processor.unwrap_or_else(|| self.clock.elapsed())
    }
}

/// Linux: the first number of the file is nanoseconds.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(text.split_whitespace().next()?.parse().ok()?))
}
