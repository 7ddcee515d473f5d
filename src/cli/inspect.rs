//! `skiagraph inspect`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::folders::expect_set;
use super::inspect_text::describe;
use super::volume::Volume;
use super::{CommandError, inspect_contacts, inspect_scenario, output};
use crate::artefacts::Destination;
use crate::common::ExperimentError;
use crate::inspect::{InspectOptions, Inspected, inspect, is_skin_file};
use crate::scenario::SolidsSource;
use skiagraph_truth::mocap::ReadOptions;

/// Describe a model, a recording, a robot, a skin, a scenario's motion or a benchmark set
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph inspect walk.model --out walk.svg\n  \
                        skiagraph inspect graph.model --against single.model --out graph.svg\n  \
                        skiagraph inspect 01_01.bvh --out clip.png\n  skiagraph inspect tracker25 --out robot.png\n  \
                        skiagraph inspect robot.urdf --solids from_joints --out robot.png\n  \
                        skiagraph inspect figure.glb --out skin.png\n  \
                        skiagraph inspect sets/walk --out set.html\n  \
                        skiagraph inspect embedded:walk --contacts --out walk.svg\n  \
                        skiagraph inspect scenarios/editing/long_walk.toml --out motion.svg")]
pub(super) struct Arguments {
    /// A model from skiagraph train; a recording (.bvh, .amc, .c3d, .trc, DeepMimic .txt or .json, AMASS .npz,
    /// embedded:NAME); a robot (.urdf, or a built-in one); a skin (.glb, .gltf, .vrm, .toml, or a built-in one); a
    /// scenario (.toml), to show its edited motion; the directory of a benchmark set
    #[arg(value_name = "MODEL|CLIP|ROBOT|SKIN|SCENARIO|SET")]
    pub(super) what: PathBuf,

    /// Overrides of the scenario's keys
    #[arg(value_name = "KEY=VALUE")]
    pub(super) overrides: Vec<String>,

    /// Directory to search recursively for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    pub(super) mocap_dir: Option<PathBuf>,

    /// Another model of the same motions, to compare reconstruction errors
    #[arg(long, value_name = "MODEL")]
    pub(super) against: Option<PathBuf>,

    /// Analyse ground contact of a recording, retargeted to the robot `actor`, or of a set's ground truth: stances,
    /// slips, gaps, worst frames
    #[arg(long, conflicts_with = "against")]
    contacts: bool,

    /// Write a picture: of a robot, recording or skin, several poses from several sides with joint limits (.png); of a
    /// model, errors over frames (.svg); with --contacts, stances and gaps over time (.svg); of a scenario, the same
    /// with its seams (.svg). For a set, a page: every frame of every camera with the true skeleton (.html)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Length of the recording's unit in metres, if the format does not define it and it cannot be guessed
    #[arg(long, value_name = "M")]
    pub(super) metres_per_unit: Option<f64>,

    /// Whose motion is read from a recording of several subjects, or which of several animations, like `subject` in a
    /// scenario
    #[arg(long, value_name = "NAME")]
    subject: Option<String>,

    /// Solids of a robot to draw: the geometry in its file, or capsules between joints, like `solids = "from_joints"`
    /// in a scenario [default: urdf]
    #[arg(long, value_name = "SOURCE")]
    solids: Option<ShownSolids>,

    /// Move an existing file at --out aside, to NAME~, if skiagraph did not write it
    #[arg(long, requires = "out")]
    force: bool,

    /// Make a coarse page of a set, below 200 kB, which fits into another page such as a notebook
    #[arg(long, requires = "out")]
    small: bool,

    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Which solids of a robot are drawn.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
enum ShownSolids {
    /// Geometry in its file
    Urdf,
    /// Capsules between joints
    FromJoints,
}

impl ShownSolids {
    fn source(self) -> SolidsSource {
        match self {
            Self::Urdf => SolidsSource::Urdf,
            Self::FromJoints => SolidsSource::FromJoints,
        }
    }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let to = arguments.out.as_deref().map(|path| Destination { path, force: arguments.force });
    let is_toml = arguments.what.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let is_scenario = is_toml && !is_skin_file(&arguments.what);
    if is_scenario && !arguments.contacts {
        let of_others = [
            ("--against", arguments.against.is_some()),
            ("--metres-per-unit", arguments.metres_per_unit.is_some()),
            ("--subject", arguments.subject.is_some()),
        ];
        if let Some((argument, _)) = of_others.into_iter().find(|(_, given)| *given) {
            let detail = format!("not valid with a scenario, and {} is a scenario", arguments.what.display());
            return Err(ExperimentError::Argument { argument, detail }.into());
        }
        let scenario = inspect_scenario::InspectedScenario {
            file: &arguments.what,
            overrides: &arguments.overrides,
            mocap_dir: arguments.mocap_dir.clone(),
            json: arguments.json,
        };
        return inspect_scenario::run(&scenario, to, volume);
    }
    for (argument, given) in
        [("KEY=VALUE", !arguments.overrides.is_empty()), ("--mocap-dir", arguments.mocap_dir.is_some())]
    {
        if given {
            let detail = format!("only valid with a scenario, and {} is not a scenario", arguments.what.display());
            return Err(ExperimentError::Argument { argument, detail }.into());
        }
    }
    if arguments.contacts {
        let (metres_per_unit, subject) = (arguments.metres_per_unit, arguments.subject.clone());
        let reading = ReadOptions { metres_per_unit, subject, ..ReadOptions::default() };
        inspect_contacts::run(&arguments.what, &reading, to, arguments.json, volume)?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.what.is_dir() {
        expect_set(&arguments.what)?;
    }
    let options = InspectOptions {
        metres_per_unit: arguments.metres_per_unit,
        subject: arguments.subject.as_deref(),
        against: arguments.against.as_deref(),
        solids: arguments.solids.map_or_else(SolidsSource::default, ShownSolids::source),
        small: arguments.small,
    };
    let found = inspect(&arguments.what, &options, to).map_err(|e| e.about(&arguments.what))?;
    let is_drawn = !matches!(&found, Inspected::Clip(clip) if clip.fit.is_none());
    let page = arguments.out.as_ref().filter(|_| is_drawn);
    page.iter().for_each(|page| volume.written(page));
    if arguments.json {
        output::print_json(&found)?;
    } else {
        output::print(&describe(&arguments.what.display().to_string(), &found))?;
        if let Some(page) = page {
            output::print(&format!("\n  picture: {}", page.display()))?;
        }
    }
    let sound = !matches!(&found, Inspected::Set(set) if !set.hashes_ok);
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
