//! Means along the axes of a sweep: every value of every axis, for every tracker, with all other axes averaged.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::definition::Expansion;
use super::plan::PlannedSweep;
use super::plan_file::table_text;
use super::results::Status;
use super::summary::{METHOD, SettingSummary, SweepSummary};
use crate::common::ExperimentError;
use skiagraph_eval::{Interval, ValueRange, mean, mean_interval};

/// The axis whose values are the units of intervals: further seeds of the same clips would not narrow them.
const CLIP: &str = "clip";
/// Most values of an axis; axes with more, such as those drawn at random, are left out.
const MOST_VALUES: usize = 200;

/// The means along all axes.
#[derive(Clone, Debug, Serialize)]
pub struct ByAxis {
    pub trackers: Vec<String>,
    /// What intervals are over: `clips`, `draws` or `seeds`.
    pub unit: &'static str,
    /// All settings together.
    pub all: Vec<MeanOfTracker>,
    pub axes: Vec<AxisMeans>,
}

#[derive(Clone, Debug, Serialize)]
pub struct AxisMeans {
    pub axis: String,
    /// Its values, rising if they are numbers.
    pub values: Vec<ValueMeans>,
    /// For every tracker the value at which the mean is twice that of 0, interpolated linearly; absent if there is no
    /// value 0, or no value reaches it.
    pub doubles_at: Vec<Option<f64>>,
    /// For every tracker how far the values can be told apart; absent if fewer than two values have a mean.
    pub separation: Vec<Option<Separation>>,
}

/// How far a tracker's means along an axis can be told apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Separation {
    /// Difference of the greatest and the least mean, as a share of the greatest; absent for metrics that may be
    /// negative.
    pub effect: Option<f64>,
    /// What can be said of the values.
    pub verdict: Verdict,
    /// Kendall's tau of the values' ranks, mean over pairs of units, from -1 to 1, where ties count 0; absent below two
    /// units.
    pub rank_agreement: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
pub struct ValueMeans {
    pub value: String,
    /// The means, one per tracker.
    pub means: Vec<MeanOfTracker>,
}

/// A tracker's mean over some settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeanOfTracker {
    /// Mean over the units, each the mean of its cells.
    pub mean: Option<f64>,
    /// 95 % interval over the units; absent below three.
    pub ci95: Option<Interval>,
    /// Number of units with values.
    pub units: usize,
    pub lost: usize,
    /// Cells that cannot be run, or have no result: the mean then covers fewer settings than others.
    pub missing: usize,
    /// Least share of the markers that have an estimate; errors count no others.
    pub coverage: Option<f64>,
    /// Mean of a tracker that never moves.
    pub frozen: Option<f64>,
}

/// What can be said of the values of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Some two 95 % intervals are apart.
    Apart,
    /// None are, and the effect is small: for this tracker the axis is no question.
    CeilingReached,
    /// None are, though the effect is large: the units scatter too much.
    Scattered,
    /// There are fewer than two intervals.
    NoIntervals,
}

/// The effect from which an axis whose intervals overlap is called scattered.
const LARGE_EFFECT: f64 = 0.3;

impl ByAxis {
    /// The means of a summary of all settings.
    pub fn new(sweep: &PlannedSweep, summary: &SweepSummary) -> Result<Self, ExperimentError> {
        let definition = sweep.definition()?.sweep;
        Ok(Self::of(summary, &sweep.only_tracker(), definition.method, definition.draws))
    }

    fn of(summary: &SweepSummary, tracker: &str, method: Expansion, draws: bool) -> Self {
        let trackers = summary.trackers(tracker);
        let by_clip = labels(summary, CLIP).len() > 1;
        let means = |is_in: &dyn Fn(&SettingSummary) -> bool| {
            let of_tracker = |tracker: &String| {
                let own = summary.settings.iter().filter(|setting| setting.is_of(tracker) && is_in(setting));
                mean_of(summary, &own.collect::<Vec<_>>(), by_clip)
            };
            trackers.iter().map(of_tracker).collect::<Vec<_>>()
        };
        let only_means = |found: Vec<(MeanOfTracker, Units)>| found.into_iter().map(|(mean, _)| mean).collect();
        let base = summary.settings.first().map(|setting| setting.axes.clone()).unwrap_or_default();
        let mut axes = Vec::new();
        for axis in summary.axes.iter().filter(|axis| *axis != METHOD) {
            let labels = labels(summary, axis);
            if !(2..=MOST_VALUES).contains(&labels.len()) {
                continue;
            }
            let (mut values, mut units) = (Vec::new(), vec![Vec::new(); trackers.len()]);
            for value in labels {
                // one axis at a time: all others have their first value
                let is_alone = |setting: &SettingSummary| {
                    let others = setting.axes.iter().filter(|(other, _)| *other != axis && *other != METHOD);
                    method != Expansion::OneAtATime || others.into_iter().all(|(key, own)| base.get(key) == Some(own))
                };
                let is_in = |setting: &SettingSummary| label(setting, axis) == Some(&value) && is_alone(setting);
                let found = means(&is_in);
                found.iter().zip(&mut units).for_each(|((_, own), all)| all.push(own.clone()));
                values.push(ValueMeans { value: table_text(&value), means: only_means(found) });
            }
            let separation = units
                .iter()
                .enumerate()
                .map(|(tracker, units)| Separation::of(&values, tracker, units, summary.range()))
                .collect();
            let number = |one: &ValueMeans| one.value.parse::<f64>().ok();
            if values.iter().all(|one| number(one).is_some()) {
                values.sort_by(|a, b| number(a).unwrap_or(0.0).total_cmp(&number(b).unwrap_or(0.0)));
            }
            let doubles_at = (0..trackers.len()).map(|tracker| doubling(&values, tracker)).collect();
            axes.push(AxisMeans { axis: axis.clone(), values, doubles_at, separation });
        }
        let unit = if by_clip {
            "clips"
        } else if draws {
            "draws"
        } else {
            "seeds"
        };
        Self { all: only_means(means(&|_| true)), trackers, unit, axes }
    }
}

fn label<'s>(setting: &'s SettingSummary, axis: &str) -> Option<&'s Value> {
    setting.axes.get(axis)
}

fn labels(summary: &SweepSummary, axis: &str) -> Vec<Value> {
    let mut known: Vec<Value> = Vec::new();
    for value in summary.settings.iter().filter_map(|setting| label(setting, axis)) {
        if known.len() <= MOST_VALUES && !known.contains(value) {
            known.push(value.clone());
        }
    }
    known
}

/// The values of each unit of an interval: a clip, draw or seed.
type Units = BTreeMap<String, Vec<f64>>;

impl Separation {
    fn of(values: &[ValueMeans], tracker: usize, units: &[Units], range: ValueRange) -> Option<Self> {
        let (mut means, mut intervals) = (Vec::new(), Vec::new());
        for value in values {
            let found = value.means.get(tracker)?;
            means.extend(found.mean);
            intervals.extend(found.ci95);
        }
        let least = means.iter().copied().reduce(f64::min)?;
        let greatest = means.iter().copied().reduce(f64::max).filter(|_| means.len() > 1)?;
        let effect = (range != ValueRange::Any && greatest > 0.0).then(|| (greatest - least) / greatest);
        let highest_low = intervals.iter().map(|interval| interval.low).reduce(f64::max);
        let lowest_high = intervals.iter().map(|interval| interval.high).reduce(f64::min);
        let verdict = match highest_low.zip(lowest_high).filter(|_| intervals.len() > 1) {
            None => Verdict::NoIntervals,
            Some((low, high)) if low > high => Verdict::Apart,
            Some(_) if effect.is_some_and(|effect| effect >= LARGE_EFFECT) => Verdict::Scattered,
            Some(_) => Verdict::CeilingReached,
        };
        Some(Self { effect, verdict, rank_agreement: rank_agreement(units) })
    }
}

/// Mean of Kendall's tau-a over all pairs of units that have a value at every label.
fn rank_agreement(labels: &[Units]) -> Option<f64> {
    let names = labels.first()?.keys().filter(|unit| labels.iter().all(|label| label.contains_key(*unit)));
    let ranked: Vec<Vec<f64>> =
        names.map(|unit| labels.iter().filter_map(|label| mean(&label[unit])).collect()).collect();
    let mut taus = Vec::new();
    for (at, one) in ranked.iter().enumerate() {
        for other in &ranked[at + 1..] {
            let pairs = (0..labels.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            let orders =
                pairs.map(|(i, j)| f64::from(one[i].total_cmp(&one[j]) as i8 * other[i].total_cmp(&other[j]) as i8));
            taus.extend(mean(&orders.collect::<Vec<f64>>()));
        }
    }
    mean(&taus)
}

fn mean_of(summary: &SweepSummary, settings: &[&SettingSummary], by_clip: bool) -> (MeanOfTracker, Units) {
    let mut units = Units::new();
    for setting in settings {
        for (at, value) in setting.values.iter().enumerate() {
            let unit = if by_clip { label(setting, CLIP).map(table_text).unwrap_or_default() } else { at.to_string() };
            units.entry(unit).or_default().extend(*value);
        }
    }
    units.retain(|_, values| !values.is_empty());
    let means: Vec<f64> = units.values().filter_map(|values| mean(values)).collect();
    let interval = mean_interval(std::slice::from_ref(&means), summary.range());
    let cells = || settings.iter().flat_map(|setting| &setting.cells);
    let of_status = |status: Option<Status>| cells().filter(|cell| cell.status == status).count();
    let found = MeanOfTracker {
        mean: mean(&means),
        ci95: interval.map(|(interval, _)| interval),
        units: means.len(),
        lost: of_status(Some(Status::Diverged)),
        missing: of_status(Some(Status::Failed)) + of_status(None),
        coverage: settings.iter().filter_map(|setting| setting.coverage).reduce(f64::min),
        frozen: mean(&settings.iter().filter_map(|setting| setting.frozen).collect::<Vec<f64>>()),
    };
    (found, units)
}

/// The value at which a tracker's mean is twice that of 0, interpolated linearly.
fn doubling(values: &[ValueMeans], tracker: usize) -> Option<f64> {
    let mut levels: Vec<(f64, f64)> = Vec::new();
    for one in values {
        levels.extend(one.value.parse().ok().zip(one.means.get(tracker)?.mean));
    }
    let twice = 2.0 * levels.first().filter(|(level, mean)| *level == 0.0 && *mean > 0.0)?.1;
    let (before, after) = levels.iter().zip(levels.iter().skip(1)).find(|(_, after)| after.1 >= twice)?;
    Some(before.0 + (after.0 - before.0) * (twice - before.1) / (after.1 - before.1))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::sweep::summary::CellSummary;

    fn setting(axes: Value, values: &[Option<f64>], coverage: f64, status: Status) -> SettingSummary {
        let cells = values.iter().map(|_| CellSummary { status: Some(status), ..CellSummary::default() }).collect();
        let axes = axes.as_object().unwrap().clone();
        let setting = SettingSummary { axes, coverage: Some(coverage), cells, ..SettingSummary::default() };
        setting.with_values(values.to_vec(), skiagraph_eval::ValueRange::NonNegative)
    }

    fn means(axes: &[&str], settings: Vec<SettingSummary>, method: Expansion) -> ByAxis {
        let axes = axes.iter().map(|axis| (*axis).to_owned()).collect();
        let summary = SweepSummary { objective: "humaneva_mm".to_owned(), axes, settings, ..SweepSummary::default() };
        ByAxis::of(&summary, "t", method, true)
    }

    #[test]
    fn the_unit_of_an_interval_is_the_clip() {
        let one = |clip: &str, place: &str, value: Option<f64>, status: Status| {
            setting(json!({ "clip": clip, "place": place }), &[value], 1.0, status)
        };
        let settings = vec![
            one("a", "x", Some(10.0), Status::Ok),
            one("a", "y", Some(20.0), Status::Ok),
            one("b", "x", Some(30.0), Status::Diverged),
            one("b", "y", None, Status::Failed),
            one("c", "x", Some(50.0), Status::Ok),
        ];
        let found = means(&["clip", "place"], settings, Expansion::Grid);
        // the means of clips are 15, 30 and 50
        let all = &found.all[0];
        assert!((all.mean.unwrap() - 95.0 / 3.0).abs() < 1e-12);
        let range = skiagraph_eval::ValueRange::NonNegative;
        assert_eq!(all.ci95, Some(mean_interval(&[vec![15.0, 30.0, 50.0]], range).unwrap().0));
        assert_eq!((found.unit, all.units, all.lost, all.missing), ("clips", 3, 1, 1));
        assert_eq!(found.axes[1].values[1].means[0].mean, Some(20.0));
    }

    #[test]
    fn levels_of_one_error_have_no_other_error() {
        let one =
            |px: f64, mm: f64, value: f64| setting(json!({ "px": px, "mm": mm }), &[Some(value); 2], 1.0, Status::Ok);
        let settings = vec![one(0.0, 0.0, 10.0), one(0.0, 5.0, 70.0), one(2.0, 0.0, 25.0), one(1.0, 0.0, 15.0)];
        let found = means(&["mm", "px"], settings, Expansion::OneAtATime);
        let px = &found.axes[1];
        let levels: Vec<_> = px.values.iter().map(|one| (one.value.as_str(), one.means[0].mean)).collect();
        assert_eq!(levels, [("0.0", Some(10.0)), ("1.0", Some(15.0)), ("2.0", Some(25.0))]);
        assert_eq!((px.doubles_at[0], found.unit), (Some(1.5), "draws"));
    }

    #[test]
    fn values_separate_if_their_intervals_are_apart() {
        let one = |px: f64, values: [f64; 3]| setting(json!({ "px": px }), &values.map(Some), 1.0, Status::Ok);
        let separation = |a, b, c| {
            let found = means(&["px"], vec![one(0.0, a), one(1.0, b), one(2.0, c)], Expansion::Grid);
            found.axes[0].separation[0].clone().unwrap()
        };
        let found = separation([10.0, 10.1, 9.9], [20.0, 20.1, 19.9], [15.0, 15.1, 14.9]);
        assert!((found.effect.unwrap() - 0.5).abs() < 1e-12);
        assert_eq!((found.verdict, found.rank_agreement), (Verdict::Apart, Some(1.0)));
        // by hand: of the three pairs of values, the first two draws order two alike and one the other way
        let found = separation([10.0, 12.0, 11.0], [11.0, 11.0, 10.0], [12.0, 13.0, 12.0]);
        assert_eq!(found.verdict, Verdict::CeilingReached);
        // two are apart though the worst is anywhere
        let wild = [1.0, 30.0, 15.0];
        assert_eq!(separation([10.0, 10.1, 9.9], [12.0, 12.1, 11.9], wild).verdict, Verdict::Apart);
        assert_eq!(separation([10.0, 10.1, 9.9], [10.0, 10.1, 9.9], wild).verdict, Verdict::Scattered);
        assert!((found.rank_agreement.unwrap() - (1.0 / 3.0 + 1.0 / 3.0 + 1.0) / 3.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn the_least_coverage_stands_beside_a_mean() {
        let one = |coverage: f64| setting(json!({ "a": coverage }), &[Some(3.0)], coverage, Status::Ok);
        assert_eq!(means(&["a"], vec![one(1.0), one(0.12)], Expansion::Grid).all[0].coverage, Some(0.12));
    }
}
