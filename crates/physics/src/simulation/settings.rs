//! Settings of simulations.

use nalgebra::{Unit, Vector3};

use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, Prop};
use skiagraph_core::contact::ContactError;
use skiagraph_core::input::excerpt;

/// Settings of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationSettings {
    /// Coulomb friction coefficient, of the ground and of the body against itself.
    pub friction: f64,
    /// Bound on the residual wrench at the root that helps the body to follow the motion, in body weights (see
    /// [`super::SimulationReport::root_wrench_mean`]); 0 for no help.
    pub root_wrench: f64,
    /// Pushes on the body.
    pub pushes: Vec<Push>,
    /// The props.
    pub props: Vec<Prop>,
    /// Playback speed of each frame relative to the recording ([`skiagraph_core::contact::Pace`]); empty for
    /// the recorded speed.
    pub pace: Vec<f64>,
}

/// A push: a constant force for [`Push::DURATION_S`] at a link's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Start time, seconds from the first frame.
    pub at_s: f64,
    /// Index of the link.
    pub link: usize,
    /// Impulse, newton seconds, >= 0.
    pub impulse_ns: f64,
    /// Direction, world.
    pub direction: Unit<Vector3<f64>>,
}

impl Push {
    /// Duration of a push, seconds: that of a shove with the hands rather than an impact.
    pub const DURATION_S: f64 = 0.1;
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self { friction: 0.8, root_wrench: 0.0, pushes: Vec::new(), props: Vec::new(), pace: Vec::new() }
    }
}

impl SimulationSettings {
    /// Checks the values for this body and a motion of this duration.
    pub(super) fn check(&self, body: &Humanoid, duration_s: f64) -> Result<(), PhysicsError> {
        let valid = |value: f64| value.is_finite() && value >= 0.0;
        let numbers = [("friction", self.friction), ("root_wrench", self.root_wrench)];
        let pushes = self.pushes.iter().flat_map(|p| [("push.at", p.at_s), ("push.impulse_ns", p.impulse_ns)]);
        if let Some((key, found)) = numbers.into_iter().chain(pushes).find(|(_, value)| !valid(*value)) {
            return Err(ContactError::of_key(key, "a finite number, 0 or more", found).into());
        }
        if let Some(late) = self.pushes.iter().find(|push| push.at_s >= duration_s) {
            let expected = "a time, in seconds, before the motion's end";
            return Err(ContactError::of_key("push.at", expected, late.at_s).into());
        }
        match self.pushes.iter().find(|push| push.link >= body.links.len()) {
            Some(Push { link, .. }) => {
                Err(PhysicsError::Refused(format!("{:?} has no link with index {link}", excerpt(&body.name))))
            }
            None => Ok(()),
        }
    }
}
