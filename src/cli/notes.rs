//! Notes for the user, on standard error.

use std::io::Write;

/// Tells what the user should know. If nobody listens, there is nothing else to do.
pub(super) fn tell(notes: &[String]) {
    for note in notes {
        writeln!(std::io::stderr(), "note: {note}").ok();
    }
}
