//! Renders a set directly to disk, frame by frame, and resumes after an interruption.

use std::path::Path;

use super::format::colour_files::ColourDrawing;
use super::format::listing::MADE_BY;
use super::set::silhouette_files;
use super::set_writer::{FileContent, SetWriter};
use super::{BenchmarkSet, BlindSet, SetError, SetParts, TruthImage};
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;

/// How a set is rendered to disk.
#[derive(Clone, Copy)]
pub struct SetDrawing<'a> {
    /// Truth images to render in addition to the silhouettes.
    pub truth_images: &'a [TruthImage],
    /// What made the set, as `made_by.json` records it; without it the set has no such file.
    pub made_by: &'a str,
    /// A file outside the set's folder that records complete files. With it, rendering resumes after an interruption of
    /// any kind.
    pub journal: Option<&'a Path>,
    /// No other frame or file is started once this returns `true`.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Called after the silhouettes of every frame, and after the truth images of every camera and frame, also if they
    /// already exist. Silhouettes are written before the truth images.
    pub tick: &'a (dyn Fn() + Sync),
}

impl Default for SetDrawing<'_> {
    fn default() -> Self {
        Self { truth_images: &[], made_by: "", journal: None, stop: &|| false, tick: &|| {} }
    }
}

impl BenchmarkSet {
    /// Renders a set directly into `folder`, one frame at a time, so memory does not grow with the number of images.
    /// The bytes are those of [`Self::write_with_truth_images`] after [`Self::assemble`]. Without a journal, `folder`
    /// must contain none of the files; with one, complete files are kept and all others in `folder` are removed first.
    /// Returns how many frames already existed.
    ///
    /// # Errors
    /// As [`Self::assemble_unless`] and [`Self::write`]; [`SetError::Differs`] if the journal belongs to other parts.
    pub fn draw_into(
        folder: &Path,
        parts: &SetParts<'_>,
        drawing: &SetDrawing<'_>,
        observe: impl Fn(usize) -> Observation + Sync,
    ) -> Result<usize, SetError> {
        parts.check()?;
        let writer = match drawing.journal {
            Some(journal) => SetWriter::resuming(folder, drawing.stop, journal)?,
            None => SetWriter::new(folder, drawing.stop),
        };
        parts.each_file_without_observations(&mut |path, content| writer.put_same(path, &content))?;
        if !drawing.made_by.is_empty() {
            writer.put_same(MADE_BY, &FileContent::Bytes(drawing.made_by.as_bytes().to_vec()))?;
        }
        let colour = parts.colour()?;
        if let Some(colour) = &colour {
            draw_backgrounds(&writer, colour)?;
        }
        let draw = |frame: usize| {
            let existed = draw_frame(&writer, parts, colour.as_ref(), &observe, frame)?;
            (drawing.tick)();
            Ok(usize::from(existed))
        };
        let drawn = parallel::map(parts.ground_truth.frames.len(), draw).into_iter();
        let existing = drawn.sum::<Result<usize, SetError>>()?;
        if !drawing.truth_images.is_empty() {
            parts.truth_image_drawing(drawing.truth_images).write(&writer, drawing.tick)?;
        }
        writer.finish()?;
        Ok(existing)
    }
}

/// Renders the background images that do not exist.
fn draw_backgrounds(writer: &SetWriter<'_>, colour: &ColourDrawing<'_>) -> Result<(), SetError> {
    let places: Vec<_> = colour.background_places().filter(|(_, _, path)| !writer.has(path)).collect();
    let draw = |index: usize| {
        let (camera, number, path) = &places[index];
        writer.stop_if_requested()?;
        writer.put(path, &colour.background(*camera, *number)?)
    };
    parallel::map(places.len(), draw).into_iter().collect()
}

/// Renders the silhouettes and images of a frame that do not exist. Returns whether all existed.
fn draw_frame(
    writer: &SetWriter<'_>,
    parts: &SetParts<'_>,
    colour: Option<&ColourDrawing<'_>>,
    observe: impl Fn(usize) -> Observation,
    frame: usize,
) -> Result<bool, SetError> {
    writer.stop_if_requested()?;
    let taken: Vec<usize> = (0..parts.rig.cameras()).filter(|camera| parts.rig.has_image(*camera, frame)).collect();
    let have = |path: &dyn Fn(usize) -> String| taken.iter().all(|camera| writer.has(&path(*camera)));
    let put = |files: Vec<(String, Vec<u8>)>| {
        let mut missing = files.iter().filter(|(path, _)| !writer.has(path));
        missing.try_for_each(|(path, bytes)| writer.put(path, bytes))
    };
    let mut existed = !taken.is_empty();
    if !existed || !have(&|camera| BlindSet::silhouette_path(camera, frame)) {
        put(silhouette_files(parts, frame, &observe(frame))?)?;
        existed = false;
    }
    if let Some(colour) = colour.filter(|colour| !have(&|camera| colour.path(camera, frame))) {
        put(colour.files(frame)?)?;
        existed = false;
    }
    Ok(existed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::with_parts;
    use crate::test_bodies::walk;
    use crate::{is_set, verify_hashes};
    use std::fs;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const FRAMES: usize = 7;

    /// Renders with a stop after this number of ticks.
    fn draw(root: &Path, truth_images: &[TruthImage], stop_after: usize) -> Result<usize, SetError> {
        let (folder, journal) = (root.join("set"), root.join("finished.sha256"));
        fs::create_dir_all(&folder).unwrap();
        let ticks = AtomicUsize::new(0);
        with_parts(&walk(FRAMES), |parts, observer| {
            let drawing = SetDrawing {
                truth_images,
                journal: Some(&journal),
                stop: &|| ticks.load(Ordering::SeqCst) >= stop_after,
                tick: &|| {
                    ticks.fetch_add(1, Ordering::SeqCst);
                },
                ..SetDrawing::default()
            };
            BenchmarkSet::draw_into(&folder, parts, &drawing, |frame| observer.observe(frame))
        })
    }

    fn listing(root: &Path) -> String {
        fs::read_to_string(root.join("set/files.sha256")).unwrap()
    }

    #[test]
    fn a_rendering_stopped_anywhere_resumes_and_gives_the_bytes_of_an_uninterrupted_one() {
        let truth_images = [TruthImage::Depth];
        let whole = tempfile::tempdir().unwrap();
        assert_eq!(draw(whole.path(), &truth_images, usize::MAX).unwrap(), 0);
        let root = tempfile::tempdir().unwrap();
        for stop_after in [1, 2, 3, 5, 8, 12, 17, 22] {
            // existing files tick too: every attempt gets farther, the last one beyond all silhouettes
            assert!(matches!(draw(root.path(), &truth_images, stop_after), Err(SetError::Stopped)), "{stop_after}");
            assert!(!is_set(&root.path().join("set")));
        }
        assert_eq!(draw(root.path(), &truth_images, usize::MAX).unwrap(), FRAMES);
        assert_eq!(listing(root.path()), listing(whole.path()));
        verify_hashes(&root.path().join("set")).unwrap();
    }

    #[test]
    fn a_journal_of_another_motion_is_refused_by_the_file_that_differs() {
        let root = tempfile::tempdir().unwrap();
        draw(root.path(), &[], 2).unwrap_err();
        let (folder, journal) = (root.path().join("set"), root.path().join("finished.sha256"));
        let refused = with_parts(&walk(FRAMES + 1), |parts, observer| {
            let drawing = SetDrawing { journal: Some(&journal), ..SetDrawing::default() };
            BenchmarkSet::draw_into(&folder, parts, &drawing, |frame| observer.observe(frame)).unwrap_err()
        });
        assert!(matches!(&refused, SetError::Differs { file } if file == "set.toml"), "{refused}");
    }
}
