//! An empty directory to run the program in.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::{cargo_bin, cargo_bin_cmd};

/// The output of the program.
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

    /// Starts a command and kills it; returns whether it was still running.
    pub(crate) fn run_and_kill(&self, arguments: &str, after: Duration) -> bool {
        self.run_and_kill_once(arguments, || true, after)
    }

    /// The same, the time counted from when something has happened.
    pub(crate) fn run_and_kill_once(&self, arguments: &str, happened: impl Fn() -> bool, after: Duration) -> bool {
        let mut child = Command::new(cargo_bin("skiagraph"))
            .args(arguments.split(' '))
            .current_dir(self.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while !happened() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(after);
        let running = child.try_wait().unwrap().is_none();
        child.kill().unwrap();
        child.wait().unwrap();
        running
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// All entries, including hidden ones, in alphabetical order.
    pub(crate) fn entries(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut entries: Vec<String> = entries.collect();
        entries.sort();
        entries
    }

    /// Runs the program in this directory.
    pub(crate) fn skiagraph<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> CommandOutput {
        let output = cargo_bin_cmd!("skiagraph")
            .args(arguments)
            .current_dir(self.0.path())
            .env_remove("SKIAGRAPH_MOCAP")
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        CommandOutput { code: output.status.code().unwrap(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// Like [`Self::skiagraph`], with the arguments in one string; the command must succeed.
    pub(crate) fn succeed(&self, arguments: &str) -> CommandOutput {
        let answer = self.skiagraph(arguments.split_whitespace());
        assert_eq!(answer.code, 0, "skiagraph {arguments}\n{}", answer.stderr);
        answer
    }
}

/// A file of the repository.
pub(crate) fn shipped(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// A scenario of four frames, two cameras and few particles.
pub(crate) const TINY: &str = r#"
schema = "skiagraph.scenario/1"
name = "tiny"
seeds = 2

[motion]
clip = "embedded:walk"
last_frame = 3

[rig.ring]
count = 2
radius_m = 3.5
size_px = [80, 60]

[tracker.annealed_particle_filter]
particles = 12
layers = 2
"#;
