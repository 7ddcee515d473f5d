//! Runs or methods beside each other: their errors as bars and over time.

use super::plots::{Bar, BarGroup, BarPlot, Colour, Line, LinePlot, Stroke};
use skiagraph_eval::{METRICS, Metric, Summary, mean, quantile};

/// Metrics of the table of all sides.
const COLUMNS: [&str; 7] =
    ["humaneva_mm", "lost_limb", "mpjpe_root_mm", "pa_mpjpe_mm", "body_orientation_deg", "track_loss", "coverage"];
/// Share of the markers with an estimate below which errors are misleading without a remark.
pub(crate) const WHOLE_COVERAGE: f64 = 0.95;
const COLOURS: [Colour; 7] =
    [Colour::Blue, Colour::Orange, Colour::Green, Colour::Red, Colour::Purple, Colour::Amber, Colour::Ink];

/// One method, or one run of several that are compared.
#[derive(Clone, Debug)]
pub struct ComparedMethod {
    /// Its name.
    pub name: String,
    /// Whether it uses the ground truth or a part of it, like an oracle: a reference, not a tracker to choose.
    pub knows_truth: bool,
    /// Summary over all its seeds.
    pub summary: Summary,
    /// Error (HumanEva, mm) of every seed over the frames, `[seed][frame]`.
    pub errors: Vec<Vec<Option<f64>>>,
    /// Address of its own page, relative to the page of the comparison.
    pub report: Option<String>,
}

/// The metrics of the table of all sides.
pub(super) fn shown() -> impl Iterator<Item = &'static Metric> {
    METRICS.iter().filter(|metric| COLUMNS.contains(&metric.name))
}

/// Mean error, mm; infinite without an error, so that it is sorted last.
fn error_of(method: &ComparedMethod) -> f64 {
    method.summary.metrics.get("humaneva_mm").map_or(f64::INFINITY, |error| error.mean)
}

/// The share of the markers that have an estimate, if it is so small that errors are misleading; without the markers
/// that are never estimated, such as the head of a detector without one.
pub fn partial_share(summary: &Summary) -> Option<f64> {
    let of_markers: Vec<f64> = summary.per_joint.iter().map(|joint| joint.coverage).collect();
    let of_all = summary.metrics.get("humaneva_mm")?.coverage;
    mean(&of_markers).map(|share| share.max(of_all)).filter(|share| *share < WHOLE_COVERAGE)
}

/// The error of every method with its interval, best first.
pub(super) fn error_bars(methods: &[ComparedMethod]) -> BarPlot {
    let mut sorted: Vec<&ComparedMethod> = methods.iter().filter(|method| error_of(method).is_finite()).collect();
    sorted.sort_by(|a, b| error_of(a).total_cmp(&error_of(b)));
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
    LinePlot {
        x_label: "set frame, from 0".to_owned(),
        y_label: "mean marker error, mm".to_owned(),
        lines: methods.iter().enumerate().map(line).collect(),
        y_from: Some(0.0),
        ..LinePlot::default()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::fixture::{Story, with_input};

    pub(crate) fn method(name: &str, story: &Story, knows_truth: bool) -> ComparedMethod {
        let summary = with_input(story, |input| input.summary.clone());
        let errors = vec![vec![None, Some(1.0)]; 3];
        ComparedMethod { name: name.to_owned(), knows_truth, summary, errors, report: None }
    }

    #[test]
    fn bars_mark_references_and_partial_estimates() {
        let story = |wander, wrist_missing_from| Story { seeds: 3, wander, wrist_missing_from, ..Story::default() };
        let mut all = [
            method("whole", &story(1.0, None), false),
            method("truth", &story(0.1, None), true),
            method("shy", &story(0.5, Some(4)), false),
        ];
        all[2].summary.per_joint.iter_mut().for_each(|joint| joint.coverage = 0.5);
        all[2].summary.metrics.get_mut("humaneva_mm").unwrap().coverage = 0.5;
        let bars = error_bars(&all);
        let found: Vec<(&str, Colour)> = bars.groups.iter().map(|g| (g.name.as_str(), g.bars[0].colour)).collect();
        assert_eq!(found, [("truth", Colour::Grey), ("shy", Colour::Orange), ("whole", Colour::Blue)]);
        assert_eq!(bars.legend.len(), 3);
        // a marker that is never estimated is no loss
        assert_eq!(partial_share(&method("headless", &story(1.0, Some(0)), false).summary), None);
    }
}
