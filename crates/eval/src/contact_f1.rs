//! Agreement of the stances of estimate and actor.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::Sequence;

pub(super) const F1: Metric = Metric {
    name: "contact_f1",
    title: "Foot contact, F1",
    meaning: "How well the estimate's feet stand on the ground when the actor's do: 100 % if always and only then",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles), geometry on the feet of both bodies, and a \
        standing foot",
    protocol: "2 TP / (2 TP + FP + FN) over frames and feet, labels of actor and estimate from their own geometry by \
        the same rule: {contact_rule}; absent if neither ever stands",
    measure: f1,
};

fn f1(sequence: &Sequence<'_>) -> Option<Measurement> {
    let pair = sequence.contacts?;
    let estimated = pair.estimate?;
    let (mut both, mut one) = (0_u32, 0_u32);
    for (truth, estimate) in pair.truth.ground.feet.iter().zip(&estimated.ground.feet) {
        for frame in sequence.scored().filter(|frame| estimated.is_known(*frame, 0)) {
            match (truth.frames[frame].in_contact, estimate.frames[frame].in_contact) {
                (true, true) => both += 1,
                (false, false) => {}
                _ => one += 1,
            }
        }
    }
    (both + one > 0).then(|| Measurement::Whole(f64::from(2 * both) / f64::from(2 * both + one)))
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{FootFrame, contacts, measured};

    #[test]
    fn f1_is_two_thirds_for_two_hits_one_miss_and_one_false_stance() {
        let feet = |on: [u8; 4]| -> Vec<FootFrame> { on.iter().map(|&on| (on == 1, 0.0, 0.0)).collect() };
        // frame 0 is left out
        let truth = contacts(&feet([1, 1, 1, 0]), &feet([1, 0, 0, 1]));
        let estimate = contacts(&feet([0, 1, 0, 0]), &feet([0, 0, 1, 1]));
        let found = measured(&truth, &estimate, [&[0.0; 4]; 2]);
        assert!((found["contact_f1"].mean - 4.0 / 6.0).abs() < 1e-12);
        let never = contacts(&feet([0; 4]), &feet([0; 4]));
        assert!(!measured(&never, &never, [&[0.0; 4]; 2]).contains_key("contact_f1"));
    }
}
