//! Why a motion's dynamics cannot be told, or a motion not be simulated.

use crate::contact::ContactError;
use crate::input::excerpt;

/// Why a motion's dynamics cannot be told, or a motion not be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// Where the body touches cannot be told, or a setting makes no sense.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A link that is not there.
    #[error("{:?} has no link number {link}", excerpt(body))]
    NoLink {
        /// Its number.
        link: usize,
        /// The body's name.
        body: String,
    },
    /// A joint that cannot be simulated.
    #[error(
        "joint {:?} is {kind}, which cannot be simulated; write hinges and slides, three hinges for a ball joint",
        excerpt(joint)
    )]
    Joint {
        /// The joint's name.
        joint: String,
        /// What it is.
        kind: &'static str,
    },
    /// A part that would be moved has no mass.
    #[error(
        "{:?} moves link {:?} and all that hangs on it, and none of it has mass; give them an <inertial>",
        excerpt(joint),
        excerpt(link)
    )]
    NoMass {
        /// The joint's name, or the body's where it is the whole body.
        joint: String,
        /// The link that it moves.
        link: String,
    },
    /// Mass properties that no solid has.
    #[error(
        "link {:?} has mass properties that no solid has: expected a mass above 0 and an inertia without negative \
         principal moments; mend its <inertial>",
        excerpt(link)
    )]
    Inertia {
        /// The link's name.
        link: String,
    },
    /// The start is not above the ground.
    #[error(
        "the motion starts {depth_mm:.0} mm under the ground (z = 0); expected at most 100 mm: check `up` and \
         `metres_per_unit` of the recording, or use contact = \"off\""
    )]
    Underground {
        /// How deep, mm.
        depth_mm: f64,
    },
    /// The start is inside something.
    #[error(
        "the motion starts with link {:?} {depth_mm:.0} mm inside the prop {:?}; expected at most 100 mm: move the prop \
         or use contact = \"off\"",
        excerpt(link),
        excerpt(prop)
    )]
    InsideProp {
        /// The link that is deepest.
        link: String,
        /// What it is in.
        prop: String,
        /// How deep, mm.
        depth_mm: f64,
    },
    /// The simulation went out of bounds.
    #[error(
        "frame {frame} (from 0): the simulation has diverged at link {:?}; lower the push or the friction, or use \
         contact = \"fix\"",
        excerpt(link)
    )]
    Diverged {
        /// Frame number.
        frame: usize,
        /// The first link that is lost.
        link: String,
    },
}
