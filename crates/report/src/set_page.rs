//! A set on the page of runs: every camera's frames with the true skeleton and the keypoints, and facts.

use serde::Serialize;

use super::html::{in_page, render_page};
use super::overlay::Whose;
use super::page::{ColourKey, KeypointsOnPage, Page, SCRIPT, TEMPLATE};
use super::playback::playback_data;
use super::plots::hex;
use super::{FactGroup, Playback, ReportError, cell};
use skiagraph_core::camera::CameraRig;

/// The content of the page.
#[derive(Clone, Copy, Debug)]
pub struct SetPage<'a> {
    /// The set's name.
    pub title: &'a str,
    /// Short descriptions below the name.
    pub pills: &'a [String],
    /// The cameras; moving ones at their position in frame 0.
    pub rig: &'a CameraRig,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The stored frames.
    pub playback: &'a Playback,
    /// Whether they show an estimate too: the page is that of a run without a truth.
    pub has_estimate: bool,
    /// The keypoints of a set that has some.
    pub keypoints: Option<&'a SetKeypointMarks>,
    /// Facts of the set.
    pub facts: &'a [FactGroup],
}

/// Found keypoints with their marks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetKeypointMarks {
    /// `[stored frame][camera]`: what was found.
    pub views: Vec<Vec<Vec<KeypointMark>>>,
    /// Whether the truth is known, so that marks differ.
    pub is_told: bool,
}

/// A found keypoint: pixels from the outer corner of the top-left pixel, rounded to a tenth, and its mark: 0 visible or
/// unknown, 1 hidden, 2 exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KeypointMark(f64, f64, u8);

impl KeypointMark {
    /// A keypoint at a pixel.
    pub fn new([x, y]: [f64; 2], mark: u8) -> Self {
        let rounded = |pixel: f64| (10.0 * pixel).round() / 10.0;
        Self(rounded(x), rounded(y), mark)
    }
}

impl SetPage<'_> {
    /// The page: self-contained HTML with inline style, script and pictures.
    ///
    /// # Errors
    /// [`ReportError`] if the stored frames do not fit the cameras or the page cannot be rendered.
    pub fn html(&self) -> Result<String, ReportError> {
        let plan = &self.playback.plan;
        let mut sampling = String::new();
        if plan.stride > 1 {
            sampling += &format!(", one frame in {} of {}", plan.stride, plan.frames);
        }
        if plan.reduction > 1 {
            sampling += &format!(", one pixel for {0} x {0} of the image", plan.reduction);
        }
        let has_truth = self.playback.truth.iter().flatten().any(Option::is_some);
        let mut page = Page::default();
        page.kicker = if self.has_estimate { "tracked recording" } else { "benchmark set" };
        page.script = SCRIPT;
        page.title = self.title;
        page.pills = self.pills.to_vec();
        page.playback = Some(in_page(&playback_data(self.playback, (self.rig, self.frames_per_second), None)?)?);
        let of_estimate = |colour: String| self.has_estimate.then_some(colour);
        page.key = Some(ColourKey {
            observed: hex(cell::BOTH),
            truth: has_truth.then(|| hex(Whose::Truth.colour())),
            estimate: of_estimate(hex(Whose::Estimate.colour())),
            only_observed: of_estimate(hex(cell::ONLY_OBSERVED)),
            only_estimated: of_estimate(hex(cell::ONLY_ESTIMATED)),
            props: (!self.playback.props.is_empty()).then(|| hex(cell::PROP)),
        });
        if let Some(marks) = self.keypoints {
            page.keypoints = Some(KeypointsOnPage { views: in_page(&marks.views)?, is_told: marks.is_told });
        }
        page.sampling = sampling;
        page.facts_heading = if self.has_estimate { "Measures and facts" } else { "Facts of the set" };
        page.facts = self.facts;
        render_page(TEMPLATE, &page)
    }
}
