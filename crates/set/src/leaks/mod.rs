//! Searches the files for trackers for poses of the test.
//!
//! Every file outside `truth/` is opened, listed or not, and all numbers in it are compared with the poses of all
//! frames except those similar to frame 0, the start pose: joint angles of the actor and of the tracker's body,
//! unchanged or mirrored, in radians or degrees; roots; markers, absolute and relative to the pelvis; joints; link
//! frames. A pose may be a row or a column anywhere in an array, with any signs. Exact angles are also found in any
//! order, angles with a little noise in their own order, and markers and joints at any position and orientation, in
//! metres, centimetres or millimetres, and in the images. Numbers in texts are included. Not found are poses in another
//! representation, with more noise, compressed or encrypted (`docs/sets.md` has the tolerances).

mod likeness;
mod markers;
mod numbers;
mod secret;

use std::path::Path;
use std::{fs, io};

use self::likeness::NoisySecret;
use self::numbers::{NumberSequence, sequences};
pub(crate) use self::secret::mirrored_indices;
use self::secret::{Secret, noisy_secrets, secrets};
use super::files::SetFiles;
use super::listing::{COMPLETE, LISTING, files_of};
use super::samples::tar_places;
use super::shard_plan::{PACKED, frame_of, is_shard};
use super::{SetError, TruthSet, body_file, keypoints_file, start_file, views_file};
use crate::npz::Npz;
use crate::parallel;

/// A pose of the test in a file that trackers may read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leak {
    /// Path inside the set.
    pub file: String,
    /// Description of the place in the file.
    pub place: String,
    /// Description of the data.
    pub what: String,
    /// The frame; `None` for data other than numbers that must not be there.
    pub frame: Option<usize>,
}

/// Searches all files of the set in `directory` outside `truth/` for poses of the test. Each kind of data found in an
/// array is reported once.
///
/// # Errors
/// [`SetError`] if the truth, or a file that may contain numbers, cannot be read.
pub fn find_leaks(directory: &Path) -> Result<Vec<Leak>, SetError> {
    find_leaks_of(directory, directory)
}

/// As [`find_leaks`], with the truth in the folder `complete`.
pub(super) fn find_leaks_of(directory: &Path, complete: &Path) -> Result<Vec<Leak>, SetError> {
    let files = SetFiles::open(directory)?;
    let body = files.read(start_file::BODY_PATH)?;
    let (truth, body) = (TruthSet::read(complete)?, body_file::from_json(start_file::BODY_PATH, &body)?);
    let views = SetFiles::open(complete)?.read(views_file::PATH).map(|bytes| Npz::from_bytes(views_file::PATH, &bytes));
    let views = views.ok().and_then(Result::ok);
    let secrets = Secrets { exact: secrets(&truth, &body), noisy: noisy_secrets(&truth, views.as_ref(), &body) };
    let outside = |path: &String| !path.starts_with("truth/") && ![LISTING, PACKED, COMPLETE].contains(&path.as_str());
    let mut leaks = Vec::new();
    for file in files_of(directory)?.into_iter().filter(outside) {
        let path = directory.join(&file);
        if is_shard(&file) {
            leaks.extend(leaks_in_shard(&files, &file, &path)?);
            continue;
        }
        let bytes = fs::read(&path).map_err(SetError::io(&path, "read"))?;
        leaks.extend(leaks_of(&file, &bytes, &secrets)?);
    }
    Ok(leaks)
}

/// Searches the silhouettes in a shard one by one, and reports all other files in it.
fn leaks_in_shard(files: &SetFiles, file: &str, path: &Path) -> Result<Vec<Leak>, SetError> {
    let broken = |e: io::Error| SetError::BrokenShard { file: file.to_owned(), detail: e.to_string() };
    let places = fs::File::open(path).and_then(|mut shard| tar_places(&mut shard)).map_err(broken)?;
    let mut leaks = Vec::new();
    for name in places.keys() {
        if frame_of(name).is_some() && files.has(name) {
            leaks.extend(leaks_of(name, &files.read(name)?, &Secrets::default())?);
        } else {
            leaks.push(leak(file, name, "a file that is not a silhouette of the set".to_owned(), None));
        }
    }
    Ok(leaks)
}

/// Data that no file for trackers may contain.
#[derive(Default)]
struct Secrets {
    exact: Vec<Secret>,
    noisy: Vec<NoisySecret>,
}

impl Secrets {
    /// The data found in a sequence, with its frame; similar data only if none is found exactly.
    fn found_in(&self, sequence: &NumberSequence) -> Vec<(String, usize)> {
        let exact = self.exact.iter().filter_map(|secret| Some((secret.what.clone(), secret.found_in(sequence)?)));
        let exact: Vec<(String, usize)> = exact.collect();
        if !exact.is_empty() {
            return exact;
        }
        let found = parallel::map(self.noisy.len(), |index| self.noisy[index].found_in(sequence));
        self.noisy.iter().zip(found).filter_map(|(noisy, frame)| Some((noisy.what.clone(), frame?))).collect()
    }
}

fn leaks_of(file: &str, bytes: &[u8], secrets: &Secrets) -> Result<Vec<Leak>, SetError> {
    let beside_the_image = match file.rsplit_once('.') {
        Some((_, "png")) => Some(unknown_chunk(bytes)),
        Some((_, "jpg")) => Some(markers::unknown_segment(bytes)),
        _ => None,
    };
    if let Some(found) = beside_the_image {
        return Ok(found.map(|what| leak(file, "image", what, None)).into_iter().collect());
    }
    let mut leaks = Vec::new();
    // keypoints are the actor's points in the images: what a tracker is given, compared by the check of keypoints
    let is_given =
        |place: &str| file == keypoints_file::PATH && ["array keypoints", "array confidence"].contains(&place);
    for sequence in sequences(file, bytes)?.into_iter().filter(|sequence| !is_given(&sequence.place)) {
        let found = secrets.found_in(&sequence).into_iter();
        leaks.extend(found.map(|(what, frame)| leak(file, &sequence.place, what, Some(frame))));
    }
    Ok(leaks)
}

fn leak(file: &str, place: &str, what: String, frame: Option<usize>) -> Leak {
    Leak { file: file.to_owned(), place: place.to_owned(), what, frame }
}

/// Description of data in a PNG other than its image.
fn unknown_chunk(bytes: &[u8]) -> Option<String> {
    const NEEDED: [&[u8]; 3] = [b"IHDR", b"IDAT", b"IEND"];
    let mut rest = bytes.get(8..)?;
    while let Some((header, after)) = rest.split_first_chunk::<8>() {
        let [a, b, c, d, name @ ..] = *header;
        if !NEEDED.contains(&&name[..]) {
            return Some(format!("a chunk {:?} in addition to the image", String::from_utf8_lossy(&name)));
        }
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        rest = after.get(length.checked_add(4)?..)?;
        if name == *b"IEND" {
            break;
        }
    }
    (!rest.is_empty()).then(|| format!("{} bytes after the image", rest.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BenchmarkSet;
    use crate::body::Pose;
    use crate::fixture::set_of;
    use crate::npz::{Array, Npz};
    use crate::test_bodies::walk;

    const FRAMES: usize = 12;

    /// A set of a walk in which every joint moves differently.
    fn written() -> (BenchmarkSet, tempfile::TempDir) {
        let mut motion = walk(FRAMES);
        for (frame, pose) in motion.poses.iter_mut().enumerate() {
            let angle = |i: usize| 0.4 * (0.1 * frame as f64 * (1.0 + 0.37 * i as f64) + i as f64).sin();
            pose.joint_angles.iter_mut().enumerate().for_each(|(i, a)| *a = angle(i));
        }
        let (set, directory) = (set_of(&motion).unwrap(), tempfile::tempdir().unwrap());
        set.write(directory.path()).unwrap();
        (set, directory)
    }

    fn poses(set: &BenchmarkSet) -> Vec<Pose> {
        set.truth.ground_truth.frames.iter().map(|frame| frame.pose.clone()).collect()
    }

    /// Leaks after a file was added to those for trackers.
    fn planted(name: &str, bytes: &[u8]) -> Vec<Leak> {
        let (_, directory) = written();
        fs::write(directory.path().join(name), bytes).unwrap();
        find_leaks(directory.path()).unwrap()
    }

    fn npz(arrays: &[(&str, Array)]) -> Vec<u8> {
        arrays.iter().map(|(name, array)| (*name, array.clone())).collect::<Npz>().to_bytes("x").unwrap()
    }

    fn angles(poses: &[Pose]) -> Vec<Vec<f64>> {
        poses.iter().map(|pose| pose.joint_angles.iter().copied().collect()).collect()
    }

    #[test]
    fn an_unchanged_set_has_no_leak() {
        let (_, directory) = written();
        assert_eq!(find_leaks(directory.path()).unwrap(), []);
    }

    #[test]
    fn the_start_pose_is_allowed_and_other_poses_are_not() {
        let (set, _) = written();
        let rows = angles(&poses(&set));
        let with = |rows: &[Vec<f64>]| {
            let array = Array::new(&[rows.len(), rows[0].len()], rows.concat());
            planted("start/more.npz", &npz(&[("angles", array)]))
        };
        assert_eq!(with(&rows[..1]), []);
        let found = with(&rows[5..6]);
        assert!(found.iter().any(|leak| leak.file == "start/more.npz" && leak.place.contains("angles")), "{found:?}");
        assert!(found.iter().all(|leak| leak.frame.is_some_and(|frame| frame > 0)));
    }

    #[test]
    fn poses_are_found_in_columns_within_rows_in_degrees_rounded_and_mirrored() {
        let (set, _) = written();
        let rows = angles(&poses(&set));
        let (frames, width) = (rows.len(), rows[0].len());
        let columns: Vec<f64> = (0..width).flat_map(|i| rows.iter().map(move |row| row[i])).collect();
        let within: Vec<f64> = rows.iter().flat_map(|row| [vec![0.5; 3], row.clone(), vec![7.0]].concat()).collect();
        let degrees: Vec<f32> = rows.concat().iter().map(|x| x.to_degrees() as f32).collect();
        let rounded: Vec<f64> = rows.concat().iter().map(|x| (x * 1e4).round() / 1e4).collect();
        let negated: Vec<f64> = rows.concat().iter().map(|x| -x).collect();
        for (name, array) in [
            ("columns", Array::new(&[width, frames], columns)),
            ("within", Array::new(&[frames, width + 4], within)),
            ("degrees", Array::new(&[frames, width], degrees)),
            ("rounded", Array::new(&[1, frames, width], rounded)),
            ("negated", Array::new(&[frames * width], negated)),
        ] {
            let found = planted("observations/extra.npz", &npz(&[(name, array)]));
            assert!(found.iter().any(|leak| leak.place.contains(name)), "{name}: {found:?}");
        }
    }

    #[test]
    fn a_mirrored_pose_is_found_with_any_signs() {
        let (set, _) = written();
        let names: Vec<&str> =
            set.truth.ground_truth.actor.degrees_of_freedom.iter().map(|dof| dof.name.as_str()).collect();
        let other = mirrored_indices(&names);
        let row = &angles(&poses(&set))[5];
        // rounded, so that it is not found as numbers in any order
        let mirrored: Vec<f64> = (0..row.len()).map(|i| -(row[other[i]] * 1e4).round() / 1e4).collect();
        assert!(mirrored.iter().zip(row).any(|(a, b)| (a.abs() - b.abs()).abs() > 0.01), "the fixture has two sides");
        let found = planted("start/m.npz", &npz(&[("mirror", Array::new(&[1, row.len()], mirrored))]));
        assert!(found.iter().any(|leak| leak.what.contains("mirrored")), "{found:?}");
    }

    #[test]
    fn poses_are_found_in_json_in_tables_and_as_plain_bytes() {
        let (set, _) = written();
        let rows = angles(&poses(&set));
        let json = serde_json::json!({ "notes": [{ "t": 3, "q": rows[4] }] }).to_string();
        let table: String =
            rows.iter().map(|r| r.iter().map(|x| format!("{x:.6};")).collect::<String>() + "\n").collect();
        let column_table: String = (0..rows[0].len())
            .map(|i| rows.iter().map(|r| format!("{:.5} ", r[i])).collect::<String>() + "\n")
            .collect();
        let doubles: Vec<u8> = [vec![1, 2, 3], rows.concat().iter().flat_map(|x| x.to_le_bytes()).collect()].concat();
        let floats: Vec<u8> = rows.concat().iter().flat_map(|x| (*x as f32).to_le_bytes()).collect();
        for (name, bytes) in [
            ("cameras.json.bak", json.as_bytes()),
            ("start/notes.json", json.as_bytes()),
            ("poses.csv", table.as_bytes()),
            ("columns.txt", column_table.as_bytes()),
            ("start/cache.bin", &doubles),
            ("observations/cam00/mask", &floats),
        ] {
            let found = planted(name, bytes);
            assert!(found.iter().any(|leak| leak.file == name), "{name}: {found:?}");
        }
    }

    #[test]
    fn angles_in_any_order_roots_markers_and_joints_are_found() {
        let (set, _) = written();
        let truth = &set.truth.ground_truth.frames[7];
        let mut shuffled: Vec<f64> = truth.pose.joint_angles.iter().copied().collect();
        shuffled.reverse();
        let root = truth.pose.world_from_root.translation.vector;
        let markers: Vec<f64> = truth.markers.iter().flatten().flat_map(|p| [p.x, p.y, p.z]).collect();
        let joints: Vec<f64> = truth.joint_positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        for (name, values) in [
            ("shuffled", shuffled),
            ("root", vec![9.0, root.x, root.y, root.z]),
            ("markers", markers),
            ("joints", joints),
        ] {
            let found = planted("start/x.npz", &npz(&[(name, Array::new(&[values.len()], values))]));
            assert!(found.iter().any(|leak| leak.place.contains(name)), "{name}: {found:?}");
        }
    }

    /// Deterministic noise with mean zero and standard deviation of about one.
    fn noise(index: usize) -> f64 {
        std::f64::consts::SQRT_2 * (12.9898 * index as f64 + 0.3 * (index as f64).powi(2)).sin()
    }

    #[test]
    fn poses_with_noise_in_the_motion_to_learn_from_are_found() {
        let (set, _) = written();
        let rows = angles(&poses(&set));
        let width = rows[0].len();
        let noisy: Vec<f64> = rows.concat().iter().enumerate().map(|(i, x)| x + 0.001 * noise(i)).collect();
        let found = planted("start/training.npz", &npz(&[("angles", Array::new(&[rows.len(), width], noisy))]));
        assert!(found.iter().any(|leak| leak.what == "joint angles of the actor, with noise"), "{found:?}");
        let other: Vec<f64> = rows.concat().iter().enumerate().map(|(i, x)| x + 0.03 * noise(i)).collect();
        let found = planted("start/training.npz", &npz(&[("angles", Array::new(&[rows.len(), width], other))]));
        assert_eq!(found, [], "a repetition of the movement is another motion");
    }

    #[test]
    fn degrees_in_the_notes_of_a_body_are_found() {
        let (set, directory) = written();
        let words = angles(&poses(&set))[6].iter().map(|x| format!("{:.2}", x.to_degrees())).collect::<Vec<_>>();
        let path = directory.path().join("start/body.json");
        for notes in [vec![words.join(" ")], words] {
            let mut body: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            body["notes"] = notes.into();
            let found = planted("start/copy.json", body.to_string().as_bytes());
            assert!(found.iter().any(|leak| leak.place == "texts" && leak.frame == Some(6)), "{found:?}");
        }
    }

    #[test]
    fn markers_in_millimetres_with_an_offset_and_markers_of_the_images_are_found() {
        let (set, directory) = written();
        let truth = &set.truth.ground_truth.frames[9];
        let markers: Vec<f64> = truth.markers.iter().flatten().flat_map(|p| [p.x, p.y, p.z]).collect();
        let offset = |i: usize| [812.0, -55.5, 300.25][i % 3];
        let moved: Vec<f64> =
            markers.iter().enumerate().map(|(i, x)| 1000.0 * x + offset(i) + 0.5 * noise(i)).collect();
        let views = fs::read(directory.path().join("truth/views.npz")).unwrap();
        let views = Npz::from_bytes("views.npz", &views).unwrap();
        let pixels = views.f64s("views.npz", "markers_2d", &[None, None, None, Some(2)]).unwrap();
        let size = [128.0, 96.0];
        let shifted: Vec<f64> = pixels.iter().enumerate().map(|(i, x)| x + 0.5 - size[i % 2]).collect();
        for (name, values, what) in [
            ("moved", moved, "markers of the actor, at any position"),
            ("pixels", pixels.to_vec(), "markers of the actor in the images of camera"),
            ("shifted", shifted, "markers of the actor in the images of camera"),
        ] {
            let found = planted("start/x.npz", &npz(&[(name, Array::new(&[values.len()], values))]));
            assert!(
                found.iter().any(|leak| leak.place.contains(name) && leak.what.contains(what)),
                "{name}: {found:?}"
            );
        }
    }

    #[test]
    fn additional_data_in_an_image_is_reported() {
        let (_, directory) = written();
        let path = "observations/cam00/silhouette/000003.png";
        let mut bytes = fs::read(directory.path().join(path)).unwrap();
        bytes.extend(b"pose");
        fs::write(directory.path().join(path), &bytes).unwrap();
        let found = find_leaks(directory.path()).unwrap();
        assert_eq!((found.len(), found[0].what.as_str()), (1, "4 bytes after the image"));
        let text = b"\0\0\0\x04tEXtpose\0\0\0\0";
        let with_text = [&bytes[..33], text, &bytes[33..bytes.len() - 4]].concat();
        fs::write(directory.path().join(path), with_text).unwrap();
        assert!(find_leaks(directory.path()).unwrap()[0].what.contains("tEXt"));
    }

    #[test]
    fn an_archive_that_cannot_be_read_is_an_error() {
        let (_, directory) = written();
        fs::write(directory.path().join("start/odd.npz"), b"PK\x03\x04 compressed").unwrap();
        assert!(find_leaks(directory.path()).unwrap_err().to_string().starts_with("start/odd.npz: "));
    }
}
