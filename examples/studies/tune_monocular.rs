//! One row of the tables of `results/monocular-notes.md`: trackers in latent space on takes that are not among the test
//! frames.
//!
//! ```sh
//! SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- tune_monocular -- [TAKE,...] \
//!     [gpdm|switching_gpdm|gpdm_graph][,key=value...]...
//! ```
//!
//! Keys are those of `[tracker.gpdm_graph]` and its like, as in `gpdm_graph,root_motion=planted,root_noise_scale=1`.
//! Three seeds, or as many as `SKIAGRAPH_SEEDS` says. The method `drift` tracks nothing: it measures how fast a root
//! drifts that follows the recording's feet, and one that follows the velocities of the most similar training frames.
//! The method `depth` tracks nothing either: it measures at which depth the silhouette fits the refitted truth best.
//! With `subject_measures` the tracker's body has the lengths of the actor's (no mismatch), with `matched` the actor is
//! the tracker's body itself.

use std::error::Error;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3, Unit, Vector3};
use skiagraph::benchmark_set::{BenchmarkSet, EstimatedSequence};
use skiagraph::body::{Landmark, LinkFrames, Motion, Pose, Solid};
use skiagraph::common::NoProgress;
use skiagraph::evaluation::Sequence;
use skiagraph::experiment::{draw, track};
use skiagraph::measure::Tracked;
use skiagraph::motion_model::pose_chart::{PoseChart, ROOT_DIMENSIONS};
use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;
use skiagraph::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph::train::Models;

/// Name, recording, skeleton, training frames and tracked frames, numbered as in the files.
type Take = (&'static str, &'static str, &'static str, [usize; 2], [usize; 2]);
const TAKES: [Take; 8] = [
    ("jogA", "14_14_f0401-1100.amc", "14.asf", [90, 245], [246, 390]),
    ("jogB", "14_14_f0401-1100.amc", "14.asf", [236, 390], [90, 235]),
    ("gestureA", "14_24.amc", "14.asf", [1141, 1980], [1981, 2280]),
    ("gestureB", "14_24.amc", "14.asf", [2281, 3120], [3121, 3420]),
    ("gestureC", "29_22_f1801-2940.amc", "29.asf", [1, 840], [841, 1140]),
    ("gestureD", "29_07_f0061-1200.amc", "29.asf", [1, 840], [841, 1140]),
    ("walkB", "49_01.amc", "49.asf", [1, 360], [361, 480]),
    ("walkC", "16_15.amc", "16.asf", [1, 340], [341, 471]),
];

/// The `[actor]` and `[tracker_body]` of a scenario.
const STANDARD: &str = "[actor]\nrobot = \"actor\"\n[tracker_body]\nrobot = \"tracker25\"\nmismatch = \"standard\"\n";
/// Alternatives, by argument.
const BODIES: [(&str, &str); 2] = [
    ("subject_measures", "[actor]\nrobot = \"actor\"\n[tracker_body]\nrobot = \"tracker25\"\nmismatch = \"none\"\n"),
    ("matched", "[actor]\nrobot = \"tracker25\"\n[tracker_body]\nrobot = \"tracker25\"\nmismatch = \"none\"\n"),
];

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's 14_14_f0401-1100, 14_24, 16_15 and 49_01");
        return Ok(());
    };
    let seeds: u64 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(3), |n| n.parse())?;
    let arguments: Vec<String> = std::env::args().skip(2).filter(|a| a != "--").collect();
    let bodies =
        BODIES.iter().find(|(name, _)| arguments.iter().any(|a| a == name)).map_or(STANDARD, |(_, text)| *text);
    let arguments: Vec<String> = arguments.into_iter().filter(|a| BODIES.iter().all(|(name, _)| a != name)).collect();
    let is_takes = |a: &&String| TAKES.iter().any(|take| a.split(',').any(|name| name == take.0));
    let wanted: Option<&String> = arguments.iter().find(is_takes);
    let takes = TAKES.iter().filter(|take| wanted.is_none_or(|w| w.split(',').any(|name| name == take.0)));
    let mut methods: Vec<&str> = arguments.iter().filter(|a| !is_takes(a)).map(String::as_str).collect();
    if methods.is_empty() {
        methods.push("gpdm_graph");
    }
    if methods == ["drift"] {
        println!(
            "| take | middle of the lower foot | its lowest point | its ankle | velocities of the most similar frames |"
        );
        println!("|---|---|---|---|---|");
        for take in takes {
            drift(take, bodies, &mocap)?;
        }
        return Ok(());
    }
    if methods == ["depth"] {
        println!(
            "| take | depth, mm | spread | upwards, mm | spread | energy there | lean, degrees | spread | energy there | energy leant by 4 | energy of the truth |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        for take in takes {
            depth(take, bodies, &mocap)?;
        }
        return Ok(());
    }
    println!(
        "| take | method | error, mm | by seed | root: depth, mm | sideways | up | root-relative, mm | energy | brought back | depth by fifth of the frames, mm | upwards | depth of ankles, knees, hips, thorax, head, wrists, mm |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for take in takes {
        run(take, bodies, &methods, seeds, &mocap)?;
    }
    Ok(())
}

fn run(take: &Take, bodies: &str, methods: &[&str], seeds: u64, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let file = ScenarioFile::parse(&scenario(take, bodies), take.0, PathBuf::new(), &[])?;
    let (set, _) = draw(&file, Some(mocap), &NoProgress)?;
    let mut models = Models::default();
    for method in methods {
        let (kind, overrides) = method.split_once(',').unwrap_or((method, ""));
        let text = scenario(take, bodies) + &format!("[tracker.{kind}]\n");
        let overrides = overrides.split(',').filter(|o| !o.is_empty());
        let overrides: Vec<String> = overrides.map(|o| format!("tracker.{kind}.{o}")).collect();
        let settings = ScenarioFile::parse(&text, method, PathBuf::new(), &overrides)?.scenario.tracker();
        let seeds: Vec<u64> = (0..seeds).collect();
        let tracked = track(&set.blind, &settings, &seeds, set.truth.refitted.as_ref(), &mut models, &NoProgress)?;
        println!("{}", row(take.0, method, &set, &tracked));
    }
    Ok(())
}

/// Displacement of the refitted truth along the view and upwards, or lean about its ankles away from the camera, that
/// fits the silhouette best: mean and deviation over frames.
fn depth(take: &Take, bodies: &str, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let file = ScenarioFile::parse(&scenario(take, bodies), take.0, PathBuf::new(), &[])?;
    let (set, _) = draw(&file, Some(mocap), &NoProgress)?;
    let Some(refitted) = &set.truth.refitted else { return Ok(()) };
    let body = &set.blind.start.body;
    let mut likelihood = SilhouetteLikelihood::new(body.clone(), &set.blind.rig, SilhouetteSettings::default())?;
    let mut scratch = likelihood.scratch();
    let mut found: Vec<[f64; 7]> = Vec::new();
    for (frame, truth) in refitted.poses.iter().enumerate().step_by(3) {
        likelihood.prepare(&set.blind.observation(frame)?)?;
        let view = truth.world_from_root.translation.vector - set.blind.rig.cameras[0].centre().coords;
        let view = Vector3::new(view.x, view.y, 0.0).normalize();
        let ankles = body.markers(&body.link_frames(truth));
        let ankle = |landmark: Landmark| ankles[landmark as usize].unwrap_or_default().coords;
        let middle = 0.5 * (ankle(Landmark::LeftAnkle) + ankle(Landmark::RightAnkle));
        let across = Unit::new_normalize(Vector3::z().cross(&view));
        let mut energy = |depth: f64, up: f64, lean: f64| {
            let mut pose = truth.clone();
            let turn = Isometry3::rotation(*across * lean);
            pose.world_from_root =
                Translation3::from(middle) * turn * Translation3::from(-middle) * pose.world_from_root;
            pose.world_from_root.translation.vector += depth * view + up * Vector3::z();
            likelihood.energy(&pose, &mut scratch)
        };
        let there = energy(0.0, 0.0, 0.0);
        let (mut moved, mut leaning) = ([0.0, 0.0, there], [0.0, there]);
        for (depth, up) in (-30..=30).flat_map(|i| (-10..=10).map(move |j| (0.01 * f64::from(i), 0.01 * f64::from(j))))
        {
            let here = energy(depth, up, 0.0);
            if here < moved[2] {
                moved = [depth, up, here];
            }
        }
        for lean in (-20..=20).map(|i| (0.5 * f64::from(i)).to_radians()) {
            let here = energy(0.0, 0.0, lean);
            if here < leaning[1] {
                leaning = [lean.to_degrees(), here];
            }
        }
        found.push([
            moved[0],
            moved[1],
            moved[2],
            there,
            leaning[0],
            leaning[1],
            energy(0.0, 0.0, 4.0_f64.to_radians()),
        ]);
    }
    let mean = |i: usize| found.iter().map(|f| f[i]).sum::<f64>() / found.len() as f64;
    let spread = |i: usize| (found.iter().map(|f| (f[i] - mean(i)).powi(2)).sum::<f64>() / found.len() as f64).sqrt();
    println!(
        "| {} | {:.0} | {:.0} | {:.0} | {:.0} | {:.4} | {:.1} | {:.1} | {:.4} | {:.4} | {:.4} |",
        take.0,
        1000.0 * mean(0),
        1000.0 * spread(0),
        1000.0 * mean(1),
        1000.0 * spread(1),
        mean(2),
        mean(4),
        spread(4),
        mean(5),
        mean(6),
        mean(3)
    );
    Ok(())
}

/// Drift over the tracked frames, mm/s.
fn drift(take: &Take, bodies: &str, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let prepared =
        PreparedScene::new(&ScenarioFile::parse(&scenario(take, bodies), take.0, PathBuf::new(), &[])?, Some(mocap))?;
    let (body, motion) = (&prepared.start.body, &prepared.refitted);
    let frames: Vec<LinkFrames> = motion.poses.iter().map(|pose| body.link_frames(pose)).collect();
    let seconds = (frames.len() - 1) as f64 / motion.frames_per_second;
    let shanks = body.foot_links();
    // the last solid of a shank is its foot
    let middle = |foot: usize| body.links[shanks[foot][0]].solids.last().and_then(Solid::middle).unwrap_or_default();
    let ankle = |foot: usize| {
        let landmark = [Landmark::LeftAnkle, Landmark::RightAnkle][foot];
        body.markers[landmark as usize].map_or_else(Default::default, |marker| marker.point_in_link)
    };
    let lowest = |foot: usize, t: usize| {
        let point = body.lowest_point(&frames[t], &shanks[foot]).unwrap_or_default();
        frames[t][shanks[foot][0]].inverse_transform_point(&point)
    };
    let net = |points: &dyn Fn(usize, usize) -> [Point3<f64>; 2]| {
        let step = |t: usize| {
            let of = |foot: usize| {
                let at = |t: usize, p: &Point3<f64>| frames[t][shanks[foot][0]] * p;
                let points = points(foot, t);
                let moved = |p: &Point3<f64>| at(t + 1, p) - at(t, p);
                (at(t, &points[0]).z, 0.5 * (moved(&points[0]) + moved(&points[1])))
            };
            let (left, right) = (of(0), of(1));
            if left.0 < right.0 { left.1 } else { right.1 }
        };
        1000.0 * (0..frames.len() - 1).map(step).sum::<Vector3<f64>>().xy().norm() / seconds
    };
    let learned = prepared.start.training.motions();
    let chart = PoseChart::learn(body, learned);
    let rows = |motion: &Motion| -> Vec<Vec<f64>> {
        let observed = chart.observe(motion);
        (0..observed.nrows()).map(|t| observed.row(t).iter().copied().collect()).collect()
    };
    let known: Vec<Vec<f64>> = learned.iter().flat_map(rows).collect();
    let squared_distance = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).take(a.len() - ROOT_DIMENSIONS).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let drift = rows(motion).iter().skip(1).fold((0.0, 0.0), |sum: (f64, f64), here| {
        let near = known.iter().min_by(|a, b| squared_distance(a, here).total_cmp(&squared_distance(b, here)));
        let (learned_step, truth) = (chart.planar_step(near.unwrap_or(here)), chart.planar_step(here));
        (sum.0 + learned_step.forward - truth.forward, sum.1 + learned_step.left - truth.left)
    });
    println!(
        "| {} | {:.0} | {:.0} | {:.0} | {:.0} |",
        take.0,
        net(&|foot, _| [middle(foot); 2]),
        net(&|foot, t| [lowest(foot, t), lowest(foot, t + 1)]),
        net(&|foot, _| [ankle(foot); 2]),
        1000.0 * f64::hypot(drift.0, drift.1) / seconds
    );
    Ok(())
}

fn scenario((name, clip, skeleton, learned, tracked): &Take, bodies: &str) -> String {
    let part = |[first, last]: &[usize; 2]| {
        format!(
            "clip = \"{clip}\"\nskeleton = \"{skeleton}\"\nfirst_frame = {first}\nlast_frame = {last}\n\
             frames_per_second = 60.0\nsource_hz = 120.0\nup = \"y\"\n"
        )
    };
    format!(
        "schema = \"skiagraph.scenario/1\"\nname = \"{name}\"\n[motion]\n{}[[training.clips]]\n{}{bodies}[rig.ring]\ncount = 1\nradius_m = 4.5\nheight_m = 1.6\n\
         field_of_view_deg = 57.4\nsize_px = [640, 480]\n",
        part(tracked),
        part(learned)
    )
}

/// Errors of one pose, mm: of the markers, of the root along the viewing direction, sideways and upwards, and of the
/// markers after aligning the roots.
fn errors(set: &BenchmarkSet, frame: usize, pose: &Pose) -> [f64; 7] {
    let body = &set.blind.start.body;
    let truth = &set.truth.ground_truth.frames[frame].markers;
    let of = |pose: &Pose| {
        let markers = body.markers(&body.link_frames(pose));
        let pair = Sequence::from_markers(60.0, std::slice::from_ref(truth), std::slice::from_ref(&markers));
        let distances: Vec<f64> = pair.distances_mm(0).collect();
        distances.iter().sum::<f64>() / distances.len() as f64
    };
    let root =
        set.truth.refitted.as_ref().map_or(Vector3::zeros(), |m| m.poses[frame].world_from_root.translation.vector);
    let off = 1000.0 * (pose.world_from_root.translation.vector - root);
    let view = root - set.blind.rig.cameras[0].centre().coords;
    let depth = Vector3::new(view.x, view.y, 0.0).normalize();
    let mut moved = pose.clone();
    moved.world_from_root.translation.vector = root;
    let side = off.dot(&Vector3::z().cross(&depth));
    [of(pose), off.dot(&depth).abs(), side.abs(), off.z.abs(), of(&moved), off.dot(&depth), off.z]
}

fn row(take: &str, method: &str, set: &BenchmarkSet, tracked: &Tracked) -> String {
    let mut of_seeds = Vec::new();
    for poses in tracked.estimates.sequences.iter().filter_map(EstimatedSequence::poses) {
        let mut sum = [0.0; 7];
        for (frame, pose) in poses.iter().flatten().enumerate().skip(1) {
            sum.iter_mut().zip(errors(set, frame, pose)).for_each(|(s, e)| *s += e / (poses.len() - 1) as f64);
        }
        of_seeds.push(sum);
    }
    let fifths = |component: usize| -> String {
        let mut sums = [(0.0, 0.0); 5];
        for poses in tracked.estimates.sequences.iter().filter_map(EstimatedSequence::poses) {
            for (frame, pose) in poses.iter().flatten().enumerate().skip(1) {
                let sum = &mut sums[5 * frame / poses.len()];
                *sum = (sum.0 + errors(set, frame, pose)[component], sum.1 + 1.0);
            }
        }
        sums.map(|(sum, count): (f64, f64)| format!("{:+.0}", sum / count)).join(" ")
    };
    let mean = |i: usize| of_seeds.iter().map(|s| s[i]).sum::<f64>() / of_seeds.len() as f64;
    let each: Vec<String> = of_seeds.iter().map(|s| format!("{:.0}", s[0])).collect();
    let records = || tracked.search.iter().flatten();
    let energy = records().filter_map(|r| r.energy).sum::<f64>() / records().count() as f64;
    let recovered: u64 = records().flat_map(|r| &r.occupancy).map(|o| u64::from(o.recovered)).sum();
    format!(
        "| {take} | {method} | **{:.1}** | {} | {:.1} | {:.1} | {:.1} | {:.1} | {energy:.4} | {recovered} | {} | {} | {} |",
        mean(0),
        each.join(" "),
        mean(1),
        mean(2),
        mean(3),
        mean(4),
        fifths(5),
        fifths(6),
        tracked_depths(set, tracked)
    )
}

/// Mean error of landmarks along the view, mm, positive if too far away; it differs between them if the body leans.
fn tracked_depths(set: &BenchmarkSet, tracked: &Tracked) -> String {
    let groups: [&[Landmark]; 6] = [
        &[Landmark::LeftAnkle, Landmark::RightAnkle],
        &[Landmark::LeftKnee, Landmark::RightKnee],
        &[Landmark::LeftHip, Landmark::RightHip],
        &[Landmark::Thorax],
        &[Landmark::HeadTop],
        &[Landmark::LeftWrist, Landmark::RightWrist],
    ];
    let body = &set.blind.start.body;
    let camera = set.blind.rig.cameras[0].centre();
    let mut sums = [(0.0, 0.0); 6];
    for poses in tracked.estimates.sequences.iter().filter_map(EstimatedSequence::poses) {
        for (frame, pose) in poses.iter().flatten().enumerate().skip(1) {
            let (truth, found) = (&set.truth.ground_truth.frames[frame].markers, body.markers(&body.link_frames(pose)));
            for (sum, group) in sums.iter_mut().zip(groups) {
                for landmark in group {
                    let (Some(truth), Some(found)) = (truth[*landmark as usize], found[*landmark as usize]) else {
                        continue;
                    };
                    let view = truth - camera;
                    let off = (found - truth).dot(&Vector3::new(view.x, view.y, 0.0).normalize());
                    *sum = (sum.0 + 1000.0 * off, sum.1 + 1.0);
                }
            }
        }
    }
    sums.map(|(sum, count): (f64, f64)| format!("{:+.0}", sum / count)).join(" ")
}
