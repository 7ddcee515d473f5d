//! Converts a humanoid's masses to rapier's.

use nalgebra::{Matrix3, Vector3};
use rapier3d::prelude::*;

use super::solids::vector;
use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, Inertia, JointKind};
use skiagraph_core::input::excerpt;

/// Every principal moment is at least that of a sphere of this radius, metres: a link without extent has no inertia
/// about some axis, and its descendants would be accelerated without bound.
const LEAST_RADIUS: f64 = 1e-3;

/// Checks that every moving part has mass.
pub(super) fn check_masses(body: &Humanoid, fixed: bool) -> Result<(), PhysicsError> {
    for link in &body.links {
        if let Some(Inertia { mass, tensor, .. }) = &link.inertia {
            let values = tensor.symmetric_eigenvalues();
            let valid = *mass > 0.0 && mass.is_finite() && values.iter().all(|v| v.is_finite() && *v >= -1e-9);
            if !valid {
                return Err(PhysicsError::Refused(format!(
                    "link {:?} has impossible mass properties: expected a mass above 0 and an inertia without negative \
                     principal moments; correct its <inertial>",
                    excerpt(&link.name)
                )));
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
            return Err(PhysicsError::Refused(format!(
                "{:?} moves link {:?} and its descendants, and none of them has mass; give them an <inertial>",
                excerpt(joint),
                excerpt(&body.links[link].name)
            )));
        }
    }
    Ok(())
}

/// Mass properties in a frame with its origin at `origin` in the link's frame.
pub(super) fn mass(inertia: &Option<Inertia>, origin: &Vector3<f64>) -> MassProperties {
    match inertia {
        None => MassProperties::default(),
        Some(Inertia { mass, centre_of_mass, tensor }) => {
            let tensor = raised(tensor, 0.4 * mass * LEAST_RADIUS * LEAST_RADIUS).map(|value| value as Real);
            let centre = vector(&(centre_of_mass.coords - origin));
            MassProperties::with_inertia_matrix(centre, *mass as Real, tensor.into())
        }
    }
}

/// The inertia with every principal moment raised to at least `least`; unchanged if none is smaller.
fn raised(tensor: &Matrix3<f64>, least: f64) -> Matrix3<f64> {
    if tensor.symmetric_eigenvalues().iter().all(|moment| *moment >= least) {
        return *tensor;
    }
    let mut principal = tensor.symmetric_eigen();
    principal.eigenvalues.apply(|moment| *moment = moment.max(least));
    principal.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_moments_are_raised_and_others_are_unchanged_to_the_bit() {
        let valid = Matrix3::new(0.2, 0.01, 0.0, 0.01, 0.3, -0.02, 0.0, -0.02, 0.25);
        assert_eq!(raised(&valid, 1e-7), valid);
        assert_eq!(raised(&Matrix3::zeros(), 1e-7), Matrix3::from_diagonal_element(1e-7));
        let flat = Matrix3::from_diagonal(&Vector3::new(0.2, 0.2, -5e-20));
        let moments = raised(&flat, 1e-7).symmetric_eigenvalues();
        assert!((moments.min() - 1e-7).abs() < 1e-15 && (moments.max() - 0.2).abs() < 1e-15, "{moments}");
    }
}
