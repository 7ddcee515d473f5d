//! `skiagraph inspect MOTION --contacts`, in words.

use std::path::Path;

use super::{CommandError, output};
use crate::experiment::{ContactSummary, inspect_contacts};

/// Says how a motion stands on the ground; `picture` shows it over time.
pub(super) fn run(name: &str, picture: Option<&Path>, json: bool) -> Result<(), CommandError> {
    let summary = inspect_contacts(name, picture)?;
    if json {
        output::print_json(&summary)?;
    } else {
        output::print(&in_words(&summary))?;
    }
    Ok(())
}

fn in_words(s: &ContactSummary) -> String {
    let mut text = format!(
        "{}: {} frames at {} Hz on {}\n  standing  {:.0} % of the frames\n  skate     {:.1} mm/s, mean over standing feet\n  sinks     \
         {:.1} mm at most\n  floats    {:.1} mm at most while standing",
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
            "\n  worst     {} {:.1} {}: {}, frame {} ({:.2} s)",
            w.fault, w.value, w.unit, w.part, w.frame, w.time_s
        ));
    }
    text.push_str("\n\n  foot        frames          s   slip mm  deepest mm  highest mm");
    for stance in &s.stances {
        let frames = format!("{} to {}", stance.first, stance.last);
        text.push_str(&format!(
            "\n  {:<10}  {frames:<12}  {:>5.2}  {:>7.1}  {:>10.1}  {:>10.1}",
            stance.foot, stance.seconds, stance.slip_mm, stance.deepest_mm, stance.highest_mm
        ));
    }
    if s.stances.is_empty() {
        text.push_str("\n  no foot ever stands");
    }
    text
}
