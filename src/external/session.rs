//! Runs a program over a whole set: one process per seed, restarted a few times after a crash.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::TrackTiming;
use super::answers::{Poses, estimates};
use super::program::{Heard, PATIENCE, Program, ProgramEnd};
use super::protocol::{FrameMessage, Hello, Ready, RepliedPose, Reply, Request, protocol_of, read_answer, read_ready};
use super::record::{AnswerCount, ExternalRecord, Incident, ProgramOptions, ProgramSettings, SeedEnding};
use super::workplace::{LeftBehind, Workplace};
use crate::common::{ExperimentError, Progress, Stage, advance};
use skiagraph_core::observation::Observation;
use skiagraph_set::{BlindSet, Estimates};

/// Consecutive invalid answers after which a program is restarted.
const MOST_INVALID: usize = 10;
/// Answers for earlier frames that are ignored while waiting for one frame.
const MOST_STALE: usize = 1000;
const KEPT_INCIDENTS: usize = 100;

/// A program's estimates and the record of its run.
#[derive(Clone, Debug)]
pub struct Programmed {
    pub estimates: Estimates,
    pub record: ExternalRecord,
    /// CSV table with one row per seed and frame.
    pub answers: Vec<u8>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ProgramSeed {
    seed: u64,
    frames: Vec<Exchange>,
    kind: Option<String>,
    ready: Ready,
    incidents: Vec<Incident>,
    ending: Option<SeedEnding>,
    left_behind: LeftBehind,
}

impl ProgramSeed {
    /// The kind of the program's answers, which must be the same in all seeds.
    pub(crate) fn kind(&self) -> Option<&str> {
        self.kind.as_deref()
    }

    /// Name and version, as the program reports them.
    pub(crate) fn program(&self) -> String {
        let text = |word: &Option<String>| word.clone().unwrap_or_else(|| "nothing".to_owned());
        format!("{}, version {}", text(&self.ready.name), text(&self.ready.version))
    }
}

/// Runs a program with one seed over a set, in a fresh folder that has only the blind side; its answers must have the
/// given `kind`, if any.
pub(crate) fn track_seed_with_program(
    set: &BlindSet,
    settings: &ProgramSettings,
    seed: u64,
    kind: Option<&str>,
    progress: &dyn Progress,
) -> Result<ProgramSeed, ExperimentError> {
    progress.begin(Stage::Track, set.frame_count);
    let place = Workplace::new(set)?;
    let mut session = Session::new(set, &place, settings, seed, progress);
    session.kind = kind.map(str::to_owned);
    let frames = session.run()?;
    let Session { kind, ready, incidents, ending, .. } = session;
    let left_behind = place.left_behind(seed);
    Ok(ProgramSeed { seed, frames, kind, ready: ready.unwrap_or_default(), incidents, ending, left_behind })
}

impl Programmed {
    /// Joins the results of seeds, in this order.
    pub(crate) fn new(
        set: &BlindSet,
        settings: &ProgramSettings,
        seeds: Vec<ProgramSeed>,
    ) -> Result<Self, ExperimentError> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let failed = |e: csv::Error| ExperimentError::Malformed { path: "answers.csv".into(), detail: e.to_string() };
        table.write_record(["seed", "frame", "answer", "milliseconds", "confidence"]).map_err(failed)?;
        let (mut poses, mut incidents, mut seconds) = (Poses::new(), Vec::new(), 0.0);
        let (mut endings, mut left_behind) = (Vec::new(), LeftBehind::default());
        let mut count = AnswerCount::default();
        let numbers: Vec<u64> = seeds.iter().map(|seed| seed.seed).collect();
        let ready = seeds.first().map(|seed| seed.ready.clone()).unwrap_or_default();
        for ProgramSeed { seed, frames, incidents: of_seed, ending, left_behind: left, .. } in seeds {
            for (frame, exchange) in frames.iter().enumerate() {
                let word = exchange.word();
                count.add(word);
                seconds += exchange.seconds;
                let confidence = exchange.answer.as_ref().and_then(|answer| answer.confidence);
                let confidence = confidence.map(|share| share.to_string()).unwrap_or_default();
                let milliseconds = format!("{:.3}", 1000.0 * exchange.seconds);
                let row = [seed.to_string(), frame.to_string(), word.to_owned(), milliseconds, confidence];
                table.write_record(row).map_err(failed)?;
            }
            poses.push(frames.into_iter().map(|exchange| exchange.answer.and_then(|answer| answer.pose)).collect());
            incidents.extend(of_seed);
            endings.extend(ending);
            left_behind.extend(left);
        }
        incidents.truncate(KEPT_INCIDENTS);
        let frames = (set.frame_count * numbers.len()) as f64;
        let record = ExternalRecord {
            schema: "skiagraph.program/1".to_owned(),
            command: settings.command.clone(),
            name: ready.name,
            version: ready.version,
            options: ProgramOptions::of(settings),
            set_hash: set.set_hash.clone(),
            without_truth: false,
            skiagraph: env!("CARGO_PKG_VERSION").to_owned(),
            answers: count,
            incidents,
            endings,
            left_behind,
            timing: TrackTiming {
                seconds,
                frames_per_second: frames / seconds.max(f64::MIN_POSITIVE),
                likelihood_evaluations: 0,
                threads: rayon::current_num_threads(),
            },
        };
        let answers = table.into_inner().map_err(|e| failed(e.into_error().into()))?;
        Ok(Self { estimates: estimates(set, &numbers, &poses)?, record, answers })
    }
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Exchange {
    pub(super) answer: Option<Reply>,
    /// Whether there was no valid answer in time.
    pub(super) failed: bool,
    /// Time from request to answer.
    pub(super) seconds: f64,
}

impl Exchange {
    /// Its value in the column `answer`.
    fn word(&self) -> &'static str {
        match (&self.answer, self.failed) {
            (_, true) => "failed",
            (Some(Reply { pose: Some(_), .. }), _) => "pose",
            _ => "lost",
        }
    }
}

pub(super) struct Session<'a> {
    set: &'a BlindSet,
    place: &'a Workplace,
    settings: &'a ProgramSettings,
    seed: u64,
    progress: &'a dyn Progress,
    program: Option<Program>,
    starts: usize,
    invalid_answers: usize,
    last_answer: Option<Value>,
    /// The kind of the program's answers, which must all be the same.
    kind: Option<String>,
    pub(super) ready: Option<Ready>,
    pub(super) incidents: Vec<Incident>,
    /// How the program ended after its last answer.
    pub(super) ending: Option<SeedEnding>,
}

impl<'a> Session<'a> {
    pub(super) fn new(
        set: &'a BlindSet,
        place: &'a Workplace,
        settings: &'a ProgramSettings,
        seed: u64,
        progress: &'a dyn Progress,
    ) -> Self {
        Self {
            set,
            place,
            settings,
            seed,
            progress,
            program: None,
            starts: 0,
            invalid_answers: 0,
            last_answer: None,
            kind: None,
            ready: None,
            incidents: Vec::new(),
            ending: None,
        }
    }

    fn run(&mut self) -> Result<Vec<Exchange>, ExperimentError> {
        let mut frames = Vec::with_capacity(self.set.frame_count);
        for observation in self.set.observations() {
            frames.push(self.frame(&observation?)?);
            advance(self.progress)?;
        }
        self.end()?;
        Ok(frames)
    }

    /// Requests one frame; starts the program first if it is not running.
    pub(super) fn frame(&mut self, observation: &Observation) -> Result<Exchange, ExperimentError> {
        let failed = Exchange { failed: true, ..Exchange::default() };
        if self.program.is_none() && !self.start(observation.frame)? {
            return Ok(failed);
        }
        let begin = Instant::now();
        let message = FrameMessage::new(self.set, &self.place.folder, observation, self.settings.inline);
        self.send(&Request::Frame(message))?;
        let answer = self.answer(observation.frame, begin)?;
        let seconds = begin.elapsed().as_secs_f64();
        Ok(match answer {
            Some(answer) => Exchange { answer: Some(answer), failed: false, seconds },
            None => Exchange { seconds, ..failed },
        })
    }

    /// Ends the program, and records how it ended.
    ///
    /// # Errors
    /// [`ExperimentError::Postponed`] if it asks for another time.
    pub(super) fn end(&mut self) -> Result<(), ExperimentError> {
        let Some(mut program) = self.program.take() else { return Ok(()) };
        if let Ok(line) = serde_json::to_vec(&Request::End {}) {
            program.send(line);
        }
        let end = program.finish();
        self.expect_not_postponed(&mut program)?;
        let (status, killed, fault) = match end {
            ProgramEnd::ByItself(true, status) => (status, false, None),
            ProgramEnd::ByItself(false, status) => {
                let fault = format!("ended after its last answer ({status})");
                (status, false, Some(fault))
            }
            ProgramEnd::Killed => {
                let fault = format!("did not end within {PATIENCE:?} of its last answer and was killed");
                ("did not end".to_owned(), true, Some(fault))
            }
        };
        if let Some(what) = fault {
            self.add_incident(None, what, program.last_errors());
        }
        self.ending = Some(SeedEnding { seed: self.seed, status, killed });
        Ok(())
    }

    /// What a program that cannot go on now has not answered is not lost: there is no run.
    fn expect_not_postponed(&self, program: &mut Program) -> Result<(), ExperimentError> {
        if !program.asks_for_another_time() {
            return Ok(());
        }
        Err(ExperimentError::Postponed { command: self.settings.command.clone() })
    }

    fn send(&self, message: &Request<'_>) -> Result<(), ExperimentError> {
        let line = serde_json::to_vec(message)?;
        self.program.iter().for_each(|program| program.send(line.clone()));
        Ok(())
    }

    /// Starts the program, unless it was started too often. Returns whether it is ready.
    pub(super) fn start(&mut self, frame: usize) -> Result<bool, ExperimentError> {
        if self.starts > self.settings.restarts {
            return Ok(false);
        }
        self.starts += 1;
        self.invalid_answers = 0;
        let begin = Instant::now();
        let program = Program::start(self.settings, &self.place.folder)
            .map_err(|e| self.never_ready(format!("cannot be started: {e}"), Vec::new()))?;
        let last_answer = self.last_answer.clone();
        let limit = self.settings.frame_limit.as_secs_f64();
        let mut hello = Hello::new(self.set, &self.place.folder, self.seed, limit);
        (hello.first_frame, hello.last_answer) = (frame, last_answer.as_ref());
        hello.settings.clone_from(&self.settings.settings);
        self.program = Some(program);
        self.send(&Request::Hello(Box::new(hello)))?;
        let limit = self.settings.start_limit;
        let line = self.line(begin + limit, "ended before it was ready", &format!("was not ready within {limit:?}"))?;
        match line.and_then(|line| read_ready(&line, protocol_of(self.set))) {
            Ok(ready) => {
                self.ready = Some(ready);
                Ok(true)
            }
            Err(what) => {
                let (what, errors) = self.stop(what)?;
                if self.ready.is_none() {
                    // it never worked, so the command is wrong
                    return Err(self.never_ready(what, errors));
                }
                self.add_incident(Some(frame), what, errors);
                Ok(false)
            }
        }
    }

    /// The next line of the program, or a message about the failure: `end` or `too_late`.
    fn line(&self, deadline: Instant, end: &str, too_late: &str) -> Result<Result<String, String>, ExperimentError> {
        match self.program.as_ref().map_or(Heard::End, |program| program.hear(deadline, self.progress)) {
            Heard::Line(line) => Ok(Ok(line)),
            Heard::TooLong => Ok(Err("printed a line of more than 1 MiB".to_owned())),
            Heard::End => Ok(Err(end.to_owned())),
            Heard::TooLate => Ok(Err(too_late.to_owned())),
            Heard::Interrupted => Err(ExperimentError::Interrupted),
        }
    }

    /// The answer for a frame; `None`, with an incident, if there is no valid one.
    fn answer(&mut self, frame: usize, begin: Instant) -> Result<Option<Reply>, ExperimentError> {
        let limit = self.settings.frame_limit;
        let too_late = format!("no answer within {limit:?}");
        for _ in 0..MOST_STALE {
            let line = match self.line(begin + limit, "ended", &too_late)? {
                Ok(line) => line,
                Err(what) => return self.gone(frame, what),
            };
            match read_answer(&line, frame, &self.set.start.body) {
                // an answer for an earlier frame, which has failed already
                Ok(None) => {}
                Ok(Some(answer)) if answer.frame > frame => {
                    let what = format!("expected an answer to frame {frame}, found one to frame {}", answer.frame);
                    return self.invalid(frame, what);
                }
                Ok(Some(answer)) => return self.accept(answer, &line),
                Err(what) => return self.invalid(frame, what),
            }
        }
        self.gone(frame, "answered a thousand earlier frames".to_owned())
    }

    /// Accepts an answer of the same kind as the ones before.
    fn accept(&mut self, answer: Reply, line: &str) -> Result<Option<Reply>, ExperimentError> {
        let kind = answer.pose.as_ref().map(RepliedPose::kind);
        if let (Some(kind), Some(before)) = (kind, &self.kind)
            && kind != before
        {
            let what = format!("answered with {kind} after {before}");
            return self.invalid(answer.frame, what);
        }
        self.kind = self.kind.take().or(kind.map(str::to_owned));
        self.invalid_answers = 0;
        self.last_answer = serde_json::from_str(line).ok();
        Ok(Some(answer))
    }

    /// Records an invalid answer, whose frame is lost; after many in a row the program is stopped.
    fn invalid(&mut self, frame: usize, what: String) -> Result<Option<Reply>, ExperimentError> {
        self.invalid_answers += 1;
        if self.invalid_answers >= MOST_INVALID {
            return self.gone(frame, format!("{what}; {MOST_INVALID} consecutive answers are invalid"));
        }
        let errors = self.program.as_mut().map(Program::last_errors).unwrap_or_default();
        self.add_incident(Some(frame), what, errors);
        Ok(None)
    }

    /// Stops the program; it is restarted with the next frame.
    fn gone(&mut self, frame: usize, what: String) -> Result<Option<Reply>, ExperimentError> {
        let (what, errors) = self.stop(what)?;
        let what = if self.starts > self.settings.restarts {
            format!("{what}; started {} times, the maximum: all further frames are lost", self.starts)
        } else {
            format!("{what}; started again")
        };
        self.add_incident(Some(frame), what, errors);
        Ok(None)
    }

    /// Stops the program. Returns the failure with the exit status, and the last lines of standard error.
    fn stop(&mut self, what: String) -> Result<(String, Vec<String>), ExperimentError> {
        let Some(mut program) = self.program.take() else { return Ok((what, Vec::new())) };
        let status = program.ended_within(Duration::from_millis(200));
        self.expect_not_postponed(&mut program)?;
        let errors = program.last_errors();
        Ok((status.map_or(what.clone(), |status| format!("{what} ({status})")), errors))
    }

    fn add_incident(&mut self, frame: Option<usize>, what: String, standard_error: Vec<String>) {
        if self.incidents.len() < KEPT_INCIDENTS {
            self.incidents.push(Incident { seed: self.seed, frame, what, standard_error });
        }
    }

    fn never_ready(&self, what: String, errors: Vec<String>) -> ExperimentError {
        let hint = self.settings.sandbox.as_ref().and_then(|sandbox| sandbox.hint(&what, &errors));
        let what = hint.map_or(what.clone(), |hint| format!("{what}; {hint}"));
        ExperimentError::Program { command: self.settings.command.clone(), what, errors }
    }
}
