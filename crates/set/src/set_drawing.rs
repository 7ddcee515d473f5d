//! Renders a set directly to disk, frame by frame, and resumes after an interruption.

use std::ops::Range;
use std::path::Path;

use super::blind::silhouette_path;
use super::colour_files::ColourDrawing;
use super::layer_drawing::LayerDrawing;
use super::set::silhouette_files;
use super::set_writer::SetWriter;
use super::shards::Packing;
use super::{BenchmarkSet, Layer, SetError, SetParts, shards};
use crate::observation::Observation;
use crate::parallel;

/// How a set is rendered to disk.
#[derive(Clone, Copy)]
pub struct SetDrawing<'a> {
    /// Truth images to render in addition to the silhouettes.
    pub layers: &'a [Layer],
    /// Number of tar shards for silhouettes and truth images; `None` for separate files.
    pub shards: Option<usize>,
    /// A file outside the set's folder that records complete files. With it, rendering resumes after an interruption of
    /// any kind.
    pub journal: Option<&'a Path>,
    /// No other frame or file is started once this returns `true`.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Called after the silhouettes of every frame, and after the layers of every camera and frame, also if they
    /// already exist. Silhouettes are written before the layers of the same shard.
    pub tick: &'a (dyn Fn() + Sync),
}

impl Default for SetDrawing<'_> {
    fn default() -> Self {
        Self { layers: &[], shards: None, journal: None, stop: &|| false, tick: &|| {} }
    }
}

impl BenchmarkSet {
    /// Renders a set directly into `folder`, one frame at a time, so memory does not grow with the number of images.
    /// The bytes are those of [`Self::write_unless`] after [`Self::assemble`]. Without a journal, `folder` must contain
    /// none of the files; with one, complete files are kept and all others in `folder` are removed first. Returns how
    /// many frames already existed.
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
        if drawing.shards.is_some() && !parts.rig.is_still() {
            let detail = "--shards: only valid with static cameras that expose every frame at its own time, but the scenario has rig.motion or \
                          rig.timing; leave out --shards";
            return Err(SetError::inconsistent(detail.to_owned()));
        }
        let frames = parts.ground_truth.frames.len();
        let plan = shards::plan(drawing.shards, frames)?;
        let writer = match drawing.journal {
            Some(journal) => SetWriter::resuming(folder, drawing.stop, journal, plan)?,
            None => SetWriter::new(folder, drawing.stop),
        };
        parts.each_file_without_observations(&mut |path, content| writer.put_same(path, &content))?;
        let colour = parts.colour()?;
        if let Some(colour) = &colour {
            draw_backgrounds(&writer, colour)?;
        }
        let observe = ObservedFrames { colour: colour.as_ref(), observe: &observe };
        let mut existing = 0;
        if let Some(plan) = plan {
            shards::write_readmes(&writer)?;
            let packing = Packing { writer: &writer, folder, parts, layers: drawing.layers, plan };
            for shard in 0..plan.shards {
                existing += draw_frames(&writer, parts, drawing, &observe, plan.frames_of(shard))?;
                packing.pack(shard)?;
            }
            packing.remove_empty_folders();
        } else {
            existing = draw_frames(&writer, parts, drawing, &observe, 0..frames)?;
        }
        writer.finish()?;
        Ok(existing)
    }
}

/// What trackers are given of the frames.
struct ObservedFrames<'a, F> {
    colour: Option<&'a ColourDrawing<'a>>,
    observe: &'a F,
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

/// Renders these frames and their layers. Returns how many of the frames already existed.
fn draw_frames<F: Fn(usize) -> Observation + Sync>(
    writer: &SetWriter<'_>,
    parts: &SetParts<'_>,
    drawing: &SetDrawing<'_>,
    observe: &ObservedFrames<'_, F>,
    frames: Range<usize>,
) -> Result<usize, SetError> {
    let draw = |index: usize| {
        let existed = draw_frame(writer, parts, observe, frames.start + index)?;
        (drawing.tick)();
        Ok(usize::from(existed))
    };
    let existing: Vec<usize> = parallel::map(frames.len(), draw).into_iter().collect::<Result<_, SetError>>()?;
    if !drawing.layers.is_empty() {
        let layers = LayerDrawing {
            truth: parts.ground_truth,
            rig: parts.rig,
            scene: parts.facts.scene(parts.observation, parts.key),
            layers: drawing.layers,
        };
        layers.write(writer, frames, drawing.tick)?;
    }
    Ok(existing.iter().sum())
}

/// Renders the silhouettes and images of a frame that do not exist. Returns whether all existed.
fn draw_frame<F: Fn(usize) -> Observation>(
    writer: &SetWriter<'_>,
    parts: &SetParts<'_>,
    given: &ObservedFrames<'_, F>,
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
    if !existed || !have(&|camera| silhouette_path(camera, frame)) {
        put(silhouette_files(parts, frame, &(given.observe)(frame))?)?;
        existed = false;
    }
    if let Some(colour) = given.colour.filter(|colour| !have(&|camera| colour.path(camera, frame))) {
        put(colour.files(frame)?)?;
        existed = false;
    }
    Ok(existed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{set_of, with_parts};
    use crate::listing::files_of;
    use crate::samples::ShardWriter;
    use crate::shard_plan::frame_of;
    use crate::test_bodies::walk;
    use crate::{BlindSet, SetPlace, find_leaks, is_set, layer_channels, verify_hashes};
    use std::fs;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const FRAMES: usize = 7;

    /// Renders with a stop after this number of ticks.
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
    fn a_rendering_stopped_anywhere_resumes_and_gives_the_bytes_of_an_uninterrupted_one() {
        let layers = [Layer::Depth];
        let whole = tempfile::tempdir().unwrap();
        assert_eq!(draw(whole.path(), &layers, usize::MAX).unwrap(), 0);
        let root = tempfile::tempdir().unwrap();
        for stop_after in [1, 2, 3, 5, 8, 12, 17, 22] {
            // existing files tick too: every attempt gets farther, the last one beyond all silhouettes
            assert!(matches!(draw(root.path(), &layers, stop_after), Err(SetError::Stopped)), "{stop_after}");
            assert!(!is_set(&root.path().join("set")));
        }
        assert_eq!(draw(root.path(), &layers, usize::MAX).unwrap(), FRAMES);
        assert_eq!(listing(root.path()), listing(whole.path()));
        verify_hashes(&root.path().join("set")).unwrap();
        for kind in ["observations", "truth"] {
            let shard = root.path().join(format!("set/{kind}/shards/000001.tar"));
            let whole = fs::read(&shard).unwrap();
            fs::remove_file(&shard).unwrap();
            let missing = verify_hashes(&root.path().join("set")).unwrap_err().to_string();
            assert!(missing.contains("000001.tar: this shard is missing; the set lists 3"), "{missing}");
            fs::write(&shard, &whole[..whole.len() / 2]).unwrap();
            let changed = verify_hashes(&root.path().join("set")).unwrap_err().to_string();
            assert!(changed.contains(&format!("{kind}/shards/000001.tar was changed or truncated")), "{changed}");
            fs::write(&shard, whole).unwrap();
        }
    }

    #[test]
    fn a_set_with_shards_has_no_separate_images_and_is_read_like_one_without() {
        let (layers, root) = ([Layer::Depth, Layer::Parts], tempfile::tempdir().unwrap());
        draw(root.path(), &layers, usize::MAX).unwrap();
        let place = root.path().join("set");
        let loose = files_of(&place).unwrap();
        assert!(loose.iter().all(|path| frame_of(path).is_none()), "{loose:?}");
        assert!(!place.join("observations/cam00").exists() && !place.join("truth/layers").exists());
        let (packed, own) = (BenchmarkSet::read(&place).unwrap(), set_of(&walk(FRAMES)).unwrap());
        assert_eq!(packed.blind.set_hash, own.blind.set_hash);
        assert_eq!(packed.truth, own.truth);
        let seen = |set: &BenchmarkSet| set.blind.observations().collect::<Result<Vec<_>, _>>().unwrap();
        assert_eq!(seen(&packed), seen(&own));
        assert_eq!(layer_channels(&place).unwrap(), ["depth.Z", "id.part"]);
        // written from shards, the images are separate files again
        let (written, plain) = (root.path().join("written"), root.path().join("plain"));
        packed.write(&written).unwrap();
        own.write_with_layers(&plain, &layers).unwrap();
        let listing = |folder: &Path| fs::read_to_string(folder.join("files.sha256")).unwrap();
        assert!(listing(&written) == listing(&plain));
        let (handed, of_own) = (root.path().join("handed"), root.path().join("of own"));
        packed.blind.copy_to(&handed).unwrap();
        own.blind.copy_to(&of_own).unwrap();
        assert_eq!(files_of(&handed).unwrap(), files_of(&of_own).unwrap());
        // a public set keeps its shards
        let public = root.path().join("public");
        packed.blind.write_without_truth(&public).unwrap();
        let public_set = BlindSet::read(&public).unwrap();
        assert_eq!(public_set.set_hash, own.blind.set_hash);
        assert_eq!(public_set.observation(4).unwrap(), own.blind.observation(4).unwrap());
        assert!(public.join("observations/shards/000002.tar").exists() && !public.join("truth").exists());
        let both = SetPlace { folder: &public, truth: Some(&place) };
        assert_eq!(both.read().unwrap().truth, own.truth);
        assert!(find_leaks(&place).unwrap().is_empty());
    }

    #[test]
    fn missing_truncated_and_changed_shards_are_named_and_the_others_can_be_read() {
        let root = tempfile::tempdir().unwrap();
        draw(root.path(), &[], usize::MAX).unwrap();
        let shard = root.path().join("set/observations/shards/000001.tar");
        let whole = fs::read(&shard).unwrap();
        // seven frames in three shards: two, two, three
        let read = || {
            let set = BlindSet::read(&root.path().join("set")).unwrap();
            assert!([0, 1, 4, 5, 6].iter().all(|frame| set.observation(*frame).is_ok()));
            set.observation(2).unwrap_err().to_string()
        };
        let mut changed = whole.clone();
        let at = whole.windows(4).position(|bytes| bytes == b"IDAT").unwrap();
        changed[at + 9] ^= 1;
        for (bytes, words) in [
            (
                &whole[..whole.len() / 2],
                "observations/shards/000001.tar: this shard is damaged: it is truncated; get it again",
            ),
            (&[][..], "this shard is damaged: it is truncated"),
            (&[7; 4096][..], "at byte 0: expected the header of a file"),
            (&changed, "observations/cam00/silhouette/000002.png in it was changed"),
        ] {
            fs::write(&shard, bytes).unwrap();
            assert!(read().contains(words), "{words}: {}", read());
        }
        fs::write(&shard, fs::read(root.path().join("set/observations/shards/000000.tar")).unwrap()).unwrap();
        assert!(read().contains("it has no observations/cam00/silhouette/000002.png"), "{}", read());
        fs::remove_file(&shard).unwrap();
        assert!(read().contains("000001.tar: this shard is missing; the set lists 3"), "{}", read());
        fs::write(&shard, &whole).unwrap();
        let list = root.path().join("set/packed.sha256");
        let lines = fs::read_to_string(&list).unwrap();
        fs::write(&list, lines.replacen(&lines[..8], "01234567", 1)).unwrap();
        let set = BlindSet::read(&root.path().join("set")).unwrap();
        let refused = set.observation(0).unwrap_err().to_string();
        assert!(refused.contains("packed.sha256 was changed or truncated"), "{refused}");
    }

    #[test]
    fn a_pose_hidden_in_a_shard_of_silhouettes_is_found() {
        let root = tempfile::tempdir().unwrap();
        draw(root.path(), &[], usize::MAX).unwrap();
        let shard = root.path().join("set/observations/shards/000000.tar");
        let mut more = ShardWriter::new(Vec::new());
        more.add("pose.json", &b"[1, 2, 3]"[..], 9).unwrap();
        let mut bytes = more.finish().unwrap();
        bytes.truncate(1024);
        bytes.extend(fs::read(&shard).unwrap());
        fs::write(&shard, bytes).unwrap();
        let leaks = find_leaks(&root.path().join("set")).unwrap();
        assert_eq!((leaks.len(), leaks[0].place.as_str()), (1, "pose.json"), "{leaks:?}");
    }

    #[test]
    fn shards_do_not_change_the_set_hash_or_depend_on_threads() {
        let drawn = |threads: usize, shards| {
            let root = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                with_parts(&walk(FRAMES), |parts, observer| {
                    let drawing = SetDrawing { shards, ..SetDrawing::default() };
                    BenchmarkSet::draw_into(root.path(), parts, &drawing, |frame| observer.observe(frame)).unwrap();
                });
            });
            let hash = crate::BlindSet::read(root.path()).unwrap().set_hash;
            (fs::read_to_string(root.path().join("files.sha256")).unwrap(), hash)
        };
        let ((one, hash), (three, _), (without, same)) = (drawn(1, Some(2)), drawn(3, Some(2)), drawn(2, None));
        assert_eq!(one, three);
        assert!(hash == same && one != without);
    }

    #[test]
    fn a_truncated_or_changed_file_is_rendered_again() {
        let root = tempfile::tempdir().unwrap();
        draw(root.path(), &[], usize::MAX).unwrap();
        let whole = listing(root.path());
        let file = |name: &str| root.path().join("set").join(name);
        let cut = file("observations/shards/000001.tar");
        let bytes = fs::read(&cut).unwrap();
        fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
        fs::write(file("truth/truth.npz"), "").unwrap();
        fs::create_dir_all(file("observations/cam01/silhouette")).unwrap();
        fs::write(file("observations/cam01/silhouette/000099.png"), "half").unwrap();
        // two of seven frames were in that shard
        assert_eq!(draw(root.path(), &[], usize::MAX).unwrap(), FRAMES - 2);
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
