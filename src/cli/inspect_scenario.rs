//! `skiagraph inspect SCENARIO` as text.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::output::counted;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::Destination;
use crate::common::ExperimentError;
use crate::inspect::{EditedSummary, inspect_scenario};
use crate::scenario::ScenarioFile;

/// Arguments of `skiagraph inspect SCENARIO`.
pub(super) struct InspectedScenario<'a> {
    pub(super) file: &'a Path,
    pub(super) overrides: &'a [String],
    pub(super) mocap_dir: Option<PathBuf>,
    pub(super) json: bool,
}

/// Prints a summary of a scenario's edited motion; `picture` shows its contacts and seams.
pub(super) fn run(
    arguments: &InspectedScenario<'_>,
    picture: Option<Destination<'_>>,
    volume: Volume,
) -> Result<ExitCode, CommandError> {
    let file = ScenarioFile::open(arguments.file, arguments.overrides).map_err(ExperimentError::from)?;
    let mocap = arguments.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from));
    let summary = inspect_scenario(&file, mocap.as_deref(), picture)?;
    picture.iter().for_each(|to| volume.written(to.path));
    output::print_as(arguments.json, &summary, describe)?;
    Ok(ExitCode::SUCCESS)
}

fn describe(s: &EditedSummary) -> String {
    let mut text = format!(
        "{}: {} frames at {} Hz, {:.2} s, {:.2} m along the ground, on {}\n  fit       {:.1} mm from the first take",
        s.name, s.frames, s.frames_per_second, s.duration_s, s.path_m, s.body, s.retarget_residual_mm,
    );
    for take in &s.takes {
        text.push_str(&format!("\n  take      {take}"));
    }
    for seam in &s.seams {
        let slip = seam.slip_mm_per_s.map_or("no foot stands".to_owned(), |slip| format!("feet skate {slip:.1} mm/s"));
        text.push_str(&format!(
            "\n  seam      frames {} to {}, from 0: `{}` to `{}`, {:.0} mm apart, {slip}",
            seam.first, seam.last, seam.from, seam.to, seam.distance_mm
        ));
    }
    if let Some(contact) = &s.contact {
        text.push_str(&format!(
            "\n  standing  {:.0} % of the frames; feet skate {:.1} mm/s on average, {:.1} in the worst stance\n  ground    at most \
             {:.1} mm into it, {:.1} mm above it while standing",
            100.0 * contact.standing,
            contact.skate_mm_per_s,
            contact.worst_stance_mm_per_s,
            contact.penetration_mm,
            contact.float_mm
        ));
    }
    if let Some(fastest) = &s.fastest {
        text.push_str(&format!(
            "\n  fastest   {} with {:.1} rad/s into frame {}",
            fastest.name, fastest.speed, fastest.frame
        ));
    }
    if !s.limits_hit.is_empty() {
        let named = s.limits_hit.iter().take(8).map(|(name, frames)| format!("{name} in {frames} frames"));
        let named: Vec<String> = named.collect();
        text.push_str(&format!(
            "\n  limits    {} at a limit: {}",
            counted(s.limits_hit.len(), "joint angle"),
            named.join(", ")
        ));
    }
    for note in &s.notes {
        text.push_str(&format!("\n  note      {note}"));
    }
    text
}
