//! Errors of planting and simulation.

use skiagraph_core::contact::ContactError;
use skiagraph_core::input::excerpt;

/// Errors of planting and simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PhysicsError {
    /// Contact cannot be computed, or a setting is invalid.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A link that does not exist.
    #[error("{:?} has no link with index {link}", excerpt(body))]
    NoLink {
        /// Its index.
        link: usize,
        /// The body's name.
        body: String,
    },
    /// A joint that cannot be simulated.
    #[error(
        "joint {:?} is {kind}, which cannot be simulated; write hinges and sliders, three hinges for a ball joint",
        excerpt(joint)
    )]
    Joint {
        /// The joint's name.
        joint: String,
        /// Kind of joint.
        kind: &'static str,
    },
    /// A moving part has no mass.
    #[error(
        "{:?} moves link {:?} and its descendants, and none of them has mass; give them an <inertial>",
        excerpt(joint),
        excerpt(link)
    )]
    NoMass {
        /// The joint's name, or the body's if the whole body has no mass.
        joint: String,
        /// The moved link.
        link: String,
    },
    /// Mass properties that no solid can have.
    #[error(
        "link {:?} has impossible mass properties: expected a mass above 0 and an inertia without negative principal \
        moments; correct its <inertial>",
        excerpt(link)
    )]
    Inertia {
        /// The link's name.
        link: String,
    },
    /// The start is below the ground.
    #[error(
        "the motion starts {depth_mm:.0} mm under the ground (z = 0); expected at most 100 mm: check `up` and \
         `metres_per_unit` of the recording, or use contact = \"off\""
    )]
    Underground {
        /// Depth, mm.
        depth_mm: f64,
    },
    /// The start is inside a prop.
    #[error(
        "the motion starts with link {:?} {depth_mm:.0} mm inside the prop {:?}; expected at most 100 mm: move the prop \
         or use contact = \"off\"",
        excerpt(link),
        excerpt(prop)
    )]
    InsideProp {
        /// The deepest link.
        link: String,
        /// The prop.
        prop: String,
        /// Depth, mm.
        depth_mm: f64,
    },
    /// The simulation diverged.
    #[error(
        "frame {frame} (from 0): the simulation diverged at link {:?}; lower the push or the friction, or use \
         contact = \"fix\"",
        excerpt(link)
    )]
    Diverged {
        /// Frame number.
        frame: usize,
        /// The first diverged link.
        link: String,
    },
}
