//! Motion of a particle's root from frame to frame.

use std::ops::{Add, Mul};

use nalgebra::{Vector2, Vector3};

use super::super::gpdm_graph::GpdmGraph;
use super::super::pose_chart::{PlanarRoot, PlanarStep, PoseChart};
use super::footing::{Feet, FootStep, Footing, turned_about};
use super::residual::{Unseen, offset_by};
use super::settings::{LatentSettings, RootMotion};
use skiagraph_core::body::{Humanoid, Pose, rotation_about};

/// Least deviations of the root's steps: metres and radians per frame.
const LEAST_NOISE: PlanarStep = PlanarStep { forward: 0.002, left: 0.002, turn: 0.3 * std::f64::consts::PI / 180.0 };

/// Least looseness of a foot: square micrometres and microradians.
const LEAST_VARIANCE: f64 = 1e-12;

/// Dynamics of the position of a particle's body on the ground.
///
/// The models predict the root's velocity, but they were learned at the training data's own moments: for unseen motion
/// their errors are [`Unseen`]. With [`RootMotion::Planted`] there are two more estimates. A standing foot stays at
/// its foothold, so the new pose determines the root, up to the slide and rotation of feet at this height in training
/// ([`Footing`]). All three are weighted by their inverse variances, and the remaining variance is the noise, with a
/// lower bound: in flight the models' velocities dominate, on firm feet the legs. Footholds are remembered
/// ([`Footing::updated`]), so that the noise does not accumulate over frames. Height is also determined by the feet:
/// the lower foot of a pose off the manifold is as high as that of the pose on it, plus a separate offset.
///
/// `[GPDM graph]` does not define the motion of the root.
#[derive(Clone, Debug)]
pub(super) struct RootDynamics {
    footing: Option<Footing>,
    /// Standard deviations of the models' steps.
    noise: PlanarStep,
    scale: f64,
}

/// Position of a particle's body on the ground.
#[derive(Clone, Debug)]
pub(super) struct RootPlace {
    pub(super) root: PlanarRoot,
    /// Its footholds before the frame's own noise; `None` if feet are not used.
    pub(super) footholds: Option<Feet>,
}

/// Estimates of a change, weighted by their inverse variances; the first estimate is no change.
struct FusedEstimate<T> {
    sum: T,
    precision: f64,
}

impl<T: Copy + Add<Output = T> + Mul<f64, Output = T>> FusedEstimate<T> {
    fn new(nothing: T, variance: f64, others: impl Iterator<Item = (T, f64)>) -> Self {
        let first = Self { sum: nothing, precision: 1.0 / variance };
        others.fold(first, |fused, (estimate, variance)| {
            let precision = 1.0 / variance.max(LEAST_VARIANCE);
            Self { sum: fused.sum + estimate * precision, precision: fused.precision + precision }
        })
    }

    fn mean(&self) -> T {
        self.sum * (1.0 / self.precision)
    }

    fn deviation(&self, floor: f64) -> f64 {
        (1.0 / self.precision.sqrt()).max(floor)
    }
}

impl RootDynamics {
    /// Learned from the training data of `graph`. A body without feet moves by the models' velocities alone.
    pub(super) fn learn(
        footing: Option<Footing>,
        graph: &GpdmGraph,
        unseen: &Unseen,
        settings: &LatentSettings,
    ) -> Self {
        let noise = match settings.root_motion {
            RootMotion::Model => own_noise(graph),
            RootMotion::Planted => unseen.step(&graph.chart),
        };
        let noise = PlanarStep {
            forward: noise.forward.max(LEAST_NOISE.forward),
            left: noise.left.max(LEAST_NOISE.left),
            turn: noise.turn.max(LEAST_NOISE.turn),
        };
        Self { footing, noise, scale: settings.root_noise_scale }
    }

    /// Standard deviations of a step in the heading frame; on firm feet if feet are used.
    pub(super) fn deviations(&self) -> [f64; 3] {
        let PlanarStep { forward, left, turn } = self.noise;
        let deviations = match self.footing.as_ref().map(Footing::firmest) {
            None => [forward, left, turn],
            Some(firm) => {
                let slide = FusedEstimate::new(0.0, self.slide_variance(), [(0.0, firm.slide)].into_iter());
                let slide = slide.deviation(LEAST_NOISE.forward);
                let turn =
                    FusedEstimate::new(0.0, turn * turn, [(0.0, firm.turn)].into_iter()).deviation(LEAST_NOISE.turn);
                [slide, slide, turn]
            }
        };
        deviations.map(|deviation| self.scale * deviation)
    }

    /// The pose of the map's mean with an offset, at `root`.
    pub(super) fn stand(&self, at: &Stand<'_>, root: &PlanarRoot) -> Pose {
        let mut pose = at.chart.place(&offset_by(at.mean.to_vec(), at.offset), root);
        at.body.clamp_to_limits(&mut pose);
        if let (Some(footing), Some(height)) = (&self.footing, at.offset.last()) {
            let on_manifold = footing.feet(at.body, &at.chart.place(at.mean, root)).lower_height();
            let wanted = on_manifold + height * at.chart.height_unit();
            pose.world_from_root.translation.z += wanted - footing.feet(at.body, &pose).lower_height();
        }
        pose
    }

    /// The last number of the offset from the map's mean to a pose: the height difference of the lower foot, in the
    /// chart's unit. `None` if feet are not used; the number is then the root's height.
    pub(super) fn height_offset(&self, body: &Humanoid, chart: &PoseChart, mean: &[f64], pose: &Pose) -> Option<f64> {
        let footing = self.footing.as_ref()?;
        let on_manifold = chart.place(mean, &PlanarRoot::from_pose(pose));
        let [here, there] = [pose, &on_manifold].map(|pose| footing.feet(body, pose).lower_height());
        Some((here - there) / chart.height_unit())
    }

    /// A pose at `root` with its footholds at its feet.
    pub(super) fn place(&self, body: &Humanoid, root: PlanarRoot, pose: &Pose) -> RootPlace {
        RootPlace { root, footholds: self.footing.as_ref().map(|footing| footing.feet(body, pose)) }
    }

    /// Position and pose one frame after `before`, which was at `place`, with noise of these standard normal numbers.
    pub(super) fn next(
        &self,
        before: &Pose,
        place: &RootPlace,
        at: &Stand<'_>,
        numbers: [f64; 3],
    ) -> (RootPlace, Pose) {
        let step = at.chart.planar_step(at.mean);
        let drawn = numbers.map(|number| self.scale * number);
        match (&self.footing, &place.footholds) {
            (Some(footing), Some(footholds)) => {
                let footholds = footing.updated(footholds, &footing.feet(at.body, before));
                let root = place.root.after(&step);
                let (root, pose) = self.held(footing, &footholds, root, self.stand(at, &root), at.body, drawn);
                (RootPlace { root, footholds: Some(footholds) }, pose)
            }
            _ => {
                let root = place.root.after(&PlanarStep {
                    forward: step.forward + self.noise.forward * drawn[0],
                    left: step.left + self.noise.left * drawn[1],
                    turn: step.turn + self.noise.turn * drawn[2],
                });
                (RootPlace { root, footholds: None }, self.stand(at, &root))
            }
        }
    }

    /// Root and pose after a change of the pose within a frame: feet keep the body where they were before the change
    /// (if they are loose it stays where it is), then it moves by `step`. Footholds do not change within a frame.
    pub(super) fn stepped(
        &self,
        before: &Pose,
        root: &PlanarRoot,
        at: &Stand<'_>,
        step: &PlanarStep,
    ) -> (PlanarRoot, Pose) {
        let pose = self.stand(at, root);
        let (root, pose) = match &self.footing {
            Some(footing) => self.held(footing, &footing.feet(at.body, before), *root, pose, at.body, [0.0; 3]),
            None => (*root, pose),
        };
        let after = root.after(step);
        (after, moved(pose, step.turn, &Vector2::new(after.x - root.x, after.y - root.y)))
    }

    /// A pose at the position predicted by the models' velocities, moved so that its feet come to `footholds`.
    fn held(
        &self,
        footing: &Footing,
        footholds: &Feet,
        root: PlanarRoot,
        pose: Pose,
        body: &Humanoid,
        drawn: [f64; 3],
    ) -> (PlanarRoot, Pose) {
        let steps = footholds.steps_to(&footing.feet(body, &pose));
        let feet = steps.map(|step| (step, footing.looseness(&step)));
        let turns = feet.iter().map(|(step, loose)| (-step.turned, loose.turn));
        let turn = FusedEstimate::new(0.0, self.noise.turn * self.noise.turn, turns);
        let turned = turn.mean() + turn.deviation(LEAST_NOISE.turn) * drawn[2];
        let pivot = pose.world_from_root.translation.vector;
        let back = |step: &FootStep| step.before.coords.xy() - turned_about(&pivot, turned, &step.after);
        let slides = feet.iter().map(|(step, loose)| (back(step), loose.slide));
        let slide = FusedEstimate::new(Vector2::zeros(), self.slide_variance(), slides);
        let shift = slide.mean() + Vector2::new(drawn[0], drawn[1]) * slide.deviation(LEAST_NOISE.forward);
        let pose = moved(pose, turned, &shift);
        let root = root.after(&PlanarStep { forward: 0.0, left: 0.0, turn: turned });
        (PlanarRoot { x: root.x + shift.x, y: root.y + shift.y, ..root }, pose)
    }

    /// Variance of the models' horizontal steps, per axis.
    fn slide_variance(&self) -> f64 {
        0.5 * (self.noise.forward * self.noise.forward + self.noise.left * self.noise.left)
    }
}

/// A pose rotated about the vertical and shifted along the ground.
fn moved(mut pose: Pose, turned: f64, shift: &Vector2<f64>) -> Pose {
    let placed = &mut pose.world_from_root;
    placed.rotation = rotation_about(&Vector3::z_axis(), turned) * placed.rotation;
    placed.translation.vector += Vector3::new(shift.x, shift.y, 0.0);
    pose
}

/// The map's mean and an offset.
pub(super) struct Stand<'a> {
    pub(super) body: &'a Humanoid,
    pub(super) chart: &'a PoseChart,
    pub(super) mean: &'a [f64],
    pub(super) offset: &'a [f64],
}

/// Standard deviation of the part of the root's steps that the models do not explain in their own training data.
fn own_noise(graph: &GpdmGraph) -> PlanarStep {
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for segment in &graph.segments {
        let mapped = segment.gpdm.map_mean(segment.gpdm.latents());
        for t in 0..mapped.nrows() {
            let model = graph.chart.planar_step(&mapped.row(t).iter().copied().collect::<Vec<_>>());
            let truth = graph.chart.planar_step(&segment.gpdm.observation(t));
            let residuals = [model.forward - truth.forward, model.left - truth.left, model.turn - truth.turn];
            squares.iter_mut().zip(residuals).for_each(|(s, r)| *s += r * r);
            count += 1.0;
        }
    }
    let [forward, left, turn] = squares.map(|s| (s / f64::max(count, 1.0)).sqrt());
    PlanarStep { forward, left, turn }
}

#[cfg(test)]
mod tests;
