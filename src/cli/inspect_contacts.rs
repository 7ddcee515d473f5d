//! `skiagraph inspect MOTION --contacts` as text.

use std::path::Path;

use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::Destination;
use crate::inspect::{ContactSummary, inspect_contacts};
use skiagraph_truth::mocap::ReadOptions;

/// Prints the ground contact of a motion; `picture` is the chart over time.
pub(super) fn run(
    name: &Path,
    reading: &ReadOptions,
    picture: Option<Destination<'_>>,
    json: bool,
    volume: Volume,
) -> Result<(), CommandError> {
    let summary = inspect_contacts(name, reading, picture).map_err(|e| e.about(name))?;
    volume.notes(&summary.notes);
    picture.iter().for_each(|to| volume.written(to.path));
    output::print_as(json, &summary, describe)?;
    Ok(())
}

fn describe(s: &ContactSummary) -> String {
    let mut text = format!(
        "{}: {} frames at {} Hz on {}\n  standing  {:.0} % of the frames\n  skate     {:.1} mm/s, mean over standing \
        feet\n  sinks     at most {:.1} mm into the ground\n  floats    at most {:.1} mm above it while standing",
        s.name,
        s.frames,
        s.frames_per_second,
        s.body,
        100.0 * s.standing,
        s.skate_mm_per_s,
        s.penetration_mm,
        s.float_mm,
    );
    for w in &s.worst {
        text.push_str(&format!(
            "\n  worst     {} {:.1} {}: {}, frame {} from 0 ({:.2} s)",
            w.fault, w.value, w.unit, w.part, w.frame, w.time_s
        ));
    }
    text.push_str("\n\n  foot        from 0          s   slip mm  deepest mm  highest mm");
    for stance in &s.stances {
        let frames = format!("{} to {}", stance.first, stance.last);
        text.push_str(&format!(
            "\n  {:<10}  {frames:<12}  {:>5.2}  {:>7.1}  {:>10.1}  {:>10.1}",
            stance.foot, stance.seconds, stance.slip_mm, stance.deepest_mm, stance.highest_mm
        ));
    }
    if s.stances.is_empty() {
        text.push_str("\n  no stances");
    }
    text
}
