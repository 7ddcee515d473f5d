//! Markers: placed by links named `marker_NAME`, otherwise proposed from names and shape.
//!
//! Legs and arms are found by the names of their links and joints, else by shape: the two mirrored chains that reach
//! lowest are legs; of the others, those that reach farthest to the sides are arms. Within a limb, names identify the
//! joints, else the middle joint is the one farthest from both ends; one that turns a bone about its length gives way
//! to one that bends. A joint of several hinges is at the intersection of their axes. Positions on trunk and head
//! without names follow human proportions (`[Drillis 1966]`). Every proposal can be overridden individually.

mod limb;
mod names;
mod proposal;
mod rigid_part;
#[cfg(test)]
mod tests;

use roxmltree::Node;

use super::UrdfError;
use super::document::Document;
use crate::body::{Joint, JointKind, LANDMARKS, Link, LinkPoint};

pub(super) use proposal::propose;

pub(super) type MarkerSet = [Option<LinkPoint>; LANDMARKS.len()];

/// The marker defined by a link with this name.
pub(super) fn slot(link: &str) -> Option<usize> {
    let name = link.strip_prefix("marker_")?;
    LANDMARKS.iter().position(|l| l.name() == name)
}

/// The position of the marker `link` on the parent link of `joint`.
pub(super) fn place(
    document: &Document<'_>,
    node: Node<'_, '_>,
    link: &Link,
    joint: &Joint,
) -> Result<LinkPoint, UrdfError> {
    if !link.solids.is_empty() || link.inertia.is_some() || joint.kind != JointKind::Fixed {
        return Err(document.refuse(node, "a marker must be a link without mass and geometry on a fixed joint"));
    }
    Ok(LinkPoint { link: joint.parent, point_in_link: joint.parent_from_joint.translation.vector.into() })
}
