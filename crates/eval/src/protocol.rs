//! Protocols that name numbers of other rooms, with the numbers filled in.

use super::{Metric, Sequence};
use crate::dynamics::{GRAVITY, GROUND_FRICTION};

/// The metric's protocol for a sequence: the contact rule is the one by which its contacts were labelled.
pub(super) fn describe(metric: &Metric, sequence: &Sequence<'_>) -> String {
    let rule = sequence.contacts.map(|pair| pair.truth.ground.rule.describe()).unwrap_or_default();
    let numbers = [
        ("{contact_rule}", rule),
        ("{gravity}", format!("{GRAVITY} m/s^2")),
        ("{friction}", format!("{GROUND_FRICTION}")),
        ("{likelihood}", likelihood(sequence).to_owned()),
    ];
    numbers.iter().fold(metric.protocol.to_owned(), |text, (name, value)| text.replace(name, value))
}

/// Whose likelihood the energies are of, in words.
fn likelihood(sequence: &Sequence<'_>) -> &'static str {
    match sequence.energies {
        Some(energies) if !energies.is_own => {
            "skiagraph's silhouette likelihood with its default settings, on the set's body, because the program's own is \
            not known"
        }
        _ => "the tracker's own likelihood",
    }
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::contacts;
    use super::super::sequence::ContactMeasures;
    use super::super::{ContactPair, METRICS, find_metric};
    use super::*;
    use crate::contact::ContactRule;
    use crate::test_figure::standing;

    fn protocols(rule: ContactRule, names: &[&str]) -> Vec<String> {
        let mut flat = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        flat.rule = rule;
        let markers = vec![standing(); 3];
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        let touching =
            ContactMeasures { ground: &flat, self_depth_m: &[0.0; 3], prop_depth_m: None, dynamics: None, known: None };
        sequence.contacts = Some(ContactPair { truth: touching, estimate: Some(touching) });
        names.iter().map(|name| describe(find_metric(name).unwrap(), &sequence)).collect()
    }

    #[test]
    fn no_protocol_leaves_a_name_unfilled() {
        let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
        for protocol in protocols(ContactRule::default(), &names) {
            assert!(!protocol.contains(['{', '}']) && !protocol.is_empty(), "{protocol}");
        }
    }

    #[test]
    fn the_contact_rule_is_told_by_its_own_thresholds() {
        let default = &protocols(ContactRule::default(), &["contact_f1"])[0];
        assert!(default.contains("comes at most 20 mm high and 0.25 m/s fast"), "{default}");
        let other =
            ContactRule { enter_gap_m: 0.0125, leave_speed_m_per_s: 0.6, shortest_s: 0.1, ..ContactRule::default() };
        let told = &protocols(other, &["contact_f1"])[0];
        for words in ["at most 12.5 mm", "above 40 mm or 0.6 m/s", "100 ms"] {
            assert!(told.contains(words), "{words}: {told}");
        }
    }

    #[test]
    fn gravity_stands_in_what_is_measured_in_weights_and_by_the_zero_moment_point() {
        for protocol in protocols(ContactRule::default(), &["zmp_outside", "residual_wrench_body_weights"]) {
            assert!(protocol.contains("9.80665 m/s^2"), "{protocol}");
        }
    }
}
