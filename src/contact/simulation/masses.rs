//! From a humanoid's masses to rapier's.

use nalgebra::Vector3;
use rapier3d::prelude::*;

use super::solids::vector;
use crate::body::{Humanoid, Inertia, JointKind};
use crate::contact::ContactError;

/// Whether everything that moves has mass.
pub(super) fn check_masses(body: &Humanoid, fixed: bool) -> Result<(), ContactError> {
    for link in &body.links {
        if let Some(Inertia { mass, tensor, .. }) = &link.inertia {
            let values = tensor.symmetric_eigenvalues();
            let sound = *mass > 0.0 && mass.is_finite() && values.iter().all(|v| v.is_finite() && *v >= -1e-9);
            if !sound {
                return Err(ContactError::Inertia { link: link.name.clone() });
            }
        }
    }
    let root_moves = (!fixed).then_some((body.name.as_str(), 0));
    let moved = body.joints.iter().enumerate().filter(|(_, joint)| joint.kind != JointKind::Fixed);
    let moved = root_moves.into_iter().chain(moved.map(|(index, joint)| (joint.name.as_str(), index + 1)));
    for (joint, link) in moved {
        let mut below = vec![false; body.links.len()];
        for other in link..body.links.len() {
            below[other] = other == link || body.parent(other).is_some_and(|parent| below[parent]);
        }
        if !(0..body.links.len()).any(|other| below[other] && body.links[other].inertia.is_some()) {
            return Err(ContactError::NoMass { joint: joint.to_owned(), link: body.links[link].name.clone() });
        }
    }
    Ok(())
}

/// Mass properties in a frame with its origin at `origin` of the link's.
pub(super) fn mass(inertia: &Option<Inertia>, origin: &Vector3<f64>) -> MassProperties {
    match inertia {
        None => MassProperties::default(),
        Some(Inertia { mass, centre_of_mass, tensor }) => {
            let tensor = tensor.map(|value| value as Real);
            let centre = vector(&(centre_of_mass.coords - origin));
            MassProperties::with_inertia_matrix(centre, *mass as Real, tensor.into())
        }
    }
}
