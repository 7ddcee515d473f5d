//! Feet for tests of contact metrics.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use skiagraph_core::contact::{ContactRule, ContactTrack, FOOT_NAMES, GroundContact, GroundContacts};

use super::evaluate::MetricValue;
use super::{ContactMeasures, ContactPair, Sequence, evaluate};
use crate::test_figure::standing;

/// A foot in one frame: whether it is in stance, its gap (mm) and its speed along x (mm/s).
pub(crate) type FootFrame = (bool, f64, f64);

/// Both feet at 60 Hz; no other link.
pub(crate) fn contacts(left: &[FootFrame], right: &[FootFrame]) -> GroundContacts {
    let track = |name: &str, feet: &[FootFrame]| ContactTrack {
        name: name.to_owned(),
        links: vec![0],
        frames: feet
            .iter()
            .map(|&(in_contact, gap, speed)| GroundContact {
                gap_m: 0.001 * gap,
                point: Point3::new(0.0, 0.0, 0.001 * gap),
                link: 0,
                velocity: Vector3::new(0.001 * speed, 0.0, -7.0),
                in_contact,
            })
            .collect(),
    };
    let feet = [track(FOOT_NAMES[0], left), track(FOOT_NAMES[1], right)];
    GroundContacts { frames_per_second: 60.0, rule: ContactRule::default(), links: feet.to_vec(), feet }
}

/// Every metric of an estimate whose markers are right and whose feet are these; self-penetration in mm.
pub(crate) fn measured(
    truth: &GroundContacts,
    estimate: &GroundContacts,
    self_mm: [&[f64]; 2],
) -> BTreeMap<String, MetricValue> {
    let markers = vec![standing(); truth.feet[0].frames.len()];
    let [true_depths, depths] = self_mm.map(|mm| mm.iter().map(|d| 0.001 * d).collect::<Vec<_>>());
    let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
    let body =
        |ground, depths| ContactMeasures { ground, self_depth_m: depths, prop_depth_m: Some(depths), known: None };
    sequence.contacts = Some(ContactPair { truth: body(truth, &true_depths), estimate: Some(body(estimate, &depths)) });
    evaluate(&sequence).unwrap().metrics
}
