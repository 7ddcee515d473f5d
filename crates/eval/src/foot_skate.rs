//! Slip of feet along the ground while the actor's foot is in stance.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{ContactMeasures, ContactPair, Sequence};
use super::statistics::mean_of;

pub(super) const STANCES: &str = "poses of the tracker's body (estimate_root and estimate_angles), geometry on the feet \
    of both bodies, and frames in which a foot of the actor stands";
pub(super) const TRUE_STANCES: &str = "geometry on the actor's feet, and frames in which a foot stands";

pub(super) const SKATE: Metric = Metric {
    name: "foot_skate_mm_per_s",
    title: "Foot skate",
    meaning: "How fast a foot slides over the ground while the actor's foot stands",
    unit: Unit::MillimetrePerSecond,
    direction: Direction::LowerIsBetter,
    needs: STANCES,
    protocol: "horizontal speed of the lowest material point of the estimate's foot (central difference over one frame \
        before and after), over frames and feet in which the actor's foot stands (exact contact truth); pooled",
    measure: |sequence| skate(sequence, |pair| pair.estimate),
};

pub(super) const TRUE_SKATE: Metric = Metric {
    name: "truth_foot_skate_mm_per_s",
    title: "Foot skate, ground truth",
    direction: Direction::Neither,
    needs: TRUE_STANCES,
    protocol: "as foot_skate_mm_per_s, of the actor: skate in the recording itself",
    measure: |sequence| skate(sequence, |pair| Some(pair.truth)),
    ..SKATE
};

pub(super) const SLIP: Metric = Metric {
    name: "slip_per_stance_mm",
    title: "Slip per stance",
    meaning: "How far a foot slides over the ground from putting it down to lifting it",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: STANCES,
    protocol: "horizontal speed of the lowest material point of the estimate's foot (central difference over one frame \
        before and after), integrated over a stance of the actor's foot (exact contact truth); mean over the stances of \
        both feet",
    measure: |sequence| slip(sequence, |pair| pair.estimate),
};

pub(super) const TRUE_SLIP: Metric = Metric {
    name: "truth_slip_per_stance_mm",
    title: "Slip per stance, ground truth",
    direction: Direction::Neither,
    needs: TRUE_STANCES,
    protocol: "as slip_per_stance_mm, of the actor",
    measure: |sequence| slip(sequence, |pair| Some(pair.truth)),
    ..SLIP
};

pub(super) const PER_FRAME: Metric = Metric {
    name: "foot_skate_per_frame_mm",
    title: "Foot skate, mm per frame (compatibility)",
    meaning: "How far a standing foot slides in one frame; it depends on the frame rate, so compare equal rates only",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: STANCES,
    protocol: "foot_skate_mm_per_s divided by the frame rate, for comparison with published values in mm/frame. \
        Caution: it depends on the frame rate; other works derive contact from the estimate's own height or speed and \
        use a joint instead of the sole: compare only values with the same rate and rule",
    measure: |sequence| per_frame(sequence),
};

pub(super) const RATIO: Metric = Metric {
    name: "skating_ratio",
    title: "Skating ratio (compatibility)",
    meaning: "How often a standing foot slides more than 25 mm in one frame; it depends on the frame rate",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: STANCES,
    protocol: "share of the actor's stance frames in which the estimate's foot moves more than 25 mm along the ground \
        in one frame. Caution: 25 mm a frame are 0.5 m/s at 20 Hz and 3 m/s at 120 Hz, so the same motion has a lower \
        ratio at a higher rate; other works select frames by a height of 50 mm instead of contact",
    measure: |sequence| ratio(sequence),
};

/// Slides in one frame that exceed this count in [`RATIO`], millimetres.
const SLIDE_MM: f64 = 25.0;

/// Selects whose contacts are measured: the estimate's or the actor's.
pub(super) type ContactsOf = for<'a> fn(&ContactPair<'a>) -> Option<ContactMeasures<'a>>;

/// Speeds, mm/s, of the feet that are in stance in the truth; none if the difference involves a frame that is left out
/// or has no pose.
fn speeds_in_stance(sequence: &Sequence<'_>, who: ContactsOf, frame: usize) -> impl Iterator<Item = f64> {
    let pair = sequence.contacts.filter(|_| frame > sequence.first_scored);
    let known = pair.and_then(|pair| Some((pair, who(&pair).filter(|body| body.is_known(frame, 1))?)));
    known.into_iter().flat_map(move |(pair, body)| {
        let feet = pair.truth.ground.feet.iter().zip(&body.ground.feet);
        feet.filter(move |(truth, _)| truth.frames[frame].in_contact)
            .map(move |(_, foot)| 1000.0 * foot.frames[frame].slip_m_per_s())
    })
}

fn pooled(sequence: &Sequence<'_>, value: impl Fn(usize) -> Vec<f64>) -> Option<Measurement> {
    sequence.contacts?;
    let per_frame = sequence.per_scored_frame(|frame| mean_of(value(frame).into_iter()));
    let mean = mean_of(sequence.scored().flat_map(value))?;
    Some(Measurement::Pooled { per_frame, mean })
}

fn skate(sequence: &Sequence<'_>, who: ContactsOf) -> Option<Measurement> {
    pooled(sequence, |frame| speeds_in_stance(sequence, who, frame).collect())
}

fn per_frame(sequence: &Sequence<'_>) -> Option<Measurement> {
    let seconds = 1.0 / sequence.frames_per_second;
    pooled(sequence, |frame| speeds_in_stance(sequence, |p| p.estimate, frame).map(|v| seconds * v).collect())
}

fn ratio(sequence: &Sequence<'_>) -> Option<Measurement> {
    let slides = |speed: f64| f64::from(u8::from(speed / sequence.frames_per_second > SLIDE_MM));
    pooled(sequence, |frame| speeds_in_stance(sequence, |p| p.estimate, frame).map(slides).collect())
}

fn slip(sequence: &Sequence<'_>, who: ContactsOf) -> Option<Measurement> {
    let pair = sequence.contacts?;
    let body = who(&pair)?;
    let of_foot = |foot: usize| {
        let stances = pair.truth.ground.feet[foot].stances().into_iter();
        stances.filter_map(move |stance| {
            let mut frames = stance.start.max(sequence.first_scored + 1)..stance.end;
            let path = frames.clone().map(|f| 1000.0 * body.ground.feet[foot].frames[f].slip_m_per_s());
            let whole = !frames.is_empty() && frames.all(|frame| body.is_known(frame, 1));
            whole.then(|| path.sum::<f64>() / sequence.frames_per_second)
        })
    };
    Some(Measurement::Whole(mean_of((0..2).flat_map(of_foot))?))
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{contacts, measured};

    #[test]
    fn skate_is_measured_in_true_stances_only_and_also_of_the_truth() {
        // frame 0 is left out, and the difference of frame 1 involves it
        let stands = [true, true, true, true, false, true];
        let feet = |speeds: [f64; 6]| stands.iter().zip(speeds).map(|(s, v)| (*s, 0.0, v)).collect::<Vec<_>>();
        let off = [(false, 50.0, 900.0); 6];
        let truth = contacts(&feet([6.0; 6]), &off);
        let estimate = contacts(&feet([9e3, 9e3, 60.0, 30.0, 9e3, 1800.0]), &off);
        let found = measured(&truth, &estimate, [&[0.0; 6]; 2]);
        assert!((found["foot_skate_mm_per_s"].mean - (60.0 + 30.0 + 1800.0) / 3.0).abs() < 1e-9);
        assert_eq!(found["foot_skate_mm_per_s"].per_frame[4], None);
        assert!((found["truth_foot_skate_mm_per_s"].mean - 6.0).abs() < 1e-9);
        assert!((found["foot_skate_per_frame_mm"].mean - (1.0 + 0.5 + 30.0) / 3.0).abs() < 1e-9);
        assert!((found["skating_ratio"].mean - 1.0 / 3.0).abs() < 1e-12, "30 mm in one of three frames");
        // two stances: 1.0 + 0.5 mm and 30 mm
        assert!((found["slip_per_stance_mm"].mean - (1.5 + 30.0) / 2.0).abs() < 1e-9);
        assert!((found["truth_slip_per_stance_mm"].mean - (0.2 + 0.1) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_body_in_flight_does_not_skate() {
        let flying = contacts(&[(false, 500.0, 900.0); 4], &[(false, 500.0, 900.0); 4]);
        let found = measured(&flying, &flying, [&[0.0; 4]; 2]);
        assert!(!found.contains_key("foot_skate_mm_per_s") && !found.contains_key("slip_per_stance_mm"));
    }
}
