//! What programs do with this package: the functions at its root, which do what the commands of the same names do.

mod compared;
mod measured;
mod render;
mod track;

pub use compared::{RunSide, compare};
pub use measured::{Measured, measure};
pub use render::render;
pub use track::{TrackerSource, track};

use serde_json::json;

use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, MadeBy};

/// Begins the folder of a run, and refuses to replace a result: a program does not say which of its calls made it.
/// Without `force` that is an error, with it the result is moved aside.
fn begin_saved(to: Destination<'_>) -> Result<Artefact, ArtefactError> {
    let difference = to.path.symlink_metadata().is_ok().then(|| "saved by a program".to_owned());
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, difference)?;
    Ok(directory.made_by(MadeBy::new("a program that uses this library", json!({}))))
}
