//! `[motion]` and `[[training.clips]]` on a robot: every take is retargeted, then edited by the settings.

use super::clip_file::{self, Folders, UsedRecording};
use super::people::apply_shape;
use super::placement::place;
use super::retargeting::retargeted;
use super::robots::RobotChoice;
use crate::common::ExperimentError;
use crate::scenario::{KeyError, MotionSettings, ShapeSettings};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::contact::Pace;
use skiagraph_set::SourceRecording;
use skiagraph_truth::editing::{EditError, Joined, Seam, Take, along_path, carried_over, joined, repeated, varied};
use skiagraph_truth::retarget::Retargeted;

/// The recordings of a motion, cut and resampled to the motion's rate: the first take and those that follow.
pub(crate) struct Recordings<'a> {
    settings: &'a MotionSettings,
    table: String,
    takes: Vec<(String, MotionSettings, UsedRecording)>,
}

pub(crate) struct RetargetedMotion {
    /// The motion, on the body of the first take's subject.
    pub(crate) retargeted: Retargeted,
    /// Where takes were joined.
    pub(crate) seams: Vec<Seam>,
    /// Each frame's speed relative to the recording; empty if all frames have the recorded speed.
    pub(crate) pace: Vec<f64>,
}

impl<'a> Recordings<'a> {
    /// Reads the recordings of `settings`, which are the scenario's `table`.
    pub(crate) fn load(
        places: Folders<'_>,
        table: &str,
        settings: &'a MotionSettings,
    ) -> Result<Self, ExperimentError> {
        let mut takes = Vec::new();
        for (table, take) in settings.takes(table) {
            let recording = clip_file::load(places, &table, &take)?;
            takes.push((table, take, recording));
        }
        Ok(Self { settings, table: table.to_owned(), takes })
    }

    pub(crate) fn sources(&self) -> Vec<SourceRecording> {
        self.takes.iter().map(|(.., recording)| recording.source.clone()).collect()
    }

    pub(crate) fn name(&self) -> String {
        let names: Vec<&str> = self.takes.iter().map(|(.., recording)| recording.clip.name.as_str()).collect();
        names.join(" + ")
    }

    /// The motion on `template`, the body of `robot`, scaled to the first take's subject, then given the `shape`.
    pub(crate) fn retarget_to(
        &self,
        robot: &RobotChoice<'_>,
        template: &Humanoid,
        shape: Option<&ShapeSettings>,
    ) -> Result<RetargetedMotion, KeyError> {
        let mut first: Option<Retargeted> = None;
        let (mut takes, mut seams) = (Vec::new(), Vec::new());
        for (table, settings, recording) in &self.takes {
            let key = format!("{table}.clip");
            let mut own = retargeted(&key, settings, robot, recording, template)?;
            if let (None, Some(shape)) = (&first, shape) {
                apply_shape(shape, template, &mut own)?;
            }
            let body = first.as_ref().map_or(&own.humanoid, |first| &first.humanoid);
            let motion = match &first {
                None => std::mem::replace(&mut own.motion, Motion { frames_per_second: 1.0, poses: Vec::new() }),
                Some(_) => carried_over(&own.humanoid, body, &own.motion),
            };
            let mut take = Take { name: recording.clip.name.clone(), motion };
            if let Some(duration) = settings.loop_to_s.filter(|_| !recording.was_cyclic) {
                let longer = repeated(body, &take, duration, &self.settings.join);
                let longer = longer.map_err(|error| not_repeated(table, settings, &error))?;
                take.motion = longer.motion;
                seams.resize(takes.len(), Vec::new());
                seams.push(longer.seams);
            }
            takes.push(take);
            match &mut first {
                None => first = Some(own),
                Some(first) => first.report.notes.extend(own.report.notes.iter().map(|note| format!("{key}: {note}"))),
            }
        }
        let Some(retargeted) = first else {
            return Err(KeyError::new(&self.table, "expected a recording, found none"));
        };
        let made = joined(&retargeted.humanoid, &takes, &self.settings.join).map_err(|error| {
            let index = match &error {
                EditError::Take { index, .. } => *index,
                _ => 0,
            };
            let table = self.takes.get(index).map_or(&self.table, |(table, ..)| table);
            KeyError::new(format!("{table}.clip"), error.to_string())
        })?;
        let pace = self.pace(&made);
        self.edit(RetargetedMotion { retargeted, seams: Vec::new(), pace }, made.with_seams_of_takes(seams))
    }

    /// Each frame's speed relative to the recording, before variation.
    fn pace(&self, made: &Joined) -> Vec<f64> {
        let speeds: Vec<f64> = self.takes.iter().map(|(_, settings, _)| settings.speed.unwrap_or(1.0)).collect();
        if speeds.iter().all(|speed| *speed == 1.0) {
            return Vec::new();
        }
        made.takes_of_frames().into_iter().map(|take| speeds[take]).collect()
    }

    /// Applies variation, length, path and placement.
    fn edit(&self, unedited: RetargetedMotion, mut made: Joined) -> Result<RetargetedMotion, KeyError> {
        let settings = self.settings;
        let RetargetedMotion { mut retargeted, mut pace, .. } = unedited;
        if let Some(variation) = &settings.variation {
            let varied = varied(&retargeted.humanoid, &made.motion, variation);
            for seam in &mut made.seams {
                let frames = varied.frames_of(seam.first, seam.end);
                (seam.first, seam.end) = (frames.start, frames.end);
            }
            if !pace.is_empty() {
                pace = varied.shows.iter().map(|shown| pace[libm::round(*shown) as usize]).collect();
            }
            made.motion = varied.motion;
        }
        if let Some(frames) = settings.frames {
            let (found, rate) = (made.motion.poses.len(), settings.frames_per_second);
            if found < frames {
                let message = format!(
                    "expected at most the {found} frames ({:.2} s) that the edited motion has at {rate} Hz, found {frames} \
                     ({:.2} s); add takes or loop_to_s",
                    found as f64 / rate,
                    frames as f64 / rate
                );
                return Err(KeyError::new("frames", message).within(&self.table));
            }
            made.cut(frames);
            pace.truncate(frames);
        }
        if !settings.path_m.is_empty() {
            let led = along_path(&retargeted.humanoid, &made.motion, &settings.path_m, Pace(&pace));
            made.motion = led.map_err(|error| KeyError::new("path_m", error.to_string()).within(&self.table))?;
        }
        place(&retargeted.humanoid, &mut made.motion, settings)
            .map_err(|error| KeyError::new("heading_deg", error).within(&self.table))?;
        retargeted.motion = made.motion;
        retargeted.report.notes.extend(made.seams.iter().map(describe));
        Ok(RetargetedMotion { retargeted, seams: made.seams, pace })
    }
}

/// The error of a take that cannot be repeated: at the key that cut it, if one did.
fn not_repeated(table: &str, settings: &MotionSettings, error: &EditError) -> KeyError {
    let (key, part) = match (settings.first_frame, settings.last_frame) {
        (None, None) => ("loop_to_s", String::new()),
        (first, None) => ("first_frame", format!("from frame {}", first.unwrap_or(1))),
        (first, Some(last)) => ("last_frame", format!("frames {} to {last}", first.unwrap_or(1))),
    };
    let message = match part.as_str() {
        "" => error.to_string(),
        part => format!("the part in use, {part}, cannot be repeated for `loop_to_s`: {error}"),
    };
    KeyError::new(key, message).within(table)
}

fn describe(seam: &Seam) -> String {
    let Seam { first, end, distance_m, from, to } = seam;
    format!(
        "`{}` goes over into `{}` in frames {first} to {}: the poses are {:.0} mm apart",
        from.0,
        to.0,
        end - 1,
        1000.0 * distance_m
    )
}
