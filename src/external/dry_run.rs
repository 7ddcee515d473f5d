//! Whether a program follows the protocol: a few frames, and how it answered them.

use serde::Serialize;

use super::answers::estimates;
use super::record::ProgramSettings;
use super::session::{Exchange, Session};
use super::start_check::StartDistance;
use super::workplace::Workplace;
use crate::benchmark_set::BlindSet;
use crate::common::{ExperimentError, Progress};

/// Frames that are asked for.
const FRAMES: usize = 5;

/// What a dry run found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Conformance {
    /// `skiagraph.conformance/1`.
    pub schema: String,
    /// What the program calls itself.
    pub name: Option<String>,
    /// Check by check.
    pub checks: Vec<ProtocolCheck>,
    /// Greatest time for a frame, milliseconds.
    pub slowest_ms: f64,
}

/// One requirement of the protocol.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProtocolCheck {
    /// What is required.
    pub what: &'static str,
    /// Whether it holds.
    pub holds: bool,
    /// What was found.
    pub found: String,
}

impl Conformance {
    /// Whether everything holds.
    pub fn holds(&self) -> bool {
        self.checks.iter().all(|check| check.holds)
    }
}

/// Runs a program for a few frames and checks what it says.
///
/// # Errors
/// [`ExperimentError`] if it cannot be started, never becomes ready, or the set cannot be read.
pub fn dry_run(
    set: &BlindSet,
    settings: &ProgramSettings,
    progress: &dyn Progress,
) -> Result<Conformance, ExperimentError> {
    let place = Workplace::new(set)?;
    let mut session = Session::new(set, &place, settings, 0, progress);
    session.start(0)?;
    let mut asked = Vec::new();
    for frame in 0..FRAMES.min(set.frame_count) {
        asked.push(session.frame(&set.observation(frame)?)?);
    }
    let incidents: Vec<String> = session.incidents.iter().map(|incident| incident.in_words()).collect();
    session.end();
    let answered = asked.iter().filter(|asked| !asked.failed).count();
    let with_pose = asked.iter().filter(|asked| has_pose(asked)).count();
    let mut checks = vec![
        ProtocolCheck { what: "answers hello with ready", holds: true, found: "ready".to_owned() },
        ProtocolCheck {
            what: "answers every frame in time, in order, with what makes sense",
            holds: answered == asked.len(),
            found: match incidents.first() {
                None => format!("{answered} of {} frames", asked.len()),
                Some(first) => format!("{answered} of {} frames; {first}", asked.len()),
            },
        },
        ProtocolCheck {
            what: "estimates a pose",
            holds: with_pose > 0,
            found: format!("{with_pose} of {} frames have one", asked.len()),
        },
    ];
    checks.extend(start_check(set, &asked)?);
    checks.extend(session.ending.as_ref().map(|ending| ProtocolCheck {
        what: "ends by itself after end, with exit code 0",
        // a fault of the end is an incident
        holds: session.incidents.len() == incidents.len(),
        found: ending.status.clone(),
    }));
    let slowest_ms = asked.iter().map(|asked| 1000.0 * asked.seconds).fold(0.0, f64::max);
    let name = session.ready.and_then(|ready| ready.name);
    Ok(Conformance { schema: "skiagraph.conformance/1".to_owned(), name, checks, slowest_ms })
}

fn has_pose(asked: &Exchange) -> bool {
    asked.answer.as_ref().is_some_and(|answer| answer.pose.is_some())
}

/// Whether the answer for frame 0 is near the start pose: units and axes are the set's.
fn start_check(set: &BlindSet, asked: &[Exchange]) -> Result<Option<ProtocolCheck>, ExperimentError> {
    let pose = asked.first().and_then(|asked| asked.answer.as_ref()?.pose.clone());
    if pose.is_none() {
        return Ok(None);
    }
    let mut all = vec![None; set.frame_count];
    all[0] = pose;
    let found = estimates(set, &[0], &vec![all])?;
    let distance = StartDistance::new(set, &found.sequences[0].markers[0]);
    Ok(Some(ProtocolCheck {
        what: "frame 0 is near the start pose: metres, Z up, the set's names",
        holds: distance.is_some_and(|distance| distance.is_near()),
        found: distance.map_or_else(
            || "it names none of the markers".to_owned(),
            |distance| format!("the farthest of {} markers is {:.3} m away", distance.markers, distance.farthest_m),
        ),
    }))
}
