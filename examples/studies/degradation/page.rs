//! Writes `results/degradation.md`, a plot for every axis, and all outcomes as numbers.

use std::error::Error;
use std::path::Path;

use skiagraph::evaluation::{Interval, ValueRange, mean_interval};
use skiagraph::observation::{AXES, CorruptionAxis};
use skiagraph::report::plots::{Colour, Line, LinePlot, Size, Stroke};

use super::{Known, Outcome, SECONDS, TRACKERS, key};

pub(super) fn write(folder: &Path, known: &Known, seeds: u64, commit: &str) -> Result<(), Box<dyn Error>> {
    let mut summary = String::from("| axis | paper doubles at | default doubles at |\n|---|---|---|\n");
    // axes on which the mean error doubles, by tracker
    let mut doubled = TRACKERS.map(|_| Vec::new());
    let mut tables = String::new();
    for axis in &AXES {
        let errors = |tracker: &str, level: f64| values(known, axis, level, tracker, seeds, |o| Some(o.humaneva_mm));
        if errors("paper", axis.levels[0]).is_empty() {
            continue;
        }
        let doubling = TRACKERS.map(|(name, _)| doubles_at(axis, &|level| mean(&errors(name, level))));
        for (names, doubling) in doubled.iter_mut().zip(&doubling) {
            if !doubling.starts_with("not") {
                names.push(format!("`{}`", axis.name));
            }
        }
        summary += &format!("| `{}`{} | {} | {} |\n", axis.name, in_unit(axis), doubling[0], doubling[1]);
        let plot = plot_of(folder, known, axis, seeds)?;
        tables += &format!(
            "\n## {}{}\n\n{}.\n\n![error by {}]({plot})\n\n| {} | paper, mm | lost | default, mm | lost | IoU |\n|---|---|---|---|---|---|\n",
            axis.name,
            in_unit(axis),
            axis.formula,
            axis.name,
            axis.name
        );
        for level in [0.0].iter().chain(&axis.levels) {
            let cell = |tracker: &str| {
                let lost = mean(&values(known, axis, *level, tracker, seeds, |o| Some(o.lost)));
                format!("{} | {lost:.2}", with_interval(&errors(tracker, *level)))
            };
            let iou = mean(&values(known, axis, *level, "default", seeds, |o| o.iou));
            let iou = if iou.is_nan() { "-".to_owned() } else { format!("{iou:.3}") };
            tables += &format!("| {level} | {} | {} | {iou} |\n", cell("paper"), cell("default"));
        }
    }
    let exact = |tracker: &str| mean(&values(known, &AXES[0], 0.0, tracker, seeds, |o| Some(o.humaneva_mm)));
    let [paper, default] = doubled.map(|names| names.join(", "));
    let page = format!(
        "# How corruptions of the observations degrade tracking\n\n\
         Without corruption, the HumanEva error is {:.1} mm for the algorithm as printed (*paper*, `paper = true`) and {:.1} mm for the default \
         settings (*default*). Within the tested strengths, the error of *paper* doubles with {paper}; that of *default* doubles with \
         {default}.\n\n\
         {summary}\n\
         *Doubles at* is the strength at which the mean error is twice that without corruption, interpolated linearly between levels. In the \
         tables below, the error is the mean HumanEva error in mm over seeds, with the 95 % interval if there are three seeds or more; *lost* is the share \
         of frames with the track lost; *IoU* compares the corrupted masks with the exact ones, if they differ. `scenarios/README.md` \
         lists the formulas.\n\
         {tables}\n\
         ## Method\n\n\
         The first {SECONDS} s of the default walk at 60 Hz, four cameras of 320 x 240 at 4.5 m: a person with a skin, tracked with \
         another skin and the standard mismatch, calibrated; both trackers have this body. {seeds} seeds. Each \
         seed draws both the corruption and the tracker's random numbers.\n\n\
         Made at commit {commit} by `SKIAGRAPH_SEEDS={seeds} cargo run --release --example studies -- degradation` (it resumes; every outcome is in \
         `degradation.json`).\n",
        exact("paper"),
        exact("default"),
    );
    std::fs::write(folder.join("degradation.md"), page)?;
    std::fs::write(folder.join("degradation.json"), serde_json::to_string_pretty(known)? + "\n")?;
    Ok(())
}

fn in_unit(axis: &CorruptionAxis) -> String {
    if axis.unit.is_empty() { String::new() } else { format!(" ({})", axis.unit) }
}

fn values(
    known: &Known,
    axis: &CorruptionAxis,
    level: f64,
    tracker: &str,
    seeds: u64,
    of: impl Fn(&Outcome) -> Option<f64>,
) -> Vec<f64> {
    (0..seeds).filter_map(|seed| of(known.get(&key(axis, level, tracker, seed))?)).collect()
}

fn doubles_at(axis: &CorruptionAxis, error: &dyn Fn(f64) -> f64) -> String {
    let twice = 2.0 * error(0.0);
    let levels: Vec<f64> = [0.0].iter().chain(&axis.levels).copied().collect();
    for pair in levels.windows(2) {
        let (low, high) = (error(pair[0]), error(pair[1]));
        if high >= twice {
            return two_digits(pair[0] + (pair[1] - pair[0]) * (twice - low) / (high - low));
        }
    }
    format!("not up to {}", axis.levels[4])
}

/// A value with as many digits as five seeds and five levels justify.
fn two_digits(value: f64) -> String {
    let digits = (1 - libm::log10(value.abs().max(1e-9)).floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

/// Draws the errors of both trackers over the levels of an axis, with intervals, and returns the file's name.
fn plot_of(folder: &Path, known: &Known, axis: &CorruptionAxis, seeds: u64) -> Result<String, Box<dyn Error>> {
    let levels: Vec<f64> = [0.0].iter().chain(&axis.levels).copied().collect();
    let line = |(tracker, colour): (&str, Colour)| {
        let errors = |level: f64| values(known, axis, level, tracker, seeds, |o| Some(o.humaneva_mm));
        let point = |level: f64| Some(mean(&errors(level))).filter(|mean| mean.is_finite());
        let band = |level: f64| interval(&errors(level)).map(|interval| [interval.low, interval.high]);
        Line {
            band: levels.iter().map(|level| (*level, band(*level))).collect(),
            ..Line::new(tracker, Stroke::solid(colour), levels.iter().map(|level| (*level, point(*level))).collect())
        }
    };
    let plot = LinePlot {
        x_label: format!("{}{}", axis.name, in_unit(axis)),
        y_label: "error, mm".to_owned(),
        lines: [("paper", Colour::Orange), ("default", Colour::Blue)].map(line).into(),
        y_from: Some(0.0),
        ..LinePlot::default()
    };
    let file = format!("degradation-{}.svg", axis.name);
    std::fs::write(folder.join(&file), plot.svg(Size { width: 700, height: 280 })?.standalone())?;
    Ok(file)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn interval(errors: &[f64]) -> Option<Interval> {
    mean_interval(&[errors.to_vec()], ValueRange::NonNegative).map(|(interval, _)| interval)
}

fn with_interval(errors: &[f64]) -> String {
    match interval(errors) {
        Some(interval) => format!("{:.1} ({:.1} to {:.1})", mean(errors), interval.low, interval.high),
        None => format!("{:.1}", mean(errors)),
    }
}
