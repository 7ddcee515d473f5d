//! The findings of a comparison in a few sentences.

use super::comparison::WHOLE_COVERAGE;
use super::displayed::{between_to, number, number_to};
use super::grading::percent;
use crate::evaluation::{AgainstBase, ComparedMetric, Direction, Finding};

/// States which side has the lower mean marker error, by how much and with which interval; how often each loses a limb;
/// and how many other metrics are better or worse.
pub(super) fn describe_side(side: &AgainstBase, base: &str) -> String {
    let name = side.side.name.as_str();
    let find = |metric: &str| side.metrics.iter().find(|compared| compared.metric == metric);
    let error = find("humaneva_mm").map_or_else(
        || format!("{name} and {base} have no marker error in common."),
        |error| describe_error(error, name, base),
    );
    let lost = find("lost_limb").map(|lost| describe_lost_limbs(lost, name, base));
    let covered = find("humaneva_mm").and_then(|error| describe_coverage(error, name, base));
    let sentences = [Some(error), covered, lost, describe_others(side)];
    sentences.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn describe_error(error: &ComparedMetric, name: &str, base: &str) -> String {
    let found = &error.difference;
    let size = number_to(found.difference.abs(), error.unit, found.difference);
    let than = if found.difference > 0.0 { "more than" } else { "less than" };
    let means =
        format!("its mean marker error is {} mm, {size} mm {than} that of {base}", number(found.other, error.unit));
    let ends = found
        .ci95
        .map(|ends| format!(" (difference, 95 %: {})", between_to(ends.low, ends.high, error.unit, found.difference)));
    let ends = ends.unwrap_or_default();
    match error.finding {
        Finding::Better => format!("{name} is better than {base}: {means}{ends}."),
        Finding::Worse => format!("{name} is worse than {base}: {means}{ends}."),
        Finding::Differs => format!("{name} differs from {base}: {means}{ends}."),
        Finding::Same => {
            format!(
                "{name} and {base} have the same mean marker error, {} mm, in every run.",
                number(found.other, error.unit)
            )
        }
        Finding::NotShown => {
            format!("No difference between {name} and {base} is shown: {means}{ends}.")
        }
        Finding::TooFew => format!("Too few seeds to say whether {name} or {base} is better: {means}."),
    }
}

/// The shares of markers with an estimate, if one is small and they differ: the errors then cover different frames.
fn describe_coverage(error: &ComparedMetric, name: &str, base: &str) -> Option<String> {
    let [of_base, of_other] = error.coverage;
    let (of_base, of_other) = of_base.zip(of_other)?;
    let differ = of_base.min(of_other) < WHOLE_COVERAGE && (of_base - of_other).abs() > 0.001;
    differ.then(|| {
        format!(
            "Markers without an estimate count in no error: {name} estimates {} of the markers, {base} {}.",
            percent(of_other),
            percent(of_base)
        )
    })
}

/// How often a limb is lost, which the mean error hides.
fn describe_lost_limbs(lost: &ComparedMetric, name: &str, base: &str) -> String {
    let [of_base, of_other] = [lost.difference.base, lost.difference.other].map(percent);
    format!(
        "A marker is more than 150 mm off in {of_other} of the frames of {name} and in {of_base} of those of {base}."
    )
}

/// Counts the other metrics that are better or worse, without the actor's own values.
fn describe_others(side: &AgainstBase) -> Option<String> {
    let described = ["humaneva_mm", "lost_limb"];
    let others = || {
        let all = side.metrics.iter().filter(|metric| metric.direction != Direction::Neither);
        all.filter(|metric| !described.contains(&metric.metric.as_str()) && !is_of_actor(metric))
    };
    let count = |finding: Finding| others().filter(|metric| metric.finding == finding).count();
    let (better, worse, all) = (count(Finding::Better), count(Finding::Worse), others().count());
    (all > 0 && better + worse > 0).then(|| format!("Of {all} other metrics, {better} are better and {worse} worse."))
}

/// Whether a metric is the actor's own value.
pub(super) fn is_of_actor(metric: &ComparedMetric) -> bool {
    metric.metric.starts_with("truth_")
}

/// Whether a row is the actor's own value, equal on both sides.
pub(super) fn is_constant(metric: &ComparedMetric) -> bool {
    is_of_actor(metric) && metric.finding == Finding::Same
}

#[cfg(test)]
mod tests {
    use super::super::difference_text::tests::compared;
    use super::*;

    #[test]
    fn the_sentence_names_the_better_side_with_the_difference_and_its_interval() {
        let mut comparison = compared(&["walk"]);
        let said = describe_side(&comparison.others[0], "main");
        let expected = "my_change is worse than main: its mean marker error is 34.6 mm, 4.2 mm more than that of main \
            (difference, 95 %: 3.9 to 4.5).";
        assert_eq!(said, expected);
        let side = &mut comparison.others[0];
        let mut lost = side.metrics[0].clone();
        lost.metric = "lost_limb".to_owned();
        (lost.difference.base, lost.difference.other) = (0.25, 0.0);
        lost.finding = Finding::Better;
        let mut truth = lost.clone();
        truth.metric = "truth_foot_float_mm".to_owned();
        let mut other = lost.clone();
        other.metric = "pck150".to_owned();
        side.metrics.extend([lost, truth, other]);
        let said = describe_side(&comparison.others[0], "main");
        let lost = "A marker is more than 150 mm off in 0 % of the frames of my_change and in 25 % of those of main.";
        assert_eq!(said, format!("{expected} {lost} Of 1 other metrics, 1 are better and 0 worse."));
    }

    #[test]
    fn a_side_that_lacks_many_estimates_is_named() {
        let mut comparison = compared(&["walk"]);
        let said = |comparison: &crate::evaluation::RunComparison| describe_side(&comparison.others[0], "main");
        comparison.others[0].metrics[0].coverage = [Some(0.97), Some(1.0)];
        assert!(!said(&comparison).contains("estimates"));
        comparison.others[0].metrics[0].coverage = [Some(1.0), Some(0.317)];
        let words = "in no error: my_change estimates 32 % of the markers, main 100 %.";
        assert!(said(&comparison).contains(words), "{}", said(&comparison));
    }

    #[test]
    fn sides_without_a_shown_difference_and_equal_sides_are_described() {
        let mut comparison = compared(&["walk"]);
        let side = &mut comparison.others[0];
        for (finding, words) in [
            (Finding::NotShown, "No difference between my_change and main is shown"),
            (Finding::Same, "my_change and main have the same mean marker error, 34.6 mm, in every run."),
            (Finding::TooFew, "Too few seeds to say whether my_change or main is better"),
        ] {
            side.metrics[0].finding = finding;
            let said = describe_side(side, "main");
            assert!(said.starts_with(words) && !said.contains("worse"), "{said}");
        }
        side.metrics.clear();
        assert_eq!(describe_side(side, "main"), "my_change and main have no marker error in common.");
    }
}
