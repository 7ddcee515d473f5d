//! The run that is explained, with its tracker and its set.

use std::path::Path;

use crate::common::{ExperimentError, Progress};
use crate::external::ExternalRecord;
use crate::measure::{RUN_FILE, RunRecord, Tracked};
use crate::runs::MoreOf;
use crate::runs::reading::read_record;
use crate::runs::set_of_run::{refuse_other_sets, set_of_run};
use crate::scenario::{ProgramTrackerSettings, TrackerSettings};
use crate::tracking::calibrating::Beginning;
use crate::train::Models;
use skiagraph_core::input::shell_word;
use skiagraph_set::BenchmarkSet;
use skiagraph_track::tracker::CalibrationVerdict;

pub(super) struct RepeatableRun {
    pub(super) record: RunRecord,
    pub(super) tracked: Tracked,
    /// Its set; `start.calibrate` says what the run calibrated.
    pub(super) set: BenchmarkSet,
    pub(super) tracker: TrackerSettings,
    pub(super) models: Models,
}

impl RepeatableRun {
    /// Reads a run and its set. `exec` is the command line of its program, if another program tracked.
    pub(super) fn read(
        run: &Path,
        exec: Option<&str>,
        from: MoreOf<'_>,
        progress: &dyn Progress,
    ) -> Result<Self, ExperimentError> {
        let malformed = |detail| ExperimentError::Malformed { path: run.to_owned(), detail };
        let record = read_record(&run.join(RUN_FILE))?;
        if record.seeds.is_empty() {
            return Err(malformed(format!("expected the seeds of the run in {RUN_FILE}, found none; run it again")));
        }
        if record.program.is_none() && record.settings.is_none() {
            let detail = "it has poses of another program that skiagraph did not run, so it cannot be repeated; run the \
                          program with skiagraph track SET --exec COMMAND, and explain that run";
            return Err(malformed(detail.to_owned()));
        }
        check_program(record.program.as_ref(), exec)?;
        refuse_other_sets(run, &record.set_hash, from.sets)?;
        let (mut set, models) = set_of_run(run, &record.set_hash, "--set", from, progress)?;
        let body = &set.blind.start.body;
        let tracked = match record.program {
            Some(_) => Tracked::read_program(run, body)?,
            None => Tracked::read(run, body)?,
        };
        let own = tracked.record.as_ref();
        set.blind.start.calibrate = own.and_then(|own| Some(own.calibration.first()?.solved)).unwrap_or_default();
        let tracker = match (own, &record.program) {
            (Some(own), _) => own.tracker.clone(),
            (None, Some(program)) => TrackerSettings::Program(settings_of(program)),
            (None, None) => return Err(malformed("expected track.json, found none; run it again".to_owned())),
        };
        Ok(Self { record, tracked, set, tracker, models })
    }

    /// The body and the cameras that the tracker used with the seed of this index: calibrated ones if it kept them.
    pub(super) fn beginning(&self, seed: usize) -> Beginning {
        let blind = &self.set.blind;
        let report = self.tracked.record.as_ref().and_then(|record| record.calibration.get(seed));
        match report.filter(|report| report.verdict == CalibrationVerdict::Kept) {
            Some(report) => Beginning::from_run(blind, self.tracked.estimates.body(seed, &blind.start.body), report),
            None => Beginning::from_set(blind),
        }
    }
}

/// Refuses a program that is not named on the command line as in its run.
fn check_program(program: Option<&ExternalRecord>, exec: Option<&str>) -> Result<(), ExperimentError> {
    let refused = |detail| Err(ExperimentError::Argument { argument: "--exec", detail });
    match (program, exec) {
        (None, None) => Ok(()),
        (None, Some(_)) => refused("the run's tracker is built in; leave out --exec".to_owned()),
        (Some(program), None) => refused(format!(
            "the run was made by another program, and only the command line may start programs: give --exec {}",
            shell_word(&program.command)
        )),
        (Some(program), Some(given)) if program.command != given => refused(format!(
            "expected the program of the run, {}, found {}; explain a run of the program that you name",
            shell_word(&program.command),
            shell_word(given)
        )),
        (Some(_), Some(_)) => Ok(()),
    }
}

fn settings_of(program: &ExternalRecord) -> ProgramTrackerSettings {
    let options = program.options.clone();
    ProgramTrackerSettings {
        command: program.command.clone(),
        name: program.name.clone(),
        settings: options.settings,
        inline: options.inline,
        frame_limit_s: options.frame_limit_s,
        start_limit_s: options.start_limit_s,
        restarts: options.restarts.and_then(|restarts| u32::try_from(restarts).ok()),
        sandbox: options.sandbox,
        readable: options.readable,
        folder: None,
    }
}
