//! Trackers that are programs of their own, in any language: JSON lines over standard input and output.
//!
//! `docs/protocol.md` describes the messages. [`track_with_program`] runs a program over a set, a process a seed; the
//! program is handed a fresh folder that holds the blind side of the set alone. A time limit that passes, a crash or an
//! answer that makes no sense costs the frames that it concerns; the program is started again a few times.

mod answers;
mod dry_run;
mod guard;
mod program;
mod protocol;
mod record;
mod sandbox;
mod session;
pub(crate) mod start_check;
mod track_timing;
mod workplace;

pub use dry_run::{Conformance, ProtocolCheck, dry_run};
pub use record::{AnswerCount, ExternalRecord, Incident, ProgramOptions, ProgramSettings, SeedEnding};
pub use sandbox::ProgramSandbox;
pub use session::{Programmed, track_with_program};
pub use track_timing::TrackTiming;
pub use workplace::{LeftBehind, LeftFile};

pub(crate) use record::{ANSWERS_FILE, EXTERNAL_FILE};
pub(crate) use session::{ProgramSeed, track_seed_with_program};
