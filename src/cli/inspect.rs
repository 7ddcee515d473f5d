//! `skiagraph inspect`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::{CommandError, output};
use crate::experiment::{ModelSummary, inspect_model};

/// Say what a model file holds
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph inspect walk.model\n  skiagraph inspect walk.model --json\n  \
                        skiagraph inspect graph.model --against single.model")]
pub(super) struct Arguments {
    /// A model of skiagraph train
    #[arg(value_name = "MODEL")]
    model: PathBuf,

    /// Another model of the same motions, whose reconstruction error is put beside
    #[arg(long, value_name = "MODEL")]
    against: Option<PathBuf>,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let summary = inspect_model(&arguments.model, arguments.against.as_deref())?;
    if arguments.json {
        output::print_json(&summary)?;
    } else {
        output::print(&in_words(&arguments.model, &summary))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn in_words(path: &Path, s: &ModelSummary) -> String {
    let facts = &s.facts;
    let mut text = format!(
        "{}: {}, {} models, {} candidates, {} inter-transitions\n  robot    {}\n  rate     {} Hz",
        path.display(),
        facts.kind(),
        s.models.len(),
        s.candidates,
        s.inter_transitions,
        facts.robot.name,
        facts.frames_per_second,
    );
    for from in &facts.learned_from {
        text.push_str(&format!("\n  learned  {}, {} frames", from.clip, from.frames));
    }
    let error = &s.reconstruction_error_rad2;
    text.push_str(&format!(
        "\n  error    mean {:.4} rad^2, max {:.4} rad^2 between recording and simulation",
        error.mean, error.max
    ));
    if let Some(other) = &s.against {
        let (kind, mean) = (other.kind, other.reconstruction_error_rad2.mean);
        text.push_str(&format!(
            "\n  against  {kind}: mean {mean:.4} rad^2; this is {:.1} % of it",
            100.0 * other.ratio
        ));
    }
    text.push_str("\n\n  model  motion  first  frames  mean rad^2  max rad^2");
    for (index, model) in s.models.iter().enumerate() {
        let error = &model.reconstruction_error_rad2;
        text.push_str(&format!(
            "\n  {index:>5}  {:>6}  {:>5}  {:>6}  {:>10.4}  {:>9.4}",
            model.motion, model.first, model.frames, error.mean, error.max
        ));
    }
    text
}
