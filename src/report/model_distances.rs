//! The frame-distance matrix of a motion model (`[GPDM graph]`, Fig. 4) with axes, colour key and candidates.

use std::fmt::Write;

use tiny_skia::Pixmap;

use super::drawing::{encoded, new_picture, pixel};
use super::{ReportError, base64};

/// Distances between all pairs of some training frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameDistances {
    /// Step between shown frames.
    pub step: usize,
    /// Row by row, `frames x frames`, rad^2.
    pub values: Vec<f32>,
    /// Number of shown frames.
    pub frames: usize,
}

/// A training frame at which particles may change models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CandidateFrame {
    /// Training frame, counted over all recordings.
    pub frame: usize,
    /// Index of its model.
    pub model: usize,
}

/// Colours from the smallest to the largest distance: blue is near, red is far, as in `[GPDM graph]`.
const RAMP: [[f32; 3]; 5] =
    [[10.0, 42.0, 110.0], [47.0, 134.0, 196.0], [238.0, 232.0, 205.0], [222.0, 120.0, 60.0], [134.0, 14.0, 32.0]];
/// Edge of the picture inside the drawing, CSS pixels.
const EDGE: f64 = 480.0;
/// Margins around it.
const LEFT: f64 = 52.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 96.0;
/// Maximum number of crosses.
const MOST_CROSSES: usize = 6000;

/// Draws the matrix: `starts` are the first frames of the models, crosses mark pairs of candidates of different models.
pub(super) fn draw(
    distances: &FrameDistances,
    candidates: &[CandidateFrame],
    starts: &[usize],
) -> Result<String, ReportError> {
    let greatest = distances.values.iter().copied().fold(0.0_f32, f32::max);
    let picture = base64::encode(&encoded(&painted(distances, greatest)?)?);
    let shown = (distances.frames * distances.step).max(1) as f64;
    let at = |frame: usize| EDGE * (frame as f64 + 0.5) / shown;
    let (width, height) = (LEFT + EDGE + RIGHT, TOP + EDGE + BOTTOM);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"Distance between every pair of training frames\" font-family=\"system-ui, sans-serif\" \
         font-size=\"14\" fill=\"var(--plot-faint,#5C6B7A)\"><g transform=\"translate({LEFT} {TOP})\">\
         <image width=\"{EDGE}\" height=\"{EDGE}\" preserveAspectRatio=\"none\" image-rendering=\"pixelated\" \
         href=\"data:image/png;base64,{picture}\"/>"
    );
    for start in starts.iter().filter(|start| **start > 0) {
        let place = EDGE * *start as f64 / shown;
        let lines = format!("M{place:.1} 0V{EDGE}M0 {place:.1}H{EDGE}");
        write_to(&mut svg, format_args!("<path d=\"{lines}\" stroke=\"#fff\" stroke-opacity=\".8\" fill=\"none\"/>"))?;
    }
    let crosses: String = pairs(candidates)
        .map(|[a, b]| format!("M{:.1} {:.1}l6 6m0 -6l-6 6", at(a.frame) - 3.0, at(b.frame) - 3.0))
        .collect();
    write_to(&mut svg, format_args!("<path d=\"{crosses}\" stroke=\"#000\" stroke-width=\"3\" fill=\"none\"/>"))?;
    write_to(&mut svg, format_args!("<path d=\"{crosses}\" stroke=\"#fff\" stroke-width=\"1.4\" fill=\"none\"/>"))?;
    axes(&mut svg, shown)?;
    key(&mut svg, greatest)?;
    svg.push_str("</g></svg>");
    Ok(svg)
}

/// Whether every pair of candidates of different models has its cross.
pub(super) fn all_shown(candidates: &[CandidateFrame]) -> bool {
    candidates.len() * candidates.len() <= MOST_CROSSES
}

/// The pairs with a cross; with very many candidates, only each with itself.
fn pairs(candidates: &[CandidateFrame]) -> Box<dyn Iterator<Item = [&CandidateFrame; 2]> + '_> {
    if !all_shown(candidates) {
        return Box::new(candidates.iter().take(MOST_CROSSES).map(|c| [c, c]));
    }
    Box::new(candidates.iter().flat_map(move |a| {
        let others = candidates.iter().filter(move |b| a.model != b.model || a == *b);
        others.map(move |b| [a, b])
    }))
}

fn axes(svg: &mut String, shown: f64) -> Result<(), ReportError> {
    let step = [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0].into_iter().find(|s| shown / s <= 6.0);
    let step = step.unwrap_or(5000.0);
    for tick in 0..=(shown / step) as usize {
        let (frame, place) = (tick as f64 * step, EDGE * tick as f64 * step / shown);
        write_to(
            svg,
            format_args!("<text x=\"{place:.1}\" y=\"{}\" text-anchor=\"middle\">{frame}</text>", EDGE + 18.0),
        )?;
        let beside = place + 5.0;
        write_to(svg, format_args!("<text x=\"-6\" y=\"{beside:.1}\" text-anchor=\"end\">{frame}</text>"))?;
    }
    let (middle, below) = (EDGE / 2.0, EDGE + 38.0);
    write_to(svg, format_args!("<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">training frame</text>"))
}

/// Draws the colour key.
fn key(svg: &mut String, greatest: f32) -> Result<(), ReportError> {
    let stops: String = (0..RAMP.len())
        .map(|i| {
            let [r, g, b] = RAMP[i];
            format!("<stop offset=\"{}\" stop-color=\"rgb({r} {g} {b})\"/>", i as f64 / (RAMP.len() - 1) as f64)
        })
        .collect();
    let (top, text) = (EDGE + 56.0, EDGE + 86.0);
    write_to(svg, format_args!("<linearGradient id=\"distance-key\">{stops}</linearGradient>"))?;
    write_to(svg, format_args!("<rect y=\"{top}\" width=\"{EDGE}\" height=\"12\" fill=\"url(#distance-key)\"/>"))?;
    write_to(svg, format_args!("<text y=\"{text}\">0: same pose</text>"))?;
    write_to(svg, format_args!("<text x=\"{EDGE}\" y=\"{text}\" text-anchor=\"end\">{greatest:.1} rad\u{b2}</text>"))
}

fn write_to(svg: &mut String, text: std::fmt::Arguments<'_>) -> Result<(), ReportError> {
    svg.write_fmt(text).map_err(|error| ReportError::Plot(error.to_string()))
}

fn painted(distances: &FrameDistances, greatest: f32) -> Result<Pixmap, ReportError> {
    let edge = distances.frames as u32;
    let mut picture = new_picture(edge, edge)?;
    for (place, value) in picture.pixels_mut().iter_mut().zip(&distances.values) {
        *place = pixel(colour(value / greatest.max(f32::MIN_POSITIVE)));
    }
    Ok(picture)
}

/// The colour of the ramp at a share in [0, 1].
pub(super) fn colour(share: f32) -> [u8; 3] {
    let along = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let index = (along as usize).min(RAMP.len() - 2);
    let rest = along - index as f32;
    [0, 1, 2].map(|c| (RAMP[index][c] + rest * (RAMP[index + 1][c] - RAMP[index][c])).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(frame: usize, model: usize) -> CandidateFrame {
        CandidateFrame { frame, model }
    }

    #[test]
    fn near_is_blue_and_far_is_red() {
        assert_eq!(colour(0.0), [10, 42, 110]);
        assert_eq!(colour(1.0), [134, 14, 32]);
        assert_eq!(colour(0.5), [238, 232, 205]);
    }

    #[test]
    fn crosses_mark_pairs_of_candidates_of_different_models() {
        let candidates = [candidate(3, 0), candidate(9, 0), candidate(20, 1)];
        let found: Vec<[usize; 2]> = pairs(&candidates).map(|pair| pair.map(|c| c.frame)).collect();
        assert_eq!(found, [[3, 3], [3, 20], [9, 9], [9, 20], [20, 3], [20, 9], [20, 20]]);
    }

    #[test]
    fn a_matrix_is_drawn_with_its_models_and_an_empty_one_is_an_error() {
        let distances = FrameDistances { step: 1, frames: 4, values: (0..16).map(|v| v as f32).collect() };
        let svg = draw(&distances, &[candidate(1, 0)], &[0, 2]).unwrap();
        assert_eq!(svg.matches("stroke-opacity").count(), 1, "the first model begins at the edge");
        assert!(svg.contains("15.0 rad") && svg.ends_with("</svg>"));
        assert!(matches!(draw(&FrameDistances::default(), &[], &[]), Err(ReportError::Size { .. })));
    }
}
