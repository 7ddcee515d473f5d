//! `skiagraph train`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::Destination;
use crate::common::ExperimentError;
use crate::scenario::ScenarioFile;
use crate::train::{ClipOptions, LearnedModel, TrainingInput, train as learn};
use skiagraph_track::motion_model::gpdm_graph::{GraphSettings, ModelKind};

/// Number of joints over which `[GPDM graph]` sums the distance that TH bounds.
const JOINTS_OF_GPDM_GRAPH_PAPER: f64 = 13.0;

/// Learn a motion model from recordings
///
/// An interrupted training saves its finished models in MODEL.partial; run the same command to resume.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph train embedded:walk --model gpdm-graph --out walk.model\n  \
                        skiagraph train ~/cmu/49/49_01.amc --model gpdm --first-frame 100 --last-frame 700 --out 49.model\n  \
                        skiagraph train walk.bvh run.bvh --model gpdm-graph --threshold 0.5 --out both.model\n  \
                        skiagraph train scenario.toml --model gpdm-graph --out graph.model\n  \
                        skiagraph inspect walk.model --out walk.html")]
pub(super) struct Arguments {
    /// A scenario (.toml), to learn its [training] clips on its tracker's body; or clips (.bvh, .amc, .c3d, .trc,
    /// DeepMimic .txt or .json, AMASS .npz, embedded:NAME)
    #[arg(value_name = "SCENARIO|CLIP", required = true)]
    inputs: Vec<PathBuf>,

    /// One model per recording (gpdm), or recordings cut into a graph of models (gpdm-graph)
    #[arg(long, value_enum)]
    model: ModelArgument,

    /// Output file; replaced if it holds the result of the same training
    #[arg(long, value_name = "MODEL")]
    out: PathBuf,

    /// Robot to retarget clips to: a built-in name or the path of a URDF [default: tracker40]
    #[arg(long, value_name = "ROBOT")]
    robot: Option<PathBuf>,

    /// Frame rate to resample clips to [default: 60]
    #[arg(long, value_name = "HZ")]
    fps: Option<f64>,

    /// First frame of each clip in the numbering of its file, from 1
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    first_frame: Option<u32>,

    /// Last frame of each clip, inclusive
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    last_frame: Option<u32>,

    /// Length of the clips' unit in metres, if the format does not define it and it cannot be guessed
    #[arg(long, value_name = "M")]
    metres_per_unit: Option<f64>,

    /// Dimensions of the latent space, 1 to 8
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=8))]
    dimensions: u8,

    /// Largest reconstruction error of a frame in a segment, rad^2 summed over 13 joints (TH in [GPDM graph], Table 1)
    #[arg(long, value_name = "TH", default_value_t = 1.0)]
    threshold: f64,

    /// Number of frames by which a segment grows [default: 0.5 s]
    #[arg(long, value_name = "N")]
    clip_length: Option<u32>,

    /// Directory to search recursively for clips [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,

    /// Move an existing file aside, to NAME~, if it is not from the same training
    #[arg(long)]
    force: bool,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ModelArgument {
    /// The original GPDM: one model per recording
    Gpdm,
    /// The GPDM graph; also written gpdm_graph, as in scenarios
    #[value(alias = "gpdm_graph")]
    GpdmGraph,
}

impl From<ModelArgument> for ModelKind {
    fn from(kind: ModelArgument) -> Self {
        match kind {
            ModelArgument::Gpdm => Self::Gpdm,
            ModelArgument::GpdmGraph => Self::GpdmGraph,
        }
    }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let progress = TerminalProgress::new(volume);
    let input = arguments.input()?;
    let rate = input.motions.first().map_or(60.0, |motion| motion.frames_per_second);
    let to = Destination { path: &arguments.out, force: arguments.force };
    let trained =
        learn(&input, &arguments.settings(rate)?, to, &progress).map_err(|e| e.about(&arguments.inputs[0]))?;
    drop(progress);
    volume.notes(&trained.notes);
    volume.written(&arguments.out);
    if arguments.json {
        output::print_json(&facts(&arguments.out, &trained.model))?;
    } else {
        let (path, graph) = (arguments.out.display(), &trained.model.graph);
        let frames: usize = graph.segments.iter().map(|s| s.errors.len()).sum();
        output::print(&format!(
            "{path}: {}, {} of {frames} frames, {}, mean reconstruction error {:.4} rad^2\n  next: skiagraph inspect \
            {path}",
            trained.model.facts.kind(),
            output::counted(graph.segments.len(), "model"),
            output::counted(graph.candidates.len(), "candidate"),
            graph.mean_reconstruction_error(),
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn facts(path: &Path, model: &LearnedModel) -> serde_json::Value {
    let frames: Vec<usize> = model.graph.segments.iter().map(|s| s.errors.len()).collect();
    json!({
        "schema": "skiagraph.train/1",
        "model": path.display().to_string(),
        "facts": model.facts,
        "frames": frames,
        "candidates": model.graph.candidates.len(),
        "mean_reconstruction_error_rad2": model.graph.mean_reconstruction_error(),
    })
}

impl Arguments {
    fn input(&self) -> Result<TrainingInput, ExperimentError> {
        let mocap = self.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from));
        let is_scenario = |input: &PathBuf| input.extension().is_some_and(|e| e == "toml");
        if !self.inputs.iter().any(is_scenario) {
            let options = ClipOptions {
                robot: self.robot.clone().unwrap_or_else(|| PathBuf::from("tracker40")),
                frames_per_second: self.fps.unwrap_or(60.0),
                first_frame: self.first_frame.map(|n| n as usize),
                last_frame: self.last_frame.map(|n| n as usize),
                metres_per_unit: self.metres_per_unit,
            };
            return TrainingInput::from_clips(&self.inputs, &options, mocap.as_deref());
        }
        if self.inputs.len() > 1 {
            let detail = "expected one scenario, or clips only; found both or several scenarios".to_owned();
            return Err(ExperimentError::Argument { argument: "SCENARIO|CLIP", detail });
        }
        let of_clips = [
            ("--robot", self.robot.is_some()),
            ("--fps", self.fps.is_some()),
            ("--first-frame", self.first_frame.is_some()),
            ("--last-frame", self.last_frame.is_some()),
            ("--metres-per-unit", self.metres_per_unit.is_some()),
        ];
        if let Some((argument, _)) = of_clips.into_iter().find(|(_, given)| *given) {
            let detail = "only valid with clips; set it in the scenario instead".to_owned();
            return Err(ExperimentError::Argument { argument, detail });
        }
        let file = ScenarioFile::open(&self.inputs[0], &[])?;
        TrainingInput::from_scenario(&file, mocap.as_deref()).map_err(|e| e.about(&file.origin))
    }

    fn settings(&self, frames_per_second: f64) -> Result<GraphSettings, ExperimentError> {
        let mut settings = GraphSettings::from_kind(self.model.into());
        settings.training.latent_dimensions = usize::from(self.dimensions);
        if !(self.threshold > 0.0 && self.threshold.is_finite()) {
            let detail = format!("expected a number above zero (rad^2), found {}", self.threshold);
            return Err(ExperimentError::Argument { argument: "--threshold", detail });
        }
        settings.threshold_per_joint = self.threshold / JOINTS_OF_GPDM_GRAPH_PAPER;
        if let Some(frames) = self.clip_length {
            let least = u32::from(self.dimensions).max(2) + 1;
            let most = (60.0 * frames_per_second) as u32;
            if !(least..=most).contains(&frames) {
                let detail = format!("expected {least} to {most} frames, found {frames}");
                return Err(ExperimentError::Argument { argument: "--clip-length", detail });
            }
            settings.clip_s = f64::from(frames) / frames_per_second;
        }
        Ok(settings)
    }
}
