//! TRC, the marker table of Motion Analysis and OpenSim: tabs, millimetres, Y up.

use std::fmt::Write as _;

use nalgebra::Point3;

use super::folder::{Folder, millimetres};
use crate::{BenchmarkSet, SetError};
use skiagraph_core::body::LANDMARKS;

const README: &str = "\
markers.trc   HumanEva's 15 virtual markers, millimetres, Y up as OpenSim has it: x = the set's x, y = its z, z = its -y
              (forward stays +X at the zero pose, right is +Z). A marker that the actor lacks is left out.
Frames are numbered from 1; time = (number - 1) / rate.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(&set.blind, README)?;
    let truth = &set.truth.ground_truth;
    let markers: Vec<usize> = (0..LANDMARKS.len()).filter(|m| truth.actor.markers[*m].is_some()).collect();
    let (rate, frames, count) = (truth.frames_per_second, truth.frames.len(), markers.len());
    let mut text = String::from("PathFileType\t4\t(X/Y/Z)\tmarkers.trc\n");
    text += "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n";
    text += &format!("{rate}\t{rate}\t{frames}\t{count}\tmm\t{rate}\t1\t{frames}\n");
    // three cells a marker in both rows, the last one empty too: readers of tables count them
    let names: String = markers.iter().map(|m| format!("\t{}\t\t", LANDMARKS[*m].name())).collect();
    let axes: String = (1..=count).map(|i| format!("\tX{i}\tY{i}\tZ{i}")).collect();
    text += &format!("Frame#\tTime{names}\n\t{axes}\n\n");
    for (number, frame) in truth.frames.iter().enumerate() {
        write!(text, "{}\t{}", number + 1, frame.time_s).ok();
        for marker in &markers {
            match frame.markers[*marker].map(|point| y_up(&point).map(millimetres)) {
                Some([x, y, z]) => write!(text, "\t{x}\t{y}\t{z}").ok(),
                None => write!(text, "\t\t\t").ok(),
            };
        }
        text.push('\n');
    }
    folder.write("markers.trc", text.as_bytes())
}

/// The point in axes with Y up and the same X.
fn y_up(point: &Point3<f64>) -> [f64; 3] {
    [point.x, point.z, -point.y]
}
