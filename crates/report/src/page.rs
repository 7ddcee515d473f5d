//! The page of a run.

use std::collections::BTreeMap;

use serde::Serialize;

use skiagraph_eval::{Direction, METRICS, MetricSummary, SeedRun, Summary, find_metric};

use super::contact_sheet::camera_step;
use super::figures::{Figure, figures, per_frame};
use super::grading::{Grade, GradeRow, PreferredPose, verdict, with_unit};
use super::html::{in_page, render_page};
use super::input::{FactGroup, describe_bodies, worst_frames};
use super::metric_groups::{GROUPS, MetricGroup, aliases};
use super::playback::playback_data;
use super::plots::hex;
use super::{Playback, ReportError, ReportInput, Sheet, Shown, Verdict, base64, cell, overlay, typical_run};

pub(super) const TEMPLATE: &str = include_str!("page.html");
pub(super) const SCRIPT: &str = include_str!("playback.js");

const HEADLINES: [&str; 7] =
    ["humaneva_mm", "lost_limb", "pa_mpjpe_mm", "body_orientation_deg", "silhouette_iou", "track_loss", "coverage"];

/// The values of the template. A set is a run without an estimate: most of its values are empty.
#[derive(Default, Serialize)]
pub(super) struct Page<'a> {
    pub(super) kicker: &'static str,
    pub(super) script: &'static str,
    pub(super) title: &'a str,
    /// Short facts below the title.
    pub(super) pills: Vec<String>,
    matched: bool,
    hint: Option<&'a str>,
    /// `None` for a set.
    verdict: Option<&'a Verdict>,
    preferred: Option<String>,
    grades: Vec<GradeOnPage>,
    headlines: Vec<&'static str>,
    /// The data for the script, as JSON escaped for a page.
    pub(super) playback: Option<String>,
    pub(super) key: Option<ColourKey>,
    pub(super) keypoints: Option<KeypointsOnPage>,
    /// Which frames and pixels of a set are shown.
    pub(super) sampling: String,
    sheet: Option<SheetOnPage>,
    figures: Vec<Figure>,
    search_figures: Vec<Figure>,
    /// `None` for a set.
    summary: Option<&'a Summary>,
    /// All metrics by name, and the names in groups.
    metrics: BTreeMap<&'static str, MetricOnPage<'a>>,
    groups: Vec<&'static MetricGroup>,
    has_frozen: bool,
    worst: Vec<WorstRow>,
    pub(super) facts_heading: &'static str,
    pub(super) facts: &'a [FactGroup],
    this_run: &'a [(String, String)],
}

#[derive(Serialize)]
struct GradeOnPage {
    title: String,
    value: Option<String>,
    grade: Option<&'static str>,
    good: String,
    fair: String,
    needs: &'static str,
}

/// A metric of the run: its definition and its values.
#[derive(Serialize)]
struct MetricOnPage<'a> {
    name: &'static str,
    title: &'static str,
    meaning: &'static str,
    better: &'static str,
    #[serde(flatten)]
    values: &'a MetricSummary,
    /// The value of a tracker that never moves.
    frozen: Option<f64>,
    /// Worse than that.
    worse: bool,
    /// Other names of the same values, which have no row of their own.
    also: Vec<&'static str>,
    is_alias: bool,
}

/// One of the worst frames; the error in millimetres.
#[derive(Serialize)]
struct WorstRow {
    seed: u64,
    frame: usize,
    time_s: f64,
    error: Option<f64>,
    overlap: Option<f64>,
    gap: Option<f64>,
}

#[derive(Serialize)]
struct SheetOnPage {
    /// Whether any frame has a silhouette of the estimate.
    outlined: bool,
    /// Whether it shows the cameras' images.
    on_images: bool,
    /// Of every how many cameras one is shown.
    step: usize,
    png: String,
}

/// The colours of the pictures. Those of what is not shown are absent.
#[derive(Serialize)]
pub(super) struct ColourKey {
    pub(super) observed: String,
    pub(super) truth: Option<String>,
    pub(super) estimate: Option<String>,
    /// Of the parts of the image in which the silhouettes differ.
    pub(super) only_observed: Option<String>,
    pub(super) only_estimated: Option<String>,
    pub(super) props: Option<String>,
}

#[derive(Serialize)]
pub(super) struct KeypointsOnPage {
    pub(super) views: String,
    /// Whether the truth tells which are hidden or exchanged.
    pub(super) is_told: bool,
}

/// The whole page: self-contained HTML with inline style, script, plots and pictures.
///
/// # Errors
/// [`ReportError`] without a run, if a sheet's frames do not fit its cameras, or if a plot or picture cannot be drawn.
pub fn render(input: &ReportInput<'_>) -> Result<String, ReportError> {
    let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
    let typical = typical_run(&runs).map(|index| &input.runs[index]).ok_or(ReportError::NoRun)?;
    let verdict = verdict(input);
    let metrics = metrics(input, &verdict);
    let mut groups: Vec<&MetricGroup> = GROUPS.iter().collect();
    groups.retain(|group| group.metrics.iter().any(|name| metrics.get(name).is_some_and(|metric| !metric.is_alias)));
    let (search_figures, figures) = figures(input, typical)?.into_iter().partition(|figure| figure.about_search);
    let seeds = input.runs.len();
    let page = Page {
        kicker: "tracking report",
        script: SCRIPT,
        title: input.title,
        pills: vec![
            input.tracker.to_owned(),
            format!("{seeds} seed{}", if seeds == 1 { "" } else { "s" }),
            describe_bodies(input.matched).to_owned(),
        ],
        matched: input.matched,
        hint: input.hint,
        headlines: HEADLINES.into_iter().filter(|name| metrics.contains_key(name)).collect(),
        sheet: input.sheet.map(|sheet| SheetOnPage {
            outlined: has_outlines(sheet),
            on_images: sheet.frames.iter().any(|frame| !frame.images.is_empty()),
            step: camera_step(sheet.rig.cameras.len()),
            png: base64::encode(input.picture),
        }),
        playback: playback(input)?,
        key: input.sheet.map(colour_key),
        keypoints: None,
        sampling: String::new(),
        figures,
        search_figures,
        summary: Some(input.summary),
        metrics,
        groups,
        has_frozen: input.frozen.is_some(),
        worst: worst_frames(&runs, WORST).into_iter().map(|worst| worst_row(&runs, worst)).collect(),
        facts_heading: "How the run was made",
        facts: input.facts,
        this_run: input.this_run,
        preferred: verdict.preferred.as_ref().map(PreferredPose::describe),
        grades: verdict.rows.iter().map(grade_on_page).collect(),
        verdict: Some(&verdict),
    };
    render_page(TEMPLATE, &page)
}

fn colour_key(sheet: &Sheet<'_>) -> ColourKey {
    let outlined = has_outlines(sheet);
    ColourKey {
        observed: hex(cell::BOTH),
        truth: Some(hex(overlay::Whose::Truth.colour())),
        estimate: Some(hex(overlay::Whose::Estimate.colour())),
        only_observed: outlined.then(|| hex(cell::ONLY_OBSERVED)),
        only_estimated: outlined.then(|| hex(cell::ONLY_ESTIMATED)),
        props: (!sheet.props.is_empty()).then(|| hex(cell::PROP)),
    }
}

fn grade_on_page(row: &GradeRow) -> GradeOnPage {
    GradeOnPage {
        title: row.title().to_owned(),
        value: row.value.map(|value| with_unit(value, row.unit)),
        grade: row.grade.map(Grade::name),
        good: row.good_limit(),
        fair: row.fair_limit(),
        needs: find_metric(&row.metric).map_or("", |metric| metric.needs),
    }
}

/// The data of the frames, as JSON.
fn playback(input: &ReportInput<'_>) -> Result<Option<String>, ReportError> {
    let Some(sheet) = input.sheet.filter(|_| !input.playbacks.is_empty()) else { return Ok(None) };
    let of_seed = |playback: &Playback| {
        let shown = input.runs.iter().find(|run| run.run.seed == playback.seed);
        let errors = shown.map_or(&[][..], |run| per_frame(run.run.evaluation, "humaneva_mm"));
        playback_data(playback, (sheet.rig, sheet.frames_per_second), Some(errors))
    };
    in_page(&input.playbacks.iter().map(of_seed).collect::<Result<Vec<_>, _>>()?).map(Some)
}

fn metrics<'a>(input: &ReportInput<'a>, verdict: &Verdict) -> BTreeMap<&'static str, MetricOnPage<'a>> {
    let aliases = aliases(input.summary);
    let mut metrics = BTreeMap::new();
    for metric in METRICS {
        let Some(values) = input.summary.metrics.get(metric.name) else { continue };
        let better = match metric.direction {
            Direction::LowerIsBetter => "lower is better",
            Direction::HigherIsBetter => "higher is better",
            Direction::Neither => "a diagnosis",
        };
        let on_page = MetricOnPage {
            name: metric.name,
            title: metric.title,
            meaning: metric.meaning,
            better,
            values,
            frozen: input.frozen.and_then(|frozen| frozen.metrics.get(metric.name)).map(|value| value.mean),
            worse: verdict.worse_than_frozen.iter().any(|worse| worse == metric.name),
            also: aliases.iter().filter(|(shown, _)| *shown == metric.name).map(|(_, alias)| *alias).collect(),
            is_alias: aliases.iter().any(|(_, alias)| *alias == metric.name),
        };
        metrics.insert(metric.name, on_page);
    }
    metrics
}

const WORST: usize = 10;

fn worst_row(runs: &[SeedRun<'_>], Shown { run, frame }: Shown) -> WorstRow {
    let SeedRun { seed, evaluation, .. } = runs[run];
    let at = |metric: &str| per_frame(evaluation, metric).get(frame).copied().flatten();
    WorstRow {
        seed,
        frame,
        time_s: frame as f64 / evaluation.frames_per_second,
        error: at("humaneva_mm"),
        overlap: at("silhouette_iou"),
        gap: at("energy_gap"),
    }
}

fn has_outlines(sheet: &Sheet<'_>) -> bool {
    sheet.frames.iter().any(|frame| frame.estimated.is_some())
}

#[cfg(test)]
mod tests;
