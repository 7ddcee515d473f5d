//! Stress conditions: corrupted silhouettes, or a worse start, frame rate or set of cameras.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use skiagraph::body::{Humanoid, Pose};
use skiagraph::observation::Observation;
use skiagraph::raster::{Mask, contour};
use skiagraph::rng::{Purpose, stream};

/// A condition; the reference is four clean views at 60 Hz from the true start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Condition {
    Clean,
    /// Two opposite cameras.
    TwoViews,
    /// Two cameras at a right angle.
    TwoViewsAcross,
    At15Hz,
    /// Normal errors with a deviation of 0.3 rad in every joint angle of the start pose.
    BadStart,
    /// 10 % of the boundary pixels moved by up to 3 pixels, 2 % of the silhouette in holes.
    Segmented,
    Eroded,
    Dilated,
    /// The second camera's masks are empty.
    CameraMissing,
    /// A box 0.7 m wide and 1 m high, 1.2 m beside the start.
    Occluded,
}

impl Condition {
    pub(crate) const STRESS: [Self; 9] = [
        Self::TwoViews,
        Self::TwoViewsAcross,
        Self::At15Hz,
        Self::BadStart,
        Self::Segmented,
        Self::Eroded,
        Self::Dilated,
        Self::CameraMissing,
        Self::Occluded,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Clean => "four clean views",
            Self::TwoViews => "two views, opposite",
            Self::TwoViewsAcross => "two views, at a right angle",
            Self::At15Hz => "15 Hz",
            Self::BadStart => "start off by 0.3 rad a joint",
            Self::Segmented => "boundaries moved, holes",
            Self::Eroded => "eroded by 1 px",
            Self::Dilated => "dilated by 1 px",
            Self::CameraMissing => "one of four cameras blank",
            Self::Occluded => "a box in the way",
        }
    }

    pub(crate) fn frames_per_second(self) -> f64 {
        if self == Self::At15Hz { 15.0 } else { 60.0 }
    }

    /// Overrides of the scenario.
    pub(crate) fn overrides(self) -> Vec<String> {
        match self {
            Self::TwoViews => vec!["rig.ring.count=2".to_owned()],
            Self::Occluded => {
                let prop = "prop=[{ name = \"box\", shape = { box = { size_m = [0.7, 0.7, 1.0] } }, place_m = [0.3, -1.2, 0.5] }]";
                ["motion.start_m=[0.0, 0.0]", "motion.heading_deg=0.0", prop].map(str::to_owned).to_vec()
            }
            _ => Vec::new(),
        }
    }

    /// Number of cameras kept of the rig.
    pub(crate) fn cameras(self) -> usize {
        if self == Self::TwoViewsAcross { 2 } else { usize::MAX }
    }

    pub(crate) fn start(self, body: &Humanoid, start: &Pose, seed: u64) -> Pose {
        let mut start = start.clone();
        if self == Self::BadStart {
            let mut random = stream(seed, Purpose::StartPose, 0, 0, 0);
            for (angle, limits) in start.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
                let noise: f64 = StandardNormal.sample(&mut random);
                *angle = (*angle + 0.3 * noise).clamp(limits.lower, limits.upper);
            }
        }
        start
    }

    pub(crate) fn corrupt(self, seen: Observation) -> Observation {
        let frame = seen.frame as u64;
        let corrupted = |(camera, mask): (usize, Mask)| match self {
            Self::Segmented => segmented(&mask, frame, camera as u64),
            Self::Eroded => grown(&mask, false),
            Self::Dilated => grown(&mask, true),
            Self::CameraMissing if camera == 1 => Mask::new(mask.width(), mask.height()),
            _ => mask,
        };
        let silhouettes = seen.silhouettes.into_iter().enumerate().map(corrupted).collect();
        Observation { silhouettes, ..seen }
    }
}

/// A mask dilated or eroded by a pixel, with four neighbours.
fn grown(mask: &Mask, add: bool) -> Mask {
    let is_set = |x: i64, y: i64| {
        let inside = (0..i64::from(mask.width())).contains(&x) && (0..i64::from(mask.height())).contains(&y);
        if inside { mask.get(x as u32, y as u32) } else { !add }
    };
    Mask::from_fn(mask.width(), mask.height(), |x, y| {
        let (x, y) = (i64::from(x), i64::from(y));
        let mut around =
            [(x, y), (x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)].map(|(x, y)| is_set(x, y)).into_iter();
        if add { around.any(|set| set) } else { around.all(|set| set) }
    })
}

fn segmented(mask: &Mask, frame: u64, camera: u64) -> Mask {
    let mut random = stream(1, Purpose::Corruption, frame, camera, 0);
    let mut corrupted = mask.clone();
    for (x, y) in contour(mask).pixels() {
        if random.random::<f64>() < 0.1 {
            let (radius, value) = (random.random_range(1.0..3.0), random.random());
            stamp(&mut corrupted, x, y, radius, value);
        }
    }
    let inside: Vec<(u32, u32)> = mask.pixels().collect();
    let mut holes = 0.02 * inside.len() as f64;
    while holes > 0.0 && !inside.is_empty() {
        let (x, y) = inside[random.random_range(0..inside.len())];
        let radius: f64 = random.random_range(0.5..3.0);
        stamp(&mut corrupted, x, y, radius, false);
        holes -= std::f64::consts::PI * radius * radius;
    }
    corrupted
}

fn stamp(mask: &mut Mask, x: u32, y: u32, radius: f64, value: bool) {
    let reach = radius.floor() as i64;
    for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
        let (u, v) = (i64::from(x) + dx, i64::from(y) + dy);
        let inside = u >= 0 && v >= 0 && u < i64::from(mask.width()) && v < i64::from(mask.height());
        if inside && ((dx * dx + dy * dy) as f64) <= radius * radius {
            mask.set(u as u32, v as u32, value);
        }
    }
}
