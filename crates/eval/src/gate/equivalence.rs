//! Whether two kinds of runs are equivalent within a margin.

use super::GateVerdict;
use crate::Interval;
use crate::comparison::{Difference, DifferenceRule};

/// Pass if the 95 % interval of the difference lies within the margin on both sides, fail if it lies beyond, otherwise
/// inconclusive: two one-sided tests (`[Schuirmann 1987]`). Runs that never vary are compared by their difference.
pub fn equivalence(found: &Difference, margin: f64) -> GateVerdict {
    match (found.ci95, found.rule) {
        (Some(Interval { low, high }), _) if low > -margin && high < margin => GateVerdict::Pass,
        (Some(Interval { low, high }), _) if low >= margin || high <= -margin => GateVerdict::Fail,
        (None, DifferenceRule::Exact) if found.difference.abs() <= margin => GateVerdict::Pass,
        (None, DifferenceRule::Exact) => GateVerdict::Fail,
        _ => GateVerdict::Inconclusive,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::IntervalUnit;
    use crate::comparison::{ClipValues, difference};

    fn verdict(shift: f64, spread: f64) -> GateVerdict {
        let values = |first: u64, shift: f64| {
            let errors = [-1.0, 1.0, 0.5, -0.5, 0.0].map(|e| 30.0 + shift + spread * e);
            (first..).zip(errors).collect::<Vec<_>>()
        };
        let clip = ClipValues { base: values(0, 0.0), other: values(100, shift) };
        equivalence(&difference(&[clip], false, IntervalUnit::Seeds).unwrap(), 2.0)
    }

    #[test]
    fn both_sides_of_the_margin_count_and_wide_intervals_decide_nothing() {
        assert_eq!([0.2, -0.2].map(|shift| verdict(shift, 0.5)), [GateVerdict::Pass; 2]);
        assert_eq!([4.0, -4.0].map(|shift| verdict(shift, 0.5)), [GateVerdict::Fail; 2], "better is not equivalent");
        assert_eq!(verdict(1.9, 1.0), GateVerdict::Inconclusive);
        assert_eq!(verdict(0.0, 9.0), GateVerdict::Inconclusive);
        assert_eq!([0.5, 2.5].map(|shift| verdict(shift, 0.0)), [GateVerdict::Pass, GateVerdict::Fail], "no spread");
    }
}
