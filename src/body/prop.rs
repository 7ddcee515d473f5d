//! What stands about besides the body.

use super::Flesh;

/// A solid that stands still in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Prop {
    /// Its name.
    pub name: String,
    /// Its shape and place: the frame that [`Flesh`] calls the link's is the world.
    pub solid: Flesh,
}
