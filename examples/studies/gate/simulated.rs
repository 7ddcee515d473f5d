//! Simulated runs with a known true difference: an error per seed, and correlated frames.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use skiagraph::evaluation::{ClipValues, DifferenceRule, IntervalUnit, difference};
use skiagraph::rng::{Purpose, stream};

/// Repetitions of every row.
const REPETITIONS: u64 = 2000;
/// Standard deviation between seeds, mm.
const SEED_SD: f64 = 3.0;
/// Standard deviation of the frames of a run, mm, and their correlation from frame to frame.
const FRAME_SD: f64 = 8.0;
const CORRELATION: f64 = 0.95;
const FRAMES: usize = 529;
const MARGIN: f64 = 2.0;

/// All rows, and what they were drawn from.
#[derive(Serialize, Deserialize)]
pub(crate) struct Simulated {
    pub(crate) repetitions: u64,
    pub(crate) seed_sd_mm: f64,
    pub(crate) frame_sd_mm: f64,
    pub(crate) frame_correlation: f64,
    pub(crate) frames: usize,
    pub(crate) margin_mm: f64,
    pub(crate) rows: Vec<Row>,
}

/// One design.
#[derive(Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) clips: usize,
    pub(crate) seeds: usize,
    /// Paired by seed, else with other seeds.
    pub(crate) paired: bool,
    /// Correlation of the seeds' own errors between the two sides.
    pub(crate) between_sides: f64,
    /// Share of repetitions whose 95 % interval covers the true difference.
    pub(crate) covered: f64,
    /// Without a true difference: share that fails at a margin of 0 and at 2 mm, and that passes at 2 mm.
    pub(crate) null_fails_at_0: f64,
    pub(crate) null_fails_at_margin: f64,
    pub(crate) null_passes: f64,
    /// Worse by exactly the margin: share that fails, and that passes.
    pub(crate) at_margin_fails: f64,
    pub(crate) at_margin_passes: f64,
    /// Worse by twice the margin: share that fails, and that passes.
    pub(crate) twice_fails: f64,
    pub(crate) twice_passes: f64,
    /// For comparison: without a true difference, share in which a paired t test over all frames finds one.
    pub(crate) frames_test_alarms: f64,
}

pub(crate) fn run() -> Simulated {
    let mut rows = Vec::new();
    for (clips, seeds) in [(1, 5), (1, 10), (6, 5), (6, 10), (6, 20)] {
        for (paired, between_sides) in [(false, 0.0), (true, 0.0), (true, 0.5)] {
            let row = row(clips, seeds, paired, between_sides);
            eprintln!("{clips} x {seeds}, paired {paired} {between_sides}: covered {:.3}", row.covered);
            rows.push(row);
        }
    }
    Simulated {
        repetitions: REPETITIONS,
        seed_sd_mm: SEED_SD,
        frame_sd_mm: FRAME_SD,
        frame_correlation: CORRELATION,
        frames: FRAMES,
        margin_mm: MARGIN,
        rows,
    }
}

/// The result of one repetition.
#[derive(Clone, Copy, Default)]
struct Found {
    covered: f64,
    counts: [f64; 8],
}

fn row(clips: usize, seeds: usize, paired: bool, between_sides: f64) -> Row {
    let found: Vec<Found> = (0..REPETITIONS)
        .into_par_iter()
        .map(|repetition| {
            let key = (clips * 100 + seeds) as u64 * 10 + u64::from(paired) * 5 + (2.0 * between_sides) as u64;
            let mut rng = stream(repetition, Purpose::Oracle, 0, 0, key);
            repetition_of(clips, seeds, paired, between_sides, &mut rng)
        })
        .collect();
    let mean = |of: &dyn Fn(&Found) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    let count = |index: usize| mean(&|found: &Found| found.counts[index]);
    Row {
        clips,
        seeds,
        paired,
        between_sides,
        covered: mean(&|found: &Found| found.covered),
        null_fails_at_0: count(0),
        null_fails_at_margin: count(1),
        null_passes: count(2),
        at_margin_fails: count(3),
        at_margin_passes: count(4),
        twice_fails: count(5),
        twice_passes: count(6),
        frames_test_alarms: count(7),
    }
}

fn repetition_of(clips: usize, seeds: usize, paired: bool, between_sides: f64, rng: &mut impl Rng) -> Found {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let (mut all, mut frame_sums) = (Vec::new(), FrameSums::default());
    for clip in 0..clips {
        let level = 30.0 + 5.0 * clip as f64;
        let mut values = ClipValues::default();
        for seed in 0..seeds as u64 {
            let common = normal();
            let mut own = || SEED_SD * (between_sides.sqrt() * common + (1.0 - between_sides).sqrt() * normal());
            let (a, b) = (own(), own());
            let (one, other) = (frames(&mut normal), frames(&mut normal));
            frame_sums.add(one.iter().zip(&other).map(|(x, y)| (b + y) - (a + x)));
            let mean = |frames: &[f64]| frames.iter().sum::<f64>() / frames.len() as f64;
            values.base.push((seed, level + a + mean(&one)));
            values.other.push((if paired { seed } else { 1000 + seed }, level + b + mean(&other)));
        }
        all.push(values);
    }
    let Some(found) = difference(&all, paired, IntervalUnit::Seeds) else { return Found::default() };
    let Some(ends) = found.ci95 else { return Found::default() };
    assert!(found.rule != DifferenceRule::Exact);
    // a true difference only shifts the interval
    let fails = |shift: f64, margin: f64| f64::from(u8::from(ends.low + shift > margin));
    let passes = |shift: f64| f64::from(u8::from(ends.high + shift <= MARGIN));
    Found {
        covered: f64::from(u8::from(ends.low <= 0.0 && 0.0 <= ends.high)),
        counts: [
            fails(0.0, 0.0),
            fails(0.0, MARGIN),
            passes(0.0),
            fails(MARGIN, MARGIN),
            passes(MARGIN),
            fails(2.0 * MARGIN, MARGIN),
            passes(2.0 * MARGIN),
            f64::from(u8::from(frame_sums.alarms())),
        ],
    }
}

/// Frames of a run about its mean: an autoregressive process of first order.
fn frames(normal: &mut impl FnMut() -> f64) -> Vec<f64> {
    let step = (1.0 - CORRELATION * CORRELATION).sqrt() * FRAME_SD;
    let mut value = FRAME_SD * normal();
    let mut all = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        all.push(value);
        value = CORRELATION * value + step * normal();
    }
    all
}

#[derive(Default)]
struct FrameSums {
    count: f64,
    sum: f64,
    squares: f64,
}

impl FrameSums {
    fn add(&mut self, differences: impl Iterator<Item = f64>) {
        for difference in differences {
            self.count += 1.0;
            self.sum += difference;
            self.squares += difference * difference;
        }
    }

    /// A paired t test over frames as if they were independent, two-sided 5 %.
    fn alarms(&self) -> bool {
        let mean = self.sum / self.count;
        let variance = (self.squares - self.count * mean * mean) / (self.count - 1.0);
        (mean / (variance / self.count).sqrt()).abs() > 1.96
    }
}
