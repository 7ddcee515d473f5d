//! Programs as trackers, for several tests.

use crate::sandbox::Sandbox;

/// Writes `t.sh`, which never moves (`programs/still.sh`), with these commands at its start and before every answer.
pub(crate) fn write_still(room: &Sandbox, start: &str, frame: &str) {
    let program = include_str!("programs/still.sh");
    room.write("t.sh", program.replacen(": START", start, 1).replacen(": FRAME", frame, 1));
}
