//! A child process that exchanges lines, with time limits and bounded memory, and that is killed with all its children.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::record::ProgramSettings;
use crate::common::{Progress, TRY_AGAIN};
use crate::scenario::setting_text;
use skiagraph_core::input::excerpt;

const LONGEST_LINE: u64 = 1 << 20;
/// Lines that may wait to be read; more block the program.
const WAITING_LINES: usize = 16;
const KEPT_ERRORS: usize = 12;
/// Interval at which a wait checks for an interruption by the user.
const PULSE: Duration = Duration::from_millis(100);
/// Time for a program to end by itself.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// Time in which the last lines of an ended program are read; only a busy machine needs it.
const PATIENCE_FOR_ERRORS: Duration = Duration::from_millis(500);

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    Line(String),
    /// A line beyond the limit.
    TooLong,
    /// Standard output is closed.
    End,
    /// Nothing within the time limit.
    TooLate,
    /// The user wants to stop.
    Interrupted,
}

/// Variables with this prefix are not passed on: they name the folders of recordings and other truth.
const OWN_PREFIX: &str = "SKIAGRAPH_";

const SETTING_PREFIX: &str = "SKIAGRAPH_SETTING_";

/// How a program ended after its input was closed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum ProgramEnd {
    /// By itself: whether successfully, and its exit status as text.
    ByItself(bool, String),
    /// Not in time; it is killed.
    Killed,
}

/// A running program; killed with all its children when dropped.
pub(super) struct Program {
    child: Child,
    to_program: Option<Sender<Vec<u8>>>,
    from_program: Receiver<Heard>,
    errors: Arc<Mutex<VecDeque<String>>>,
    /// Ends when standard error has been read to its end.
    errors_reader: Option<JoinHandle<()>>,
}

impl Program {
    /// Starts a command line with the shell, in a sandbox if the settings have one. `folder` is the blind side of the
    /// set.
    pub(super) fn start(settings: &ProgramSettings, folder: &Path) -> std::io::Result<Self> {
        let mut shell = match &settings.sandbox {
            Some(sandbox) => {
                let current = settings.folder.clone().or_else(|| std::env::current_dir().ok());
                sandbox.command(&settings.command_line(), folder, current)
            }
            None => shell(&settings.command_line()),
        };
        in_own_group(&mut shell);
        if let Some(folder) = &settings.folder {
            shell.current_dir(folder);
        }
        for (name, _) in std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with(OWN_PREFIX)) {
            shell.env_remove(name);
        }
        for (name, value) in &settings.settings {
            shell.env(format!("{SETTING_PREFIX}{}", name.to_uppercase()), setting_text(value));
        }
        let mut child = shell.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
        let (to_program, lines) = channel();
        let (heard, from_program) = sync_channel(WAITING_LINES);
        let errors = Arc::new(Mutex::new(VecDeque::new()));
        if let Some(stdin) = child.stdin.take() {
            thread::spawn(move || write_lines(stdin, &lines));
        }
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || read_lines(stdout, &heard));
        }
        let errors_reader = child.stderr.take().map(|stderr| {
            let kept = errors.clone();
            thread::spawn(move || keep_last_lines(stderr, &kept))
        });
        let to_program = Some(to_program);
        Ok(Self { child, to_program, from_program, errors, errors_reader })
    }

    /// Sends one line. Failures show in the answer.
    pub(super) fn send(&self, mut line: Vec<u8>) {
        line.push(b'\n');
        if let Some(to_program) = &self.to_program {
            to_program.send(line).ok();
        }
    }

    /// The next line; waits for it until `deadline`.
    pub(super) fn hear(&self, deadline: Instant, progress: &dyn Progress) -> Heard {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.from_program.recv_timeout(left.min(PULSE)) {
                Ok(heard) => return heard,
                Err(RecvTimeoutError::Disconnected) => return Heard::End,
                Err(RecvTimeoutError::Timeout) if progress.interrupted() => return Heard::Interrupted,
                Err(RecvTimeoutError::Timeout) if left.is_zero() => return Heard::TooLate,
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Closes its input and waits at most [`PATIENCE`] for its end. A program that does not end in time is killed when
    /// this is dropped.
    pub(super) fn finish(&mut self) -> ProgramEnd {
        self.to_program.take();
        match self.ended_within(PATIENCE) {
            Some(status) => ProgramEnd::ByItself(status.success(), status.to_string()),
            None => ProgramEnd::Killed,
        }
    }

    /// Whether it has ended with the exit code that asks for another time.
    pub(super) fn asks_for_another_time(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(Some(status)) if status.code() == Some(TRY_AGAIN.into()))
    }

    /// Its exit status, if it ends within `patience`.
    pub(super) fn ended_within(&mut self, patience: Duration) -> Option<ExitStatus> {
        let begin = Instant::now();
        loop {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Some(status);
            }
            if begin.elapsed() >= patience {
                return None;
            }
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// The last lines that it printed to standard error. If it has ended, they are read to the end, unless its children
    /// keep it open for more than [`PATIENCE_FOR_ERRORS`].
    pub(super) fn last_errors(&mut self) -> Vec<String> {
        let begin = Instant::now();
        let is_reading = |reader: &Option<JoinHandle<()>>| reader.as_ref().is_some_and(|reader| !reader.is_finished());
        while matches!(self.child.try_wait(), Ok(Some(_)))
            && is_reading(&self.errors_reader)
            && begin.elapsed() < PATIENCE_FOR_ERRORS
        {
            thread::sleep(Duration::from_millis(1));
        }
        self.errors.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        kill_with_children(&mut self.child);
        self.child.wait().ok();
    }
}

#[cfg(unix)]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(command);
    shell
}

/// Starts the command in its own process group, so that its children end with it.
#[cfg(unix)]
fn in_own_group(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
}

#[cfg(not(unix))]
fn in_own_group(_: &mut Command) {}

#[cfg(not(unix))]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("cmd");
    shell.arg("/C").arg(command);
    shell
}

#[cfg(unix)]
fn kill_with_children(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process_group};
    // also if the shell itself has ended, because its group may still exist
    if let Some(group) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        kill_process_group(group, Signal::KILL).ok();
    }
    child.kill().ok();
}

#[cfg(not(unix))]
fn kill_with_children(child: &mut Child) {
    child.kill().ok();
}

fn write_lines(mut stdin: ChildStdin, lines: &Receiver<Vec<u8>>) {
    while let Ok(line) = lines.recv() {
        if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

fn read_lines(stdout: impl Read, heard: &SyncSender<Heard>) {
    let mut reader = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let received = match reader.by_ref().take(LONGEST_LINE + 1).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => Heard::End,
            Ok(_) if line.len() as u64 > LONGEST_LINE => Heard::TooLong,
            Ok(_) => Heard::Line(String::from_utf8_lossy(&line).trim().to_owned()),
        };
        let is_last = !matches!(received, Heard::Line(_));
        let is_empty = matches!(&received, Heard::Line(line) if line.is_empty());
        if !is_empty && heard.send(received).is_err() || is_last {
            return;
        }
    }
}

fn keep_last_lines(stderr: impl Read, kept: &Mutex<VecDeque<String>>) {
    let mut reader = BufReader::new(stderr);
    loop {
        let mut line = Vec::new();
        match reader.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {
                let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                if kept.len() == KEPT_ERRORS {
                    kept.pop_front();
                }
                kept.push_back(excerpt(String::from_utf8_lossy(&line).trim_end()));
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::common::NoProgress;

    fn start(command: &str) -> Program {
        let settings = ProgramSettings { command: command.to_owned(), ..ProgramSettings::default_settings() };
        Program::start(&settings, Path::new("/")).unwrap()
    }

    fn hear(program: &Program, milliseconds: u64) -> Heard {
        program.hear(Instant::now() + Duration::from_millis(milliseconds), &NoProgress)
    }

    #[test]
    fn the_time_limit_holds_and_the_programs_children_end_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("alive");
        let command = format!("(sleep 1; echo > {}) & sleep 60", file.display());
        let begin = Instant::now();
        let program = start(&command);
        assert_eq!(hear(&program, 200), Heard::TooLate);
        drop(program);
        assert!(begin.elapsed() < Duration::from_secs(1));
        thread::sleep(Duration::from_millis(1300));
        assert!(!file.exists(), "the grandchild was killed too");
    }

    #[test]
    fn the_last_words_of_a_program_that_has_just_ended_are_read_also_on_a_busy_machine() {
        for _ in 0..20 {
            let mut program = start("for i in 1 2 3 4 5 6 7 8 9; do echo $i >&2; done");
            while !matches!(program.child.try_wait(), Ok(Some(_))) {}
            assert_eq!(program.last_errors().last().map(String::as_str), Some("9"));
        }
        let mut held = start("sleep 3 & echo begun >&2");
        assert!(held.ended_within(PATIENCE).is_some());
        assert_eq!(held.last_errors(), ["begun"]);
    }

    #[test]
    fn the_last_lines_of_standard_error_are_kept() {
        let mut program = start("for i in $(seq 1 30); do echo line $i >&2; done; exit 7");
        assert_eq!(hear(&program, 5000), Heard::End);
        assert_eq!(program.finish(), ProgramEnd::ByItself(false, "exit status: 7".to_owned()));
        thread::sleep(Duration::from_millis(100));
        let errors = program.last_errors();
        assert_eq!((errors.len(), errors.last().map(String::as_str)), (KEPT_ERRORS, Some("line 30")));
    }
}
