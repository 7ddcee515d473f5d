//! Writes `results/skinned-body.md`, its plots and its numbers.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use skiagraph::evaluation::{ValueRange, mean, mean_interval};
use skiagraph::report::plots::{Colour, Line, LinePlot, Size, Stroke};

use super::{BODIES, CASES, Case, Known, Outcome, SCENARIO, Turns};

const LIMBS: [&str; 4] = ["left arm", "right arm", "left leg", "right leg"];
/// A limb is mistracked if its outer markers are off by more than this for this many consecutive frames.
const MISTRACKED_MM: f32 = 150.0;
const CONSECUTIVE_FRAMES: usize = 6;

/// The numbers of a case in `skinned-body.json`: one value per seed.
#[derive(Default, Serialize)]
struct Numbers {
    error_mm: Vec<f64>,
    orientation_deg: Vec<f64>,
    head_deg: Vec<f64>,
    body_heading_deg: Vec<f64>,
    silhouette_iou: Vec<f64>,
    energy_gap: Vec<f64>,
    seconds: Vec<f64>,
    evaluations: Vec<u64>,
    set_hash: String,
}

pub(super) fn write(
    folder: &Path,
    known: &Known,
    turns: &Turns,
    (seeds, commit): (u64, &str),
) -> Result<(), Box<dyn Error>> {
    let outcomes =
        |case: &Case| -> Vec<&Outcome> { (0..seeds).filter_map(|seed| known.get(&case.key(seed))).collect() };
    let done: Vec<(Case, Vec<&Outcome>)> =
        CASES.into_iter().map(|case| (case, outcomes(&case))).filter(|(_, found)| !found.is_empty()).collect();
    let mut text = found(&done);
    table(&done, &mut text);
    over_time(folder, &done, &mut text)?;
    mistracked(&done, &mut text);
    ambiguity(turns, &done, &mut text);
    text += &method(&done, seeds, commit);
    let numbers: BTreeMap<String, Numbers> = done.iter().map(|(case, all)| (name(case), numbers(all))).collect();
    std::fs::write(folder.join("skinned-body.json"), serde_json::to_string_pretty(&numbers)? + "\n")?;
    std::fs::write(folder.join("skinned-body.md"), text)?;
    Ok(())
}

fn name(case: &Case) -> String {
    format!("{} views, {}, {}", case.views, case.body, case.method)
}

/// Means over seeds of one quantity, for capsules and the skin, in every setting.
fn both(done: &[(Case, Vec<&Outcome>)], unit: &str, of: fn(&Numbers) -> &Vec<f64>) -> String {
    let centre = |found: &[&Outcome]| mean(of(&numbers(found))).unwrap_or(f64::NAN);
    let pairs = done.iter().filter(|(case, _)| case.body == "capsules").filter_map(|(case, capsules)| {
        let other =
            |(of, _): &&(Case, Vec<&Outcome>)| of.body == "skin" && of.views == case.views && of.method == case.method;
        let (_, skin) = done.iter().find(other)?;
        let (views, method) = (case.views, case.method);
        Some(format!("{:.1} and {:.1} {unit} ({method}, {views} views)", centre(capsules), centre(skin)))
    });
    pairs.collect::<Vec<_>>().join(", ")
}

fn found(done: &[(Case, Vec<&Outcome>)]) -> String {
    format!(
        "# A skinned and a cylindrical body on a long walk\n\n\
         With capsules and with a skin, the position error is {}, and the error of the head's orientation {}. The skin helps most with \
         the orientation of the head, because a capsule looks the same however it is turned about its axis.\n",
        both(done, "mm", |numbers| &numbers.error_mm),
        both(done, "degrees", |numbers| &numbers.head_deg),
    )
}

fn method(done: &[(Case, Vec<&Outcome>)], seeds: u64, commit: &str) -> String {
    let all = || done.iter().flat_map(|(_, found)| found.iter());
    let iou: Vec<f64> = all().filter_map(|outcome| outcome.segmentation_iou).collect();
    let frames = all().next().map_or(0, |outcome| outcome.error_mm.len());
    format!(
        "\n## Method\n\n\
         This follows both experiments of [Skinned APF], section 7. `{SCENARIO}`: the built-in walk, {frames} frames at 60 Hz along a circle, with \
         varied strides, performed by `actor` (44 joint angles) with the skin `person` of 5,000 triangles; images of 640 x 480 pixels in \
         which the body is 210 to 350 pixels tall, \
         silhouettes by background subtraction (overlap with the exact ones {:.3}). The recording is not the paper's (HumanEva's may not \
         be redistributed), and the images are rendered. So the ranking of the bodies can be compared with the paper, but not the \
         millimetres.\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} cargo run --release --example studies -- skinned_body` (it resumes), with commit {commit}; numbers for every seed and \
         the hashes of the sets are in `skinned-body.json`.\n",
        mean(&iou).unwrap_or(f64::NAN)
    )
}

fn table(done: &[(Case, Vec<&Outcome>)], text: &mut String) {
    *text += "\n| views | tracker's body | method | position error, mm | body orientation error, degrees | head orientation error, degrees | \
              IoU of the estimate | energy gap | ms per frame | seeds |\n|---:|---|---|---|---|---|---|---:|---:|---:|\n";
    for (case, found) in done {
        let numbers = numbers(found);
        let frames = found.first().map_or(1, |outcome| outcome.error_mm.len()) as f64;
        let gap = mean(&numbers.energy_gap).map_or("-".to_owned(), |gap| format!("{gap:.3}"));
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {gap} | {:.0} | {} |",
            case.views,
            case.body,
            case.method,
            with_interval(&numbers.error_mm, 1),
            with_interval(&numbers.orientation_deg, 1),
            with_interval(&numbers.head_deg, 1),
            with_interval(&numbers.silhouette_iou, 3),
            1e3 * mean(&numbers.seconds).unwrap_or(f64::NAN) / frames,
            found.len()
        )
        .ok();
    }
    *text += "\nMeans over frames and seeds, with 95 % intervals over seeds. Trackers know the true lengths. Their bodies have tapered capsules \
              (*capsules*: truncated cones with round ends, like those of [Balan 2005]) or the skin `person_coarse` of 1,000 triangles \
              (*skin*). *Paper* is Algorithm 1 as printed on `tracker25`, the paper's body, with 200 particles x 5 layers; *default* is \
              `tracker40` with 60 x 5 and refinement. Position error is HumanEva's, over its 15 markers; body orientation is that of the root. The energy gap is the energy of \
              the true pose on the tracker's body minus that of the estimate. Times are wall-clock times on a machine with other load.\n";
}

fn numbers(found: &[&Outcome]) -> Numbers {
    let over_frames = |of: &dyn Fn(&Outcome) -> Vec<f64>| -> Vec<f64> {
        found.iter().filter_map(|outcome| mean(&of(outcome)[1..])).collect()
    };
    let wide = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect::<Vec<f64>>();
    Numbers {
        error_mm: over_frames(&|outcome| wide(&outcome.error_mm)),
        orientation_deg: over_frames(&|outcome| wide(&outcome.orientation_deg)),
        head_deg: over_frames(&|outcome| wide(&outcome.head_deg).into_iter().map(f64::abs).collect()),
        body_heading_deg: over_frames(&|outcome| wide(&outcome.body_deg)),
        silhouette_iou: found.iter().map(|outcome| outcome.silhouette_iou).collect(),
        energy_gap: found.iter().filter_map(|outcome| outcome.energy_gap).collect(),
        seconds: found.iter().map(|outcome| outcome.seconds).collect(),
        evaluations: found.iter().map(|outcome| outcome.evaluations).collect(),
        set_hash: found.first().map(|outcome| outcome.set_hash.clone()).unwrap_or_default(),
    }
}

/// Errors over time, as in figure 5 of the paper: one plot per quantity and method, with four cameras.
fn over_time(folder: &Path, done: &[(Case, Vec<&Outcome>)], text: &mut String) -> Result<(), Box<dyn Error>> {
    *text += "\n## Over time\n\nMean over seeds; the band is from the lowest to the highest seed. For its skinned body, [Skinned APF], figure 5, has \
              mean position errors below 80 mm and orientation errors of about 8 degrees.\n";
    for method in ["paper", "default"] {
        let cases = || done.iter().filter(|(case, _)| case.views == 4 && case.method == method);
        if cases().count() < BODIES.len() {
            continue;
        }
        type OfFrames = fn(&Outcome) -> &[f32];
        let quantities: [(&str, &str, OfFrames); 2] = [
            ("position", "position error, mm", |outcome| &outcome.error_mm),
            ("orientation", "body orientation error, degrees", |outcome| &outcome.orientation_deg),
        ];
        for (quantity, label, of) in quantities {
            let lines = cases()
                .zip([Colour::Orange, Colour::Blue])
                .map(|((case, found), colour)| line(case.body, colour, found, of));
            let plot = LinePlot {
                x_label: "frame, from 0, at 60 Hz".to_owned(),
                y_label: label.to_owned(),
                lines: lines.collect(),
                y_from: Some(0.0),
                ..LinePlot::default()
            };
            let file = format!("skinned-body-{method}-{quantity}.svg");
            std::fs::write(folder.join(&file), plot.svg(Size { width: 1000, height: 340 })?.standalone())?;
            writeln!(text, "\n![{label}, {method}, four views]({file})").ok();
        }
    }
    Ok(())
}

fn line(body: &str, colour: Colour, found: &[&Outcome], of: fn(&Outcome) -> &[f32]) -> Line {
    let frames = found.first().map_or(0, |outcome| of(outcome).len());
    let values = |frame: usize| -> Vec<f64> { found.iter().map(|outcome| f64::from(of(outcome)[frame])).collect() };
    let ends =
        |values: Vec<f64>| values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
    Line {
        band: (1..frames).map(|frame| (frame as f64, Some(ends(values(frame))))).collect(),
        ..Line::new(
            body,
            Stroke::solid(colour),
            (1..frames).map(|frame| (frame as f64, mean(&values(frame)))).collect(),
        )
    }
}

/// The frames in which limbs are mistracked.
fn mistracked(done: &[(Case, Vec<&Outcome>)], text: &mut String) {
    write!(
        text,
        "\n## Where limbs are mistracked\n\nA limb is mistracked if its two outer markers are off by more than {MISTRACKED_MM} mm on average \
         for {CONSECUTIVE_FRAMES} frames in a row. The table has the share of all frames of all seeds, and the frame intervals of the worst seed. ([Skinned \
         APF] shows the body of [Balan 2005] losing the right arm at frame 35 and the left leg at frame 135.)\n\n\
         | views | body | method | {} |\n|---:|---|---|{}\n",
        LIMBS.join(" | "),
        "---|".repeat(LIMBS.len())
    )
    .ok();
    for (case, found) in done {
        let cells: Vec<String> = (0..LIMBS.len())
            .map(|limb| {
                let all: Vec<Vec<(usize, usize)>> =
                    found.iter().map(|outcome| stretches(&outcome.limbs_mm[limb])).collect();
                let length = |stretches: &Vec<(usize, usize)>| stretches.iter().map(|(a, b)| b - a + 1).sum::<usize>();
                let frames: usize = found.iter().map(|outcome| outcome.error_mm.len() - 1).sum();
                let share = 100.0 * all.iter().map(length).sum::<usize>() as f64 / frames as f64;
                let worst = all.iter().max_by_key(|stretches| length(stretches)).cloned().unwrap_or_default();
                let intervals: Vec<String> = worst.iter().take(4).map(|(a, b)| format!("{a}-{b}")).collect();
                let more = if worst.len() > 4 { ", ..." } else { "" };
                if share == 0.0 { "none".to_owned() } else { format!("{share:.1} %: {}{more}", intervals.join(", ")) }
            })
            .collect();
        writeln!(text, "| {} | {} | {} | {} |", case.views, case.body, case.method, cells.join(" | ")).ok();
    }
}

fn stretches(errors: &[f32]) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (frame, _) in errors.iter().enumerate().filter(|(_, error)| **error > MISTRACKED_MM) {
        match found.last_mut() {
            Some((_, last)) if *last + 1 == frame => *last = frame,
            _ => found.push((frame, frame)),
        }
    }
    found.retain(|(first, last)| last - first + 1 >= CONSECUTIVE_FRAMES);
    found
}

/// Increase of the energy by rotating the head, compared with moving an arm.
fn ambiguity(turns: &Turns, done: &[(Case, Vec<&Outcome>)], text: &mut String) {
    *text += "\n## Orientation of the head\n\nFor seven cameras, [Skinned APF] (figure 7) reports that the head's orientation is not accurate, because \
              a head is close to a sphere. The table shows how much the energy increases, in thousandths, when the head of the true pose (refitted to \
              the tracker's body) is turned about its axis, and when the left upper arm is lifted by the same angle; mean over every 23rd \
              frame. If the energy does not increase, the silhouettes do not determine the head's orientation.\n\n";
    let mut angles: Vec<f64> = turns.iter().map(|(.., angle, _, _)| *angle).collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    let titles: Vec<String> = angles.iter().map(|angle| format!("{angle:+.0}°")).collect();
    writeln!(text, "| views | body | part | {} |\n|---:|---|---|{}", titles.join(" | "), "---:|".repeat(angles.len()))
        .ok();
    for views in [4, 7] {
        for (body, _) in BODIES {
            for (what, of) in [("head", 0), ("left arm", 1)] {
                let rise = |angle: &f64| {
                    let row = turns.iter().find(|(v, b, a, ..)| *v == views && b == body && a == angle);
                    row.map_or("-".to_owned(), |(.., head, arm)| format!("{:.1}", 1e3 * [head, arm][of]))
                };
                writeln!(
                    text,
                    "| {views} | {body} | {what} | {} |",
                    angles.iter().map(rise).collect::<Vec<_>>().join(" | ")
                )
                .ok();
            }
        }
    }
    *text += "\nErrors of the estimated heading of head and body:\n\n| views | body | method | head, degrees | body, degrees |\n\
              |---:|---|---|---|---|\n";
    for (case, found) in done {
        let numbers = numbers(found);
        let (head, body) = (with_interval(&numbers.head_deg, 1), with_interval(&numbers.body_heading_deg, 1));
        writeln!(text, "| {} | {} | {} | {head} | {body} |", case.views, case.body, case.method).ok();
    }
}

fn with_interval(values: &[f64], digits: usize) -> String {
    let Some(centre) = mean(values) else { return "-".to_owned() };
    match mean_interval(&[values.to_vec()], ValueRange::NonNegative) {
        Some((interval, _)) => format!("{centre:.digits$} ({:.digits$} to {:.digits$})", interval.low, interval.high),
        None => format!("{centre:.digits$}"),
    }
}
