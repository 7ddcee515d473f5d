//! Safe output: results appear at their output path in one step, replace only unmodified output of this program, and an
//! interruption removes partial output, except progress that the same command can resume.

mod artefact;
mod error;
mod inputs;
mod made_by;
mod place;
mod provenance;
mod resumable;
mod unfinished;

pub(crate) use artefact::Artefact;
pub use artefact::{Destination, keep_others_from_junit, put_file};
pub use error::ArtefactError;
pub(crate) use error::{NOTHING_WRITTEN, is_no_room, output};
pub(crate) use inputs::Inputs;
pub(crate) use made_by::{MADE_BY, MadeBy};
pub(crate) use place::{
    LockedPlace, backup_of, of_this_process, parent_of, sibling, sync_parent, write_synced, write_whole,
};
pub use provenance::MANUAL_MARK;
pub(crate) use provenance::{ArtefactKind, LISTING, Listing, is_signed, is_unlisted, is_whole, sign};
pub(crate) use resumable::{Resumable, ResumableKind};
pub use unfinished::abandon;
pub(crate) use unfinished::{Unfinished, remove};

pub(crate) const PLAN_FILE: &str = "plan.json";
pub(crate) const CELLS_FILE: &str = "cells.jsonl";
pub(crate) const REPORTS: &str = "reports";
