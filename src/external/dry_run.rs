//! Checks on a few frames whether a program follows the protocol.

use serde::Serialize;

use super::answers::estimates;
use super::record::ProgramSettings;
use super::session::{Exchange, Session};
use super::start_check::StartDistance;
use super::workplace::Workplace;
use crate::common::{ExperimentError, Progress};
use skiagraph_set::BlindSet;

const FRAMES: usize = 5;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Conformance {
    /// `skiagraph.conformance/1`.
    pub schema: String,
    /// The program's name, as it reports it.
    pub name: Option<String>,
    pub checks: Vec<ProtocolCheck>,
    /// Greatest time for a frame, milliseconds.
    pub slowest_ms: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProtocolCheck {
    pub what: &'static str,
    pub holds: bool,
    pub found: String,
}

impl Conformance {
    /// Whether all requirements are met.
    pub fn holds(&self) -> bool {
        self.checks.iter().all(|check| check.holds)
    }
}

/// Runs a program for a few frames and checks its answers.
pub fn dry_run(
    set: &BlindSet,
    settings: &ProgramSettings,
    progress: &dyn Progress,
) -> Result<Conformance, ExperimentError> {
    let place = Workplace::new(set)?;
    let mut session = Session::new(set, &place, settings, 0, progress);
    session.start(0)?;
    let mut exchanges = Vec::new();
    for frame in 0..FRAMES.min(set.frame_count) {
        exchanges.push(session.frame(&set.observation(frame)?)?);
    }
    let incidents: Vec<String> = session.incidents.iter().map(|incident| incident.describe()).collect();
    session.end()?;
    let count = exchanges.len();
    let answered = exchanges.iter().filter(|exchange| !exchange.failed).count();
    let with_pose = exchanges.iter().filter(|exchange| has_pose(exchange)).count();
    let mut checks = vec![
        ProtocolCheck { what: "answers hello with ready", holds: true, found: "ready".to_owned() },
        ProtocolCheck {
            what: "answers every frame in time, in order, with a valid message",
            holds: answered == count,
            found: match incidents.first() {
                None => format!("{answered} of {count} frames"),
                Some(first) => format!("{answered} of {count} frames; {first}"),
            },
        },
        ProtocolCheck {
            what: "estimates a pose",
            holds: with_pose > 0,
            found: format!("{with_pose} of {count} frames have a pose"),
        },
    ];
    checks.extend(start_check(set, &exchanges)?);
    checks.extend(session.ending.as_ref().map(|ending| ProtocolCheck {
        what: "ends by itself after end, with exit code 0",
        // a bad end is recorded as an incident
        holds: session.incidents.len() == incidents.len(),
        found: ending.status.clone(),
    }));
    let slowest_ms = exchanges.iter().map(|exchange| 1000.0 * exchange.seconds).fold(0.0, f64::max);
    let name = session.ready.and_then(|ready| ready.name);
    Ok(Conformance { schema: "skiagraph.conformance/1".to_owned(), name, checks, slowest_ms })
}

fn has_pose(exchange: &Exchange) -> bool {
    exchange.answer.as_ref().is_some_and(|answer| answer.pose.is_some())
}

/// Checks that the answer for frame 0 is near the start pose, so that units and axes are the set's.
fn start_check(set: &BlindSet, exchanges: &[Exchange]) -> Result<Option<ProtocolCheck>, ExperimentError> {
    let pose = exchanges.first().and_then(|exchange| exchange.answer.as_ref()?.pose.clone());
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
            || "it has none of the markers".to_owned(),
            |distance| format!("the farthest of {} markers is {:.3} m away", distance.markers, distance.farthest_m),
        ),
    }))
}
