//! Durations for which simulated recordings stay upright, and residual wrenches: regenerates `results/simulation.md`
//! and `results/simulation.json`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- simulation`, where DIR holds CMU's clips and their
//! skeletons, in itself or in `DIR/cmu_asf_amc`. Nothing in it is random, and no figure depends on the number of cores.
//! Without DIR nothing is written.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;
use skiagraph::body::{Motion, shipped};
use skiagraph::mocap::{ReadOptions, read};
use skiagraph::physics::{SimulationSettings, simulate};
use skiagraph::retarget::{RetargetOptions, Retargeted, retarget};

/// Kind of motion, clip, and whether constants of the control were chosen on it.
const CLIPS: [(&str, &str, bool); 25] = [
    ("walk", "02_01", false),
    ("walk", "16_15", true),
    ("walk", "16_17", false),
    ("walk", "16_22", true),
    ("walk", "35_02", false),
    ("walk", "35_08", false),
    ("walk", "35_34", true),
    ("walk", "49_01", true),
    ("walk", "humanoid3d_walk", true),
    ("dance", "cmu_3dsmax_131_01", true),
    ("run", "02_03", false),
    ("run", "16_35", false),
    ("run", "16_36", true),
    ("run", "16_45", false),
    ("run", "humanoid3d_run", false),
    ("run to a stop", "16_08", true),
    ("run to a stop", "16_57", true),
    ("jump", "16_03", true),
    ("jump", "02_04", false),
    ("jump", "01_01_f0001-0700", false),
    ("jump", "humanoid3d_jump", false),
    ("jog on the spot", "14_14_f0401-1100", false),
    ("sit and rise", "14_27_f0001-0900", true),
    ("gesture", "29_02_f1201-2340", false),
    ("gesture", "14_24", false),
];
/// Bounds of the residual root wrench, body weights; the last is the greatest that a scenario may allow.
const BOUNDS: [f64; 4] = [0.0, 0.05, 0.2, 10.0];
/// Longest part of a recording that is simulated, seconds.
const MAX_DURATION_S: f64 = 10.0;

/// One simulation.
#[derive(Clone, Serialize)]
struct Case {
    kind: &'static str,
    clip: &'static str,
    /// Whether constants of the control were chosen on this clip.
    chosen_on: bool,
    robot: &'static str,
    frames_per_second: f64,
    /// Share of the recording that is omitted at its beginning.
    from: f64,
}

#[derive(Serialize)]
struct Outcome {
    #[serde(flatten)]
    case: Case,
    bound_percent: f64,
    duration_s: f64,
    /// `null` if it stayed upright.
    fell_at_s: Option<f64>,
    root_wrench_percent_mean: f64,
    root_wrench_percent_most: f64,
    skate_mm_per_s: f64,
    /// Root of the mean square distance of joints from the recording until the fall.
    joints_off_mm_rms: f64,
}

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a directory with CMU's clips and their .asf files");
        return Ok(());
    };
    let outcomes: Result<Vec<Vec<Outcome>>, String> =
        cases().into_par_iter().map(|case| outcomes(&mocap, case).map_err(|e| e.to_string())).collect();
    let outcomes: Vec<Outcome> = outcomes?.into_iter().flatten().collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    std::fs::write(folder.join("simulation.json"), serde_json::to_string_pretty(&outcomes)? + "\n")?;
    std::fs::write(folder.join("simulation.md"), page(&outcomes)?)?;
    Ok(())
}

/// All clips at 60 Hz on the actor and on `tracker25`; and the walks at other rates and from later starting points.
fn cases() -> Vec<Case> {
    let case = |(kind, clip, chosen_on), robot, frames_per_second, from| Case {
        kind,
        clip,
        chosen_on,
        robot,
        frames_per_second,
        from,
    };
    let walks = || CLIPS.into_iter().filter(|(kind, ..)| *kind == "walk");
    let mut cases: Vec<Case> = CLIPS.into_iter().map(|clip| case(clip, "actor", 60.0, 0.0)).collect();
    cases.extend(CLIPS.into_iter().map(|clip| case(clip, "tracker25", 60.0, 0.0)));
    cases.extend([30.0, 120.0].into_iter().flat_map(|rate| walks().map(move |clip| case(clip, "actor", rate, 0.0))));
    cases.extend([0.2, 0.4].into_iter().flat_map(|from| walks().map(move |clip| case(clip, "actor", 60.0, from))));
    cases
}

fn outcomes(mocap: &Path, case: Case) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let retargeted = retargeted(mocap, &case)?;
    let mut outcomes = Vec::new();
    for bound in BOUNDS {
        let settings = SimulationSettings { root_wrench: bound, ..SimulationSettings::default() };
        let found = simulate(&retargeted.humanoid, &retargeted.motion, &settings)?;
        let report = &found.report;
        eprintln!("{} ({}), bound {bound}: {report}", case.clip, case.robot);
        outcomes.push(Outcome {
            case: case.clone(),
            bound_percent: 100.0 * bound,
            duration_s: report.duration_s,
            fell_at_s: report.fell_at_s,
            root_wrench_percent_mean: 100.0 * report.root_wrench_mean,
            root_wrench_percent_most: 100.0 * report.root_wrench_most,
            skate_mm_per_s: report.quality.skate_mm_per_s,
            joints_off_mm_rms: off_mm(&retargeted, &found.motion, report.fell_at_frame),
        });
    }
    Ok(outcomes)
}

/// A recording on a robot, as in a scenario: cut or repeated, resampled, then retargeted.
fn retargeted(mocap: &Path, case: &Case) -> Result<Retargeted, Box<dyn Error>> {
    let clip = read(&find(mocap, case.clip)?, &ReadOptions::default())?.without_inserted_rest_pose();
    let is_cycle = ["humanoid3d_walk", "humanoid3d_run"].contains(&case.clip);
    let clip = if is_cycle { clip.looped(5.0)? } else { clip };
    let first = (case.from * clip.frames.len() as f64) as usize;
    let last = clip.frames.len().min(first + (MAX_DURATION_S * clip.frames_per_second) as usize);
    let clip = clip.crop(first..last)?.resampled(case.frames_per_second)?;
    Ok(retarget(&clip, &shipped(case.robot)?, &RetargetOptions::default())?)
}

fn find(mocap: &Path, clip: &str) -> Result<PathBuf, String> {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions");
    let places = [
        mocap.join(format!("cmu_asf_amc/{clip}.amc")),
        mocap.join(format!("{clip}.amc")),
        mocap.join(format!("bvh/{clip}.bvh")),
        mocap.join(format!("{clip}.bvh")),
        shipped.join(format!("{clip}.txt")),
    ];
    places.into_iter().find(|path| path.exists()).ok_or(format!("no {clip} below {}", mocap.display()))
}

/// Root of the mean square distance of joints from the recording before the fall, mm.
fn off_mm(retargeted: &Retargeted, simulated: &Motion, fell_at: Option<usize>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    let pairs = retargeted.motion.poses.iter().zip(&simulated.poses);
    for (a, b) in pairs.take(fell_at.unwrap_or(usize::MAX).max(1)) {
        let [a, b] = [a, b].map(|pose| retargeted.humanoid.link_frames(pose));
        for (a, b) in a.0.iter().zip(&b.0) {
            sum += (a.translation.vector - b.translation.vector).norm_squared();
            count += 1;
        }
    }
    1000.0 * (sum / count.max(1) as f64).sqrt()
}

/// Number of simulations in a group that stay upright with a bound, and size of the group.
fn up(outcomes: &[Outcome], is_in: fn(&Case) -> bool, bound: f64) -> (usize, usize) {
    let of: Vec<&Outcome> = outcomes.iter().filter(|o| is_in(&o.case) && o.bound_percent == 100.0 * bound).collect();
    (of.iter().filter(|o| o.fell_at_s.is_none()).count(), of.len())
}

fn page(outcomes: &[Outcome]) -> Result<String, std::fmt::Error> {
    let share = |group: usize, bound: f64| {
        let (up, of) = up(outcomes, groups()[group].1, bound);
        format!("{up} of {of}")
    };
    let mut page = format!(
        "# Simulated recordings\n\n\
         Of the simulated walks of `actor`, {} stay upright with a residual root wrench of at most 5 % of body weight, {} with 20 %, and {} \
         without a wrench. Of all its clips, {} stay upright with 20 %, and {} without a wrench. On `tracker25`, which has no ankles, \
         {} walks and {} clips stay upright with 20 %.\n\n\
         ## How many stay upright\n\n\
         | group | clips | 0 % | 5 % | 20 % | 1000 % |\n|---|---|---|---|---|---|\n",
        share(0, 0.05),
        share(0, 0.2),
        share(0, 0.0),
        share(6, 0.2),
        share(6, 0.0),
        share(8, 0.2),
        share(9, 0.2),
    );
    for (name, is_in) in groups() {
        let counts = BOUNDS.map(|bound| up(outcomes, is_in, bound).0.to_string()).join(" | ");
        writeln!(page, "| {name} | {} | {counts} |", up(outcomes, is_in, 0.0).1)?;
    }
    page += "\nThe columns are bounds of the residual root wrench (`root_wrench`) in % of body weight. The wrench is the norm of its force and of \
             its moment over the height of the centre of mass at the start; 1000 % is the most that a scenario may allow. A body has \
             fallen when its centre of mass is below three quarters of that of the motion. The control was tuned on the clips with a \
             star, which are therefore no independent test; [`contact.md`](contact.md) describes the control and its tuning.\n\n\
             ## All simulations\n\n\
             The last column compares joints with the recording, not with the planted motion, until the fall.\n\n\
             | motion | bound % | upright s | residual root wrench % (mean, most) | skate mm/s | joints from the recording until the fall, mm (rms) |\n\
             |---|---|---|---|---|---|\n";
    for o in outcomes {
        let wrench = format!("{:.1}, {:.1}", o.root_wrench_percent_mean, o.root_wrench_percent_most);
        writeln!(
            page,
            "| {} | {:.0} | {} | {wrench} | {:.1} | {:.1} |",
            name(&o.case),
            o.bound_percent,
            upright_time(o),
            o.skate_mm_per_s.abs(),
            o.joints_off_mm_rms
        )?;
    }
    page += "\n## Method\n\n\
             `[actor] contact = \"simulate\"` for recordings on two of the included robots: 480 steps a second, friction 0.8, at most 10 s \
             of each recording; the walk and the run of DeepMimic are repeated to 5 s. Nothing is random.\n\n\
             Made by `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- simulation`; all digits are in `simulation.json`.\n";
    Ok(page)
}

type Group = (&'static str, fn(&Case) -> bool);

/// Groups of simulations that are counted together.
fn groups() -> [Group; 10] {
    fn plain(case: &Case, robot: &str) -> bool {
        case.robot == robot && case.frames_per_second == 60.0 && case.from == 0.0
    }
    [
        ("actor: walks", |c| plain(c, "actor") && c.kind == "walk"),
        ("... of these, not used for tuning", |c| plain(c, "actor") && c.kind == "walk" && !c.chosen_on),
        ("... at 30 and 120 Hz", |c| c.frames_per_second != 60.0),
        ("... starting at a fifth and two fifths of their length", |c| c.from > 0.0),
        ("actor: jumps", |c| plain(c, "actor") && c.kind == "jump"),
        ("actor: runs and runs to a stop", |c| plain(c, "actor") && c.kind.starts_with("run")),
        ("actor: all clips", |c| plain(c, "actor")),
        ("... of these, not used for tuning", |c| plain(c, "actor") && !c.chosen_on),
        ("tracker25, which has no ankles: walks", |c| plain(c, "tracker25") && c.kind == "walk"),
        ("tracker25: all clips", |c| plain(c, "tracker25")),
    ]
}

fn name(case: &Case) -> String {
    let mut name = format!("{}{} ({}", case.clip, if case.chosen_on { " *" } else { "" }, case.kind);
    if case.robot != "actor" {
        name += &format!(", {}", case.robot);
    }
    if case.frames_per_second != 60.0 {
        name += &format!(", {} Hz", case.frames_per_second);
    }
    if case.from > 0.0 {
        name += &format!(", from {:.0} %", 100.0 * case.from);
    }
    name + ")"
}

fn upright_time(o: &Outcome) -> String {
    match o.fell_at_s {
        Some(at) => format!("{at:.2} of {:.2}, fell", o.duration_s),
        None => format!("**{0:.2}** of {0:.2}", o.duration_s),
    }
}
