//! `results/search.md`.

use std::collections::BTreeMap;

use serde::Serialize;
use skiagraph::evaluation::{ValueRange, mean_interval};

use super::units::{Outcome, mean};
use super::{MOST_FRAMES, STRESS_FRAMES, STRESSED, TRACKERS, takes};

/// `[take][tracker]`.
pub(crate) type Takes = BTreeMap<String, BTreeMap<String, Outcome>>;

#[derive(Default, Serialize)]
pub(crate) struct Results {
    /// `[bodies]`.
    pub(crate) clean: BTreeMap<String, Takes>,
    /// `[condition]`.
    pub(crate) stress: BTreeMap<String, Takes>,
}

pub(crate) fn page(results: &Results, seeds: u32) -> String {
    let takes: Vec<String> = takes::REPORTED.iter().map(takes::Take::in_words).collect();
    let mut text = format!(
        "# Search: particles, descent and limbs\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- search`; all digits, seed by seed, are in \
         `search.json`. *Paper* is Algorithm 1 as printed, 200 particles x 5 layers (`paper = true`); *refined* is the default: 60 x 5, \
         then descent on outlines and limbs looked for anew. Four clean views of 640 x 480 at 60 Hz, {seeds} seeds, at most \
         {MOST_FRAMES} frames of a take (time was short: whole takes are longer); proposals learned from other frames or another take \
         of the subject. *Matched*: actor and tracker are the same `tracker25`. *Mismatch*: `actor` against `tracker25` with the \
         standard mismatch; the *floor* is the error of the truth refitted to that body. Settings were chosen on 16_15, 35_02, 02_01, \
         14_24, 16_57, 16_03 and 14_27, never on these takes.\n\n\
         HumanEva error in mm, mean over seeds, 95 % interval over seeds below; the energy gap is that of the truth (refitted) less that \
         of the estimate. Times are of a busy machine with two cores: compare the two columns, which ran in turn.\n",
    );
    for (bodies, takes) in &results.clean {
        text += &format!("\n## {bodies}\n\n{}", clean_table(takes));
    }
    text += &format!(
        "\n## Under stress\n\nMatched bodies, the first {STRESS_FRAMES} frames of {}; mean over takes and seeds, in mm, the interval over \
         seeds. *Worse* are takes on which refined is worse than paper beyond the interval of their difference, seed by seed.\n\n{}",
        STRESSED.join(", "),
        stress_table(&results.stress)
    );
    text + "\n## Takes\n\nFrames of the files from 1, at 120 Hz: " + &takes.join("; ") + ".\n"
}

fn clean_table(takes: &Takes) -> String {
    let mut text = String::from(
        "| take | paper, mm | refined, mm | floor, mm | gap, paper | gap, refined | lost, paper | lost, refined | ms a frame, paper | refined |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut rows: Vec<(String, [&Outcome; 2])> = Vec::new();
    for (take, outcomes) in takes {
        rows.push((take.clone(), TRACKERS.map(|(name, _)| &outcomes[name])));
    }
    for (take, [paper, refined]) in &rows {
        text += &format!(
            "| {take} | {} | **{}** | {:.1} | {:+.3} | {:+.3} | {:.2} | {:.2} | {:.1} | {:.1} |\n",
            with_interval(std::slice::from_ref(&paper.humaneva_mm)),
            with_interval(std::slice::from_ref(&refined.humaneva_mm)),
            refined.floor_mm,
            mean(&paper.energy_gap),
            mean(&refined.energy_gap),
            mean(&paper.lost),
            mean(&refined.lost),
            paper.ms_per_frame,
            refined.ms_per_frame,
        );
    }
    let all = |tracker: usize, of: fn(&Outcome) -> f64| {
        mean(&rows.iter().map(|(_, outcomes)| of(outcomes[tracker])).collect::<Vec<_>>())
    };
    let errors = |tracker: usize| {
        with_interval(&rows.iter().map(|(_, outcomes)| outcomes[tracker].humaneva_mm.clone()).collect::<Vec<_>>())
    };
    text + &format!(
        "| mean | {} | **{}** | {:.1} | {:+.3} | {:+.3} | {:.2} | {:.2} | {:.1} | {:.1} |\n",
        errors(0),
        errors(1),
        all(1, |o| o.floor_mm),
        all(0, |o| mean(&o.energy_gap)),
        all(1, |o| mean(&o.energy_gap)),
        all(0, |o| mean(&o.lost)),
        all(1, |o| mean(&o.lost)),
        all(0, |o| o.ms_per_frame),
        all(1, |o| o.ms_per_frame),
    )
}

fn stress_table(stress: &BTreeMap<String, Takes>) -> String {
    let mut text = String::from(
        "| condition | paper, mm | refined, mm | take by take, refined | worse |\n|---|---|---|---|---|\n",
    );
    for condition in super::Condition::STRESS {
        let Some(takes) = stress.get(condition.name()) else { continue };
        let errors =
            |tracker: &str| -> Vec<Vec<f64>> { takes.values().map(|o| o[tracker].humaneva_mm.clone()).collect() };
        let each: Vec<String> =
            takes.iter().map(|(take, o)| format!("{take} {:.1}", mean(&o["refined"].humaneva_mm))).collect();
        let worse: Vec<&str> =
            takes.iter().filter(|(_, o)| is_worse(&o["paper"], &o["refined"])).map(|(t, _)| t.as_str()).collect();
        let worse = if worse.is_empty() { "none".to_owned() } else { worse.join(", ") };
        text += &format!(
            "| {} | {} | **{}** | {} | {worse} |\n",
            condition.name(),
            with_interval(&errors("paper")),
            with_interval(&errors("refined")),
            each.join(", ")
        );
    }
    text
}

fn is_worse(paper: &Outcome, refined: &Outcome) -> bool {
    let differences: Vec<f64> = refined.humaneva_mm.iter().zip(&paper.humaneva_mm).map(|(r, p)| r - p).collect();
    let interval = mean_interval(&[differences], ValueRange::Any);
    interval.is_some_and(|(interval, _)| interval.low > 0.0)
}

fn with_interval(clips: &[Vec<f64>]) -> String {
    let middle = mean(&clips.iter().map(|clip| mean(clip)).collect::<Vec<_>>());
    match mean_interval(clips, ValueRange::NonNegative) {
        Some((interval, _)) => format!("{middle:.1} <br> {:.1} to {:.1}", interval.low, interval.high),
        None => format!("{middle:.1}"),
    }
}
