//! A set drawn straight to disk, frame by frame, and gone on with after an interruption.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::blind::silhouette_path;
use super::layer_drawing::LayerDrawing;
use super::set::silhouette_files;
use super::set_writer::SetWriter;
use super::{BenchmarkSet, Layer, SetError, SetParts, shards};
use crate::camera::FilmingRig;
use crate::observation::Observation;
use crate::parallel;

/// How a set is drawn to disk.
#[derive(Clone, Copy)]
pub struct SetDrawing<'a> {
    /// Truth images to draw besides the silhouettes.
    pub layers: &'a [Layer],
    /// Into how many tar shards the files are repeated, below `truth/shards/`.
    pub shards: Option<usize>,
    /// A file outside the set's folder that remembers what is whole. With it a drawing goes on where the same one was
    /// interrupted, however that ended.
    pub journal: Option<&'a Path>,
    /// No frame and no file is begun once this answers `true`.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Told of every frame whose silhouettes are written, and of every camera and frame whose layers are; of those that
    /// were there too. Silhouettes come before the layers of the same shard.
    pub tick: &'a (dyn Fn() + Sync),
}

impl Default for SetDrawing<'_> {
    fn default() -> Self {
        Self { layers: &[], shards: None, journal: None, stop: &|| false, tick: &|| {} }
    }
}

impl BenchmarkSet {
    /// Draws a set straight into `folder`: a frame is observed, written and forgotten, so that memory does not grow
    /// with the images. The same bytes as those of [`Self::write_unless`] after [`Self::assemble`]. Without a journal
    /// none of the files may be there yet; with one, whole files stay and all others in `folder` are removed first.
    /// Returns how many frames were observed before.
    ///
    /// # Errors
    /// As [`Self::assemble_unless`] and [`Self::write`]; [`SetError::Differs`] where a journal is that of other parts.
    pub fn draw_into(
        folder: &Path,
        parts: &SetParts<'_>,
        drawing: &SetDrawing<'_>,
        observe: impl Fn(usize) -> Observation + Sync,
    ) -> Result<usize, SetError> {
        parts.check()?;
        shards::check(drawing.shards, parts.ground_truth.frames.len())?;
        if drawing.shards.is_some() && parts.observed.filming.is_some_and(FilmingRig::leaves_frames) {
            let detail = "--shards: its samples hold points of a frame's own time, and images of these cameras are exposed at \
                          other times (rig.timing.offset_ms, line_delay_us)";
            return Err(SetError::inconsistent(detail.to_owned()));
        }
        let writer = match drawing.journal {
            Some(journal) => SetWriter::resuming(folder, drawing.stop, journal)?,
            None => SetWriter::new(folder, drawing.stop),
        };
        parts.each_file_beside_observations(&mut |path, content| writer.put_same(path, &content))?;
        if drawing.shards.is_some() {
            shards::write_readme(&writer)?;
        }
        let mut there = 0;
        let ranges = shards::frame_ranges(drawing.shards, parts.ground_truth.frames.len());
        for (shard, frames) in ranges.into_iter().enumerate() {
            there += draw_frames(&writer, parts, drawing, &observe, frames.clone())?;
            if drawing.shards.is_some() {
                shards::write(&writer, folder, parts, drawing.layers, (shard, frames))?;
            }
        }
        writer.finish()?;
        Ok(there)
    }
}

/// Draws some frames and their layers; how many frames were there.
fn draw_frames(
    writer: &SetWriter<'_>,
    parts: &SetParts<'_>,
    drawing: &SetDrawing<'_>,
    observe: &(impl Fn(usize) -> Observation + Sync),
    frames: Range<usize>,
) -> Result<usize, SetError> {
    let cameras = parts.rig.cameras.len();
    let of_frame = |index: usize| {
        let frame = frames.start + index;
        writer.unless_stopped()?;
        let taken: Vec<usize> = (0..cameras).filter(|camera| parts.has_image(*camera, frame)).collect();
        let has = |camera: &usize| writer.has(&silhouette_path(*camera, frame));
        let whole = !taken.is_empty() && taken.iter().all(has);
        if !whole {
            for (path, bytes) in silhouette_files(parts, frame, &observe(frame))? {
                if !writer.has(&path) {
                    writer.put(&path, &bytes)?;
                }
            }
        }
        (drawing.tick)();
        Ok(usize::from(whole))
    };
    let there: Vec<usize> = parallel::map(frames.len(), of_frame).into_iter().collect::<Result<_, SetError>>()?;
    if !drawing.layers.is_empty() {
        let layers = LayerDrawing {
            truth: parts.ground_truth,
            filming: parts.observed.filming.map_or_else(|| Cow::Owned(FilmingRig::from(parts.rig)), Cow::Borrowed),
            images: parts.observed.facts.and_then(|facts| facts.images).unwrap_or_default(),
            seed: parts.facts.observation_seed.unwrap_or(1).into(),
            layers: drawing.layers,
        };
        layers.write(writer, frames, drawing.tick)?;
    }
    Ok(there.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark_set::fixture::with_parts;
    use crate::benchmark_set::{is_set, verify_hashes};
    use crate::body::fixture::walk;
    use std::fs;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const FRAMES: usize = 7;

    /// The listing of a drawing that is stopped, or runs into something else, after so many ticks, and how it ended.
    fn draw(root: &Path, layers: &[Layer], stop_after: usize) -> Result<usize, SetError> {
        let (folder, journal) = (root.join("set"), root.join("finished.sha256"));
        fs::create_dir_all(&folder).unwrap();
        let ticks = AtomicUsize::new(0);
        with_parts(&walk(FRAMES), |parts, observer| {
            let drawing = SetDrawing {
                layers,
                shards: Some(3),
                journal: Some(&journal),
                stop: &|| ticks.load(Ordering::SeqCst) >= stop_after,
                tick: &|| {
                    ticks.fetch_add(1, Ordering::SeqCst);
                },
            };
            BenchmarkSet::draw_into(&folder, parts, &drawing, |frame| observer.observe(frame))
        })
    }

    fn listing(root: &Path) -> String {
        fs::read_to_string(root.join("set/files.sha256")).unwrap()
    }

    #[test]
    fn a_drawing_that_is_stopped_anywhere_goes_on_and_ends_with_the_bytes_of_an_undisturbed_one() {
        let layers = [Layer::Depth];
        let whole = tempfile::tempdir().unwrap();
        assert_eq!(draw(whole.path(), &layers, usize::MAX).unwrap(), 0);
        let root = tempfile::tempdir().unwrap();
        for stop_after in [1, 2, 3, 5, 8, 12, 17, 22] {
            // what was there counts too: every try gets farther, the last one beyond all silhouettes
            assert!(matches!(draw(root.path(), &layers, stop_after), Err(SetError::Stopped)), "{stop_after}");
            assert!(!is_set(&root.path().join("set")));
        }
        assert_eq!(draw(root.path(), &layers, usize::MAX).unwrap(), FRAMES);
        assert_eq!(listing(root.path()), listing(whole.path()));
        verify_hashes(&root.path().join("set")).unwrap();
        let shard = root.path().join("set/truth/shards/000001.tar");
        fs::remove_file(&shard).unwrap();
        let missing = verify_hashes(&root.path().join("set")).unwrap_err().to_string();
        assert!(missing.contains("000001.tar: this shard is missing, of 3 that the set lists"), "{missing}");
        fs::write(&shard, "x").unwrap();
        let changed = verify_hashes(&root.path().join("set")).unwrap_err().to_string();
        assert!(changed.contains("000001.tar was changed or truncated"), "{changed}");
    }

    #[test]
    fn shards_leave_the_hash_of_a_set_alone_and_do_not_depend_on_threads() {
        let drawn = |threads: usize, shards| {
            let root = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                with_parts(&walk(FRAMES), |parts, observer| {
                    let drawing = SetDrawing { shards, ..SetDrawing::default() };
                    BenchmarkSet::draw_into(root.path(), parts, &drawing, |frame| observer.observe(frame)).unwrap();
                });
            });
            let hash = crate::benchmark_set::BlindSet::read(root.path()).unwrap().set_hash;
            (fs::read_to_string(root.path().join("files.sha256")).unwrap(), hash)
        };
        let ((one, hash), (three, _), (without, same)) = (drawn(1, Some(2)), drawn(3, Some(2)), drawn(2, None));
        assert_eq!(one, three);
        assert!(hash == same && one.len() > without.len());
    }

    #[test]
    fn a_file_that_was_cut_or_changed_meanwhile_is_drawn_again() {
        let root = tempfile::tempdir().unwrap();
        draw(root.path(), &[], usize::MAX).unwrap();
        let whole = listing(root.path());
        let file = |name: &str| root.path().join("set").join(name);
        let cut = file("observations/cam00/silhouette/000003.png");
        let bytes = fs::read(&cut).unwrap();
        fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
        fs::write(file("truth/truth.npz"), "").unwrap();
        fs::write(file("observations/cam01/silhouette/000099.png"), "half").unwrap();
        assert_eq!(draw(root.path(), &[], usize::MAX).unwrap(), FRAMES - 1);
        assert_eq!(listing(root.path()), whole);
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
