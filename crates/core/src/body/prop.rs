//! Props: fixed solids in the scene.

use super::Solid;

/// A solid that is fixed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Prop {
    /// Its name.
    pub name: String,
    /// Its shape and position; the link frame of [`Solid`] is the world frame here.
    pub solid: Solid,
}
