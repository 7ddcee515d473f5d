//! What programs do with this package: the functions at its root, which do what the commands of the same names do.

mod compared;
mod measured;
mod render;
mod track;

pub use compared::{RunSide, compare};
pub use measured::{Measured, measure};
pub use render::render;
pub use track::{TrackerSource, track};

/// Refuses to replace a result: a program does not say which of its calls made it. Without `force` it is an error,
/// with it the result is moved aside.
fn never_replaced(to: crate::artefacts::Destination<'_>) -> Option<String> {
    to.path.symlink_metadata().is_ok().then(|| "saved by a program".to_owned())
}
