//! Errors of motion editing.

use skiagraph_core::contact::ContactError;

/// Why a motion cannot be edited.
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// A take without poses similar to those of the take before, or shorter than a blend needs.
    #[error("{problem}")]
    Take {
        /// Index of the take, from 0; 0 for a take that follows itself.
        index: usize,
        /// The takes, what was expected and what was found.
        problem: String,
    },
    /// A path that feet cannot follow or that has too few waypoints, or a motion that stays in place, or whose own path
    /// bends during a stance while the given one does not.
    #[error("{0}")]
    Path(String),
    /// The stances of the feet cannot be determined.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
