//! Fills in the placeholders of protocols with constants of other modules.

use super::{Metric, Sequence};

/// The metric's protocol for a sequence, with the contact rule that labelled its contacts.
pub(super) fn describe(metric: &Metric, sequence: &Sequence<'_>) -> String {
    let rule = sequence.contacts.map(|pair| pair.truth.ground.rule.describe()).unwrap_or_default();
    let numbers = [("{contact_rule}", rule), ("{likelihood}", likelihood(sequence).to_owned())];
    numbers.iter().fold(metric.protocol.to_owned(), |text, (name, value)| text.replace(name, value))
}

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
    use crate::test_figure::standing;
    use skiagraph_core::contact::ContactRule;

    fn protocols(rule: ContactRule, names: &[&str]) -> Vec<String> {
        let mut flat = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        flat.rule = rule;
        let markers = vec![standing(); 3];
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        let touching = ContactMeasures { ground: &flat, self_depth_m: &[0.0; 3], prop_depth_m: None, known: None };
        sequence.contacts = Some(ContactPair { truth: touching, estimate: Some(touching) });
        names.iter().map(|name| describe(find_metric(name).unwrap(), &sequence)).collect()
    }

    #[test]
    fn no_protocol_has_an_unfilled_placeholder() {
        let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
        for protocol in protocols(ContactRule::default(), &names) {
            assert!(!protocol.contains(['{', '}']) && !protocol.is_empty(), "{protocol}");
        }
    }

    #[test]
    fn the_contact_rule_is_described_by_its_thresholds() {
        let default = &protocols(ContactRule::default(), &["contact_f1"])[0];
        assert!(default.contains("comes at most 20 mm high and 0.25 m/s fast"), "{default}");
        let other =
            ContactRule { enter_gap_m: 0.0125, leave_speed_m_per_s: 0.6, shortest_s: 0.1, ..ContactRule::default() };
        let described = &protocols(other, &["contact_f1"])[0];
        for words in ["at most 12.5 mm", "above 40 mm or 0.6 m/s", "100 ms"] {
            assert!(described.contains(words), "{words}: {described}");
        }
    }
}
