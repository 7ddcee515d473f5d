//! Ends the external program if this process is killed by a signal that cannot be handled.
//!
//! A small shell waits on a pipe whose other end this process holds. The system closes that end when this process ends
//! for any reason; then the shell kills the program's process group and all processes with its mark, and removes the
//! program's folder. (A parent-death signal would have to be set between `fork` and `exec`, which needs `unsafe`, and
//! would reach only the first process.)

use std::path::Path;
use std::process::Child;

/// Reads the program's group, then the word `over`. If the pipe closes without that word, this process was killed.
#[cfg(unix)]
const SCRIPT: &str = r#"trap '' HUP INT TERM
read -r group && read -r over && exit 0
[ -n "$group" ] && kill -s KILL -- "-$group" 2>/dev/null
for process in /proc/[0-9]*; do
  if tr '\0' '\n' 2>/dev/null <"$process/environ" | grep -qxF "$1"; then kill -KILL "${process#/proc/}"; fi
done
[ -n "$2" ] && rm -rf "$2"
"#;

/// Watches for the death of this process until it is dropped.
pub(super) struct Guard {
    #[cfg(unix)]
    shell: Child,
}

#[cfg(unix)]
impl Guard {
    /// Starts the guard, before the program starts. `mark` is the environment entry of the program and all its
    /// children; `folder` is removed with them.
    pub(super) fn begin(mark: &str, folder: Option<&Path>) -> std::io::Result<Self> {
        use std::os::unix::process::CommandExt;
        use std::process::{Command, Stdio};
        let mut shell = Command::new("sh");
        shell.args(["-c", SCRIPT, "guard", mark]).arg(folder.unwrap_or(Path::new("")));
        // in its own group, so that a signal to this process's group does not kill the guard
        shell.process_group(0).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        Ok(Self { shell: shell.spawn()? })
    }

    /// Guards a started program, which leads the process group of its number.
    pub(super) fn watch(&mut self, program: &Child) {
        self.send(&program.id().to_string());
    }

    fn send(&mut self, word: &str) {
        use std::io::Write;
        // if the guard has ended, there is nothing to do
        self.shell.stdin.as_mut().map(|pipe| writeln!(pipe, "{word}"));
    }
}

#[cfg(unix)]
impl Drop for Guard {
    fn drop(&mut self) {
        self.send("over\nover");
        self.shell.wait().ok();
    }
}

#[cfg(not(unix))]
impl Guard {
    /// There are no guards on this system.
    pub(super) fn begin(_: &str, _: Option<&Path>) -> std::io::Result<Self> {
        Ok(Self {})
    }

    /// There are no guards on this system.
    pub(super) fn watch(&mut self, _: &Child) {}
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::CommandExt;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    fn program() -> Child {
        Command::new("sh").args(["-c", "sleep 30 & sleep 30"]).process_group(0).spawn().unwrap()
    }

    #[test]
    fn a_closed_pipe_ends_the_program_and_removes_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let mut program = program();
        let mut guard = Guard::begin("SKIAGRAPH_PROGRAM=none", Some(folder.path())).unwrap();
        guard.watch(&program);
        // the system closes the pipe like this when this process dies
        drop(guard.shell.stdin.take());
        let begin = Instant::now();
        assert!(!program.wait().unwrap().success());
        guard.shell.wait().unwrap();
        assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
        assert!(!folder.path().exists());
    }

    #[test]
    fn a_dropped_guard_ends_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for is_watched in [true, false] {
            let mut program = program();
            let mut guard = Guard::begin("SKIAGRAPH_PROGRAM=none", Some(folder.path())).unwrap();
            if is_watched {
                guard.watch(&program);
            }
            drop(guard);
            assert!(program.try_wait().unwrap().is_none() && folder.path().exists());
            let group = format!("-{}", program.id());
            assert!(Command::new("kill").args(["-KILL", "--", &group]).status().unwrap().success());
            program.wait().unwrap();
        }
    }

    #[test]
    fn a_program_with_the_mark_ends_even_before_the_guard_knows_its_group() {
        let mark = format!("guard-test-{}", std::process::id());
        let mut program =
            Command::new("sleep").arg("30").env("SKIAGRAPH_PROGRAM", &mark).stdin(Stdio::null()).spawn().unwrap();
        let mut guard = Guard::begin(&format!("SKIAGRAPH_PROGRAM={mark}"), None).unwrap();
        drop(guard.shell.stdin.take());
        assert!(!program.wait().unwrap().success());
        guard.shell.wait().unwrap();
    }
}
