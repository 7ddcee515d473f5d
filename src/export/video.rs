//! Videos of a set, encoded by the user's ffmpeg: frames go through a pipe, and no picture is stored on the way.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

use crate::artefacts::Artefact;
use crate::common::{ExperimentError, Progress, advance};
use skiagraph_core::input::excerpt;
use skiagraph_core::raster::Mask;
use skiagraph_set::{BlindSet, EXPORT_README, export_readme};
use skiagraph_truth::observing::Image;

const FFMPEG: &str = "ffmpeg";
pub(super) const VIDEO_TITLE: &str = "Videos";
/// Greatest length of ffmpeg's message that is kept, bytes.
const MESSAGE: u64 = 4096;

const README: &str = "\
NN-NAME.mp4 of every camera, NN its number: H.264 (x264, yuv420p, lossy) at the frame rate of the set, one picture per frame of
the set. In a set with colour images these are shown, and NN-NAME-background.png (or .jpg) is the first picture of the scene
without people; otherwise the silhouettes, white on black. A frame for which a camera took no image repeats the one before. Black
is added at the right and at the bottom where a width or height is odd, because yuv420p needs even ones. Cameras that have times
of their own or move: picture f is of the time that cameras.npz of the set states (time_s).";

pub(super) fn check_ffmpeg() -> Result<(), ExperimentError> {
    let found = Command::new(FFMPEG).arg("-version").stdin(Stdio::null()).output();
    found.map(|_| ()).map_err(|error| not_started(&error))
}

pub(super) fn videos(set: &BlindSet, folder: &Artefact, progress: &dyn Progress) -> Result<(), ExperimentError> {
    folder.write(EXPORT_README, export_readme(VIDEO_TITLE, set, README).as_bytes())?;
    for (index, camera) in set.rig.cameras.iter().enumerate() {
        let size = [camera.pinhole.width, camera.pinhole.height];
        let file = format!("{}.mp4", camera_file(index, &camera.name));
        let mut encoder = Encoder::start(folder.folder(), &file, size, set.frames_per_second)?;
        let mut picture = vec![0; 3 * size[0] as usize * size[1] as usize];
        for frame in 0..set.frame_count {
            // progress counts the frames of the first camera
            if index == 0 {
                advance(progress)?;
            } else if progress.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            if set.has_image(index, frame) {
                picture = picture_of(set, index, frame)?;
            }
            encoder.push(&picture)?;
        }
        encoder.finish()?;
        if let Some(path) = set.background_paths(index).first() {
            let extension = Path::new(path).extension().unwrap_or_default().to_string_lossy();
            let name = format!("{}-background.{extension}", camera_file(index, &camera.name));
            folder.write(&name, &set.file(path)?)?;
        }
    }
    Ok(())
}

/// The name of a camera's file without its extension; characters of the camera's name that are unsafe in paths are
/// replaced.
fn camera_file(index: usize, camera: &str) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    format!("{index:02}-{}", camera.chars().map(safe).collect::<String>())
}

/// Red, green and blue of every pixel of a camera's picture: its image if the set has images, else its silhouette.
fn picture_of(set: &BlindSet, camera: usize, frame: usize) -> Result<Vec<u8>, ExperimentError> {
    if let Some(image) = set.colour(camera, frame)? {
        return Ok(rgb_of_image(&image));
    }
    Ok(rgb_of_mask(&set.observation(frame)?.silhouettes.swap_remove(camera)))
}

fn rgb_of_image(image: &Image) -> Vec<u8> {
    match image.planes() {
        [grey] => grey.iter().flat_map(|value| [*value; 3]).collect(),
        _ => image.interleaved(),
    }
}

fn rgb_of_mask(mask: &Mask) -> Vec<u8> {
    let pixels = (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| (x, y)));
    pixels.flat_map(|(x, y)| [if mask.get(x, y) { 255 } else { 0 }; 3]).collect()
}

/// A running ffmpeg that encodes the pictures that it is given. It is stopped when this is dropped.
struct Encoder {
    ffmpeg: Child,
    pictures: Option<ChildStdin>,
    /// Reads ffmpeg's messages, so that it never waits to write one.
    messages: Option<JoinHandle<Vec<u8>>>,
    video: PathBuf,
}

impl Encoder {
    /// Starts to encode pictures of this size into `file` in `folder`.
    fn start(
        folder: &Path,
        file: &str,
        [width, height]: [u32; 2],
        frames_per_second: f64,
    ) -> Result<Self, ExperimentError> {
        let (size, rate) = (format!("{width}x{height}"), frames_per_second.to_string());
        let mut command = Command::new(FFMPEG);
        command.args(["-nostdin", "-hide_banner", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-video_size", &size, "-framerate", &rate, "-i", "pipe:0"]);
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-pix_fmt", "yuv420p"]);
        command.args(["-movflags", "+faststart", "-n", &format!("file:{file}")]).current_dir(folder);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut ffmpeg = command.spawn().map_err(|error| not_started(&error))?;
        let messages = ffmpeg.stderr.take().map(|stderr| std::thread::spawn(|| beginning_of(stderr)));
        Ok(Self { pictures: ffmpeg.stdin.take(), messages, ffmpeg, video: folder.join(file) })
    }

    fn push(&mut self, picture: &[u8]) -> Result<(), ExperimentError> {
        let written = self.pictures.as_mut().map(|pictures| pictures.write_all(picture));
        // a pipe breaks when ffmpeg ends, and then its message says why
        if matches!(written, Some(Ok(()))) { Ok(()) } else { self.end().and(Err(failed("it ended early"))) }
    }

    fn finish(mut self) -> Result<(), ExperimentError> {
        self.end()?;
        let is_written = fs::metadata(&self.video).is_ok_and(|video| video.is_file() && video.len() > 0);
        if is_written { Ok(()) } else { Err(failed("it ended without an error, but wrote no video")) }
    }

    fn end(&mut self) -> Result<(), ExperimentError> {
        drop(self.pictures.take());
        let status = self.ffmpeg.wait().map_err(|error| failed(&error.to_string()))?;
        let said = self.messages.take().and_then(|messages| messages.join().ok()).unwrap_or_default();
        let said = String::from_utf8_lossy(&said);
        match said.trim() {
            _ if status.success() => Ok(()),
            "" => Err(failed(&status.to_string())),
            said => Err(failed(&excerpt(said))),
        }
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        // it may have ended, and then there is nothing to stop
        let _ = self.ffmpeg.kill();
        let _ = self.ffmpeg.wait();
    }
}

fn beginning_of(mut stream: impl Read) -> Vec<u8> {
    let mut beginning = Vec::new();
    let _ = stream.by_ref().take(MESSAGE).read_to_end(&mut beginning);
    let _ = io::copy(&mut stream, &mut io::sink());
    beginning
}

fn not_started(error: &io::Error) -> ExperimentError {
    let detail = match error.kind() {
        io::ErrorKind::NotFound => {
            "video: needs the program ffmpeg, and found none on the path; install ffmpeg".to_owned()
        }
        _ => format!("video: cannot start ffmpeg: {error}"),
    };
    ExperimentError::Argument { argument: "--to", detail }
}

fn failed(why: &str) -> ExperimentError {
    let detail = format!("video: expected ffmpeg to encode H.264 with libx264, but it failed: {why}");
    ExperimentError::Argument { argument: "--to", detail }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_white_on_black_and_grey_images_have_three_equal_channels() {
        let mut mask = Mask::new(3, 2);
        mask.set(2, 1, true);
        assert_eq!(rgb_of_mask(&mask), [&[0; 15][..], &[255; 3]].concat());
        let image =
            |planes: &[&[u8]]| Image::from_planes(2, 1, planes.iter().map(|plane| plane.to_vec()).collect()).unwrap();
        assert_eq!(rgb_of_image(&image(&[&[7, 9]])), [7, 7, 7, 9, 9, 9]);
        assert_eq!(rgb_of_image(&image(&[&[1, 4], &[2, 5], &[3, 6]])), [1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn long_messages_are_read_to_their_end_and_cut() {
        let mut left = io::repeat(b'x').take(100_000);
        assert_eq!(beginning_of(&mut left), vec![b'x'; MESSAGE as usize]);
        assert_eq!(left.limit(), 0);
    }
}
