//! Joint solution for the poses of several frames and one body shape, on outline residuals.
//!
//! With pose steps `p_k` of the frames and a shape step `s`, one Gauss-Newton step solves
//! `[H_k C_k; C_k' S] [p_k; s] = -[g_k; t]`. Poses of different frames are coupled only through the shape, so they are
//! eliminated first by the Schur complement, as in `[Triggs 2000]`:
//! `(S - sum C_k' H_k^-1 C_k) s = -(t - sum C_k' H_k^-1 g_k)`.

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use rayon::prelude::*;

use super::OutlineImportance;
use super::cameras::{CameraCorrection, CameraModel, NUMBERS_PER_CAMERA};
use super::shape::{ShapeModel, ShapeNumber};
use crate::body::{Humanoid, LinkFrames, Pose, ROOT_STEP, Solid};
use crate::camera::Camera;
use crate::motion_model::NormalEquations;
use crate::tracker::descent::{
    self, Accumulator, BodyOutline, DescentScratch, ObservedOutline, OutlineSample, SolidPlace, length_px,
    robust_weight, slide, wrench,
};

/// Gauss-Newton steps.
const STEPS: usize = 16;
/// Width of the residuals' robust weight in the first and last step, lengths.
const WIDTHS: [f64; 2] = [5.0, 2.0];
/// Levenberg-Marquardt damping: the share of the diagonal that is added to it.
const DAMPING: f64 = 0.01;
/// Standard deviations of the start pose's position, metres, and orientation, radians.
const START_DEVIATION_M: f64 = 0.015;
const START_DEVIATION_RAD: f64 = 0.03;
/// Maximum translation of the root, metres, and rotation of the root or a joint, radians, in one step.
const MAX_TRANSLATION_M: f64 = 0.1;
const MAX_ROTATION_RAD: f64 = 0.3;
/// Step of the finite differences with respect to the shape, in standard deviations of its parameters.
const DIFFERENCE: f64 = 0.01;

/// The data of the joint problem.
pub(super) struct CalibrationProblem<'a> {
    pub(super) model: &'a ShapeModel,
    /// Corrections of the cameras' poses.
    pub(super) corrections: &'a CameraModel,
    /// `[frame][view]`: the cameras at the time of the image, as given.
    pub(super) cameras: Vec<Vec<Camera>>,
    /// Weights of the body's parts.
    pub(super) importance: &'a OutlineImportance,
    /// `[frame][view]`: the observed outlines.
    pub(super) observed: Vec<Vec<Option<ObservedOutline>>>,
    /// The initial poses, one per frame.
    pub(super) tracked: Vec<Pose>,
    /// The start pose, if the first frame is the start: it places the world when the cameras are corrected, too.
    pub(super) start: Option<&'a Pose>,
    /// Factor on the precision of the shape's prior: the noise of the outlines, as a variance relative to that in
    /// images of 480 rows or more.
    pub(super) outline_noise: f64,
    /// Precision of the prior that holds every component of a pose step to the tracked pose.
    pub(super) precision: &'a [f64],
}

/// Poses and a shape.
#[derive(Clone, Debug)]
pub(super) struct CalibrationSolution {
    /// One value per shape parameter, followed by those of the cameras' corrections.
    pub(super) values: Vec<f64>,
    pub(super) poses: Vec<Pose>,
    /// Mean weighted squared residual, squared lengths; NaN without residuals.
    pub(super) cost: f64,
}

/// A body and its outline surfaces.
struct Variant {
    body: Humanoid,
    outline: BodyOutline,
}

/// The normal equations of one frame.
struct FrameEquations {
    pose: NormalEquations,
    /// One row per pose component, one column per shape parameter.
    cross: DMatrix<f64>,
    shape: DMatrix<f64>,
    shape_gradient: DVector<f64>,
}

/// A frame's eliminated pose.
struct Eliminated {
    /// `H^-1 C` and `H^-1 g`.
    by_shape: DMatrix<f64>,
    alone: DVector<f64>,
}

impl CalibrationProblem<'_> {
    /// The parameters of the body as given and the cameras as given.
    pub(super) fn as_given(&self) -> Vec<f64> {
        vec![0.0; self.model.numbers.len() + self.corrections.numbers()]
    }

    /// The best shape and poses.
    pub(super) fn solve(&self) -> CalibrationSolution {
        self.solve_from(self.as_given(), self.model.numbers.len())
    }

    /// The best shape, cameras and poses.
    pub(super) fn solve_with_cameras(&self) -> CalibrationSolution {
        let given = self.as_given();
        let count = given.len();
        self.solve_from(given, count)
    }

    /// The best poses for the shape and cameras of `values`.
    pub(super) fn solve_poses(&self, values: &[f64]) -> CalibrationSolution {
        self.solve_from(values.to_vec(), 0)
    }

    /// Solves from parameters of which the first `count` are free.
    fn solve_from(&self, mut values: Vec<f64>, count: usize) -> CalibrationSolution {
        let mut poses = self.tracked.clone();
        for step in 0..STEPS {
            let share = step as f64 / (STEPS - 1) as f64;
            let width = WIDTHS[0] * libm::pow(WIDTHS[1] / WIDTHS[0], share);
            let body = self.model.shaped(&values);
            let equations = self.equations(&values, &poses, count, width);
            let Some((shape_step, pose_steps)) = self.step(&body, &values, &poses, &equations, count) else { break };
            values.iter_mut().zip(shape_step.iter()).for_each(|(value, step)| *value += step);
            for (pose, step) in poses.iter_mut().zip(&pose_steps) {
                *pose = body.step(pose, step.as_slice());
                body.clamp_to_limits(pose);
            }
        }
        let last = self.equations(&values, &poses, 0, WIDTHS[1]);
        let cost = last.iter().map(|frame| frame.pose.cost).sum::<f64>();
        let cost = cost / last.iter().map(|frame| frame.pose.weight).sum::<f64>();
        CalibrationSolution { values, poses, cost }
    }

    fn equations(&self, values: &[f64], poses: &[Pose], count: usize, width: f64) -> Vec<FrameEquations> {
        let variant = |values: &[f64]| {
            let body = self.model.shaped(values);
            Variant { outline: BodyOutline::new(&body), body }
        };
        let base = variant(values);
        let varied = |number: usize| {
            let mut values = values.to_vec();
            values[number] += self.difference(number);
            variant(&values)
        };
        let variants: Vec<Variant> = (0..count.min(self.model.numbers.len())).map(varied).collect();
        let corrections = self.corrections_of(values);
        let frames = (0..poses.len()).into_par_iter();
        let buffers = || DescentScratch::new(self.cameras.first().into_iter().flatten());
        frames
            .map_init(buffers, |scratch, frame| {
                let cameras: Vec<Camera> = corrected(&self.cameras[frame], &corrections).collect();
                self.frame(&base, &variants, &poses[frame], frame, &cameras, count, width, scratch)
            })
            .collect()
    }

    /// The cameras' corrections from all parameters, one per camera.
    pub(super) fn corrections_of(&self, values: &[f64]) -> Vec<CameraCorrection> {
        let names = self.cameras.first().into_iter().flatten().map(|camera| camera.name.as_str());
        self.corrections.corrections(names, &values[self.model.numbers.len()..]).collect()
    }

    fn difference(&self, number: usize) -> f64 {
        DIFFERENCE * self.deviation(number)
    }

    /// Standard deviation of the prior of a parameter.
    fn deviation(&self, number: usize) -> f64 {
        let shape = self.model.numbers.get(number).map(ShapeNumber::deviation);
        shape.unwrap_or_else(|| CameraModel::deviation(number - self.model.numbers.len()))
    }

    #[expect(clippy::too_many_arguments, reason = "one frame's data, the free parameters and scratch buffers")]
    fn frame(
        &self,
        base: &Variant,
        variants: &[Variant],
        pose: &Pose,
        frame: usize,
        cameras: &[Camera],
        count: usize,
        width: f64,
        scratch: &mut DescentScratch,
    ) -> FrameEquations {
        let body = &base.body;
        let frames = body.link_frames(pose);
        let shape = ShapeDerivatives::new(self, base, &frames, variants, pose);
        let about: Point3<f64> = pose.world_from_root.translation.vector.into();
        let mut links = Accumulator::new(body.links.len(), about);
        let mut cross = vec![DMatrix::<f64>::zeros(6, count); body.links.len()];
        let (mut square, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut moves: Vec<(usize, f64)> = Vec::new();
        for (view, (camera, observed)) in cameras.iter().zip(&self.observed[frame]).enumerate() {
            let Some(observed) = observed else { continue };
            let length = length_px(camera);
            descent::each_residual(
                body,
                &frames,
                &base.outline,
                camera,
                view,
                observed,
                scratch,
                |sample, residual| {
                    let importance = self.importance.of(sample);
                    links.add(camera, sample, residual, length, width, importance);
                    if count == 0 {
                        return;
                    }
                    let weight = importance * robust_weight(residual.value, width);
                    let slide = slide(camera, &sample.point, &residual, length);
                    let place = camera.camera_from_world.inverse_transform_point(&sample.point);
                    let row = wrench(&slide, &(place - about));
                    shape.derivatives(sample, camera, &slide, &mut moves);
                    if count > variants.len() {
                        let seen = wrench(&slide, &(place - self.corrections.about));
                        let first = variants.len() + view * NUMBERS_PER_CAMERA;
                        moves.extend((first..).zip(seen.iter().copied()));
                    }
                    for (i, (number, along)) in moves.iter().enumerate() {
                        let weighted = weight * along;
                        gradient[*number] += weighted * residual.value;
                        (0..6).for_each(|k| cross[sample.link][(k, *number)] += weighted * row[k]);
                        moves[..=i].iter().for_each(|(other, by)| square[(*other, *number)] += weighted * by);
                    }
                },
            );
        }
        square.fill_lower_triangle_with_upper_triangle();
        let mut spread = DMatrix::zeros(body.step_len(), count);
        let mut twists = Vec::new();
        for (link, cross) in cross.iter().enumerate().filter(|_| count > 0) {
            body.step_twists(&frames, link, &about, &mut twists);
            for (number, [v, w]) in &twists {
                for column in 0..count {
                    let part = |from: usize| Vector3::from(cross.fixed_view::<3, 1>(from, column));
                    spread[(*number, column)] += v.dot(&part(0)) + w.dot(&part(3));
                }
            }
        }
        FrameEquations { pose: links.finish(body, &frames), cross: spread, shape: square, shape_gradient: gradient }
    }

    /// The steps of the shape and of all poses; `None` if the equations are singular.
    fn step(
        &self,
        body: &Humanoid,
        values: &[f64],
        poses: &[Pose],
        equations: &[FrameEquations],
        count: usize,
    ) -> Option<(DVector<f64>, Vec<DVector<f64>>)> {
        let with_cameras = count > self.model.numbers.len();
        let eliminate = |(index, (frame, pose)): (usize, (&FrameEquations, &Pose))| {
            let start = self.start.filter(|_| with_cameras && index == 0);
            self.eliminate(body, frame, pose, &self.tracked[index], start)
        };
        let eliminated: Vec<Eliminated> =
            equations.iter().zip(poses).enumerate().map(eliminate).collect::<Option<_>>()?;
        let frames = equations.len() as f64;
        let mut square = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        for (frame, gone) in equations.iter().zip(&eliminated) {
            square += &frame.shape - frame.cross.transpose() * &gone.by_shape;
            gradient += &frame.shape_gradient - frame.cross.transpose() * &gone.alone;
        }
        for number in 0..count {
            // The prior scales with the number of frames, like the evidence: neighbouring frames are correlated.
            let precision = self.outline_noise * frames / self.deviation(number).powi(2);
            square[(number, number)] += precision;
            gradient[number] += precision * values[number];
            square[(number, number)] *= 1.0 + DAMPING;
        }
        let mut shape_step = -square.cholesky()?.solve(&gradient);
        for (number, step) in shape_step.iter_mut().enumerate() {
            let deviation = self.deviation(number);
            *step = step.clamp(-deviation, deviation);
        }
        let pose_step = |gone: &Eliminated| {
            let mut step = -(&gone.alone + &gone.by_shape * &shape_step);
            for (number, step) in step.iter_mut().enumerate() {
                let most = if number < 3 { MAX_TRANSLATION_M } else { MAX_ROTATION_RAD };
                *step = step.clamp(-most, most);
            }
            step
        };
        let pose_steps: Vec<DVector<f64>> = eliminated.iter().map(pose_step).collect();
        let finite = shape_step.iter().chain(pose_steps.iter().flatten()).all(|number| number.is_finite());
        finite.then_some((shape_step, pose_steps))
    }

    /// Eliminates a frame's pose, with the prior towards the tracked pose, so that it is solved for any shape step.
    /// With a `start` pose, the root has a prior towards it, too. Angles pushed against their limits are fixed.
    fn eliminate(
        &self,
        body: &Humanoid,
        frame: &FrameEquations,
        pose: &Pose,
        anchor: &Pose,
        start: Option<&Pose>,
    ) -> Option<Eliminated> {
        let mut towards = vec![0.0; body.step_len()];
        let (mut matrix, mut gradient) = (frame.pose.matrix.clone(), frame.pose.gradient.clone());
        let mut cross = frame.cross.clone();
        if let Some(start) = start {
            body.difference(pose, start, &mut towards);
            for number in 0..ROOT_STEP {
                let deviation = if number < 3 { START_DEVIATION_M } else { START_DEVIATION_RAD };
                // scaled with the number of frames, as the priors of shape and cameras are
                let precision = self.outline_noise * self.tracked.len() as f64 / (deviation * deviation);
                matrix[(number, number)] += precision;
                gradient[number] -= precision * towards[number];
            }
        }
        body.difference(pose, anchor, &mut towards);
        for (number, (towards, precision)) in towards.iter().zip(self.precision).enumerate() {
            matrix[(number, number)] = (matrix[(number, number)] + precision) * (1.0 + DAMPING);
            gradient[number] -= precision * towards;
        }
        for (index, limits) in body.degrees_of_freedom.iter().enumerate() {
            let (angle, number) = (pose.joint_angles[index], ROOT_STEP + index);
            // An angle at its limit that the step would push further is removed from the equations: its row keeps it
            // fixed, and it no longer depends on the shape. Clamping the solved step instead would leave the others
            // wrong.
            let pushed_down = angle <= limits.lower && gradient[number] >= 0.0;
            let pushed_up = angle >= limits.upper && gradient[number] <= 0.0;
            if pushed_down || pushed_up {
                matrix.row_mut(number).fill(0.0);
                matrix.column_mut(number).fill(0.0);
                cross.row_mut(number).fill(0.0);
                (matrix[(number, number)], gradient[number]) = (1.0, 0.0);
            }
        }
        let solver = matrix.cholesky()?;
        Some(Eliminated { by_shape: solver.solve(&cross), alone: solver.solve(&gradient) })
    }
}

/// The cameras of one frame with their corrections.
fn corrected<'a>(cameras: &'a [Camera], corrections: &'a [CameraCorrection]) -> impl Iterator<Item = Camera> + 'a {
    cameras.iter().zip(corrections).map(|(camera, by)| camera.placed(camera.camera_from_world * by.motion()))
}

/// World positions of a skin's vertices, for the body and for each variant.
type VariedSkin = (Vec<Point3<f64>>, Vec<Vec<Point3<f64>>>);

/// Derivatives of the visible body with respect to the shape parameters, in one pose.
struct ShapeDerivatives<'a> {
    base: &'a Variant,
    frames: &'a LinkFrames,
    variants: &'a [Variant],
    varied_frames: Vec<LinkFrames>,
    differences: Vec<f64>,
    /// `[link][solid]`: the parameters that move it.
    moving: Vec<Vec<Vec<usize>>>,
    /// For a body with a skin.
    skins: Option<VariedSkin>,
}

impl<'a> ShapeDerivatives<'a> {
    fn new(
        problem: &CalibrationProblem<'_>,
        base: &'a Variant,
        frames: &'a LinkFrames,
        variants: &'a [Variant],
        pose: &Pose,
    ) -> Self {
        let varied_frames: Vec<LinkFrames> = variants.iter().map(|variant| variant.body.link_frames(pose)).collect();
        let is_moved = |number: usize, link: usize, solid: usize| {
            varied_frames[number][link] != frames[link]
                || variants[number].body.links[link].solids[solid] != base.body.links[link].solids[solid]
        };
        let of_solid = |link: usize, solid: usize| -> Vec<usize> {
            (0..variants.len()).filter(|number| is_moved(*number, link, solid)).collect()
        };
        let of_link = |(link, solids): (usize, usize)| (0..solids).map(|solid| of_solid(link, solid)).collect();
        let moving = base.body.links.iter().map(|link| link.solids.len()).enumerate().map(of_link).collect();
        let differences = (0..variants.len()).map(|number| problem.difference(number)).collect();
        let skins = deformed(&base.body, frames).map(|skin| {
            let of = |(variant, frames): (&Variant, &LinkFrames)| deformed(&variant.body, frames).unwrap_or_default();
            (skin, variants.iter().zip(&varied_frames).map(of).collect())
        });
        Self { base, frames, variants, differences, moving, varied_frames, skins }
    }

    /// The derivatives of the residual at `sample` with respect to the shape parameters: parameter index and value.
    /// `slide` is the residual's derivative with respect to the sample's world position.
    fn derivatives(
        &self,
        sample: &OutlineSample,
        camera: &Camera,
        slide: &Vector3<f64>,
        found: &mut Vec<(usize, f64)>,
    ) {
        found.clear();
        if let Some((base, varied)) = &self.skins {
            let moved = |number: usize| {
                let by =
                    (on_skin(&varied[number], &sample.spot)? - on_skin(base, &sample.spot)?) / self.differences[number];
                (by != Vector3::zeros()).then(|| (number, slide.dot(&by)))
            };
            return found.extend((0..varied.len()).filter_map(moved));
        }
        let Some((place, radius)) = spot(self.base, self.frames, sample.link, &sample.spot) else { return };
        let normal = camera.camera_from_world.inverse_transform_vector(&sample.surface_normal(&camera.pinhole));
        for &number in &self.moving[sample.link][sample.spot.solid as usize] {
            let moved = spot(&self.variants[number], &self.varied_frames[number], sample.link, &sample.spot);
            let Some((moved, thicker)) = moved else { continue };
            let by = (moved - place + normal * (thicker - radius)) / self.differences[number];
            found.push((number, slide.dot(&by)));
        }
    }
}

/// World positions of a skin's vertices; `None` for a body without a skin.
fn deformed(body: &Humanoid, frames: &LinkFrames) -> Option<Vec<Point3<f64>>> {
    let mut vertices = Vec::new();
    body.skin.as_ref()?.deform_into(frames, &mut vertices);
    Some(vertices)
}

/// Position of a spot on a skin with these vertices.
fn on_skin(vertices: &[Point3<f64>], spot: &SolidPlace) -> Option<Point3<f64>> {
    let [from, to] = spot.ends.map(|end| vertices.get(end as usize));
    from.zip(to).map(|(from, to)| from + spot.share * (to - from))
}

/// World position of a spot on a capsule's axis or on another solid's surface, and the distance of the surface from it.
fn spot(variant: &Variant, frames: &LinkFrames, link: usize, spot: &SolidPlace) -> Option<(Point3<f64>, f64)> {
    let ends = match variant.body.links[link].solids.get(spot.solid as usize)? {
        Solid::TaperedCapsule(c) => spot.ends.map(|end| if end == 0 { (c.a, c.radius_a) } else { (c.b, c.radius_b) }),
        _ => {
            let vertex = |end| Some((variant.outline.vertex(link, spot.solid, end)?, 0.0));
            [vertex(spot.ends[0])?, vertex(spot.ends[1])?]
        }
    };
    let [(from, thin), (to, thick)] = ends;
    Some((frames[link] * (from + spot.share * (to - from)), thin + spot.share * (thick - thin)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Skin, shipped, shipped_skin};
    use crate::tracker::descent::OutlineResidual;
    use crate::tracker::fixture;

    #[test]
    fn shape_derivatives_agree_with_finite_differences_of_the_outline() {
        check_derivatives(&shipped("tracker25").unwrap(), 1.5);
    }

    #[test]
    fn shape_derivatives_agree_with_finite_differences_of_a_skins_outline() {
        let body = shipped("tracker25").unwrap();
        let bind = body.link_frames(&body.zero_pose());
        let skin = Skin::bound(&shipped_skin("person_coarse").unwrap(), &body, &bind).unwrap();
        check_derivatives(&Humanoid { skin: Some(skin.into()), ..body }, 1.5);
    }

    /// Tolerance: 2 %, plus `most` pixels per unit of the parameter.
    fn check_derivatives(body: &Humanoid, most: f64) {
        let model = ShapeModel::new(body);
        let camera = fixture::ring(1, 3.5, [640, 480]).cameras.remove(0);
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.z = 0.93;
        let variant = |values: &[f64]| {
            let body = model.shaped(values);
            Variant { outline: BodyOutline::new(&body), body }
        };
        let problem = CalibrationProblem {
            model: &model,
            corrections: &CameraModel::new(1, Point3::origin()),
            cameras: vec![vec![camera.clone()]],
            importance: &OutlineImportance::default(),
            observed: Vec::new(),
            tracked: Vec::new(),
            start: None,
            outline_noise: 1.0,
            precision: &[],
        };
        let zero = vec![0.0; model.numbers.len()];
        let varied = |number: usize, by: f64| {
            let mut values = zero.clone();
            values[number] = by;
            variant(&values)
        };
        let (base, frames) = (variant(&zero), body.link_frames(&pose));
        let variants: Vec<Variant> = (0..zero.len()).map(|number| varied(number, problem.difference(number))).collect();
        let shape = ShapeDerivatives::new(&problem, &base, &frames, &variants, &pose);
        let outline = |variant: &Variant| {
            let mut samples = Vec::new();
            let frames = variant.body.link_frames(&pose);
            variant.outline.sample(&variant.body, &frames, &camera, 5.0, &mut samples);
            samples
        };
        let samples = outline(&base);
        let mut found = Vec::new();
        let mut checked = 0;
        for (number, name) in model.numbers.iter().map(|number| number.name.as_str()).enumerate() {
            let h = 2e-5;
            let (more, less) = (outline(&varied(number, h)), outline(&varied(number, -h)));
            for sample in samples.iter().step_by(7) {
                // The sample of the changed body at the same spot, if one with the same normal remains.
                let same = |all: &[OutlineSample]| {
                    let near = |s: &&OutlineSample| {
                        s.link == sample.link
                            && (s.spot.solid, s.spot.ends) == (sample.spot.solid, sample.spot.ends)
                            && (s.spot.share - sample.spot.share).abs() < 0.003
                            && s.normal[0] * sample.normal[0] + s.normal[1] * sample.normal[1] > 0.9999
                    };
                    all.iter().find(near).map(|s| s.pixel)
                };
                let (Some(more), Some(less)) = (same(&more), same(&less)) else { continue };
                // Compares across the outline, because position along it is arbitrary.
                let across = [0, 1]
                    .map(|i| (more[i] - less[i]) / (2.0 * h))
                    .iter()
                    .zip(sample.normal)
                    .map(|(d, n)| d * n)
                    .sum::<f64>();
                let residual = OutlineResidual { value: 1.0, gradient: sample.normal };
                shape.derivatives(sample, &camera, &slide(&camera, &sample.point, &residual, 1.0), &mut found);
                let along = found.iter().find(|(of, _)| *of == number).map_or(0.0, |(_, along)| *along);
                assert!((along - across).abs() < 0.02 * across.abs() + most, "{name}: {along} is not {across}");
                checked += 1;
            }
        }
        assert!(checked > 200, "{checked}");
    }
}
