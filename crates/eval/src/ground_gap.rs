//! Penetration of the ground, and height of the feet while the actor's foot is in stance.

use super::foot_skate::{ContactsOf, STANCES, TRUE_STANCES};
use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::Sequence;
use super::statistics::mean_of;

pub(super) const PENETRATION: Metric = Metric {
    name: "ground_penetration_mm",
    title: "Ground penetration",
    meaning: "How deep the lowest point of the body is in the ground",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles) and geometry on its feet",
    protocol: "depth below z = 0 of the lowest point of the tracker's body in the estimated pose, 0 if all of it is \
        above; mean over frames",
    measure: |sequence| penetration(sequence, |pair| pair.estimate),
};

pub(super) const TRUE_PENETRATION: Metric = Metric {
    name: "truth_ground_penetration_mm",
    title: "Ground penetration, ground truth",
    direction: Direction::Neither,
    needs: "geometry on the actor's feet",
    protocol: "as ground_penetration_mm, of the actor",
    measure: |sequence| penetration(sequence, |pair| Some(pair.truth)),
    ..PENETRATION
};

pub(super) const FLOAT: Metric = Metric {
    name: "foot_float_mm",
    title: "Float in stance",
    meaning: "How high a foot floats above the ground while the actor's foot stands",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: STANCES,
    protocol: "height above z = 0 of the lowest point of the estimate's foot, 0 if it is below, over frames and feet in \
        which \
               the actor's foot stands; pooled",
    measure: |sequence| float(sequence, |pair| pair.estimate),
};

pub(super) const TRUE_FLOAT: Metric = Metric {
    name: "truth_foot_float_mm",
    title: "Float in stance, ground truth",
    direction: Direction::Neither,
    needs: TRUE_STANCES,
    protocol: "as foot_float_mm, of the actor",
    measure: |sequence| float(sequence, |pair| Some(pair.truth)),
    ..FLOAT
};

fn penetration(sequence: &Sequence<'_>, who: ContactsOf) -> Option<Measurement> {
    let body = who(&sequence.contacts?)?;
    let deepest = |frame: usize| {
        let links = body.ground.links.iter();
        let depths = links.map(|link| 1000.0 * link.frames[frame].penetration_m());
        body.is_known(frame, 0).then(|| depths.fold(0.0, f64::max))
    };
    Some(Measurement::PerFrame(sequence.per_scored_frame(deepest)))
}

fn float(sequence: &Sequence<'_>, who: ContactsOf) -> Option<Measurement> {
    let pair = sequence.contacts?;
    let body = who(&pair)?;
    let heights = |frame: usize| {
        let feet = pair.truth.ground.feet.iter().zip(&body.ground.feet).filter(move |_| body.is_known(frame, 0));
        feet.filter(move |(truth, _)| truth.frames[frame].in_contact)
            .map(move |(_, foot)| 1000.0 * foot.frames[frame].gap_m.max(0.0))
    };
    let per_frame = sequence.per_scored_frame(|frame| mean_of(heights(frame)));
    let mean = mean_of(sequence.scored().flat_map(heights))?;
    Some(Measurement::Pooled { per_frame, mean })
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{contacts, measured};

    #[test]
    fn the_deepest_part_penetrates_and_standing_feet_float() {
        let truth = contacts(
            &[(true, -2.0, 0.0); 4],
            &[(false, 80.0, 0.0), (true, 1.0, 0.0), (true, 3.0, 0.0), (false, 9.0, 0.0)],
        );
        let left = [(true, 99.0, 0.0), (true, -10.0, 0.0), (true, 30.0, 0.0), (true, 0.0, 0.0)];
        let right = [(true, 99.0, 0.0), (true, -40.0, 0.0), (true, 6.0, 0.0), (true, 50.0, 0.0)];
        let found = measured(&truth, &contacts(&left, &right), [&[0.0; 4]; 2]);
        assert!((found["ground_penetration_mm"].mean - 40.0 / 3.0).abs() < 1e-9, "40, 0 and 0 mm");
        assert!((found["truth_ground_penetration_mm"].mean - 2.0).abs() < 1e-9);
        // left foot in stance in frames 1 to 3, right foot in 1 and 2: 0, 30, 0 and 0, 6 mm
        assert!((found["foot_float_mm"].mean - 36.0 / 5.0).abs() < 1e-9);
        assert!((found["truth_foot_float_mm"].mean - 4.0 / 5.0).abs() < 1e-9);
        assert_eq!(found["foot_float_mm"].per_frame[2], Some(18.0));
    }
}
