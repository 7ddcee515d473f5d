//! `--sandbox`: the program sees only the system, the blind side and granted paths, and no network.
//!
//! bubblewrap (`bwrap`) makes the sandbox from kernel namespaces, without privileges.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::ExperimentError;
use skiagraph_core::input::excerpt;

/// System folders that a program may read.
const SYSTEM: [&str; 9] = ["/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/etc", "/opt", "/nix"];

/// The paths that a program in a sandbox may see besides the system and the blind side.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramSandbox {
    /// Files and folders that it may read.
    pub readable: Vec<PathBuf>,
    /// Paths that are hidden even inside these: the set and the folders of recordings.
    pub hidden: Vec<PathBuf>,
}

impl ProgramSandbox {
    /// Checks that this machine can make a sandbox.
    pub fn check(&self) -> Result<(), ExperimentError> {
        let refuse = |detail: String| ExperimentError::Argument { argument: "--sandbox", detail };
        if let Some(missing) = self.readable.iter().find(|path| !path.exists()) {
            let detail = format!("expected a file or folder that exists, found {}", missing.display());
            return Err(ExperimentError::Argument { argument: "--readable", detail });
        }
        let tried = Command::new("bwrap").args(["--unshare-all", "--ro-bind", "/", "/", "true"]).output();
        let remedy = "install the package bubblewrap on a Linux system that allows user namespaces, or run the program \
                      on a machine without the truth (docs/protocol.md)";
        match tried {
            Ok(output) if output.status.success() => Ok(()),
            Ok(output) => {
                let errors = String::from_utf8_lossy(&output.stderr);
                let error = excerpt(errors.lines().last().unwrap_or("no message"));
                Err(refuse(format!("bwrap cannot make a sandbox here ({error}); {remedy}")))
            }
            Err(error) => Err(refuse(format!("needs bwrap, which cannot be started ({error}); {remedy}"))),
        }
    }

    /// Advice if a program probably failed because it, or a file that it needs, is not visible in the sandbox. `what`
    /// is the failure, `errors` the last lines of standard error.
    pub(super) fn hint(&self, what: &str, errors: &[String]) -> Option<String> {
        const MISSING: [&str; 5] = ["not found", "No such file", "can't open", "cannot open", "ModuleNotFoundError"];
        // a shell's exit status is 127 if it finds no program, and 126 if it may not start it
        let is_missing = ["exit status: 127", "exit status: 126"].iter().any(|end| what.contains(end));
        let is_reported = errors.iter().any(|line| MISSING.iter().any(|words| line.contains(words)));
        let granted: Vec<String> = self.readable.iter().map(|path| path.display().to_string()).collect();
        let visible = if granted.is_empty() { "nothing else".to_owned() } else { granted.join(", ") };
        (is_missing || is_reported).then(|| {
            format!(
                "in the sandbox it sees the system, the blind side and {visible}: grant its own files and folders with \
                 --readable PATH, which may be repeated"
            )
        })
    }

    /// The command line in the sandbox; `folder` has the blind side.
    pub(super) fn command(&self, command: &str, folder: &Path, current: Option<PathBuf>) -> Command {
        let mut bwrap = Command::new("bwrap");
        bwrap.args(["--unshare-all", "--die-with-parent", "--new-session", "--unsetenv", "OLDPWD"]);
        bwrap.args(self.mounts(folder));
        // the current folder if the program may see anything in it
        let current = current.map(|path| resolved(&path)).filter(|path| self.shows(path) || self.shows_below(path));
        bwrap.arg("--chdir").arg(current.as_deref().unwrap_or(folder));
        bwrap.args(["--", "sh", "-c", command]);
        bwrap
    }

    /// The mount arguments, outer folders first, so that no mount hides an earlier one by accident.
    fn mounts(&self, folder: &Path) -> Vec<OsString> {
        let mut mounts: Vec<(PathBuf, &str)> = SYSTEM.iter().map(|path| (path.into(), "--ro-bind-try")).collect();
        mounts.extend([("/proc".into(), "--proc"), ("/dev".into(), "--dev"), ("/tmp".into(), "--tmpfs")]);
        mounts.extend(self.readable.iter().map(|path| (resolved(path), "--ro-bind")));
        mounts.sort();
        let hidden = self.hidden.iter().map(|path| resolved(path)).filter(|path| self.shows_around(path));
        mounts.extend(hidden.map(|path| (path, "--tmpfs")));
        mounts.push((folder.to_owned(), "--ro-bind"));
        let arguments = mounts.into_iter().flat_map(|(path, how)| match how {
            "--ro-bind" | "--ro-bind-try" => vec![how.into(), path.clone().into(), path.into()],
            _ => vec![how.into(), path.into()],
        });
        arguments.collect()
    }

    /// Whether the program can see a folder.
    fn shows(&self, path: &Path) -> bool {
        self.shows_around(path) && !self.hidden.iter().any(|hidden| path.starts_with(resolved(hidden)))
    }

    /// Whether anything in a folder is granted.
    fn shows_below(&self, folder: &Path) -> bool {
        self.readable.iter().any(|readable| resolved(readable).starts_with(folder))
    }

    /// Whether a path is in a readable folder.
    fn shows_around(&self, path: &Path) -> bool {
        let readable = self.readable.iter().map(|readable| resolved(readable));
        readable.chain(SYSTEM.iter().map(PathBuf::from)).any(|readable| path.starts_with(readable))
    }
}

fn resolved(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_not_visible_in_the_sandbox_gets_advice() {
        let sandbox = |readable: &[&str]| ProgramSandbox {
            readable: readable.iter().map(PathBuf::from).collect(),
            hidden: Vec::new(),
        };
        let errors = vec!["python: can't open file '/home/me/t.py': [Errno 2] No such file or directory".to_owned()];
        let advice = sandbox(&[]).hint("it ended before it was ready (exit status: 2)", &errors).unwrap();
        assert!(advice.contains("and nothing else: ") && advice.contains("--readable PATH"), "{advice}");
        let advice = sandbox(&["a", "b"]).hint("it ended (exit status: 127)", &[]).unwrap();
        assert!(advice.contains("and a, b: "), "{advice}");
        assert_eq!(sandbox(&[]).hint("it ended (exit status: 1)", &["out of memory".to_owned()]), None);
    }

    #[test]
    fn hidden_folders_are_mounted_after_granted_ones_and_the_blind_side_last() {
        let root = tempfile::tempdir().unwrap();
        let root = resolved(root.path());
        let (set, elsewhere) = (root.join("set"), root.join("nowhere-near/recordings"));
        std::fs::create_dir(&set).unwrap();
        let readable = vec![root.clone()];
        let sandbox = ProgramSandbox { readable: readable.clone(), hidden: vec![set.clone(), elsewhere] };
        let mounts = sandbox.mounts(Path::new("/tmp/blind"));
        let at = |what: &Path| mounts.iter().rposition(|argument| argument == what.as_os_str()).unwrap();
        assert!(at(Path::new("/tmp")) < at(&root) && at(&root) < at(&set), "{mounts:?}");
        assert_eq!(mounts[at(&set) - 1], "--tmpfs");
        assert_eq!(mounts.last().unwrap(), "/tmp/blind");
        assert!(sandbox.shows(&root) && !sandbox.shows(&set) && !sandbox.shows(Path::new("/home")));
        assert!(sandbox.shows_below(root.parent().unwrap()) && !sandbox.shows_below(&set));
        let alone = ProgramSandbox { readable: Vec::new(), hidden: vec![set.clone()] };
        assert!(!alone.mounts(Path::new("/tmp/blind")).contains(&set.into_os_string()), "it is not there at all");
    }

    #[test]
    fn granted_paths_must_exist() {
        let sandbox = ProgramSandbox { readable: vec!["/no/such/folder".into()], hidden: Vec::new() };
        let advice = sandbox.check().unwrap_err().to_string();
        assert!(advice.contains("--readable") && advice.contains("/no/such/folder"), "{advice}");
    }
}
