//! `skiagraph inspect`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::file_access::FileAccess;
use super::folders::expect_set;
use super::inspect_words::in_words;
use super::volume::Volume;
use super::{CommandError, inspect_contacts, inspect_scenario, output};
use crate::experiment::{Destination, ExperimentError, Inspected, inspect, is_skin_file};

/// Describe a model, a recording, a robot, a skin, a scenario's motion or a benchmark set
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph inspect walk.model --out walk.html\n  \
                        skiagraph inspect graph.model --against single.model --out graph.html\n  \
                        skiagraph inspect 01_01.bvh --out clip.png\n  skiagraph inspect tracker25 --out robot.html\n  \
                        skiagraph inspect figure.glb --out skin.png\n  \
                        skiagraph inspect sets/walk\n  \
                        skiagraph inspect embedded:walk --contacts --out walk.svg\n  \
                        skiagraph inspect scenarios/editing/long_walk.toml --out strip.png")]
pub(super) struct Arguments {
    /// A model of skiagraph train; a recording (.bvh, .amc, .c3d, .trc, DeepMimic .txt or .json, embedded:NAME); a
    /// robot (.urdf, or a built-in one); a skin (.glb, .gltf, .toml, or a built-in one); a scenario (.toml), for the
    /// motion that it makes of its recordings; the directory of a benchmark set
    #[arg(value_name = "MODEL|CLIP|ROBOT|SKIN|SCENARIO|SET")]
    pub(super) what: PathBuf,

    /// Overrides of the scenario's keys
    #[arg(value_name = "KEY=VALUE")]
    pub(super) overrides: Vec<String>,

    /// Directory that is searched, with its subdirectories, for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    pub(super) mocap_dir: Option<PathBuf>,

    /// Another model of the same motions, to compare reconstruction errors with
    #[arg(long, value_name = "MODEL")]
    pub(super) against: Option<PathBuf>,

    /// Analyse ground contact of a recording, retargeted to the robot `actor`, or of a set's ground truth: stances,
    /// slips, gaps, worst frames
    #[arg(long, conflicts_with = "against")]
    contacts: bool,

    /// Write pictures. Of a model an HTML page: latent spaces, errors over frames, distances between frames; of a
    /// robot, recording or skin a picture, .png, or a page, .html: turned about, in some poses, limits of its joints;
    /// with --contacts a chart, .svg or .html; of a scenario a strip of its motion with stances and seams, .png
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Length of the recording's unit in metres, if the format does not define it and it cannot be guessed
    #[arg(long, value_name = "M")]
    pub(super) metres_per_unit: Option<f64>,
    /// Move an existing file at --out that skiagraph did not write aside, to NAME~
    #[arg(long, requires = "out")]
    force: bool,

    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    access: FileAccess,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let to = arguments.out.as_deref().map(|path| Destination { path, force: arguments.force });
    let is_toml = arguments.what.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let is_scenario = is_toml && !is_skin_file(&arguments.what);
    if is_scenario && !arguments.contacts {
        let of_others =
            [("--against", arguments.against.is_some()), ("--metres-per-unit", arguments.metres_per_unit.is_some())];
        if let Some((argument, _)) = of_others.into_iter().find(|(_, given)| *given) {
            let detail = format!("is not for scenarios, and {} is one", arguments.what.display());
            return Err(ExperimentError::Argument { argument, detail }.into());
        }
        let scenario = inspect_scenario::InspectedScenario {
            file: &arguments.what,
            overrides: &arguments.overrides,
            mocap_dir: arguments.mocap_dir.clone(),
            json: arguments.json,
            access: arguments.access,
        };
        return inspect_scenario::run(&scenario, to, volume);
    }
    for (argument, given) in
        [("KEY=VALUE", !arguments.overrides.is_empty()), ("--mocap-dir", arguments.mocap_dir.is_some())]
    {
        if given {
            let detail = format!("is for scenarios only, and {} is not one", arguments.what.display());
            return Err(ExperimentError::Argument { argument, detail }.into());
        }
    }
    if arguments.contacts {
        let unit = arguments.metres_per_unit;
        inspect_contacts::run(&arguments.what, unit, to, arguments.json, volume)?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.what.is_dir() {
        expect_set(&arguments.what)?;
    }
    let found = inspect(
        &arguments.what,
        arguments.metres_per_unit,
        arguments.against.as_deref(),
        to,
        arguments.access.allow_outside,
    )
    .map_err(|e| e.about(&arguments.what))?;
    let is_drawn = !matches!(&found, Inspected::Clip(clip) if clip.fit.is_none());
    let page = arguments.out.as_ref().filter(|_| is_drawn);
    page.iter().for_each(|page| volume.written(page));
    if arguments.json {
        output::print_json(&found)?;
    } else {
        output::print(&in_words(&arguments.what.display().to_string(), &found))?;
        if let Some(page) = page {
            output::print(&format!("\n  pictures: {}", page.display()))?;
        }
    }
    let sound = !matches!(&found, Inspected::Set(set) if !set.hashes_ok);
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
