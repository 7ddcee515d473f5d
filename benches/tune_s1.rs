//! One row of the tables of `results/s1-notes.md`: trackers in latent space on takes that are not among the test frames.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo bench --bench tune_s1 -- [TAKE,...] [gpdm|switching_gpdm|gpdm_graph][,key=value...]...` where keys are those
//! of `[tracker.gpdm_graph]` and its like: `gpdm_graph,root_motion=planted,root_noise_scale=1`. Three seeds, or as many as
//! `SKIAGRAPH_SEEDS` says. The method `drift` tracks nothing: it says how fast a root drifts that follows the recording's own feet,
//! and one that follows the velocities of the most similar training frames.

use std::error::Error;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use skiagraph::benchmark_set::BenchmarkSet;
use skiagraph::body::{Flesh, Landmark, LinkFrames, Motion, Pose};
use skiagraph::evaluation::Sequence;
use skiagraph::experiment::{Models, ScenarioFile, Staged, Tracked, Unwatched, draw, track};
use skiagraph::motion_model::pose_chart::{PoseChart, ROOT_DIMENSIONS};

/// Name, recording, skeleton, frames learned from and frames tracked, as the files count them.
type Take = (&'static str, &'static str, &'static str, [usize; 2], [usize; 2]);
const TAKES: [Take; 6] = [
    ("jogA", "14_14_f0401-1100.amc", "14.asf", [90, 245], [246, 390]),
    ("jogB", "14_14_f0401-1100.amc", "14.asf", [236, 390], [90, 235]),
    ("gestureA", "14_24.amc", "14.asf", [1141, 1980], [1981, 2280]),
    ("gestureB", "14_24.amc", "14.asf", [2281, 3120], [3121, 3420]),
    ("walkB", "49_01.amc", "49.asf", [1, 360], [361, 480]),
    ("walkC", "16_15.amc", "16.asf", [1, 340], [341, 471]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's 14_14_f0401-1100, 14_24, 16_15 and 49_01");
        return Ok(());
    };
    let seeds: u64 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(3), |n| n.parse())?;
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let is_takes = |a: &&String| TAKES.iter().any(|take| a.split(',').any(|name| name == take.0));
    let wanted: Option<&String> = arguments.iter().find(is_takes);
    let mut methods: Vec<&str> = arguments.iter().filter(|a| !is_takes(a)).map(String::as_str).collect();
    if methods.is_empty() {
        methods.push("gpdm_graph");
    }
    if methods == ["drift"] {
        println!(
            "| take | middle of the lower foot | its lowest point | its ankle | velocities of the most similar frames |"
        );
        println!("|---|---|---|---|---|");
        for take in TAKES.iter().filter(|take| wanted.is_none_or(|w| w.split(',').any(|name| name == take.0))) {
            drift(take, &mocap)?;
        }
        return Ok(());
    }
    println!(
        "| take | method | error, mm | by seed | root: depth, mm | sideways | up | root-relative, mm | energy | brought back |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for take in TAKES.iter().filter(|take| wanted.is_none_or(|w| w.split(',').any(|name| name == take.0))) {
        run(take, &methods, seeds, &mocap)?;
    }
    Ok(())
}

fn run(take: &Take, methods: &[&str], seeds: u64, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let file = ScenarioFile::parse(&scenario(take), take.0, PathBuf::new(), &[])?;
    let (set, _) = draw(&file, Some(mocap), &Unwatched)?;
    let mut models = Models::default();
    for method in methods {
        let (kind, overrides) = method.split_once(',').unwrap_or((method, ""));
        let text = scenario(take) + &format!("[tracker.{kind}]\n");
        let overrides = overrides.split(',').filter(|o| !o.is_empty());
        let overrides: Vec<String> = overrides.map(|o| format!("tracker.{kind}.{o}")).collect();
        let settings = ScenarioFile::parse(&text, method, PathBuf::new(), &overrides)?.scenario.tracker();
        let seeds: Vec<u64> = (0..seeds).collect();
        let tracked = track(&set.blind, &settings, &seeds, set.truth.refitted.as_ref(), &mut models, &Unwatched)?;
        println!("{}", row(take.0, method, &set, &tracked));
    }
    Ok(())
}

/// Millimetres a second, over the frames tracked.
fn drift(take: &Take, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let staged = Staged::new(&ScenarioFile::parse(&scenario(take), take.0, PathBuf::new(), &[])?, Some(mocap))?;
    let (body, motion) = (&staged.start.body, &staged.refitted);
    let frames: Vec<LinkFrames> = motion.poses.iter().map(|pose| body.link_frames(pose)).collect();
    let seconds = (frames.len() - 1) as f64 / motion.frames_per_second;
    let shanks = body.foot_links();
    // the last solid of a shank is its foot
    let middle = |foot: usize| body.links[shanks[foot][0]].flesh.last().and_then(Flesh::middle).unwrap_or_default();
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
    let learned = &staged.start.training.motions;
    let chart = PoseChart::learn(body, learned);
    let rows = |motion: &Motion| -> Vec<Vec<f64>> {
        let observed = chart.observe(motion);
        (0..observed.nrows()).map(|t| observed.row(t).iter().copied().collect()).collect()
    };
    let known: Vec<Vec<f64>> = learned.iter().flat_map(rows).collect();
    let apart = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).take(a.len() - ROOT_DIMENSIONS).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let astray = rows(motion).iter().skip(1).fold((0.0, 0.0), |sum: (f64, f64), here| {
        let near = known.iter().min_by(|a, b| apart(a, here).total_cmp(&apart(b, here)));
        let (said, truth) = (chart.planar_step(near.unwrap_or(here)), chart.planar_step(here));
        (sum.0 + said.forward - truth.forward, sum.1 + said.left - truth.left)
    });
    println!(
        "| {} | {:.0} | {:.0} | {:.0} | {:.0} |",
        take.0,
        net(&|foot, _| [middle(foot); 2]),
        net(&|foot, t| [lowest(foot, t), lowest(foot, t + 1)]),
        net(&|foot, _| [ankle(foot); 2]),
        1000.0 * f64::hypot(astray.0, astray.1) / seconds
    );
    Ok(())
}

fn scenario((name, clip, skeleton, learned, tracked): &Take) -> String {
    let part = |[first, last]: &[usize; 2]| {
        format!(
            "clip = \"{clip}\"\nskeleton = \"{skeleton}\"\nfirst_frame = {first}\nlast_frame = {last}\n\
             frames_per_second = 60.0\nsource_hz = 120.0\nup = \"y\"\n"
        )
    };
    format!(
        "schema = \"skiagraph.scenario/1\"\nname = \"{name}\"\n[motion]\n{}[[training.clips]]\n{}[actor]\nrobot = \"actor\"\n\
         [tracker_body]\nrobot = \"tracker25\"\nmismatch = \"standard\"\n[rig.ring]\ncount = 1\nradius_m = 4.5\nheight_m = 1.6\n\
         field_of_view_deg = 57.4\nsize_px = [640, 480]\n",
        part(tracked),
        part(learned)
    )
}

/// Errors of one pose, mm: of the markers, of the root along the camera's view of it, sideways and upwards, and of the markers
/// once the roots lie on each other.
fn errors(set: &BenchmarkSet, frame: usize, pose: &Pose) -> [f64; 5] {
    let body = &set.blind.start.body;
    let truth = &set.truth.ground_truth.frames[frame].markers;
    let of = |pose: &Pose| {
        let markers = body.markers(&body.link_frames(pose));
        let pair = Sequence::of_markers(60.0, std::slice::from_ref(truth), std::slice::from_ref(&markers));
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
    [of(pose), off.dot(&depth).abs(), side.abs(), off.z.abs(), of(&moved)]
}

fn row(take: &str, method: &str, set: &BenchmarkSet, tracked: &Tracked) -> String {
    let mut of_seeds = Vec::new();
    for poses in &tracked.poses.estimates {
        let mut sum = [0.0; 5];
        for (frame, pose) in poses.iter().enumerate().skip(1) {
            sum.iter_mut().zip(errors(set, frame, pose)).for_each(|(s, e)| *s += e / (poses.len() - 1) as f64);
        }
        of_seeds.push(sum);
    }
    let mean = |i: usize| of_seeds.iter().map(|s| s[i]).sum::<f64>() / of_seeds.len() as f64;
    let each: Vec<String> = of_seeds.iter().map(|s| format!("{:.0}", s[0])).collect();
    let records = || tracked.search.iter().flatten();
    let energy = records().filter_map(|r| r.energy).sum::<f64>() / records().count() as f64;
    let recovered: u64 = records().flat_map(|r| &r.occupancy).map(|o| u64::from(o.recovered)).sum();
    format!(
        "| {take} | {method} | **{:.1}** | {} | {:.1} | {:.1} | {:.1} | {:.1} | {energy:.4} | {recovered} |",
        mean(0),
        each.join(" "),
        mean(1),
        mean(2),
        mean(3),
        mean(4)
    )
}
