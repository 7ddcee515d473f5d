//! Compares the information with drawn images, with the scatter of fits, and with rules that hold for every rig.

use nalgebra::Vector3;

use super::*;
use crate::tracker::fixture::{March, ring};
use skiagraph_core::body::{KeypointLayout, Pose, ProposalScales, draw_silhouette, shipped};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::rng::{Purpose, normal, stream};

const MARCH: March = March { cycle: 20, advance: 0.03, hip: 0.2, knee: 0.6, abduction: 0.5, elbow: 0.8 };
const NOISE: OutlineNoise = OutlineNoise(12.0);

fn of_rig(body: &Humanoid, pose: &Pose, rig: &CameraRig) -> DMatrix<f64> {
    let (informed, frames) = (InformedBody::new(body), body.link_frames(pose));
    rig.cameras.iter().map(|camera| informed.of_silhouette(&frames, camera, NOISE)).sum()
}

fn total_mm(body: &Humanoid, pose: &Pose, information: &DMatrix<f64>) -> f64 {
    let covariance = covariance(information, &InformedBody::new(body).ignorance()).unwrap();
    let markers = body.marker_covariances(&body.link_frames(pose), &covariance);
    1000.0 * markers.iter().flatten().map(|marker| marker.trace()).sum::<f64>().sqrt()
}

/// With `v` the speed of the outline along its normal for a step of the pose, the information is the integral of
/// `v^2 ds` over the outline. That is also how fast the integral of `v` over the silhouette changes, if `v` is
/// continued beyond the outline along its normals: a finite difference of drawn images, in which an outline that is
/// counted twice or left out, or is not where the samples are, would show. The speeds are finite differences, too.
#[test]
fn the_information_agrees_with_finite_differences_of_drawn_images_to_one_percent() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 3);
    let camera = &ring(2, 3.0, [4000, 3000]).cameras[1];
    let (informed, frames) = (InformedBody::new(&body), body.link_frames(&pose));
    let found = informed.of_silhouette(&frames, camera, NOISE);
    let samples: Vec<OutlineSample> =
        informed.seen_outline(&frames, camera).into_iter().map(|edge| edge.sample).collect();
    let before = drawn(&body, &pose, camera);
    let named = |name: &str| ROOT_STEP + body.find_degree_of_freedom(name).unwrap();
    for (number, by) in
        [(0, 0.002), (1, 0.002), (2, 0.002), (4, 0.003), (5, 0.004), (named("left_shoulder_abduction"), 0.006)]
    {
        let moved = |by: f64| {
            let mut step = vec![0.0; body.step_len()];
            step[number] = by;
            body.step(&pose, &step)
        };
        let speeds = speeds(&samples, camera, &frames, &body.link_frames(&moved(1e-6)), 1e-6);
        let change = |by: f64| integral_of_change(&before, &drawn(&body, &moved(by), camera), &samples, &speeds);
        let expected = (change(by) - change(-by)) / (2.0 * by) / NOISE.0;
        let ratio = found[(number, number)] / expected;
        assert!((ratio - 1.0).abs() < 0.01, "{number}: {ratio}");
    }
}

fn drawn(body: &Humanoid, pose: &Pose, camera: &Camera) -> Mask {
    let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
    draw_silhouette(body, &body.link_frames(pose), camera, &mut mask);
    mask
}

/// How fast each sample moves along its normal, pixels, between links at `frames` and at `after`, a step `by` later.
fn speeds(samples: &[OutlineSample], camera: &Camera, frames: &LinkFrames, after: &LinkFrames, by: f64) -> Vec<f64> {
    let speed = |sample: &OutlineSample| {
        let in_link = frames[sample.link].inverse() * (camera.camera_from_world.inverse() * sample.point);
        let [then, now] = [after, frames].map(|at| camera.project(&(at[sample.link] * in_link)).unwrap());
        sample.normal[0] * (then.x - now.x) / by + sample.normal[1] * (then.y - now.y) / by
    };
    samples.iter().map(speed).collect()
}

/// The sum of the nearest sample's value over the pixels that were added, minus that over those that were removed.
fn integral_of_change(before: &Mask, after: &Mask, samples: &[OutlineSample], values: &[f64]) -> f64 {
    const CELL: f64 = 16.0;
    let key = |pixel: [f64; 2]| pixel.map(|at| (at / CELL).floor() as i64);
    let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    (0..samples.len()).for_each(|i| cells.entry(key(samples[i].pixel)).or_default().push(i));
    let value = |x: u32, y: u32| {
        let place = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let [column, row] = key(place);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
        let apart = |i: &&usize| (0..2).map(|axis| (samples[**i].pixel[axis] - place[axis]).powi(2)).sum::<f64>();
        let nearest = around.filter_map(|key| cells.get(&key)).flatten().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        values[*nearest.expect("an outline within a cell")]
    };
    let pixels = (0..after.height()).flat_map(|y| (0..after.width()).map(move |x| (x, y)));
    let changed = pixels.filter(|(x, y)| before.get(*x, *y) != after.get(*x, *y));
    changed.map(|(x, y)| if after.get(x, y) { value(x, y) } else { -value(x, y) }).sum()
}

#[test]
fn the_resolution_of_the_image_changes_nothing_but_the_unit_of_the_noise() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 7);
    let [small, large] = [[320, 240], [640, 480]].map(|size| of_rig(&body, &pose, &ring(2, 3.5, size)));
    // the same noise in pixels is half of it in the scene: sigma^2 l, in cubic pixels, by eight
    assert!((&large - 8.0 * &small).norm() < 1e-9 * large.norm());
}

#[test]
fn another_camera_never_raises_the_bound_and_two_of_the_same_halve_the_covariance_of_one() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 5);
    let rig = ring(6, 3.5, [320, 240]);
    let few = |count: usize| CameraRig { cameras: rig.cameras[..count].to_vec() };
    let bounds: Vec<f64> = (1..=6).map(|count| total_mm(&body, &pose, &of_rig(&body, &pose, &few(count)))).collect();
    assert!(bounds.windows(2).all(|pair| pair[1] < pair[0]), "{bounds:?}");
    assert!(bounds[0] > 10.0 * bounds[5], "one camera does not see depth: {bounds:?}");
    let nothing = DVector::zeros(body.step_len());
    let [once, twice] = [few(3), CameraRig { cameras: [few(3).cameras, few(3).cameras].concat() }].map(|rig| {
        covariance(&(of_rig(&body, &pose, &rig) + 1e-9 * DMatrix::identity(body.step_len(), body.step_len())), &nothing)
            .unwrap()
    });
    assert!((&once - 2.0 * &twice).norm() < 1e-3 * once.norm());
}

/// Outlines are simulated as points that noise displaces along the normal, one per correlation length; the pose is
/// fitted to them by Gauss-Newton steps, with the prior of a motion. Its errors scatter as the bound says.
#[test]
fn fits_to_simulated_outlines_scatter_as_the_bound_says() {
    const TRIALS: u64 = 100;
    const LENGTH_PX: f64 = 3.0;
    const DEVIATION_PX: f64 = 0.3;
    let body = shipped("tracker25").unwrap();
    for count in [2, 3] {
        let rig = ring(count, 3.5, [320, 240]);
        let (truth, informed) = (MARCH.pose(&body, 4), InformedBody::new(&body));
        let frames = body.link_frames(&truth);
        let prior = ProposalScales::for_human(&body, 30.0).in_step_order();
        let precision = DVector::from_iterator(prior.len(), prior.iter().map(|scale| scale.powi(-2)));
        let noise = OutlineNoise(DEVIATION_PX * DEVIATION_PX * LENGTH_PX);
        let information = rig.cameras.iter().map(|camera| informed.of_silhouette(&frames, camera, noise)).sum();
        let bound = covariance(&information, &precision).unwrap();
        let expected: f64 =
            body.marker_covariances(&frames, &bound).iter().flatten().map(|marker| marker.trace()).sum();
        let mut found = 0.0;
        for trial in 0..TRIALS {
            let mut rng = stream(trial, Purpose::Oracle, 0, 0, u64::from(count));
            let observed = simulated(&informed, &frames, &rig, [LENGTH_PX, DEVIATION_PX], &mut rng);
            let away: Vec<f64> = prior.iter().map(|scale| scale * normal(&mut rng)).collect();
            let mean = body.step(&truth, &away);
            let fitted = fit(&informed, &rig, &observed, &mean, &precision, noise, LENGTH_PX);
            let (a, b) = (body.markers(&frames), body.markers(&body.link_frames(&fitted)));
            let squares = a.iter().zip(&b).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm_squared()));
            found += squares.sum::<f64>() / TRIALS as f64;
        }
        let ratio = (found / expected).sqrt();
        assert!((ratio - 1.0).abs() < 0.1, "{count} cameras: {ratio}");
    }
}

/// Points on the outlines in the enlarged images, one per correlation length and displaced along their normals, which
/// follow, per camera.
fn simulated(
    informed: &InformedBody<'_>,
    frames: &LinkFrames,
    rig: &CameraRig,
    [length, deviation]: [f64; 2],
    rng: &mut rand_chacha::ChaCha8Rng,
) -> Vec<Vec<[[f64; 2]; 2]>> {
    let mut of_camera = |camera: &Camera| {
        let (fine, scale) = enlarged(camera);
        let (mut along, mut points) = (0.0, Vec::new());
        for SeenEdge { sample, length: part } in informed.seen_outline(frames, &fine) {
            along += part;
            if along >= length * scale {
                along -= length * scale;
                let by = deviation * scale * normal(rng);
                points.push([[0, 1].map(|i| sample.pixel[i] + by * sample.normal[i]), sample.normal]);
            }
        }
        points
    };
    rig.cameras.iter().map(&mut of_camera).collect()
}

/// The pose with the greatest posterior probability, by Gauss-Newton steps on distances along the normals of the
/// model's nearest outline points.
fn fit(
    informed: &InformedBody<'_>,
    rig: &CameraRig,
    observed: &[Vec<[[f64; 2]; 2]>],
    mean: &Pose,
    precision: &DVector<f64>,
    noise: OutlineNoise,
    length: f64,
) -> Pose {
    let body = informed.body;
    let mut pose = mean.clone();
    for _ in 0..6 {
        let frames = body.link_frames(&pose);
        let mut matrix = DMatrix::from_diagonal(precision);
        let mut away = vec![0.0; body.step_len()];
        body.difference(mean, &pose, &mut away);
        let mut gradient = precision.component_mul(&DVector::from_vec(away));
        for (camera, points) in rig.cameras.iter().zip(observed) {
            let (fine, scale) = enlarged(camera);
            let samples: Vec<OutlineSample> =
                informed.seen_outline(&frames, &fine).into_iter().map(|edge| edge.sample).collect();
            let weight = length * scale / (noise.0 * scale * scale * scale);
            let mut sums = Accumulator::new(body.links.len(), Point3::origin());
            for [point, outward] in points {
                let apart = |s: &&OutlineSample| (s.pixel[0] - point[0]).hypot(s.pixel[1] - point[1]);
                let faces = |s: &&OutlineSample| s.normal[0] * outward[0] + s.normal[1] * outward[1] > 0.5;
                let facing = samples.iter().filter(faces);
                let nearest = facing.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
                let value = (0..2).map(|i| nearest.normal[i] * (nearest.pixel[i] - point[i])).sum();
                let residual = OutlineResidual { value, gradient: nearest.normal, outline: 1.0 };
                sums.add(&fine, nearest, residual, 1.0, 1e9, weight);
            }
            let sums = sums.finish(body, &frames);
            matrix += sums.matrix;
            gradient += sums.gradient;
        }
        let step = -Cholesky::new(matrix).unwrap().solve(&gradient);
        pose = body.step(&pose, step.as_slice());
    }
    pose
}

#[test]
fn keypoints_of_two_cameras_bound_a_marker_as_triangulation_does() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 2);
    let frames = body.link_frames(&pose);
    let informed = InformedBody::new(&body);
    let points: Vec<KeypointPlace> = body.keypoint_places(KeypointLayout::Coco17).into_iter().flatten().collect();
    let rig = ring(3, 4.0, [640, 480]);
    let of = |deviation: f64| {
        rig.cameras.iter().map(|camera| informed.of_keypoints(&frames, camera, &points, |_, _| deviation)).sum()
    };
    let bounds = [1.0, 2.0].map(|deviation| total_mm(&body, &pose, &of(deviation)));
    assert!((bounds[1] / bounds[0] - 2.0).abs() < 0.02, "twice the deviation, twice the error: {bounds:?}");
    // a pixel at 4 m and 370 px of focal length is 11 mm; three cameras, and limbs of known length help
    assert!((5.0..60.0).contains(&bounds[0]), "root of the sum over 15 markers, mm: {bounds:?}");
    let none = informed.of_keypoints(&frames, &rig.cameras[0], &[], |_, _| 1.0);
    assert_eq!(none.norm(), 0.0);
}

#[test]
fn a_filter_is_between_the_last_frame_alone_and_a_known_last_pose() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 2);
    let information = of_rig(&body, &pose, &ring(2, 3.5, [320, 240]));
    let scales = ProposalScales::for_human(&body, 30.0).in_step_order();
    let precision = DVector::from_iterator(scales.len(), scales.iter().map(|scale| scale.powi(-2)));
    let known = covariance(&information, &precision).unwrap();
    let alone = covariance(&information, &InformedBody::new(&body).ignorance()).unwrap();
    let zero = DMatrix::zeros(body.step_len(), body.step_len());
    let first = filtered(&zero, &scales, &information).unwrap();
    assert!((&first - &known).norm() < 1e-9 * known.norm());
    let mut now = first;
    for _ in 0..50 {
        now = filtered(&now, &scales, &information).unwrap();
    }
    assert!(known.trace() < now.trace() && now.trace() < alone.trace());
}

/// The mean length in three dimensions is `2 sqrt(2 / pi) s`, in two `sqrt(pi / 2) s`, in one `sqrt(2 / pi) s`.
#[test]
fn the_mean_length_of_normal_deviates_is_that_of_the_textbook() {
    use std::f64::consts::PI;
    let of = |variances: [f64; 3]| mean_length(&Matrix3::from_diagonal(&Vector3::from(variances)));
    for (variances, expected) in [
        ([4.0, 4.0, 4.0], 4.0 * (2.0 / PI).sqrt()),
        ([4.0, 4.0, 0.0], 2.0 * (PI / 2.0).sqrt()),
        ([0.0, 4.0, 0.0], 2.0 * (2.0 / PI).sqrt()),
    ] {
        assert!((of(variances) / expected - 1.0).abs() < 2e-3, "{variances:?}: {} {expected}", of(variances));
    }
    assert_eq!(of([0.0; 3]), 0.0);
}

#[test]
fn a_camera_that_looks_away_tells_nothing() {
    let body = shipped("tracker25").unwrap();
    let pose = MARCH.pose(&body, 0);
    let mut camera = ring(1, 3.5, [320, 240]).cameras.remove(0);
    camera.camera_from_world.translation.vector.x += 100.0;
    let frames = body.link_frames(&pose);
    assert_eq!(InformedBody::new(&body).of_silhouette(&frames, &camera, NOISE).norm(), 0.0);
}
