//! The page that compares methods.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use serde::Serialize;

use super::ReportError;
use super::displayed::{between, number, symbol};
use super::grading::percent;
use super::html::render_page;
use super::plots::{Bar, BarGroup, BarPlot, Colour, Line, LinePlot, Size, Stroke, Svg};
use crate::evaluation::{
    ClipValues, Difference, DifferenceRule, IntervalUnit, METRICS, Metric, Summary, difference, mean, quantile,
    should_pair,
};

const TEMPLATE: &str = include_str!("comparison.html");
/// Metrics of the table.
const COLUMNS: [&str; 7] =
    ["humaneva_mm", "lost_limb", "mpjpe_root_mm", "pa_mpjpe_mm", "body_orientation_deg", "track_loss", "coverage"];
/// Share of the markers with an estimate below which errors are misleading without a remark.
pub(crate) const WHOLE_COVERAGE: f64 = 0.95;
pub(super) const COLOURS: [Colour; 7] =
    [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber, Colour::Ink];

/// The input of a comparison page. All methods tracked the same clip with the same seeds.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonInput<'a> {
    /// The scenario's title.
    pub title: &'a str,
    /// Number of frames.
    pub frames: usize,
    /// Number of seeds.
    pub seeds: usize,
    /// Whether actor and tracker have the same body.
    pub matched: bool,
    /// The methods, at least one.
    pub methods: &'a [ComparedMethod],
}

/// One method of a comparison.
#[derive(Clone, Debug)]
pub struct ComparedMethod {
    /// Its name; its report is `NAME/report.html`.
    pub name: String,
    /// Description of its tracker.
    pub tracker: String,
    /// Whether it uses the ground truth or a part of it, like an oracle: a reference, not a tracker to choose.
    pub knows_truth: bool,
    /// Summary over all its seeds.
    pub summary: Summary,
    /// Mean of every metric for a tracker that never moves.
    pub frozen: BTreeMap<String, f64>,
    /// Error (HumanEva, mm) of every seed over the frames, `[seed][frame]`.
    pub errors: Vec<Vec<Option<f64>>>,
}

#[derive(Serialize)]
struct ComparisonPage<'a> {
    title: &'a str,
    frames: usize,
    seeds: usize,
    matched: bool,
    interval: &'a str,
    columns: Vec<String>,
    verdict: String,
    /// Whether a method lacks many estimates, and is below the others.
    any_partial: bool,
    rows: Vec<MethodRow<'a>>,
    /// For wide screens.
    plot: String,
    /// For phones.
    narrow: String,
}

#[derive(Serialize)]
struct MethodRow<'a> {
    name: &'a str,
    tracker: &'a str,
    knows_truth: bool,
    /// The share of the markers with an estimate, if it is small.
    partial: Option<String>,
    cells: Vec<String>,
    band: Option<Band>,
}

/// A method's error and interval as bars, in per cent of the largest.
#[derive(Serialize)]
struct Band {
    error: f64,
    low: f64,
    width: f64,
}

/// The metrics of the tables.
pub(super) fn shown() -> impl Iterator<Item = &'static Metric> {
    METRICS.iter().filter(|metric| COLUMNS.contains(&metric.name))
}

impl<'a> MethodRow<'a> {
    fn new(method: &'a ComparedMethod) -> Self {
        let cell = |metric: &Metric| {
            method.summary.metrics.get(metric.name).map_or_else(
                || "-".to_owned(),
                |m| {
                    let ends = m.ci95.map(|i| format!(" ({})", between(i.low, i.high, m.unit))).unwrap_or_default();
                    let is_worse = method.frozen.get(metric.name).is_some_and(|floor| metric.is_worse(m.mean, *floor));
                    format!("{}{}{ends}", if is_worse { "▼ " } else { "" }, number(m.mean, m.unit))
                },
            )
        };
        let (name, tracker, knows_truth) = (&method.name, &method.tracker, method.knows_truth);
        let partial = partial_share(&method.summary).map(percent);
        Self { name, tracker, knows_truth, partial, cells: shown().map(cell).collect(), band: None }
    }
}

/// The page: self-contained HTML with an inline plot.
///
/// # Errors
/// [`ReportError`] without a method, or if the plot cannot be drawn.
pub fn comparison_page(input: &ComparisonInput<'_>) -> Result<String, ReportError> {
    let mut methods: Vec<&ComparedMethod> = input.methods.iter().collect();
    methods.sort_by(|a, b| by_rank(a, b));
    let first = methods.first().ok_or(ReportError::NoRun)?;
    let plot = error_plot(input.methods);
    let (Svg(broad), Svg(narrow)) =
        (plot.svg(Size { width: 1160, height: 420 })?, plot.svg(Size { width: 350, height: 360 })?);
    let page = ComparisonPage {
        title: input.title,
        frames: input.frames,
        seeds: input.seeds,
        matched: input.matched,
        interval: &first.summary.interval,
        columns: shown().map(|metric| format!("{} {}", metric.title, symbol(metric.unit))).collect(),
        verdict: verdict(&methods),
        any_partial: methods.iter().any(|method| partial_share(&method.summary).is_some()),
        rows: bands(&methods),
        plot: broad,
        narrow,
    };
    render_page(TEMPLATE, &page)
}

/// Mean error, mm; infinite without an error, so that the method is sorted last.
pub(super) fn error_of(method: &ComparedMethod) -> f64 {
    method.summary.metrics.get("humaneva_mm").map_or(f64::INFINITY, |error| error.mean)
}

/// The share of the markers that have an estimate, if it is so small that errors are misleading; without the markers
/// that are never estimated, such as the head of a detector without one.
pub(crate) fn partial_share(summary: &Summary) -> Option<f64> {
    let of_markers: Vec<f64> = summary.per_joint.iter().map(|joint| joint.coverage).collect();
    let of_all = summary.metrics.get("humaneva_mm")?.coverage;
    mean(&of_markers).map(|share| share.max(of_all)).filter(|share| *share < WHOLE_COVERAGE)
}

/// The order of methods, best first: those that lack many estimates are below the others, because frames without an
/// estimate count in no error, and those without an error are last.
pub(super) fn by_rank(a: &ComparedMethod, b: &ComparedMethod) -> Ordering {
    let group = |method: &ComparedMethod| match partial_share(&method.summary) {
        _ if !error_of(method).is_finite() => 2,
        Some(_) => 1,
        None => 0,
    };
    group(a).cmp(&group(b)).then(error_of(a).total_cmp(&error_of(b)))
}

/// Mean error and the ends of its interval, mm.
pub(super) fn error_with_ends(method: &ComparedMethod) -> Option<(f64, [f64; 2])> {
    let error = method.summary.metrics.get("humaneva_mm")?;
    Some((error.mean, error.ci95.map_or([error.mean; 2], |ends| [ends.low, ends.high])))
}

/// One row per method, with errors and intervals on a common scale.
fn bands<'a>(methods: &[&'a ComparedMethod]) -> Vec<MethodRow<'a>> {
    let greatest = methods
        .iter()
        .filter_map(|m| error_with_ends(m))
        .map(|(mean, [_, high])| high.min(2.0 * mean))
        .fold(1e-9, f64::max);
    let band = |(mean, [low, high]): (f64, [f64; 2])| {
        let part = |value: f64| (1000.0 * (value / greatest).clamp(0.0, 1.0)).round() / 10.0;
        Band { error: part(mean), low: part(low), width: (part(high) - part(low)).max(0.4) }
    };
    methods
        .iter()
        .map(|method| MethodRow { band: error_with_ends(method).map(band), ..MethodRow::new(method) })
        .collect()
}

/// States which tracker is best, and whether it is significantly better than the next that has enough seeds to say so.
/// A method that uses the ground truth is a reference, not a tracker, however small its error. Trackers that lack many
/// estimates are never better than one that has them.
pub(super) fn verdict(methods: &[&ComparedMethod]) -> String {
    let mut measured: Vec<&ComparedMethod> = methods.to_vec();
    measured.retain(|method| error_of(method).is_finite());
    measured.sort_by(|a, b| by_rank(a, b));
    let trackers: Vec<&ComparedMethod> = measured.iter().copied().filter(|method| !method.knows_truth).collect();
    let [best, rest @ ..] = trackers.as_slice() else {
        return if measured.is_empty() {
            "No method has an error that could be measured.".into()
        } else {
            "All methods that could be measured use the ground truth, so there is no tracker to choose.".into()
        };
    };
    let is_partial = |method: &ComparedMethod| partial_share(&method.summary).is_some();
    let partial = describe_partial(&trackers, !is_partial(best));
    let among = match (is_partial(best), partial.is_empty()) {
        (false, false) => " of the trackers that estimate almost all markers",
        _ if trackers.len() < measured.len() => " of the trackers",
        _ => "",
    };
    let lost = best.summary.metrics.get("lost_limb").map_or_else(String::new, |lost| {
        format!(" (a marker is more than 150 mm off in {} of its frames)", percent(lost.mean))
    });
    let alone = format!("{} has the lowest mean marker error{among}, {:.1} mm{lost}", best.name, error_of(best));
    let alike = rest.iter().copied().filter(|other| is_partial(other) == is_partial(best));
    let others: Vec<(&ComparedMethod, Option<Difference>)> =
        alike.map(|other| (other, difference_from(best, other))).collect();
    format!("{}{partial}", against_others(&alone, &others))
}

/// A sentence, after a space, on the trackers that lack many estimates; empty if there are none.
fn describe_partial(trackers: &[&ComparedMethod], are_below: bool) -> String {
    let describe = |method: &&ComparedMethod| {
        let share = percent(partial_share(&method.summary)?);
        Some(format!("{} ({:.1} mm, {share} of the markers estimated)", method.name, error_of(method)))
    };
    let found: Vec<String> = trackers.iter().filter_map(describe).collect();
    match (found.is_empty(), are_below) {
        (true, _) => String::new(),
        (_, true) => {
            format!(" Ranked below, because frames without an estimate count in no error: {}.", found.join(", "))
        }
        (_, false) => format!(" Frames without an estimate count in no error: {}.", found.join(", ")),
    }
}

/// The difference of the errors of two methods with measured errors, `other` minus `best`; `None` with too few seeds to
/// say anything.
fn difference_from(best: &ComparedMethod, other: &ComparedMethod) -> Option<Difference> {
    let clip = ClipValues { base: error_by_seed(best), other: error_by_seed(other) };
    let seeds = |method: &ComparedMethod| method.summary.runs.iter().map(|run| run.seed).collect::<Vec<u64>>();
    let found = difference(&[clip], should_pair(&seeds(best), &seeds(other)), IntervalUnit::Seeds);
    found.filter(|found| found.rule != DifferenceRule::TooFew)
}

/// The seeds with an error, and their errors.
fn error_by_seed(method: &ComparedMethod) -> Vec<(u64, f64)> {
    let errors = method.summary.metrics.get("humaneva_mm").map_or(&[][..], |error| error.per_run.as_slice());
    let runs = method.summary.runs.iter().zip(errors);
    runs.filter_map(|(run, value)| Some((run.seed, (*value)?))).collect()
}

/// The best tracker against the first of the others that has enough seeds; those that have too few are named.
fn against_others(alone: &str, others: &[(&ComparedMethod, Option<Difference>)]) -> String {
    let Some((next, _)) = others.first() else { return format!("{alone}.") };
    let too_few = |(method, found): &(&ComparedMethod, Option<Difference>)| {
        let seeds = error_by_seed(method).len();
        let plural = if seeds == 1 { "" } else { "s" };
        found.is_none().then(|| format!("{} ({:.1} mm, {seeds} seed{plural})", method.name, error_of(method)))
    };
    let too_few: Vec<String> = others.iter().filter_map(too_few).collect();
    let compared = others.iter().find_map(|(other, found)| Some((other, found.as_ref()?)));
    let Some((other, found)) = compared else {
        return format!("{alone}; {} has {:.1} mm. Too few seeds to say more.", next.name, error_of(next));
    };
    let (name, more) = (&other.name, found.difference);
    let skipped = if too_few.is_empty() {
        String::new()
    } else {
        format!(" Too few seeds to compare it with {}.", too_few.join(", "))
    };
    let which = if next.name == *name { format!("the next, {name},") } else { name.clone() };
    match found.ci95 {
        Some(ends) if ends.low > 0.0 => format!(
            "{alone}. It is better than {which} by {more:.1} mm (95 %: {}).{skipped}",
            between(ends.low, ends.high, crate::evaluation::Unit::Millimetre)
        ),
        Some(ends) => format!(
            "{alone}, but these seeds do not show a difference from {name}: the difference is {more:.1} mm (95 %: {}).\
             {skipped}",
            between(ends.low, ends.high, crate::evaluation::Unit::Millimetre)
        ),
        None => format!(
            "{alone}; {name} has {:.1} mm. The difference is the same in every seed, so it has no interval.{skipped}",
            error_of(other)
        ),
    }
}

/// The error of every method with its interval, best first.
pub(super) fn error_bars(methods: &[ComparedMethod]) -> BarPlot {
    let mut sorted: Vec<&ComparedMethod> = methods.iter().filter(|method| error_of(method).is_finite()).collect();
    sorted.sort_by(|a, b| by_rank(a, b));
    let is_partial = |method: &ComparedMethod| partial_share(&method.summary).is_some();
    let group = |method: &&ComparedMethod| {
        let ends = method.summary.metrics.get("humaneva_mm").and_then(|error| error.ci95);
        let colour = match (method.knows_truth, is_partial(method)) {
            (true, _) => Colour::Grey,
            (false, true) => Colour::Orange,
            (false, false) => Colour::Blue,
        };
        let bar = Bar { value: error_of(method), interval: ends.map(|ends| [ends.low, ends.high]), colour };
        BarGroup { name: method.name.replace('_', " "), bars: vec![bar] }
    };
    let mut legend = vec![("tracker".to_owned(), Colour::Blue)];
    let lacks = |m: &ComparedMethod| is_partial(m) && !m.knows_truth;
    legend.extend(methods.iter().any(lacks).then(|| ("lacks many estimates".to_owned(), Colour::Orange)));
    legend.extend(methods.iter().any(|m| m.knows_truth).then(|| ("uses the ground truth".to_owned(), Colour::Grey)));
    BarPlot {
        value_label: "mean marker error, mm".to_owned(),
        legend,
        groups: sorted.iter().map(group).collect(),
        ..BarPlot::default()
    }
}

/// The median over seeds, with a band for the range over seeds if there are several.
pub(super) fn median_line<E: AsRef<[Option<f64>]>>(
    name: &str,
    stroke: Stroke,
    seeds: &[E],
    place: impl Fn(usize) -> f64,
) -> Line {
    let mut line = Line::new(name, stroke, Vec::new());
    for index in 0..seeds.iter().map(|seed| seed.as_ref().len()).max().unwrap_or(0) {
        let values = seeds.iter().filter_map(|seed| seed.as_ref().get(index).copied().flatten());
        let mut present: Vec<f64> = values.collect();
        present.sort_by(f64::total_cmp);
        line.points.push((place(index), quantile(&present, 0.5)));
        line.band.push((place(index), present.first().zip(present.last()).map(|(low, high)| [*low, *high])));
    }
    if seeds.len() < 2 {
        line.band.clear();
    }
    line
}

/// The error of every method over the frames (as in `[GPDM graph]`, Fig. 6): the median over seeds.
pub fn error_plot(methods: &[ComparedMethod]) -> LinePlot {
    let line = |(index, method): (usize, &ComparedMethod)| {
        let colour = COLOURS[index % COLOURS.len()];
        let stroke = if index < COLOURS.len() { Stroke::solid(colour) } else { Stroke::dashed(colour) };
        median_line(&method.name.replace('_', " "), stroke, &method.errors, |frame| frame as f64)
    };
    let describe = |method: &ComparedMethod| format!("{} {:.0} mm", method.name.replace('_', " "), error_of(method));
    LinePlot {
        x_label: "set frame, from 0".to_owned(),
        y_label: "mean marker error, mm".to_owned(),
        lines: methods.iter().enumerate().map(line).collect(),
        y_from: Some(0.0),
        finding: methods.iter().filter(|m| error_of(m).is_finite()).map(describe).collect::<Vec<_>>().join(", "),
        ..LinePlot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

    fn method(name: &str, story: &Story, knows_truth: bool) -> ComparedMethod {
        let summary = with_input(story, |input| input.summary.clone());
        let (name, tracker, frozen) = (name.to_owned(), "a tracker".to_owned(), BTreeMap::new());
        ComparedMethod { name, tracker, knows_truth, summary, frozen, errors: vec![vec![None, Some(1.0)]; 3] }
    }

    fn methods() -> Vec<ComparedMethod> {
        let story = |wander, wrist_lost_from| Story { seeds: 3, wander, wrist_lost_from, ..Story::default() };
        vec![
            method("truth_refitted", &story(0.1, None), true),
            method("graph", &story(1.0, Some(80)), false),
            method("frozen", &story(5.0, None), false),
        ]
    }

    #[test]
    fn a_reference_that_uses_the_truth_is_never_the_best_tracker() {
        let all = methods();
        let said = verdict(&all.iter().collect::<Vec<_>>());
        assert!(said.starts_with("graph has the lowest mean marker error of the trackers, "), "{said}");
        assert!(said.contains("(a marker is more than 150 mm off in 34 % of its frames)"), "{said}");
        assert!(!said.contains("truth_refitted") && said.contains("frozen"), "{said}");
        let knowing = verdict(&[&all[0]]);
        let expected = "All methods that could be measured use the ground truth, so there is no tracker to choose.";
        assert_eq!(knowing, expected);
        let alone = verdict(&[&all[1]]);
        assert!(alone.starts_with("graph has the lowest mean marker error, "), "{alone}");
    }

    #[test]
    fn a_tracker_that_lacks_many_estimates_is_ranked_below_and_marked() {
        let partial = Story { seeds: 3, wander: 0.1, wrist_missing_from: Some(4), ..Story::default() };
        let mut all = [method("shy", &partial, false), method("whole", &Story { seeds: 3, ..Story::default() }, false)];
        assert!(error_of(&all[0]) < error_of(&all[1]) && partial_share(&all[1].summary).is_none());
        let said = verdict(&all.iter().collect::<Vec<_>>());
        assert!(said.starts_with("whole has the lowest mean marker error of the trackers that estimate"), "{said}");
        assert!(said.contains(" Ranked below, because frames without an estimate count in no error: shy ("), "{said}");
        assert!(!said.contains("better than"), "{said}");
        let input = ComparisonInput { title: "Walk", frames: 2, seeds: 3, matched: false, methods: &all };
        let html = comparison_page(&input).unwrap();
        assert_eq!(html.matches("of the markers estimated").count(), 2, "the verdict and the row");
        assert!(html.find("href=\"whole").unwrap() < html.find("href=\"shy").unwrap());
        assert_eq!(error_bars(&all).groups[1].bars[0].colour, Colour::Orange);
        // a marker that is never estimated is no loss
        let headless = Story { wrist_missing_from: Some(0), ..partial };
        all[0] = method("headless", &headless, false);
        assert!(verdict(&all.iter().collect::<Vec<_>>()).starts_with("headless has the lowest mean marker error, "));
    }

    #[test]
    fn a_run_with_too_few_seeds_is_named_and_the_order_of_the_runs_does_not_matter() {
        let story = |seeds, wander| Story { seeds, wander, ..Story::default() };
        let [best, far] = [("best", 1.0), ("far", 5.0)].map(|(name, wander)| method(name, &story(3, wander), false));
        let near = method("near", &story(1, 2.0), false);
        let said = verdict(&[&far, &near, &best]);
        assert!(said.starts_with("best has the lowest mean marker error, "), "{said}");
        assert!(said.contains("far") && !said.contains("the next, "), "{said}");
        assert!(said.contains(" Too few seeds to compare it with near (") && said.ends_with(" mm, 1 seed)."), "{said}");
        assert!(verdict(&[&near, &best]).ends_with(" mm. Too few seeds to say more."));
    }

    #[test]
    fn the_page_and_the_figures_mark_references_that_use_the_truth() {
        let all = methods();
        let input = ComparisonInput { title: "Walk", frames: 2, seeds: 3, matched: false, methods: &all };
        let html = comparison_page(&input).unwrap();
        assert_eq!(html.matches("a reference that uses the ground truth").count(), 1);
        assert!(html.contains("Frames with a marker over 150 mm off"), "a column");
        let bars = error_bars(&all);
        assert_eq!(
            bars.groups.iter().map(|group| group.bars[0].colour).collect::<Vec<_>>(),
            [Colour::Grey, Colour::Blue, Colour::Blue]
        );
        assert_eq!(bars.legend.len(), 2);
    }
}
