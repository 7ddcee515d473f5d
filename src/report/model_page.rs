//! The page of a learned motion model.

use serde::Serialize;

use super::figures::ResponsiveSvg;
use super::html::render_page;
use super::model_distances::{all_shown, draw};
use super::model_input::{ModelPageInput, OneModel};
use super::{FactGroup, ReportError, model_figures};

const TEMPLATE: &str = include_str!("model_page.html");

#[derive(Serialize)]
struct ModelPage<'a> {
    title: &'a str,
    rate: f64,
    chips: &'a [String],
    headlines: Vec<ModelHeadline>,
    errors: ResponsiveSvg,
    against: Option<&'a str>,
    has_threshold: bool,
    models: Vec<ModelOnPage<'a>>,
    distances: String,
    candidates: usize,
    all_crosses: bool,
    several: bool,
    facts: &'a [FactGroup],
}

#[derive(Serialize)]
struct ModelHeadline {
    value: String,
    unit: &'static str,
    meaning: &'static str,
}

#[derive(Serialize)]
struct ModelOnPage<'a> {
    number: usize,
    recording: &'a str,
    first: usize,
    last: usize,
    frames: usize,
    mean: String,
    greatest: String,
    latents: ResponsiveSvg,
}

/// The page: self-contained HTML with inline plots.
///
/// # Errors
/// [`ReportError`] without a model, or if a plot or picture cannot be drawn.
pub fn model_page(input: &ModelPageInput<'_>) -> Result<String, ReportError> {
    if input.models.is_empty() {
        return Err(ReportError::NoRun);
    }
    let starts: Vec<usize> = input.models.iter().map(|m| m.start).collect();
    let page = ModelPage {
        title: input.title,
        rate: input.frames_per_second,
        chips: &input.chips,
        headlines: headlines(input),
        errors: model_figures::errors(input)?,
        against: input.against.as_ref().map(|other| other.name.as_str()),
        has_threshold: input.threshold.is_some(),
        models: input.models.iter().enumerate().map(|(i, m)| on_page(i, m)).collect::<Result<_, _>>()?,
        distances: draw(&input.distances, &input.candidates, &starts)?,
        candidates: input.candidates.len(),
        all_crosses: all_shown(&input.candidates),
        several: input.models.len() > 1,
        facts: &input.facts,
    };
    render_page(TEMPLATE, &page)
}

fn on_page(index: usize, model: &OneModel) -> Result<ModelOnPage<'_>, ReportError> {
    let frames = model.errors.len();
    let [mean, greatest] = mean_and_greatest(&model.errors).map(rad2);
    Ok(ModelOnPage {
        number: index + 1,
        recording: &model.recording,
        first: model.first + 1,
        last: model.first + frames,
        frames,
        mean,
        greatest,
        latents: model_figures::latents(index, model)?,
    })
}

fn headlines(input: &ModelPageInput<'_>) -> Vec<ModelHeadline> {
    let all: Vec<f64> = input.models.iter().flat_map(|m| m.errors.iter().copied()).collect();
    let [mean, greatest] = mean_and_greatest(&all);
    let headline = |value: String, unit, meaning| ModelHeadline { value, unit, meaning };
    let turns = match input.candidates.len() {
        1 => "frame at which particles may change models",
        _ => "frames at which particles may change models",
    };
    let mut headlines = vec![
        headline(rad2(mean), "rad\u{b2}", "mean distance between recording and simulation, summed over the joints"),
        headline(rad2(greatest), "rad\u{b2}", "largest distance in a frame"),
        headline(input.models.len().to_string(), "", if input.models.len() == 1 { "model" } else { "models" }),
        headline(input.candidates.len().to_string(), "", turns),
    ];
    if let Some(other) = &input.against {
        let [of_other, _] = mean_and_greatest(&other.errors);
        let percent = 100.0 * mean / of_other;
        let share = if percent < 1.0 { format!("{percent:.3}") } else { format!("{percent:.1}") };
        headlines.insert(1, headline(share, "%", "of the mean error of the compared model"));
    }
    headlines
}

fn mean_and_greatest(errors: &[f64]) -> [f64; 2] {
    [errors.iter().sum::<f64>() / errors.len().max(1) as f64, errors.iter().copied().fold(0.0, f64::max)]
}

/// Three significant digits.
fn rad2(value: f64) -> String {
    if value >= 1.0 { format!("{value:.2}") } else { format!("{value:.4}") }
}

#[cfg(test)]
mod tests {
    use super::super::model_distances::{CandidateFrame, FrameDistances};
    use super::super::model_input::OtherModel;
    use super::*;

    fn input(models: usize) -> ModelPageInput<'static> {
        let one = |index: usize| {
            let angle = |t: usize| 0.2 * (t + 30 * index) as f64;
            OneModel {
                start: 30 * index,
                recording: "walk <1>".to_owned(),
                first: 30 * index,
                learned: (0..30).map(|t| vec![angle(t).sin(), angle(t).cos(), 0.3 * angle(t)]).collect(),
                predicted: (0..30).map(|t| vec![angle(t).sin(), angle(t).cos(), 0.25 * angle(t)]).collect(),
                errors: (0..30).map(|t| 0.01 * t as f64).collect(),
            }
        };
        let edge = 30 * models;
        let far = |i: usize, j: usize| (i as f32 * 0.1 - j as f32 * 0.1).abs();
        ModelPageInput {
            title: "walk & run.model",
            frames_per_second: 60.0,
            chips: vec!["gpdm-graph".to_owned()],
            models: (0..models).map(one).collect(),
            threshold: Some(1.0),
            against: None,
            distances: FrameDistances {
                step: 1,
                frames: edge,
                values: (0..edge * edge).map(|k| far(k / edge, k % edge)).collect(),
            },
            candidates: (0..models).map(|model| CandidateFrame { frame: 30 * model + 9, model }).collect(),
            facts: vec![],
        }
    }

    /// Set `SKIAGRAPH_MODEL_PAGE` to a path to look at the page in a browser.
    #[test]
    fn a_page_shows_every_model_and_needs_no_network() {
        let mut input = input(3);
        input.against = Some(OtherModel { name: "single.model".to_owned(), errors: vec![0.29; 90] });
        let html = model_page(&input).unwrap();
        if let Some(path) = std::env::var_os("SKIAGRAPH_MODEL_PAGE") {
            std::fs::write(path, &html).unwrap();
        }
        assert!(html.contains("walk &amp; run.model") && html.contains("walk &lt;1&gt;") && !html.contains("<1>"));
        assert!((1..=3).all(|k| html.contains(&format!("id=\"model-{k}\""))));
        assert!(html.contains("50.0<small>%"), "0.145 of 0.29");
        let outside = html.replace("http://www.w3.org/2000/svg", "");
        assert!(["http:", "https:", "src=", "@import", "<link"].iter().all(|r| !outside.contains(r)));
    }

    #[test]
    fn a_single_model_of_one_dimension_has_a_page_and_no_model_is_refused() {
        let mut flat = input(1);
        let OneModel { learned, predicted, .. } = &mut flat.models[0];
        learned.iter_mut().chain(predicted).for_each(|z| z.truncate(1));
        flat.threshold = None;
        flat.candidates.clear();
        let html = model_page(&flat).unwrap();
        assert!(html.contains("No frames were found") && !html.contains(">TH<"));
        assert!(model_page(&input(0)).is_err());
    }
}
