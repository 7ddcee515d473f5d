//! Joint solution for the poses of several frames and one body shape, on outline residuals.
//!
//! With pose steps `p_k` of the frames and a shape step `s`, one Gauss-Newton step solves
//! `[H_k C_k; C_k' S] [p_k; s] = -[g_k; t]`. Poses of different frames are coupled only through the shape, so they are
//! eliminated first by the Schur complement, as in `[Triggs 2000]`:
//! `(S - sum C_k' H_k^-1 C_k) s = -(t - sum C_k' H_k^-1 g_k)`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Point3, Vector3};
use rayon::prelude::*;

use super::OutlineImportance;
use super::cameras::{CameraCorrection, CameraModel, NUMBERS_PER_CAMERA};
use super::shape::{ShapeModel, ShapeNumber};
use super::shape_derivatives::{ShapeDerivatives, ShapeVariant};
use crate::motion_model::NormalEquations;
use crate::tracker::descent::{
    self, Accumulator, Density, DescentScratch, ObservedOutline, length_px, robust_weight, slide, wrench,
};
use crate::tracker::mask_trust::MaskTrust;
use skiagraph_core::body::{Humanoid, Pose, ROOT_STEP};
use skiagraph_core::camera::Camera;

const STEPS: usize = 16;
/// Width of the residuals' robust weight in the first and last step, lengths.
const WIDTHS: [f64; 2] = [5.0, 2.0];
/// Levenberg-Marquardt damping: the share of the diagonal that is added to it.
const DAMPING: f64 = 0.01;
/// Standard deviations of a known start pose's position, metres, and orientation, radians.
const START_DEVIATION_M: f64 = 0.015;
const START_DEVIATION_RAD: f64 = 0.03;
/// Step of the finite differences of what is held, in standard deviations of the parameters.
const DIFFERENCE: f64 = 1e-3;
/// Newton's steps onto what is held, after the solution.
const HOLDING_STEPS: usize = 6;
/// Maximum translation of the root, metres, and rotation of the root or a joint, radians, in one step.
const MAX_TRANSLATION_M: f64 = 0.1;
const MAX_ROTATION_RAD: f64 = 0.3;
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
    /// The start pose, if it is known and the first frame is the start: it places the world when the cameras are
    /// corrected, too. Without it the cameras keep their common place.
    pub(super) start: Option<&'a Pose>,
    /// The stature that a solved shape keeps, metres, if one is given.
    pub(super) stature_m: Option<f64>,
    /// Whether the shape is solved, too, when the cameras are.
    pub(super) with_shape: bool,
    /// Factor on the precision of the shape's prior: the noise of the outlines, as a variance relative to that in
    /// images of 480 rows or more.
    pub(super) outline_noise: f64,
    /// Precision of the prior that holds every component of a pose step to the tracked pose.
    pub(super) precision: &'a [f64],
}

#[derive(Clone, Debug)]
pub(super) struct CalibrationSolution {
    /// One value per shape parameter, followed by those of the cameras' corrections.
    pub(super) values: Vec<f64>,
    pub(super) poses: Vec<Pose>,
    /// Mean weighted squared residual, squared lengths; NaN without residuals.
    pub(super) cost: f64,
}

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
            // The robust weight narrows geometrically: wide at first, so that limbs that are far off still pull.
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
        // the last step ends micrometres beside what is held: equations are linear, and steps clamped
        let spread = DVector::from_fn(count, |number, _| self.deviation(number).powi(-2));
        let spread = DMatrix::from_diagonal(&spread).cholesky();
        for spread in spread.iter().cycle().take(HOLDING_STEPS) {
            let mut step = DVector::zeros(count);
            self.hold(&mut step, &values, spread);
            values.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
        }
        let last = self.equations(&values, &poses, 0, WIDTHS[1]);
        let cost = last.iter().map(|frame| frame.pose.cost).sum::<f64>();
        let cost = cost / last.iter().map(|frame| frame.pose.weight).sum::<f64>();
        CalibrationSolution { values, poses, cost }
    }

    fn equations(&self, values: &[f64], poses: &[Pose], count: usize, width: f64) -> Vec<FrameEquations> {
        let base = ShapeVariant::new(self.model.shaped(values));
        let variants = ShapeVariant::of_numbers(self.model, values, count);
        let corrections = self.corrections_of(values);
        let frames = (0..poses.len()).into_par_iter();
        let buffers = || DescentScratch::new(self.cameras.first().into_iter().flatten());
        frames
            .map_init(buffers, |scratch, frame| {
                let own = self.cameras[frame].iter().zip(&corrections);
                let placed = own.map(|(camera, by)| camera.placed(camera.camera_from_world * by.motion()));
                let cameras: Vec<Camera> = placed.collect();
                self.frame(&base, &variants, &poses[frame], frame, &cameras, count, width, scratch)
            })
            .collect()
    }

    /// The cameras' corrections from all parameters, one per camera.
    pub(super) fn corrections_of(&self, values: &[f64]) -> Vec<CameraCorrection> {
        let names = self.cameras.first().into_iter().flatten().map(|camera| camera.name.as_str());
        self.corrections.corrections(names, &values[self.model.numbers.len()..]).collect()
    }

    /// What must stay 0 while the first `count` parameters are solved: the change of a given stature, metres, and,
    /// without a known start, the common motion of all cameras. Holding it here, and not by a similarity afterwards,
    /// holds scale and stature together, and needs no scaling of bodies or of moving cameras.
    fn held(&self, values: &[f64], count: usize) -> Vec<f64> {
        let (shape, cameras) = values.split_at(self.model.numbers.len());
        let with_cameras = count > shape.len();
        let solves_shape = count > 0 && (self.with_shape || !with_cameras);
        let stature = self.stature_m.filter(|_| solves_shape).and_then(|given| {
            let own = self.model.shaped(shape).stature()?;
            Some(own - given)
        });
        let common = (with_cameras && self.start.is_none()).then(|| self.corrections.common_motion(cameras));
        stature.into_iter().chain(common.into_iter().flatten()).collect()
    }

    /// Changes a step of the parameters by the least, in the norm of the factorised `square`, that keeps what is held
    /// to first order; leaves it if that cannot be kept (all cameras in one place).
    fn hold(&self, step: &mut DVector<f64>, values: &[f64], square: &Cholesky<f64, Dyn>) {
        let count = step.len();
        let now = DVector::from_vec(self.held(values, count));
        if now.is_empty() {
            return;
        }
        let mut slopes = DMatrix::zeros(count, now.len());
        for number in 0..count {
            let (by, mut beside) = (DIFFERENCE * self.deviation(number), values.to_vec());
            beside[number] += by;
            let up = DVector::from_vec(self.held(&beside, count));
            beside[number] -= 2.0 * by;
            let down = DVector::from_vec(self.held(&beside, count));
            slopes.row_mut(number).tr_copy_from(&((up - down) / (2.0 * by)));
        }
        let by_held = square.solve(&slopes);
        let off = now + slopes.tr_mul(step);
        if let Some(pulls) = slopes.tr_mul(&by_held).cholesky() {
            *step -= by_held * pulls.solve(&off);
        }
    }

    /// Standard deviation of the prior of a parameter.
    fn deviation(&self, number: usize) -> f64 {
        let shape = self.model.numbers.get(number).map(ShapeNumber::deviation);
        shape.unwrap_or_else(|| CameraModel::deviation(number - self.model.numbers.len()))
    }

    #[expect(clippy::too_many_arguments, reason = "one frame's data, the free parameters and scratch buffers")]
    fn frame(
        &self,
        base: &ShapeVariant,
        variants: &[ShapeVariant],
        pose: &Pose,
        frame: usize,
        cameras: &[Camera],
        count: usize,
        width: f64,
        scratch: &mut DescentScratch,
    ) -> FrameEquations {
        let body = &base.body;
        let frames = body.link_frames(pose);
        let shape = ShapeDerivatives::new(self.model, base, &frames, variants, pose);
        let about: Point3<f64> = pose.world_from_root.translation.vector.into();
        // A point of a link moves by a twist of that link, whatever the joint: residuals are first summed as 6-vectors
        // per link, and spread over the joints once, after the loop over thousands of samples.
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
                Density::Dense,
                MaskTrust::FULL,
                scratch,
                |sample, residual| {
                    let importance = self.importance.of(sample);
                    links.add(camera, sample, residual, length, width, importance);
                    if count == 0 {
                        return;
                    }
                    let weight = importance * residual.outline * robust_weight(residual.value, width);
                    let slide = slide(camera, &sample.point, residual.gradient, length);
                    let place = camera.camera_from_world.inverse_transform_point(&sample.point);
                    let row = wrench(&slide, &(place - about));
                    shape.derivatives(sample, camera, &slide, &mut moves);
                    // the cameras are free too: moving a camera is moving the world about the body, the other way
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
        // Frames share only shape and cameras. Each pose is eliminated by itself (Schur complement), so the equations
        // that are solved have the size of a shape, not of all poses.
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
            // Levenberg's damping, relative to the diagonal: metres and shares of lengths stand in the same matrix
            square[(number, number)] *= 1.0 + DAMPING;
        }
        if count > self.model.numbers.len() && !self.with_shape {
            for number in 0..self.model.numbers.len() {
                square.row_mut(number).fill(0.0);
                square.column_mut(number).fill(0.0);
                (square[(number, number)], gradient[number]) = (1.0, 0.0);
            }
        }
        let square = square.cholesky()?;
        let mut shape_step = -square.solve(&gradient);
        self.hold(&mut shape_step, values, &square);
        for (number, step) in shape_step.iter_mut().enumerate() {
            // one step moves no number by more than people differ: the outlines are linear only near by
            let deviation = self.deviation(number);
            *step = step.clamp(-deviation, deviation);
        }
        let pose_step = |gone: &Eliminated| {
            // the clamped step of the shape is put back, so that poses answer to what was really done
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
