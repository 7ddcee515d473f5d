//! Notes for the user, on standard error.

use std::io::Write;

use crate::input::plain;

/// Tells what the user should know. If nobody listens, there is nothing else to do.
pub(super) fn tell(notes: &[String]) {
    for note in notes {
        writeln!(std::io::stderr(), "note: {}", plain(note)).ok();
    }
}
