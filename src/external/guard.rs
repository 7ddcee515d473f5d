//! Ends a program whose skiagraph was killed by a signal that cannot be handled.
//!
//! A small shell waits on a pipe whose other end this process holds. The system closes that end when the process is
//! gone, however it ended; then the shell ends the program's group and all that carries its mark, and removes the
//! folder that the program worked in. (A parent-death signal would have to be asked for between `fork` and `exec`,
//! which needs `unsafe`, and would reach the first process alone.)

use std::path::Path;
use std::process::Child;

/// Reads the program's group, then a word that all is over. An end without that word is the death of skiagraph.
#[cfg(unix)]
const SCRIPT: &str = r#"trap '' HUP INT TERM
read -r group && read -r over && exit 0
[ -n "$group" ] && kill -s KILL -- "-$group" 2>/dev/null
for process in /proc/[0-9]*; do
  if tr '\0' '\n' 2>/dev/null <"$process/environ" | grep -qxF "$1"; then kill -KILL "${process#/proc/}"; fi
done
[ -n "$2" ] && rm -rf "$2"
"#;

/// Waits for this process's death, until it is dropped.
pub(super) struct Guard {
    #[cfg(unix)]
    shell: Child,
}

#[cfg(unix)]
impl Guard {
    /// Begins to wait, before the program starts. `mark` is the entry of the environment that the program and all that
    /// it starts carry; `folder` is removed with them.
    pub(super) fn begin(mark: &str, folder: Option<&Path>) -> std::io::Result<Self> {
        use std::os::unix::process::CommandExt;
        use std::process::{Command, Stdio};
        let mut shell = Command::new("sh");
        shell.args(["-c", SCRIPT, "guard", mark]).arg(folder.unwrap_or(Path::new("")));
        // a group of its own: what kills skiagraph's group shall not kill the guard
        shell.process_group(0).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        Ok(Self { shell: shell.spawn()? })
    }

    /// The program has started and leads the group of its number.
    pub(super) fn progress(&mut self, program: &Child) {
        self.tell(&program.id().to_string());
    }

    fn tell(&mut self, word: &str) {
        use std::io::Write;
        // a guard that is gone guards nothing, and there is nobody else to tell
        self.shell.stdin.as_mut().map(|pipe| writeln!(pipe, "{word}"));
    }
}

#[cfg(unix)]
impl Drop for Guard {
    fn drop(&mut self) {
        self.tell("over\nover");
        self.shell.wait().ok();
    }
}

#[cfg(not(unix))]
impl Guard {
    /// Nothing is guarded here.
    pub(super) fn begin(_: &str, _: Option<&Path>) -> std::io::Result<Self> {
        Ok(Self {})
    }

    /// Nothing is guarded here.
    pub(super) fn progress(&mut self, _: &Child) {}
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
    fn a_pipe_that_closes_without_a_word_is_the_programs_end_and_its_folders() {
        let folder = tempfile::tempdir().unwrap();
        let mut program = program();
        let mut guard = Guard::begin("SKIAGRAPH_PROGRAM=none", Some(folder.path())).unwrap();
        guard.progress(&program);
        // as the system closes it when this process dies
        drop(guard.shell.stdin.take());
        let begin = Instant::now();
        assert!(!program.wait().unwrap().success());
        guard.shell.wait().unwrap();
        assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
        assert!(!folder.path().exists());
    }

    #[test]
    fn a_guard_that_is_told_that_all_is_over_ends_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for told in [true, false] {
            let mut program = program();
            let mut guard = Guard::begin("SKIAGRAPH_PROGRAM=none", Some(folder.path())).unwrap();
            if told {
                guard.progress(&program);
            }
            drop(guard);
            assert!(program.try_wait().unwrap().is_none() && folder.path().exists());
            let group = format!("-{}", program.id());
            assert!(Command::new("kill").args(["-KILL", "--", &group]).status().unwrap().success());
            program.wait().unwrap();
        }
    }

    #[test]
    fn a_program_that_carries_the_mark_ends_even_before_its_group_was_told() {
        let mark = format!("guard-test-{}", std::process::id());
        let mut program =
            Command::new("sleep").arg("30").env("SKIAGRAPH_PROGRAM", &mark).stdin(Stdio::null()).spawn().unwrap();
        let mut guard = Guard::begin(&format!("SKIAGRAPH_PROGRAM={mark}"), None).unwrap();
        drop(guard.shell.stdin.take());
        assert!(!program.wait().unwrap().success());
        guard.shell.wait().unwrap();
    }
}
