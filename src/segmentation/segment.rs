//! `skiagraph segment`: silhouettes from images of a static camera.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::pictures::{images_in, read_image};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, Stage, advance, to_json};
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;
use skiagraph_set::silhouette_to_png;
use skiagraph_truth::observing::{BackgroundSettings, Image, LEAST_BACKGROUND, Segmenter};

pub const SEGMENT_FILE: &str = "segment.json";

#[derive(Clone, Debug)]
pub struct SegmentInput<'a> {
    /// Directories with images of the background, one per period. The images of a single directory are divided, in the
    /// order of their names, into `components` periods of equal length.
    pub background: &'a [PathBuf],
    /// Directory with the images to segment.
    pub frames: &'a Path,
    /// Components of the mixture, if one directory holds all periods.
    pub components: usize,
    /// Settings of the mixture, the shadow rule and the cleaning.
    pub settings: BackgroundSettings,
}

/// The record of a segmentation: `segment.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segmented {
    /// `skiagraph.segment/1`.
    pub schema: String,
    /// Number of background frames in each period.
    pub background_frames: Vec<usize>,
    /// Number of segmented frames.
    pub frames: usize,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// 1 for grey, 3 for colour.
    pub channels: usize,
    /// Mean share of foreground pixels.
    pub foreground: f64,
    /// Settings of the mixture, the shadow rule and the cleaning.
    pub settings: BackgroundSettings,
    /// Frames per second on all threads, with reading and writing.
    pub frames_per_second: f64,
}

fn made_by(input: &SegmentInput<'_>) -> MadeBy {
    let background: Vec<String> = input.background.iter().map(|path| path.display().to_string()).collect();
    let mut settings = json!(input.settings);
    (settings["--background"], settings["--components"]) = (json!(background), json!(input.components));
    MadeBy::new("skiagraph segment", settings).of("--frames", input.frames.display().to_string())
}

/// Segments the images of a directory. Each mask has the name of its image with the extension `.png`.
pub fn segment(
    input: &SegmentInput<'_>,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Segmented, ExperimentError> {
    let inputs = input.background.iter().cloned().chain([input.frames.to_owned()]);
    Inputs::new(inputs).keep_from(to.path)?;
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by(input))?;
    let frames = images_in(input.frames)?;
    let names = names_of(&frames, input.frames)?;
    let periods = periods_of(input)?;
    let images = read_periods(&periods)?;
    let (mut shape, begin) = ((0, 0, 0), Instant::now());
    if let Some(first) = images.iter().flatten().next() {
        shape = first.shape();
    }
    progress.begin(Stage::Segment, frames.len());
    let write = |index: usize, mask: &Mask| -> Result<u64, ExperimentError> {
        directory.write(&names[index], &silhouette_to_png(&names[index], mask)?)?;
        Ok(mask.count())
    };
    let segmenter = Segmenter::learn(images.iter(), &input.settings)
        .map_err(|e| ExperimentError::Argument { argument: "--background", detail: e.to_string() })?;
    let of_frame = |index: usize| {
        advance(progress)?;
        let mask = segmenter.silhouette(&read_image(&frames[index])?).map_err(shape_error(&frames[index]))?;
        write(index, &mask)
    };
    let counts: Vec<u64> = parallel::map(frames.len(), of_frame).into_iter().collect::<Result<_, _>>()?;
    let pixels = f64::from(shape.0) * f64::from(shape.1) * frames.len() as f64;
    let foreground = counts.iter().sum::<u64>() as f64 / pixels;
    doubts(input, &images, foreground).iter().for_each(|doubt| progress.note(doubt));
    let segmented = Segmented {
        schema: "skiagraph.segment/1".to_owned(),
        background_frames: images.iter().map(Vec::len).collect(),
        frames: frames.len(),
        size_px: [shape.0, shape.1],
        channels: shape.2,
        foreground,
        settings: input.settings,
        frames_per_second: frames.len() as f64 / begin.elapsed().as_secs_f64(),
    };
    directory.write(SEGMENT_FILE, &to_json(&segmented)?)?;
    directory.finish()?;
    Ok(segmented)
}

/// Why the masks are probably useless, if they are.
fn doubts(input: &SegmentInput<'_>, images: &[Vec<Image>], foreground: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    let least = images.iter().map(Vec::len).min().filter(|least| *least < LEAST_BACKGROUND);
    if let Some(least) = least {
        doubts.push(format!(
            "a component of the background is learned from {least} image(s), which tell little of its noise: record about \
             20, or choose fewer --components"
        ));
    }
    if foreground > 0.5 {
        doubts.push(format!(
            "{:.0} % of all pixels are foreground: light or camera probably differ from the images of the background, or \
             those are too few",
            100.0 * foreground
        ));
    }
    if foreground == 0.0 && input.settings.remove_shadows {
        doubts.push(
            "no pixel is foreground. If the images show anybody: clothing that is darker than a plain background is taken \
             for shadow (--keep-shadows keeps it)"
                .to_owned(),
        );
    }
    doubts
}

fn shape_error(path: &Path) -> impl Fn(skiagraph_truth::observing::BackgroundError) -> ExperimentError {
    move |e| ExperimentError::Malformed { path: path.to_owned(), detail: e.to_string() }
}

/// The names of the masks. Two images that differ only in their extension are refused.
fn names_of(frames: &[PathBuf], directory: &Path) -> Result<Vec<String>, ExperimentError> {
    let name =
        |path: &PathBuf| path.file_stem().map(|stem| format!("{}.png", stem.to_string_lossy())).unwrap_or_default();
    let mut names: Vec<String> = frames.iter().map(name).collect();
    let in_order = names.clone();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(in_order),
        Some(twice) => {
            let detail = format!("two images would become {}; rename one", twice[0]);
            Err(ExperimentError::Malformed { path: directory.to_owned(), detail })
        }
    }
}

fn periods_of(input: &SegmentInput<'_>) -> Result<Vec<Vec<PathBuf>>, ExperimentError> {
    let [one] = input.background else {
        return input.background.iter().map(|directory| images_in(directory)).collect();
    };
    let images = images_in(one)?;
    let (count, components) = (images.len(), input.components.max(1));
    if count < components {
        let detail = format!(
            "expected at least one background frame for each of the {components} components of the mixture, found {count} \
             in {}; give more frames, or fewer --components",
            one.display()
        );
        return Err(ExperimentError::Argument { argument: "--background", detail });
    }
    let period = |index: usize| images[index * count / components..(index + 1) * count / components].to_vec();
    Ok((0..components).map(period).collect())
}

/// All images of the background, which must have the same size.
fn read_periods(periods: &[Vec<PathBuf>]) -> Result<Vec<Vec<Image>>, ExperimentError> {
    let paths: Vec<&PathBuf> = periods.iter().flatten().collect();
    let mut images =
        parallel::map(paths.len(), |i| read_image(paths[i])).into_iter().collect::<Result<Vec<_>, _>>()?.into_iter();
    let mut expected = None;
    let mut of_period = |period: &Vec<PathBuf>| {
        let of_image = |path: &PathBuf| {
            let image = images.next().ok_or(ExperimentError::Interrupted)?;
            let shape = *expected.get_or_insert(image.shape());
            if image.shape() != shape {
                let error =
                    skiagraph_truth::observing::BackgroundError::Shape { found: image.shape(), expected: shape };
                return Err(shape_error(path)(error));
            }
            Ok(image)
        };
        period.iter().map(of_image).collect::<Result<Vec<_>, ExperimentError>>()
    };
    periods.iter().map(&mut of_period).collect()
}
