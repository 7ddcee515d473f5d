//! Estimates of markers as other programs write them.

use std::fmt::Write;

use nalgebra::Point3;
use skiagraph_core::body::{LANDMARKS, Markers};

pub(crate) fn names() -> Vec<&'static str> {
    LANDMARKS.iter().map(|landmark| landmark.name()).collect()
}

/// The markers of every frame after a change of their positions.
pub(crate) fn changed(estimate: &[Markers], change: impl Fn(Point3<f64>) -> Point3<f64>) -> Vec<Markers> {
    estimate.iter().map(|markers| markers.map(|m| m.map(&change))).collect()
}

pub(crate) fn coordinates(markers: &Markers) -> impl Iterator<Item = f64> {
    markers.iter().flat_map(|marker| <[f64; 3]>::from(marker.unwrap()))
}

fn joined(markers: &Markers, between: &str) -> String {
    coordinates(markers).map(|number| number.to_string()).collect::<Vec<_>>().join(between)
}

/// A table with one column per coordinate.
pub(crate) fn csv(markers: &[Markers], names: &[&str]) -> String {
    let columns: Vec<String> = names.iter().flat_map(|n| ["x", "y", "z"].map(|axis| format!("{n}_{axis}"))).collect();
    let mut text = columns.join(",") + "\n";
    markers.iter().for_each(|frame| writeln!(text, "{}", joined(frame, ",")).unwrap());
    text
}

pub(crate) fn trc(markers: &[Markers], names: &[&str], unit: &str, rate: f64) -> String {
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\tmine.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n\
         {rate}\t{rate}\t{}\t15\t{unit}\nFrame#\tTime",
        markers.len()
    );
    names.iter().for_each(|name| write!(text, "\t{name}\t\t").unwrap());
    text.push_str("\n\t\tX1\n\n");
    for (frame, markers) in markers.iter().enumerate() {
        writeln!(text, "{}\t{}\t{}", frame + 1, frame as f64 / rate, joined(markers, "\t")).unwrap();
    }
    text
}
