//! An empty directory to run the program in.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_skiagraph");

/// A scenario of four frames, two cameras and few particles.
pub(crate) const TINY: &str = include_str!("tiny.toml");

pub(crate) struct CommandOutput {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// An empty directory, removed when dropped.
pub(crate) struct Sandbox(tempfile::TempDir);

impl Sandbox {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// With [`TINY`] in `tiny.toml`.
    pub(crate) fn tiny() -> Self {
        let sandbox = Self::new();
        sandbox.write("tiny.toml", TINY);
        sandbox
    }

    /// With `tiny.toml` and its set in `set`.
    pub(crate) fn with_set() -> Self {
        let sandbox = Self::tiny();
        sandbox.succeed("render tiny.toml --out set -q");
        sandbox
    }

    /// With `tiny.toml`, its set, and in `run` the run of a tracker that never moves.
    pub(crate) fn with_run() -> Self {
        let sandbox = Self::with_set();
        sandbox.succeed("track set --tracker frozen --out run -q");
        sandbox
    }

    pub(crate) fn program<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(self.0.path()).env_remove("SKIAGRAPH_MOCAP").stdin(Stdio::null());
        command
    }

    pub(crate) fn skiagraph<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> CommandOutput {
        CommandOutput::of(self.program(arguments))
    }

    /// Runs the program with the arguments in one string; single quotes hold spaces together.
    pub(crate) fn ask(&self, arguments: &str) -> CommandOutput {
        self.skiagraph(split(arguments))
    }

    /// Like [`Self::ask`]; the command must succeed.
    pub(crate) fn succeed(&self, arguments: &str) -> CommandOutput {
        let answer = self.ask(arguments);
        assert_eq!(answer.code, 0, "skiagraph {arguments}\n{}", answer.stderr);
        answer
    }

    /// Like [`Self::ask`]; the command must be refused with a message that contains `words`. Returns the message.
    pub(crate) fn refused(&self, arguments: &str, words: &str) -> String {
        let answer = self.ask(arguments);
        assert_eq!(answer.code, 2, "skiagraph {arguments}\n{}{}", answer.stdout, answer.stderr);
        assert!(answer.stderr.contains(words), "skiagraph {arguments}\nno {words:?} in: {}", answer.stderr);
        answer.stderr
    }

    /// Like [`Self::succeed`]; standard output must contain all of `words`.
    pub(crate) fn says(&self, arguments: &str, words: &[&str]) {
        assert_contains(&self.succeed(arguments).stdout, words);
    }

    /// The same for standard error.
    pub(crate) fn notes(&self, arguments: &str, words: &[&str]) {
        assert_contains(&self.succeed(arguments).stderr, words);
    }

    /// What a command that succeeds prints as JSON.
    pub(crate) fn json_of(&self, arguments: &str) -> Value {
        serde_json::from_str(&self.succeed(arguments).stdout).unwrap()
    }

    /// Starts a command; what it says on standard error is kept.
    pub(crate) fn start(&self, arguments: &str) -> Child {
        self.program(split(arguments)).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// Starts a command and kills it; returns whether it was still running.
    pub(crate) fn run_and_kill(&self, arguments: &str, after: Duration) -> bool {
        self.run_and_kill_once(arguments, || true, after)
    }

    /// The same, the time counted from when something has happened.
    pub(crate) fn run_and_kill_once(&self, arguments: &str, happened: impl Fn() -> bool, after: Duration) -> bool {
        let mut child = self.program(split(arguments)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while !happened() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(after);
        let running = child.try_wait().unwrap().is_none();
        child.kill().unwrap();
        child.wait().unwrap();
        running
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// Writes a program that can be started by its name.
    #[cfg(unix)]
    pub(crate) fn executable(&self, name: &str, text: &str) {
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        fs::set_permissions(self.write(name, text), mode).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).unwrap()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    /// The mean of a metric over the seeds of a measured run.
    pub(crate) fn mean(&self, run: &str, metric: &str) -> f64 {
        let record = self.json(&format!("{run}/run.json"));
        record["metrics"][metric]["mean"].as_f64().unwrap_or_else(|| panic!("{run}: no {metric}"))
    }

    /// All entries, including hidden ones, in alphabetical order.
    pub(crate) fn entries(&self) -> Vec<String> {
        self.entries_of(".")
    }

    /// The same of a folder; none if it does not exist.
    pub(crate) fn entries_of(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).into_iter().flatten();
        let mut entries: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        entries.sort();
        entries
    }

    /// Every file below a folder, as paths from here; none if it does not exist.
    pub(crate) fn files_below(&self, folder: &str) -> Vec<String> {
        let found = skiagraph_core::input::files_below(&self.path(folder)).unwrap_or_default();
        found.into_iter().map(|file| format!("{folder}/{file}")).collect()
    }

    /// Makes the list of hashes of a set again, as if it had been written like this.
    pub(crate) fn sign(&self, set: &str) {
        let files = skiagraph_core::input::files_below(&self.path(set)).unwrap();
        let hash = |file: String| {
            let hash = skiagraph_core::input::hex_sha256(&self.read(&format!("{set}/{file}")));
            (file, hash)
        };
        let mut hashes: BTreeMap<String, String> = files.into_iter().map(hash).collect();
        hashes.remove("files.sha256");
        self.write(&format!("{set}/files.sha256"), skiagraph_core::input::listing_of(&hashes));
    }
}

impl CommandOutput {
    pub(crate) fn of(mut command: Command) -> Self {
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { code: output.status.code().unwrap(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|_| panic!("{}{}", self.stdout, self.stderr))
    }
}

/// Waits until `ready`, which must come before the process ends.
pub(crate) fn wait_until(child: &mut Child, ready: impl Fn() -> bool) {
    while !ready() {
        assert!(child.try_wait().unwrap().is_none(), "it was too fast");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Sends Ctrl-C; returns what the process says until it ends with 130.
#[cfg(unix)]
pub(crate) fn interrupt(child: Child) -> String {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    said
}

pub(crate) fn assert_contains(said: &str, words: &[&str]) {
    words.iter().for_each(|words| assert!(said.contains(words), "no {words:?} in: {said}"));
}

/// The words of a command; single quotes hold spaces together.
fn split(arguments: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in arguments.split('\'').enumerate() {
        if index % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

pub(crate) fn shipped(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}
