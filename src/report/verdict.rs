//! The verdict on a run: a summary, its grade with limits, and the likely cause of its error.

use serde::{Deserialize, Serialize};

use super::ReportInput;
use super::grading::{Criterion, Grade, WrongInput, criteria, never_estimated, percent};
use crate::evaluation::METRICS;

/// Fewer frames are counted, not given in per cent.
const FEW_FRAMES: usize = 20;
/// Shares of the frames that are no majority.
const UNDECIDED: std::ops::RangeInclusive<f64> = 0.4..=0.6;
/// Where to find what the sign of the energy gap does not tell.
const EXPLAIN: &str = " `skiagraph explain RUN` divides the error among its causes.";

/// The verdict on a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The worst grade of all criteria.
    pub grade: Grade,
    /// A few sentences: the grade, the error with the share of frames with a lost limb, the limiting criteria, the
    /// longest stretch of a lost limb, and the markers that are not graded.
    pub line: String,
    /// The criteria with their limits.
    pub criteria: Vec<Criterion>,
    /// Names of the metrics that are worse than those of a tracker that never moves, in table order; without metrics of
    /// the estimate's own motion ([`crate::evaluation::Metric::has_frozen_floor`]).
    pub worse_than_frozen: Vec<String>,
    /// Whether the images prefer the estimate or the true pose; absent if energies are unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

/// Grades a run and describes it.
pub fn verdict(input: &ReportInput<'_>) -> Verdict {
    let criteria = criteria(input);
    let grade = criteria.iter().map(|criterion| criterion.grade).max().unwrap_or(Grade::Lost);
    let worse_than_frozen = worse_than_frozen(input);
    let (error, lost) = (describe_error(input), describe_lost_limb(input));
    let (limits, longest, not_graded) = (limited_by(grade, &criteria), where_lost(input), not_graded(input));
    let line = format!("{}: {error}{lost}.{limits}{longest}{not_graded}", grade.title());
    Verdict { grade, line, criteria, worse_than_frozen, cause: cause(input, grade) }
}

fn describe_error(input: &ReportInput<'_>) -> String {
    let Some(error) = input.summary.metrics.get("humaneva_mm") else {
        return "the error could not be measured".to_owned();
    };
    let seeds = input.runs.len();
    let certainty = match error.ci95 {
        Some(ends) => format!("95 % interval {:.0} to {:.0} mm over {seeds} seeds", ends.low, ends.high),
        None => error.interval.clone(),
    };
    format!("the mean marker error is {:.0} mm ({certainty})", error.mean)
}

/// In how many frames a marker is far off, which the mean hides.
fn describe_lost_limb(input: &ReportInput<'_>) -> String {
    let share = input.summary.metrics.get("lost_limb").map(|lost| lost.mean);
    match (share, lacks_markers(input)) {
        (None, _) => String::new(),
        (Some(0.0), false) => ", no marker is ever more than 150 mm off".to_owned(),
        (Some(0.0), true) => ", no estimated marker is ever more than 150 mm off".to_owned(),
        (Some(share), false) => format!(", a marker is more than 150 mm off in {} of the frames", percent(share)),
        (Some(share), true) => {
            format!(", a marker is missing or more than 150 mm off in {} of the frames", percent(share))
        }
    }
}

/// Whether any marker has no estimate in some frames.
fn lacks_markers(input: &ReportInput<'_>) -> bool {
    input.summary.metrics.get("coverage").is_some_and(|coverage| coverage.mean < 1.0)
}

/// A sentence, after a space, on the longest stretch with a lost limb, or if no stretch is long, on the marker with the
/// largest error; empty if no limb is lost.
fn where_lost(input: &ReportInput<'_>) -> String {
    let Some(longest) = &input.summary.longest_lost else { return worst_marker(input) };
    let words = longest.stretch.describe(lacks_markers(input));
    let (first, rest) = words.split_at(words.chars().next().map_or(0, char::len_utf8));
    let seed = if input.runs.len() > 1 { format!(" (seed {})", longest.run.seed) } else { String::new() };
    format!(" Longest stretch: {}{rest}{seed}.", first.to_lowercase())
}

/// A sentence, after a space, on the marker with the largest mean error, if any limb is lost.
fn worst_marker(input: &ReportInput<'_>) -> String {
    let lost = input.summary.metrics.get("lost_limb").is_some_and(|lost| lost.mean > 0.0);
    let worst = input.summary.per_joint.iter().filter(|_| lost).max_by(|a, b| a.mean_mm.total_cmp(&b.mean_mm));
    worst.map_or_else(String::new, |worst| {
        format!(" Largest mean error: {}, {:.0} mm.", worst.joint.replace('_', " "), worst.mean_mm)
    })
}

/// A sentence, after a space, on the markers that the estimate never has; empty if there are none.
fn not_graded(input: &ReportInput<'_>) -> String {
    let names: Vec<String> = never_estimated(input).iter().map(|name| name.replace('_', " ")).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(" Not graded, because never estimated: {}.", names.join(", "))
    }
}

/// The criteria that determine the grade, unless it is the best.
fn limited_by(grade: Grade, criteria: &[Criterion]) -> String {
    let worst: Vec<&str> = criteria.iter().filter(|c| c.grade == grade).map(|c| c.finding.as_str()).collect();
    if grade == Grade::Good { String::new() } else { format!(" Grade limited by: {}.", worst.join("; ")) }
}

fn worse_than_frozen(input: &ReportInput<'_>) -> Vec<String> {
    let Some(frozen) = input.frozen else { return vec![] };
    let is_worse = |name: &str| Some((input.summary.metrics.get(name)?.mean, frozen.metrics.get(name)?.mean));
    let compared = METRICS.iter().filter(|metric| metric.has_frozen_floor());
    let worse = compared.filter(|m| is_worse(m.name).is_some_and(|(value, floor)| m.is_worse(value, floor)));
    worse.map(|metric| metric.name.to_owned()).collect()
}

/// Whether the images fit the truth or the estimate better, from the sign of the energy gap in each frame: in the
/// frames with a lost limb if there are any and the run is not good, else in all.
fn cause(input: &ReportInput<'_>, grade: Grade) -> Option<String> {
    let lost = gaps(input, |lost| lost > 0.0);
    let of_lost = grade != Grade::Good && !lost.is_empty();
    let (gaps, lost) = if of_lost { (lost, "a marker over 150 mm off") } else { (gaps(input, |_| true), "") };
    let seen = if lacks_images(input) { "an image" } else { "" };
    let having: Vec<&str> = [seen, lost].into_iter().filter(|words| !words.is_empty()).collect();
    let which = if having.is_empty() { "frames".to_owned() } else { format!("frames with {}", having.join(" and ")) };
    let which = which.as_str();
    let told: Vec<f64> = gaps.iter().copied().filter(|gap| *gap != 0.0).collect();
    let alike = gaps.len() - told.len();
    let alike =
        format!("In {} the images fit both poses alike, as empty images do.", part_of(alike, gaps.len(), which));
    if told.is_empty() {
        return of_lost.then_some(alike);
    }
    let (first, which) = if told.len() == gaps.len() {
        (String::new(), which.to_owned())
    } else {
        (alike + " ", format!("other {which}"))
    };
    let wrong = told.iter().filter(|gap| **gap > 0.0).count();
    Some(first + &preferred_pose(input, grade, [wrong, told.len()], &which))
}

/// Which pose the images prefer in most frames, and what follows; `wrong` of `all` frames prefer the estimate.
fn preferred_pose(input: &ReportInput<'_>, grade: Grade, [wrong, all]: [usize; 2], which: &str) -> String {
    let (estimate, truth) = (part_of(wrong, all, which), part_of(all - wrong, all, which));
    let share = wrong as f64 / all as f64;
    if input.own_likelihood && share >= 0.5 && grade == Grade::Good {
        let inputs: Vec<&str> = misleading_inputs(input).collect();
        let expected = match (input.matched, inputs.is_empty()) {
            (true, true) => "of a small error".to_owned(),
            (true, false) => format!("with {}", listed(inputs.into_iter())),
            (false, true) => "if the tracker's body differs from the actor's".to_owned(),
            (false, false) => {
                format!("if the tracker's body differs from the actor's, and with {}", listed(inputs.into_iter()))
            }
        };
        return format!(
            "In {estimate} the images fit the estimate better than the true pose (refitted to the tracker's body); this is \
             expected {expected}."
        );
    }
    if UNDECIDED.contains(&share) {
        return format!(
            "In {estimate} the images fit the estimate better than the true pose, in the others the true pose, \
             so this does not tell the cause.{EXPLAIN}"
        );
    }
    match (input.own_likelihood, share >= 0.5) {
        (true, true) => format!(
            "In {estimate} the images fit the estimate better than the true pose (refitted to the tracker's body): there, a \
             wrong pose fits better because of {}.{EXPLAIN}",
            listed(["the likelihood", "the body model"].into_iter().chain(misleading_inputs(input)))
        ),
        (true, false) => {
            let inputs: Vec<&str> = wrong_inputs(input).map(WrongInput::name).collect();
            let why = match inputs.as_slice() {
                [] => String::new(),
                inputs => {
                    format!(" The cause may still be the input ({}), which misleads a search too.", inputs.join(", "))
                }
            };
            format!(
                "In {truth} the images fit the true pose (refitted to the tracker's body) better than the estimate: there, \
                 the search missed a better pose.{why}{EXPLAIN}"
            )
        }
        (false, true) => format!(
            "In {estimate} the silhouettes fit the estimate better than the true pose, by skiagraph's likelihood on the \
             set's body: there, silhouettes and this body cannot distinguish the two poses."
        ),
        (false, false) => format!(
            "In {truth} the silhouettes fit the true pose better than the estimate, by skiagraph's likelihood on the set's \
             body: there, the images show a better pose than the program found."
        ),
    }
}

fn wrong_inputs(input: &ReportInput<'_>) -> impl Iterator<Item = WrongInput> {
    input.observation.map(WrongInput::all).unwrap_or_default().into_iter()
}

/// The wrong inputs with which a wrong pose may fit better than the true one.
fn misleading_inputs<'a>(input: &'a ReportInput<'_>) -> impl Iterator<Item = &'static str> + 'a {
    wrong_inputs(input).filter(|input| *input != WrongInput::WrongStart).map(WrongInput::name)
}

/// `the likelihood, the body model or wrong cameras`.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    match names.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        names => names.concat(),
    }
}

/// A part of the frames: in per cent, or counted if there are few.
fn part_of(count: usize, all: usize, which: &str) -> String {
    if all < FEW_FRAMES {
        format!("{count} of the {all} {which}")
    } else {
        format!("{} of the {which}", percent(count as f64 / all as f64))
    }
}

/// Whether energies are missing although no estimate is: where no camera took an image.
fn lacks_images(input: &ReportInput<'_>) -> bool {
    let gaps = input.runs.iter().filter_map(|run| run.run.evaluation.metrics.get("energy_gap"));
    // the first frame is not scored
    !lacks_markers(input) && gaps.into_iter().any(|gap| gap.per_frame.iter().skip(1).any(Option::is_none))
}

/// The energy gaps of all frames whose share of lost limbs is as asked. Frames whose images are empty have a gap of 0.
fn gaps(input: &ReportInput<'_>, is_asked: impl Fn(f64) -> bool) -> Vec<f64> {
    let mut found = Vec::new();
    for run in input.runs {
        let of = |name: &str| run.run.evaluation.metrics.get(name).map(|metric| metric.per_frame.as_slice());
        let (gaps, lost) = (of("energy_gap").unwrap_or_default(), of("lost_limb").unwrap_or_default());
        let lost = lost.iter().map(|lost| lost.unwrap_or(0.0)).chain(std::iter::repeat(0.0));
        found.extend(gaps.iter().zip(lost).filter(|(_, lost)| is_asked(*lost)).filter_map(|(gap, _)| *gap));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

    #[test]
    fn a_run_that_follows_is_good_and_says_how_sure_it_is() {
        let verdict = with_input(&Story { seeds: 3, ..Story::default() }, verdict);
        assert_eq!(verdict.grade, Grade::Good, "{:?}", verdict.criteria);
        assert!(verdict.line.starts_with("Good: the mean marker error is "), "{}", verdict.line);
        assert!(
            verdict.line.contains("95 % interval")
                && verdict.line.ends_with("over 3 seeds), no marker is ever more than 150 mm off."),
            "{}",
            verdict.line
        );
    }

    #[test]
    fn one_and_two_seeds_have_no_interval_and_a_lost_body_is_not_good() {
        let verdict_of = |seeds| with_input(&Story { seeds, lost_from: Some(60), ..Story::default() }, verdict);
        let of_one = verdict_of(1);
        assert!(of_one.grade > Grade::Usable, "{of_one:?}");
        assert!(
            of_one.line.contains("1 seed: no interval") && of_one.line.contains("Grade limited by"),
            "{}",
            of_one.line
        );
        assert!(verdict_of(2).line.contains("2 seeds: no interval"));
    }

    /// An estimate that is 149 mm off in every frame has no frame counted as lost.
    #[test]
    fn an_estimate_that_is_149_mm_off_in_every_frame_is_poor() {
        let verdict = with_input(&Story { beside_m: 0.149, ..Story::default() }, verdict);
        assert!(verdict.grade >= Grade::Poor, "{verdict:?}");
        assert!(
            verdict.line.contains("error is 149 mm") || verdict.line.contains("error is 150 mm"),
            "{}",
            verdict.line
        );
    }

    #[test]
    fn exchanged_limbs_in_all_frames_are_poor_regardless_of_the_error() {
        let verdict = with_input(&Story { exchanged: true, ..Story::default() }, verdict);
        assert!(verdict.grade >= Grade::Poor, "{verdict:?}");
        let swaps = verdict.criteria.iter().find(|criterion| criterion.metric == "limbs_exchanged").unwrap();
        assert!(swaps.grade == Grade::Poor && swaps.value > 0.8, "{swaps:?}");
    }

    /// The mean error is below 50 mm even with a wrist that is half a metre off for 41 frames or more.
    #[test]
    fn a_small_mean_with_a_lost_limb_is_not_good_and_the_stretch_is_named() {
        for (from, grade) in [(80, Grade::Usable), (50, Grade::Poor)] {
            let verdict = with_input(&Story { wrist_lost_from: Some(from), seeds: 2, ..Story::default() }, verdict);
            let mean = verdict.criteria.iter().find(|criterion| criterion.metric == "humaneva_mm").unwrap();
            assert!(mean.grade == Grade::Good && mean.value < 50.0, "{mean:?}");
            assert_eq!(verdict.grade, grade, "{}", verdict.line);
            let stretch =
                format!(" Longest stretch: left wrist more than 150 mm off from frame {from} to 120 (seed 0).");
            assert!(verdict.line.ends_with(&stretch), "{}", verdict.line);
            assert!(verdict.line.contains("a marker is more than 150 mm off in "), "{}", verdict.line);
        }
        let short = with_input(&Story { wrist_lost_from: Some(116), ..Story::default() }, verdict);
        assert_eq!(short.grade, Grade::Good, "5 of 120 frames: {}", short.line);
        assert!(!short.line.contains("Longest stretch"), "{}", short.line);
        assert!(short.line.contains(" Largest mean error: left wrist, "), "{}", short.line);
    }

    #[test]
    fn a_missing_marker_is_called_missing() {
        let verdict = with_input(&Story { wrist_missing_from: Some(50), ..Story::default() }, verdict);
        let words = "Longest stretch: left wrist missing or more than 150 mm off from frame 50 to 120.";
        assert!(verdict.line.ends_with(words), "{}", verdict.line);
        assert!(verdict.line.contains("a marker is missing or more than 150 mm off in "), "{}", verdict.line);
        let verdict = with_input(&Story { wrist_missing_from: Some(0), ..Story::default() }, super::verdict);
        assert_eq!(verdict.grade, Grade::Good, "{:?}", verdict.criteria);
        assert!(verdict.line.ends_with(" Not graded, because never estimated: left wrist."), "{}", verdict.line);
    }

    /// A constant pose fits better with left and right exchanged in a third of the frames of a walk.
    #[test]
    fn a_rigid_pose_is_not_reported_as_exchanged() {
        let (verdict, swaps) = with_input(&Story { rigid: true, ..Story::default() }, |input| {
            (verdict(input), input.summary.metrics["limb_swaps"].mean)
        });
        assert!(swaps > 0.3, "{swaps}");
        let exchanged = verdict.criteria.iter().find(|criterion| criterion.metric == "limbs_exchanged").unwrap();
        assert!(exchanged.grade == Grade::Good && !verdict.line.contains("exchanged"), "{}", verdict.line);
    }

    #[test]
    fn the_overlap_is_graded_on_the_exact_silhouettes_if_the_observed_ones_are_corrupted() {
        let overlap = |verdict: &Verdict| {
            verdict.criteria.iter().find(|criterion| criterion.metric.starts_with("silhouette")).unwrap().clone()
        };
        let observed = overlap(&with_input(&Story::default(), verdict));
        assert_eq!(
            (observed.metric.as_str(), observed.title.as_str()),
            ("silhouette_iou", "Overlap of the silhouettes")
        );
        let graded = with_input(&Story { exact_overlap: Some(0.5), ..Story::default() }, verdict);
        let exact = overlap(&graded);
        assert_eq!((exact.metric.as_str(), exact.value, exact.grade), ("silhouette_iou_exact", 0.5, Grade::Poor));
        assert!(graded.line.contains("50 %, measured on the exact silhouettes, because those observed are corrupted"));
    }

    #[test]
    fn the_cause_for_another_program_names_the_likelihood() {
        for (gap, words) in
            [(0.1, "cannot distinguish the two poses"), (-0.1, "show a better pose than the program found")]
        {
            let story = Story { gap, own_likelihood: false, ..Story::default() };
            let cause = with_input(&story, verdict).cause.unwrap();
            assert!(cause.contains(words) && cause.contains("by skiagraph's likelihood on the set's body"), "{cause}");
        }
    }

    #[test]
    fn metrics_worse_than_never_moving_are_listed() {
        let of_good = with_input(&Story::default(), verdict).worse_than_frozen;
        assert!(!of_good.iter().any(|name| name == "humaneva_mm"), "{of_good:?}");
        assert!(
            !of_good.iter().any(|name| name == "jitter_m_per_s3"),
            "jitter has no value of the static tracker: {of_good:?}"
        );
        let of_bad = with_input(&Story { beside_m: 9.0, ..Story::default() }, verdict);
        assert!(of_bad.worse_than_frozen.iter().any(|name| name == "humaneva_mm") && of_bad.grade == Grade::Lost);
        assert!(with_input(&Story { frozen: false, ..Story::default() }, verdict).worse_than_frozen.is_empty());
    }

    #[test]
    fn the_cause_states_only_which_pose_the_images_prefer() {
        for (gap, words) in [
            (0.1, "a wrong pose fits better because of the likelihood or the body model"),
            (-0.1, "the search missed a better pose"),
        ] {
            let cause = with_input(&Story { gap, lost_from: Some(60), ..Story::default() }, verdict).cause.unwrap();
            assert!(cause.contains(words), "{cause}");
            assert!(!cause.contains("may help") && !cause.contains("would not"), "{cause}");
        }
    }

    #[test]
    fn a_wrong_start_pose_may_mislead_the_search_but_not_the_likelihood() {
        use crate::observation::{Corruption, ObservationFacts};
        let corruption = Corruption { start_mm: 800.0, calibration_mm: 100.0, ..Corruption::default() };
        let facts = ObservationFacts { corruption, ..ObservationFacts::default() };
        let cause_of = |story| {
            with_input(&story, |input| verdict(&ReportInput { observation: Some(&facts), ..*input }).cause.unwrap())
        };
        let lost = |gap| Story { gap, lost_from: Some(60), ..Story::default() };
        let (wrong, missed) = (cause_of(lost(0.1)), cause_of(lost(-0.1)));
        assert!(wrong.contains("the body model or wrong cameras.") && !wrong.contains("start"), "{wrong}");
        assert!(missed.contains("the input (wrong cameras, a wrong start pose)"), "{missed}");
        let good = cause_of(Story { gap: 0.1, ..Story::default() });
        assert!(good.contains("this is expected") && good.contains("with wrong cameras."), "{good}");
    }

    #[test]
    fn a_cause_among_wrong_images_or_cameras_is_not_blamed_on_search_or_body_alone() {
        use crate::observation::{Corruption, ObservationFacts};
        let corruption = Corruption { boundary_px: 4.0, calibration_deg: 2.0, ..Corruption::default() };
        let facts = ObservationFacts { corruption, distractors: 1, ..ObservationFacts::default() };
        let cause_of = |gap| {
            with_input(&Story { gap, lost_from: Some(60), ..Story::default() }, |input| {
                verdict(&ReportInput { observation: Some(&facts), ..*input }).cause.unwrap()
            })
        };
        let inputs = "corrupted silhouettes, silhouettes with other people";
        let (wrong, missed) = (cause_of(0.1), cause_of(-0.1));
        let prefers = format!("fits better because of the likelihood, the body model, {inputs} or wrong cameras.");
        assert!(wrong.contains(&prefers), "{wrong}");
        let misleads =
            format!("The cause may still be the input ({inputs}, wrong cameras), which misleads a search too.");
        assert!(missed.contains(&misleads), "{missed}");
        assert!([wrong, missed].iter().all(|cause| cause.contains("`skiagraph explain RUN`")));
    }

    #[test]
    fn a_tie_of_two_frames_is_no_majority_and_few_frames_are_counted() {
        let input = |own_likelihood| Story { own_likelihood, ..Story::default() };
        let pose = |parts, own| with_input(&input(own), |input| preferred_pose(input, Grade::Poor, parts, "frames"));
        let tie = "In 1 of the 2 frames the images fit the estimate better than the true pose, in the others the true pose, \
                   so this does not tell the cause. `skiagraph explain RUN` divides the error among its causes.";
        assert_eq!((pose([1, 2], true), pose([1, 2], false)), (tie.to_owned(), tie.to_owned()));
        assert!(pose([3, 4], true).starts_with("In 3 of the 4 frames the images fit the estimate better"));
        assert!(pose([0, 40], true).starts_with("In 100 % of the frames the images fit the true pose"));
    }

    #[test]
    fn the_cause_of_a_lost_body_is_that_of_its_lost_frames() {
        let story = Story { gap: 0.1, lost_from: Some(80), gap_when_lost: Some(-0.1), ..Story::default() };
        let cause = with_input(&story, verdict).cause.unwrap();
        assert!(cause.starts_with("In 100 % of the frames with a marker over 150 mm off the images fit the true pose"));
        assert!(cause.contains("the search missed a better pose") && !cause.contains("a wrong pose fits"), "{cause}");
    }

    #[test]
    fn frames_with_empty_images_are_named_and_not_counted() {
        let cause = |gap| with_input(&Story { gap, empty_from: Some(61), ..Story::default() }, verdict).cause.unwrap();
        let (wrong, missed) = (cause(0.1), cause(-0.1));
        let alike =
            "In 50 % of the frames the images fit both poses alike, as empty images do. In 100 % of the other frames";
        assert!(wrong.starts_with(&format!("{alike} the images fit the estimate better")), "{wrong}");
        assert!(missed.starts_with(&format!("{alike} the images fit the true pose")), "{missed}");
    }

    #[test]
    fn a_body_lost_while_images_are_empty_is_not_said_to_be_preferred() {
        let story = Story { gap: 0.1, lost_from: Some(80), empty_from: Some(75), ..Story::default() };
        let cause = with_input(&story, verdict).cause.unwrap();
        let all =
            "In 100 % of the frames with a marker over 150 mm off the images fit both poses alike, as empty images do.";
        assert_eq!(cause, all);
    }

    #[test]
    fn a_good_estimate_that_the_images_prefer_is_expected() {
        let cause = with_input(&Story { gap: 0.1, ..Story::default() }, verdict).cause.unwrap();
        assert!(cause.starts_with("In 100 % of the frames the images fit the estimate better"), "{cause}");
        assert!(cause.contains("this is expected") && !cause.contains("a wrong pose fits"), "{cause}");
    }

    #[test]
    fn empty_images_give_no_cause() {
        let verdict = with_input(&Story { gap: 0.0, ..Story::default() }, verdict);
        assert_eq!(verdict.cause, None);
        let json = serde_json::to_value(&verdict).unwrap();
        assert!(json.get("cause").is_none(), "absent and not null: {json}");
    }

    #[test]
    fn small_shares_are_not_rounded_away() {
        assert_eq!([0.0, 0.001, 0.5, 0.999, 1.0].map(percent), ["0 %", "under 1 %", "50 %", "over 99 %", "100 %"]);
    }
}
