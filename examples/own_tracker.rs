//! Runs a custom tracker on a set, without access to the truth, and measures it.
//!
//! ```sh
//! cargo run --release --example own_tracker
//! ```
//!
//! The tracker is a simple coordinate search: it changes one coordinate of the pose at a time, and keeps changes that
//! reduce the energy of the silhouettes. Any implementation of [`Tracker`] can replace it.

use std::error::Error;

use skiagraph::{ScenarioFile, measure, render, track};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::observation::Observation;
use skiagraph_track::tracker::{Estimate, Likelihood, SilhouetteLikelihood, SilhouetteSettings, TrackError, Tracker};

/// Step sizes, metres and radians, in order of use.
const STEPS: [f64; 3] = [0.06, 0.02, 0.007];

/// Searches along every coordinate of the pose.
struct CoordinateSearch {
    body: Humanoid,
    likelihood: SilhouetteLikelihood,
    pose: Pose,
}

impl Tracker for CoordinateSearch {
    fn name(&self) -> &str {
        "coordinate_search"
    }

    fn start(&mut self, start: &Pose) {
        self.pose = start.clone();
    }

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        self.likelihood.prepare(observation)?;
        let mut scratch = self.likelihood.scratch();
        let mut energy = self.likelihood.energy(&self.pose, &mut scratch);
        let mut evaluations = 1;
        // position and orientation of the root, then the joint angles
        let coordinates = 6 + self.body.degrees_of_freedom.len();
        for size in STEPS {
            for coordinate in 0..coordinates {
                for sign in [1.0, -1.0] {
                    let mut step = vec![0.0; coordinates];
                    step[coordinate] = sign * size;
                    let candidate = self.body.step(&self.pose, &step);
                    let found = self.likelihood.energy(&candidate, &mut scratch);
                    evaluations += 1;
                    if found < energy {
                        (self.pose, energy) = (candidate, found);
                    }
                }
            }
        }
        let answer = Estimate::without_search(observation.frame, self.pose.clone());
        Ok(Estimate { energy: Some(energy), evaluations, ..answer })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let short = ["motion.loop_to_s=1.0", "rig.ring.size_px=[160, 120]"].map(str::to_owned);
    let scenario = ScenarioFile::built_in(&short)?;
    let (set, _notes) = render(&scenario, None)?;

    // the tracker is given only its body, the cameras and the start pose
    let (body, start) = (&set.blind.start.body, &set.blind.start.pose);
    let new_tracker = |_seed: u64| {
        let likelihood = SilhouetteLikelihood::new(body.clone(), &set.blind.rig, SilhouetteSettings::default())?;
        Ok(CoordinateSearch { body: body.clone(), likelihood, pose: start.clone() })
    };
    let tracked = track(&set.blind, new_tracker, &[0])?;

    let measured = measure(&set, &tracked)?;
    for name in ["humaneva_mm", "body_orientation_deg", "silhouette_iou"] {
        let own = &measured.summary.metrics[name];
        let frozen = &measured.frozen.metrics[name];
        println!("{name}: {:.2} (a tracker that never moves: {:.2})", own.mean, frozen.mean);
    }
    Ok(())
}
