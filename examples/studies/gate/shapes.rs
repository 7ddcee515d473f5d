//! Differences of runs with normal, skewed or mixed errors: coverage of the intervals, and rate at which the gate
//! passes a run that is worse by the margin.

use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use skiagraph::evaluation::{ClipValues, Interval, IntervalUnit, difference};
use skiagraph::rng::{Purpose, normal, stream};

use crate::error_shapes::ErrorShape;
use crate::interval_rules::{IntervalOfMean, bca, johnson, studentised};

/// Repetitions of a row, and for rules that resample.
const REPETITIONS: u64 = 20_000;
const RESAMPLED: u64 = 4000;
const SEEDS: [usize; 4] = [5, 9, 10, 20];
const SHAPES: [(&str, ErrorShape); 4] = [
    ("normal", ErrorShape::Normal),
    ("log-normal", ErrorShape::LogNormal(0.5)),
    ("exponential", ErrorShape::Exponential),
    ("one in ten lost", ErrorShape::Lost(0.1)),
];

/// All tables.
#[derive(Serialize, Deserialize)]
pub(crate) struct Shapes {
    pub(crate) repetitions: u64,
    pub(crate) resampled: u64,
    pub(crate) rows: Vec<ShapeRow>,
    pub(crate) pairing: Vec<PairingRow>,
    pub(crate) clips: Vec<ClipsRow>,
}

/// One shape, number of seeds and kind of sides.
#[derive(Serialize, Deserialize)]
pub(crate) struct ShapeRow {
    pub(crate) shape: String,
    pub(crate) seeds: usize,
    /// `paired`, `other seeds`, or `one side varies`.
    pub(crate) sides: String,
    /// The rule in use.
    pub(crate) now: Held,
    /// Share of two-sided p values below 5 % without a difference.
    pub(crate) p_below_5_percent: f64,
    /// Share of intervals that contradict their p value.
    pub(crate) contradictions: f64,
    /// For pairs only: rules that were not chosen.
    pub(crate) bca: Option<Held>,
    pub(crate) johnson: Option<Held>,
    pub(crate) studentised: Option<Held>,
}

/// The performance of a rule.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Held {
    /// Share of intervals that cover the true difference.
    pub(crate) covered: f64,
    /// Share of runs worse by exactly the margin that pass: the upper end is below the true difference.
    pub(crate) wrong_passes: f64,
    /// Share of runs worse by exactly the margin that fail.
    pub(crate) wrong_fails: f64,
}

/// Sides that share some of their seeds.
#[derive(Serialize, Deserialize)]
pub(crate) struct PairingRow {
    pub(crate) base: usize,
    pub(crate) other: usize,
    pub(crate) shared: usize,
    pub(crate) between_sides: f64,
    pub(crate) paired: bool,
    /// Share of false alarms at 5 %: of the rule in use, and of the narrower of both intervals.
    pub(crate) alarms: f64,
    pub(crate) narrower_alarms: f64,
}

/// Trackers that differ from motion to motion, but are equal on average over all motions.
#[derive(Serialize, Deserialize)]
pub(crate) struct ClipsRow {
    pub(crate) clips: usize,
    pub(crate) seeds: usize,
    /// Share of false alarms concerning all motions: with intervals over seeds, and over clips.
    pub(crate) over_seeds: f64,
    pub(crate) over_clips: Option<f64>,
}

pub(crate) fn run() -> Shapes {
    let mut rows = Vec::new();
    for (number, shape) in (0..).zip(SHAPES) {
        for seeds in SEEDS {
            for sides in ["paired", "other seeds", "one side varies"] {
                let row = row(number, shape, seeds, sides);
                eprintln!("{} {seeds} {sides}: {:.3}, passes {:.4}", row.shape, row.now.covered, row.now.wrong_passes);
                rows.push(row);
            }
        }
    }
    let designs = [(10, 10, 10), (10, 10, 5), (10, 10, 4), (5, 7, 5), (5, 10, 5), (5, 11, 5), (3, 5, 3), (20, 20, 12)];
    let pairing = designs.into_iter().flat_map(|design| [0.0, 0.5].map(|r| pairing(design, r))).collect();
    let clips = [(1, 20), (2, 10), (3, 5), (5, 5), (6, 10), (10, 5)].map(clips).into();
    Shapes { repetitions: REPETITIONS, resampled: RESAMPLED, rows, pairing, clips }
}

fn row(number: u64, (name, shape): (&str, ErrorShape), seeds: usize, sides: &str) -> ShapeRow {
    let drawn = |repetition: u64| {
        let kind = sides.len() as u64;
        let mut rng = stream(repetition, Purpose::Oracle, number, kind, seeds as u64);
        let constant = sides == "one side varies";
        let side = |rng: &mut ChaCha8Rng, still: bool| -> Vec<f64> {
            (0..seeds).map(|_| if still { shape.mean() } else { shape.draw(rng) }).collect()
        };
        let base = side(&mut rng, constant);
        (base, side(&mut rng, false))
    };
    let found: Vec<(Held, f64, f64)> = (0..REPETITIONS)
        .into_par_iter()
        .filter_map(|repetition| {
            let (base, other) = drawn(repetition);
            let numbered = |values: Vec<f64>, first: u64| (first..).zip(values).collect();
            let paired = sides != "other seeds";
            let clip = ClipValues { base: numbered(base, 0), other: numbered(other, if paired { 0 } else { 1000 }) };
            let found = difference(&[clip], paired, IntervalUnit::Seeds)?;
            let (ends, p) = (found.ci95?, found.p?);
            let excludes_zero = ends.low > 0.0 || ends.high < 0.0;
            Some((held(ends), share(p < 0.05), share((p < 0.05) != excludes_zero)))
        })
        .collect();
    let of_pairs = |rule: IntervalOfMean, repetitions: u64| {
        let all = (0..repetitions).into_par_iter().filter_map(|repetition| {
            let (base, other) = drawn(repetition);
            rule(&base.iter().zip(&other).map(|(a, b)| b - a).collect::<Vec<_>>()).map(held)
        });
        Some(average(&all.collect::<Vec<_>>())).filter(|_| sides != "other seeds")
    };
    let mean = |of: fn(&(Held, f64, f64)) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    ShapeRow {
        shape: name.to_owned(),
        seeds,
        sides: sides.to_owned(),
        now: average(&found.iter().map(|(held, ..)| *held).collect::<Vec<_>>()),
        p_below_5_percent: mean(|(_, alarm, _)| *alarm),
        contradictions: mean(|(.., contradiction)| *contradiction),
        bca: of_pairs(bca, RESAMPLED),
        johnson: of_pairs(johnson, REPETITIONS),
        studentised: of_pairs(studentised, RESAMPLED),
    }
}

fn share(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// The true difference is 0; a run worse by the margin shifts interval and margin equally.
fn held(ends: Interval) -> Held {
    Held {
        covered: share(ends.low <= 0.0 && 0.0 <= ends.high),
        wrong_passes: share(ends.high <= 0.0),
        wrong_fails: share(ends.low > 0.0),
    }
}

fn average(all: &[Held]) -> Held {
    let mean = |of: fn(&Held) -> f64| all.iter().map(of).sum::<f64>() / all.len().max(1) as f64;
    Held { covered: mean(|h| h.covered), wrong_passes: mean(|h| h.wrong_passes), wrong_fails: mean(|h| h.wrong_fails) }
}

/// Normal errors; those of a seed are correlated by `between_sides` between the sides.
fn pairing((base, other, shared): (usize, usize, usize), between_sides: f64) -> PairingRow {
    let numbers = |from: usize, count: usize| (from as u64..(from + count) as u64).collect::<Vec<u64>>();
    let (base_seeds, other_seeds) = (numbers(0, base), numbers(base - shared, other));
    let paired = skiagraph::evaluation::should_pair(&base_seeds, &other_seeds);
    let found: Vec<[f64; 2]> = (0..REPETITIONS)
        .into_par_iter()
        .filter_map(|repetition| {
            let key = (base * 10_000 + other * 100 + shared) as u64 * 10 + (2.0 * between_sides) as u64;
            let mut rng = stream(repetition, Purpose::Oracle, 1000, 0, key);
            let common: Vec<f64> = (0..base + other).map(|_| normal(&mut rng)).collect();
            let mut side = |seeds: &[u64]| -> Vec<(u64, f64)> {
                let of = |seed: &u64| {
                    let own = (1.0 - between_sides).sqrt() * normal(&mut rng);
                    (*seed, 30.0 + between_sides.sqrt() * common[*seed as usize] + own)
                };
                seeds.iter().map(of).collect()
            };
            let clip = [ClipValues { base: side(&base_seeds), other: side(&other_seeds) }];
            let ends = |paired: bool| difference(&clip, paired, IntervalUnit::Seeds)?.ci95;
            let alarms = |ends: Interval| share(ends.low > 0.0 || ends.high < 0.0);
            let width = |ends: &Interval| ends.high - ends.low;
            let both = [ends(true), ends(false)].into_iter().flatten();
            let narrower = both.min_by(|a, b| width(a).total_cmp(&width(b)))?;
            Some([alarms(ends(paired)?), alarms(narrower)])
        })
        .collect();
    let mean = |at: usize| found.iter().map(|alarms| alarms[at]).sum::<f64>() / found.len() as f64;
    PairingRow { base, other, shared, between_sides, paired, alarms: mean(0), narrower_alarms: mean(1) }
}

/// The trackers differ by 3 mm (standard deviation) from motion to motion, and seeds of one motion by 1 mm.
fn clips((clips, seeds): (usize, usize)) -> ClipsRow {
    let found: Vec<[Option<f64>; 2]> = (0..REPETITIONS)
        .into_par_iter()
        .map(|repetition| {
            let mut rng = stream(repetition, Purpose::Oracle, 2000, 0, (clips * 100 + seeds) as u64);
            let of_clip = |rng: &mut ChaCha8Rng| {
                let differs = 3.0 * normal(rng);
                let mut side = |by: f64| (0..seeds as u64).map(|seed| (seed, 30.0 + by + normal(rng))).collect();
                ClipValues { base: side(0.0), other: side(differs) }
            };
            let drawn: Vec<ClipValues> = (0..clips).map(|_| of_clip(&mut rng)).collect();
            let average = |values: &[(u64, f64)]| values.iter().map(|(_, v)| v).sum::<f64>() / values.len() as f64;
            let means = |side: fn(&ClipValues) -> &Vec<(u64, f64)>| {
                (0..).zip(drawn.iter().map(|clip| average(side(clip)))).collect()
            };
            let of_clips = [ClipValues { base: means(|clip| &clip.base), other: means(|clip| &clip.other) }];
            let alarm = |clips: &[ClipValues], unit| {
                let ends = difference(clips, true, unit)?.ci95?;
                Some(share(ends.low > 0.0 || ends.high < 0.0))
            };
            [alarm(&drawn, IntervalUnit::Seeds), alarm(&of_clips, IntervalUnit::Clips)]
        })
        .collect();
    let mean = |at: usize| {
        let all: Option<Vec<f64>> = found.iter().map(|alarms| alarms[at]).collect();
        all.map(|all| all.iter().sum::<f64>() / all.len() as f64)
    };
    ClipsRow { clips, seeds, over_seeds: mean(0).unwrap_or(f64::NAN), over_clips: mean(1) }
}
