//! Videos of masks, taken apart into images by the user's ffmpeg.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde::Deserialize;

use crate::common::{ExperimentError, key_error};
use skiagraph_core::input::excerpt;

pub(super) const ENDINGS: [&str; 6] = ["mp4", "mov", "avi", "mkv", "webm", "m4v"];
/// Rates that differ by a smaller share are the same: 59.94 is called 60.
const SAME_RATE: f64 = 0.005;

#[derive(Deserialize)]
struct Probed {
    streams: Vec<Stream>,
    format: Format,
}

#[derive(Deserialize)]
struct Stream {
    avg_frame_rate: String,
    r_frame_rate: String,
    #[serde(default)]
    duration: Option<String>,
    #[serde(default)]
    side_data_list: Vec<SideData>,
}

#[derive(Deserialize)]
struct SideData {
    #[serde(default)]
    rotation: f64,
}

#[derive(Deserialize)]
struct Format {
    #[serde(default)]
    duration: Option<String>,
}

/// Writes the frames of a video into `folder`, in grey and turned as the video says, one image for each frame that it
/// has, whatever its time; with notes about its rate and frames.
///
/// # Errors
/// [`ExperimentError`] without ffmpeg, for a file that it cannot read, and if the rate is another than
/// `frames_per_second`.
pub(super) fn take_apart(video: &Path, frames_per_second: f64, folder: &Path) -> Result<Vec<String>, ExperimentError> {
    let unreadable = |source| ExperimentError::Unreadable { path: video.to_owned(), source };
    let place = format!("file:{}", std::path::absolute(video).map_err(unreadable)?.display());
    let fields = "stream=avg_frame_rate,r_frame_rate,duration:stream_side_data=rotation:format=duration";
    let asked = ["-v", "error", "-select_streams", "v:0", "-show_entries", fields, "-of", "json", &place];
    let malformed = |detail: String| ExperimentError::Malformed { path: video.to_owned(), detail };
    let probed: Probed = serde_json::from_slice(&run("ffprobe", &asked, video, Path::new("."))?.stdout)
        .map_err(|error| malformed(format!("expected a video, but ffprobe does not tell of one: {error}")))?;
    let stream = probed.streams.first().ok_or_else(|| malformed("expected a video, found none in it".to_owned()))?;
    let (rate, nominal) = (ratio(&stream.avg_frame_rate), ratio(&stream.r_frame_rate));
    let name = video.file_name().unwrap_or_default().display();
    let is_same = |a: f64, b: f64| (a - b).abs() <= SAME_RATE * b;
    if let Some(rate) = rate.filter(|rate| !is_same(*rate, frames_per_second)) {
        let message = format!(
            "{name} has {rate:.3} frames a second, but frames_per_second is {frames_per_second}: give the videos' rate, or \
             convert the video (ffmpeg -i {name} -r {frames_per_second} NEW)"
        );
        return Err(key_error("frames_per_second", message));
    }
    fs::create_dir_all(folder).map_err(unreadable)?;
    // every frame gets the time of its number: ffmpeg would repeat or drop frames otherwise
    let frames = ["-nostdin", "-v", "error", "-i", &place, "-map", "0:v:0", "-vf", "settb=1/25,setpts=N", "-r", "25"];
    run("ffmpeg", &[&frames[..], &["-pix_fmt", "gray", "-start_number", "0", "%06d.png"]].concat(), video, folder)?;
    let mut notes = Vec::new();
    if let Some((rate, nominal)) = rate.zip(nominal).filter(|(rate, nominal)| !is_same(*rate, *nominal)) {
        notes.push(format!(
            "{name}: variable frame rate ({rate:.2} in the mean, {nominal:.2} nominal): its frames are taken as if evenly \
             spaced"
        ));
    }
    let duration =
        stream.duration.as_ref().or(probed.format.duration.as_ref()).and_then(|text| text.parse::<f64>().ok());
    let found = fs::read_dir(folder).map_err(unreadable)?.count();
    if let Some(expected) = duration.map(|seconds| (seconds * frames_per_second).round()) {
        // a frame more or less is how programs count the length
        if (found as f64 - expected).abs() > 1.0 {
            notes.push(format!(
                "{name}: {found} frames, but its length at {frames_per_second} a second is that of {expected:.0}: frames \
                 were dropped or repeated, and it is out of step with the others from there"
            ));
        }
    }
    let turned = stream.side_data_list.iter().map(|data| data.rotation).find(|angle| *angle != 0.0);
    notes.extend(turned.map(|angle| format!("{name}: turned by {angle} degrees, as the video says")));
    Ok(notes)
}

pub(super) fn forget(folder: &Path) -> Result<(), ExperimentError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(ExperimentError::Unreadable { path: folder.to_owned(), source: error })
        }
        _ => Ok(()),
    }
}

fn run(program: &str, arguments: &[&str], video: &Path, folder: &Path) -> Result<Output, ExperimentError> {
    let output = Command::new(program).args(arguments).current_dir(folder).stdin(Stdio::null()).output();
    let output = output.map_err(|error| {
        let why = match error.kind() {
            io::ErrorKind::NotFound => format!("found no {program} on the path"),
            _ => format!("cannot start {program}: {error}"),
        };
        let message = format!(
            "{} is a video, which needs the programs ffmpeg and ffprobe, but {why}: install ffmpeg, or give a folder of images",
            video.display()
        );
        key_error("masks.path", message)
    })?;
    if output.status.success() {
        return Ok(output);
    }
    let said = excerpt(String::from_utf8_lossy(&output.stderr).trim());
    let detail = format!("expected a video that {program} can read, but it failed: {said}");
    Err(ExperimentError::Malformed { path: video.to_owned(), detail })
}

/// A rate such as `30000/1001`.
fn ratio(text: &str) -> Option<f64> {
    let (above, below) = text.split_once('/')?;
    let rate = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
    rate.is_finite().then_some(rate).filter(|rate| *rate > 0.0)
}
