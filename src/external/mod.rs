//! External trackers: programs in any language that exchange JSON lines over standard input and output.
//!
//! `docs/protocol.md` describes the messages. `track_seed_with_program` runs a program over a set, one process per
//! seed, in a fresh folder that has only the blind side of the set. A late or invalid answer or a crash costs only the
//! frames concerned; the program is started again a few times.

mod answers;
mod dry_run;
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
pub use session::Programmed;
pub use track_timing::TrackTiming;
pub use workplace::{LeftBehind, LeftFile};

pub(crate) use record::{ANSWERS_FILE, EXTERNAL_FILE};
pub(crate) use session::{ProgramSeed, track_seed_with_program};
