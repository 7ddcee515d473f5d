//! How a program is run.

use std::time::Duration;

use super::sandbox::ProgramSandbox;

/// How a program is run.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSettings {
    /// The command line, for the shell.
    pub command: String,
    /// How long it may take until it is ready.
    pub start_limit: Duration,
    /// How long it may take for a frame.
    pub frame_limit: Duration,
    /// How often it is started again after a crash or a time limit, a seed.
    pub restarts: usize,
    /// Silhouettes within the messages instead of paths.
    pub inline: bool,
    /// What it may see in a sandbox; `None` for none: it runs with the rights of its user.
    pub sandbox: Option<ProgramSandbox>,
}

impl ProgramSettings {
    /// Seconds that a program may take for a frame, unless told otherwise.
    pub const FRAME_LIMIT_S: f64 = 30.0;
    /// Seconds that a program may take until it is ready, unless told otherwise.
    pub const START_LIMIT_S: f64 = 60.0;
    /// How often a program is started again, unless told otherwise.
    pub const RESTARTS: u32 = 3;

    /// As without options; the command is empty.
    #[cfg(test)]
    pub(super) fn usual() -> Self {
        Self {
            command: String::new(),
            start_limit: Duration::from_secs_f64(Self::START_LIMIT_S),
            frame_limit: Duration::from_secs_f64(Self::FRAME_LIMIT_S),
            restarts: Self::RESTARTS as usize,
            inline: false,
            sandbox: None,
        }
    }
}
