//! Penetration depths of a pose, including kinematics, in poses per second on one thread; and the cost of the
//! plausibility term in a frame of the annealed particle filter. `cargo bench --bench plausibility`
//!
//! The cost is a small difference of large times, which on a shared machine is lost in noise if they are measured one
//! after the other. Frames with and without the term are therefore tracked alternately, and the quartiles of their
//! ratio are printed (`SKIAGRAPH_PAIRS`, default 400; 0 skips this).
//!
//! The body with sixteen capsules is tracker25 without its head and one capsule of the trunk, with plain instead of
//! tapered capsules. The ground and all pairs that are neither adjacent nor touch in the bind pose are tested. Poses
//! are those of `benches/silhouette.rs`.

#[path = "scene/jittered.rs"]
mod jittered;
mod scene;

use divan::Bencher;
use divan::counter::ItemsCount;
use jittered::jittered;
use scene::{filter, ring, seen, tracker25};
use skiagraph_core::body::{Humanoid, LinkFrames, Pose, Solid};
use skiagraph_core::contact::{Interpenetration, InterpenetrationScratch, SelfCollision};
use skiagraph_core::raster::TaperedCapsule;
use skiagraph_track::tracker::{PlausibilitySettings, SilhouetteLikelihood, SilhouetteSettings, Tracker};

fn main() {
    let body = sixteen_capsules();
    let pairs = SelfCollision::new(&body);
    println!("sixteen capsules: {} pairs, {} excluded", pairs.pairs().len(), pairs.left_out().len());
    let pairs = std::env::var("SKIAGRAPH_PAIRS").map_or(400, |number| number.parse().expect("a number of pairs"));
    if pairs > 0 && std::env::args().any(|argument| argument == "--bench") {
        rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(|| cost_of_the_term(pairs));
    }
    divan::main();
}

/// Prints the quartiles of the ratio of frame times with and without the term, one thread, 160x120; and of the ratio of
/// two frames without it, which indicates the noise.
fn cost_of_the_term(pairs: usize) {
    let (body, rig) = (tracker25(), ring([160, 120]));
    let seen = seen(&body, &rig);
    let silhouettes =
        || SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default()).expect("valid settings");
    let with_the_term = silhouettes().with_plausibility(PlausibilitySettings::default()).expect("valid settings");
    let (mut plain, mut plausible) = (filter(200, &body, silhouettes()), filter(200, &body, with_the_term));
    let mut other = filter(200, &body, silhouettes());
    let run: [&mut dyn Tracker; 3] = [&mut plain, &mut plausible, &mut other];
    let mut ratios = [Vec::new(), Vec::new()];
    for pair in 0..pairs {
        let mut seconds = [0.0; 3];
        for turn in 0..3 {
            let which = (turn + pair) % 3; // each is first, second and third equally often
            let start = std::time::Instant::now();
            divan::black_box(run[which].track(&seen)).expect("an observation of this rig");
            seconds[which] = start.elapsed().as_secs_f64();
        }
        ratios[0].push(seconds[1] / seconds[0]);
        ratios[1].push(seconds[2] / seconds[0]);
    }
    for (name, ratios) in ["time with the term / without", "time without / without"].iter().zip(&mut ratios) {
        ratios.sort_by(f64::total_cmp);
        let at = |share: f64| ratios[(ratios.len() as f64 * share) as usize];
        println!("{name}: {:.3}, quartiles {:.3} to {:.3}, {pairs} frames each", at(0.5), at(0.25), at(0.75));
    }
}

const POSES: u64 = 256;

fn sixteen_capsules() -> Humanoid {
    let mut body = tracker25();
    let links: Vec<usize> = (0..body.links.len()).filter(|&link| !body.links[link].solids.is_empty()).collect();
    let mut surplus = body.links.iter().map(|link| link.solids.len()).sum::<usize>() - 16;
    for link in links {
        let solid = &mut body.links[link].solids;
        while surplus > 0 && solid.len() > 2 {
            solid.pop();
            surplus -= 1;
        }
        for solid in solid {
            if let Solid::TaperedCapsule(c) = solid {
                *c = TaperedCapsule { radius_b: c.radius_a, ..*c };
            }
        }
    }
    assert_eq!(body.links.iter().map(|link| link.solids.len()).sum::<usize>(), 16);
    body
}

/// Kinematics only.
#[divan::bench]
fn kinematics(bencher: Bencher<'_, '_>) {
    let body = tracker25();
    let poses: Vec<Pose> = (0..POSES).map(|index| jittered(&body, index)).collect();
    let mut frames = LinkFrames::default();
    bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
        for pose in &poses {
            body.link_frames_into(divan::black_box(pose), &mut frames);
            divan::black_box(&frames);
        }
    });
}

fn depths(bencher: Bencher<'_, '_>, body: &Humanoid) {
    let solids = Interpenetration::new(body, 0.01);
    let poses: Vec<Pose> = (0..POSES).map(|index| jittered(body, index)).collect();
    let (mut frames, mut scratch) = (LinkFrames::default(), InterpenetrationScratch::default());
    bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
        for pose in &poses {
            body.link_frames_into(divan::black_box(pose), &mut frames);
            divan::black_box(solids.depths(&frames, &mut scratch));
        }
    });
}

#[divan::bench]
fn depths_of_sixteen_capsules(bencher: Bencher<'_, '_>) {
    depths(bencher, &sixteen_capsules());
}

#[divan::bench]
fn depths_of_tracker25(bencher: Bencher<'_, '_>) {
    depths(bencher, &tracker25());
}

/// One frame repeatedly, 200 particles x 5 layers x 4 views.
fn frames(bencher: Bencher<'_, '_>, size: [u32; 2], plausibility: Option<PlausibilitySettings>) {
    let (body, rig) = (tracker25(), ring(size));
    let seen = seen(&body, &rig);
    let mut likelihood =
        SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default()).expect("valid settings");
    if let Some(settings) = plausibility {
        likelihood = likelihood.with_plausibility(settings).expect("valid settings");
    }
    let mut filter = filter(200, &body, likelihood);
    bencher.bench_local(|| filter.track(divan::black_box(&seen)));
}

#[divan::bench(args = [[160, 120], [640, 480]], sample_count = 40)]
fn frame_without(bencher: Bencher<'_, '_>, size: [u32; 2]) {
    frames(bencher, size, None);
}

#[divan::bench(args = [[160, 120], [640, 480]], sample_count = 40)]
fn frame_with_the_term(bencher: Bencher<'_, '_>, size: [u32; 2]) {
    frames(bencher, size, Some(PlausibilitySettings::default()));
}
