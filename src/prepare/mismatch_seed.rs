//! The seed from which the mismatch of the tracker's body is drawn.

use crate::scenario::{MismatchBy, Scenario};
use skiagraph_core::body::Humanoid;
use skiagraph_core::rng::{KeyedSeed, Purpose};
use skiagraph_truth::retarget::SegmentLengths;

/// The seed of the scenario, or one derived from it, the `actor` and the observation's key.
pub(crate) fn mismatch_seed(scenario: &Scenario, actor: &Humanoid) -> KeyedSeed {
    let settings = &scenario.tracker_body;
    let seed = u64::from(settings.seed);
    match settings.mismatch_by {
        MismatchBy::Seed => seed.into(),
        MismatchBy::Subject => {
            let keyed = scenario.observation.keyed_seed().with_seed(seed);
            keyed.of_numbers(Purpose::BodyMismatch, &subject(actor))
        }
    }
}

/// What identifies a subject: the lengths of the limbs in whole millimetres. Limbs are rigid, so all recordings of a
/// subject have the same lengths; trunk and shoulders bend.
fn subject(actor: &Humanoid) -> [u64; 4] {
    let SegmentLengths { upper_arm, forearm, thigh, shank, .. } = SegmentLengths::from_body(actor).symmetric();
    [upper_arm, forearm, thigh, shank].map(|[left, _]| left.map_or(u64::MAX, |length| (1e3 * length).round() as u64))
}
