//! Planted misreadings are found with all their parts, and poor trackers are not taken for misread files.

use nalgebra::{Point3, Rotation3, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::body::{LANDMARKS, Landmark, Markers};
use crate::test_figure::standing;

const FRAMES: usize = 240;
const RATE: f64 = 60.0;

/// The pose at a time (seconds) of a walker in a curve at 1.2 m/s who swings arms and legs.
fn walker(time: f64) -> Markers {
    let phase = std::f64::consts::TAU * time / 1.1;
    let (heading, place) =
        (0.4 * time, Vector3::new(3.0 * (0.4 * time).sin() - 1.0, 3.0 - 3.0 * (0.4 * time).cos(), 0.0));
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), heading);
    std::array::from_fn(|marker| {
        let point = standing()[marker]?;
        let name = LANDMARKS[marker].name();
        let side = if name.starts_with("left") { 1.0 } else { -1.0 };
        let reach = match LANDMARKS[marker] {
            Landmark::LeftKnee | Landmark::RightKnee => 0.18,
            Landmark::LeftAnkle | Landmark::RightAnkle => 0.35,
            Landmark::LeftElbow | Landmark::RightElbow => -0.1,
            Landmark::LeftWrist | Landmark::RightWrist => -0.25,
            _ => 0.0,
        };
        let swung = point + Vector3::new(side * reach * phase.sin(), 0.0, 0.02 * (2.0 * phase).cos());
        Some(Point3::from(turn * swung.coords + place))
    })
}

fn truth() -> Vec<Markers> {
    (0..FRAMES).map(|frame| walker(frame as f64 / RATE)).collect()
}

/// The truth with a slowly changing error of every marker, of this standard deviation per axis.
fn noisy(deviation: f64, seed: u64) -> Vec<Markers> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut error = [Vector3::zeros(); 15];
    let mut next = |random: &mut ChaCha8Rng| {
        error.iter_mut().for_each(|error| *error = 0.95 * *error + 0.3 * deviation * normal(random));
        error
    };
    let of = |markers: Markers| {
        let errors = next(&mut random);
        std::array::from_fn(|marker| markers[marker].map(|point| point + errors[marker]))
    };
    truth().into_iter().map(of).collect()
}

fn normal(random: &mut impl Rng) -> Vector3<f64> {
    // the sum of twelve uniform numbers is nearly normal
    Vector3::from_fn(|_, _| (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0)
}

fn find_in_repetitions(estimates: &[Vec<Markers>]) -> Option<Misreading> {
    find_with_cameras(estimates, &[])
}

fn find_with_cameras(estimates: &[Vec<Markers>], cameras: &[Vec<Point3<f64>>]) -> Option<Misreading> {
    let truth = truth();
    let swapped: Vec<Vec<Markers>> =
        estimates.iter().map(|estimate| estimate.iter().map(with_sides_exchanged).collect()).collect();
    let given = estimates.iter().zip(&swapped);
    let given = given.map(|(markers, swapped)| GivenPositions { markers, swapped, roots: None }).collect();
    let scales = vec![1.0, 0.01, 0.001, 0.0254, 0.3048, 100.0, 1000.0];
    find_misreading(&MisreadingCase { frames_per_second: RATE, truth: &truth, given, cameras, scales })
}

fn find(estimate: &[Markers]) -> Option<Misreading> {
    find_in_repetitions(&[estimate.to_vec()])
}

fn mapped(estimate: &[Markers], change: impl Fn(Point3<f64>) -> Point3<f64>) -> Vec<Markers> {
    estimate.iter().map(|markers| markers.map(|marker| marker.map(&change))).collect()
}

/// Frame f of the result is frame f - by of the estimate.
fn delayed(estimate: &[Markers], by: i64) -> Vec<Markers> {
    let at = |frame: usize| (frame as i64 - by).clamp(0, FRAMES as i64 - 1) as usize;
    (0..FRAMES).map(|frame| estimate[at(frame)]).collect()
}

#[test]
fn every_order_of_the_axes_is_found_in_every_unit() {
    let estimate = noisy(0.05, 1);
    let orders = AxisOrder::all().into_iter();
    for (order, scale) in orders.flat_map(|order| [1.0, 0.01, 0.001].map(|scale| (order, scale))) {
        let file_from_set = order.set_from_file().transpose();
        let written = mapped(&estimate, |point| Point3::from(file_from_set * point.coords / scale));
        match find(&written) {
            Some(found) => {
                assert_eq!((found.correction.axes, found.correction.scale), (order, scale), "{order}");
                assert!(found.error_corrected_m < 0.15 && found.correction.kinds().len() <= 2, "{order}: {found:?}");
            }
            None => assert_eq!((order, scale), (AxisOrder::SAME, 1.0)),
        }
    }
}

#[test]
fn sides_shifts_origins_and_names_are_found_alone_and_together() {
    let estimate = noisy(0.02, 2);
    let swapped: Vec<Markers> = estimate.iter().map(with_sides_exchanged).collect();
    let found = find(&swapped).unwrap().correction;
    assert_eq!(found, Correction { swapped: true, ..Correction::none() });
    let found = find(&delayed(&noisy(0.004, 5), -2)).unwrap().correction;
    assert_eq!(found, Correction { shift: 2, ..Correction::none() }, "a tracker cannot be early");
    for shift in [5_i64, -3, -12, 40] {
        // a file whose first frame is frame `shift` of the set
        let found = find(&delayed(&estimate, -shift)).unwrap().correction;
        assert_eq!(found, Correction { shift, ..Correction::none() }, "{shift}");
    }
    let away = Vector3::new(0.8, -1.5, 0.0);
    let found = find(&mapped(&estimate, |point| point - away)).unwrap().correction;
    assert!(found.kinds() == [MisreadingKind::Offset] && (found.offset - away).norm() < 0.05, "{found:?}");
    let exchanged = |markers: Markers| {
        let mut names: [usize; 15] = std::array::from_fn(|marker| marker);
        names[Landmark::LeftKnee as usize] = Landmark::LeftWrist as usize;
        names[Landmark::LeftWrist as usize] = Landmark::HeadTop as usize;
        names[Landmark::HeadTop as usize] = Landmark::LeftKnee as usize;
        (names.map(|name| markers[name]), names)
    };
    let renamed: Vec<Markers> = estimate.iter().map(|markers| exchanged(*markers).0).collect();
    let found = find(&renamed).unwrap().correction;
    assert_eq!(found.kinds(), [MisreadingKind::Names]);
    let names = exchanged([None; 15]).1;
    // the inverse of the exchange of names
    assert!((0..15).all(|marker| names[found.names[marker]] == marker), "{:?}", found.names);
    let turned = mapped(&swapped, |point| AxisOrder::Y_UP.set_from_file().transpose() * point);
    let found = find(&delayed(&turned, -5)).unwrap().correction;
    let all = Correction { axes: AxisOrder::Y_UP, swapped: true, shift: 5, ..Correction::none() };
    assert_eq!(found, all);
}

#[test]
fn the_misreading_of_a_poor_estimate_is_found_too() {
    let estimate = noisy(0.12, 3);
    let swapped: Vec<Markers> = estimate.iter().map(with_sides_exchanged).collect();
    assert_eq!(find(&swapped).unwrap().correction.kinds(), [MisreadingKind::Sides]);
    let turned = mapped(&estimate, |point| AxisOrder::BVH.set_from_file().transpose() * point);
    assert_eq!(find(&turned).unwrap().correction.axes, AxisOrder::BVH);
}

#[test]
fn the_majority_of_repetitions_decides_if_some_are_lost() {
    let turn = |estimate: Vec<Markers>| mapped(&estimate, |point| AxisOrder::Y_UP.set_from_file().transpose() * point);
    let lost = vec![walker(2.0); FRAMES];
    let all: Vec<Vec<Markers>> = (0..20).map(|seed| turn(noisy(0.05, seed))).chain([lost]).collect();
    assert_eq!(find_in_repetitions(&all).unwrap().correction.kinds(), [MisreadingKind::Axes]);
}

/// Estimates of poor trackers whose files are read correctly, with descriptions of their errors.
fn poor_trackers() -> Vec<(&'static str, Vec<Markers>)> {
    let truth = truth();
    let middle = |markers: &Markers| {
        let sum: Vector3<f64> = markers.iter().flatten().map(|point| point.coords).sum();
        Point3::from(sum / 15.0)
    };
    let smoothed = |share: f64| {
        let mut at = truth[0];
        let step = |markers: &Markers| {
            at = std::array::from_fn(|m| Some(at[m]? + share * (markers[m]? - at[m]?)));
            at
        };
        truth.iter().map(step).collect::<Vec<Markers>>()
    };
    let averaged = |width: usize| -> Vec<Markers> {
        let of = |frame: usize| {
            let part = &truth[frame.saturating_sub(width - 1)..=frame];
            std::array::from_fn(|m| {
                let sum: Vector3<f64> = part.iter().filter_map(|markers| Some(markers[m]?.coords)).sum();
                Some(Point3::from(sum / part.len() as f64))
            })
        };
        (0..FRAMES).map(of).collect()
    };
    let framewise = |change: &dyn Fn(usize, &Markers) -> Markers| -> Vec<Markers> {
        truth.iter().enumerate().map(|(frame, markers)| change(frame, markers)).collect()
    };
    let legs = |markers: &Markers| {
        let mut other = *markers;
        [(8, 11), (9, 12), (10, 13)].iter().for_each(|(left, right)| other.swap(*left, *right));
        other
    };
    let about = |markers: &Markers, change: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
        let middle = middle(markers);
        markers.map(|marker| marker.map(|point| middle + change(point - middle)))
    };
    // the pose of half a period later
    let wrong_foot = |frame: usize, markers: &Markers| {
        let later = walker(frame as f64 / RATE + 0.55);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -0.4 * 0.55);
        later.map(|marker| marker.map(|point| middle(markers) + turn * (point - middle(&later))))
    };
    let rigid = {
        let first = middle(&truth[0]);
        framewise(&|_, markers| truth[0].map(|point| point.map(|point| point + (middle(markers) - first))))
    };
    vec![
        ("frozen", vec![truth[0]; FRAMES]),
        ("centroid", framewise(&|_, markers| [Some(middle(markers)); 15])),
        ("rigid body on the right path", rigid),
        ("late by one frame", delayed(&truth, 1)),
        ("late by two frames", delayed(&truth, 2)),
        ("exponential filter", smoothed(0.3)),
        ("slow exponential filter", smoothed(0.1)),
        ("moving average of 9", averaged(9)),
        ("moving average of 15", averaged(15)),
        ("drift", framewise(&|f, m| mapped(&[*m], |p| p + Vector3::new(0.004 * f as f64, 0.002 * f as f64, 0.0))[0])),
        ("calibration 6 cm off", mapped(&truth, |point| point + Vector3::new(0.04, -0.03, 0.03))),
        ("calibration 15 cm off", mapped(&truth, |point| point + Vector3::new(0.12, -0.09, 0.0))),
        ("body 5 % too large", mapped(&truth, |point| Point3::from(1.05 * point.coords))),
        ("legs exchanged for half of the time", framewise(&|f, m| if f > 120 { legs(m) } else { *m })),
        ("legs exchanged from the start", framewise(&|_, m| legs(m))),
        ("all limbs exchanged later", framewise(&|f, m| if f > 60 { with_sides_exchanged(m) } else { *m })),
        (
            "one arm lost",
            framewise(&|_, m| {
                let mut lost = *m;
                [3, 4].iter().for_each(|marker| lost[*marker] = m[8]);
                lost
            }),
        ),
        ("mirrored in depth", framewise(&|_, m| about(m, &|v| Vector3::new(v.x, -v.y, v.z)))),
        ("turns around", framewise(&|f, m| if f > 30 { about(m, &|v| Vector3::new(-v.x, -v.y, v.z)) } else { *m })),
        (
            "lies down halfway",
            framewise(&|f, m| if f > 100 { about(m, &|v| Vector3::new(v.z, v.y, -v.x)) } else { *m }),
        ),
        ("lost halfway", framewise(&|f, m| if f > 100 { truth[100].map(|p| p.map(|p| p + Vector3::x())) } else { *m })),
        (
            "depth error that oscillates",
            framewise(&|f, m| mapped(&[*m], |p| p + Vector3::x() * 0.6 * (0.03 * f as f64).sin())[0]),
        ),
        ("depth too small", framewise(&|_, m| about(m, &|v| Vector3::new(0.3 * v.x, v.y, v.z)))),
        ("starts on the wrong foot", framewise(&|f, m| wrong_foot(f, m))),
        ("changes to the wrong foot", framewise(&|f, m| if f > 30 { wrong_foot(f, m) } else { *m })),
        ("mirrored sideways on the right path", framewise(&|_, m| about(m, &|v| Vector3::new(-v.x, v.y, v.z)))),
        ("small noise", noisy(0.03, 11)),
        ("much noise", noisy(0.25, 12)),
        ("very much noise", noisy(0.6, 13)),
    ]
}

#[test]
fn poor_trackers_are_not_taken_for_misread_files() {
    for (name, estimate) in poor_trackers() {
        let found = find(&estimate);
        assert!(found.is_none(), "{name}: {:?}", found.map(|found| (found.correction.kinds(), found)));
    }
}

#[test]
fn poor_trackers_with_noise_are_not_taken_for_misread_files() {
    let mut wrong = Vec::new();
    for seed in 0..4 {
        let noise = noisy(0.06, 100 + seed);
        let exact = truth();
        for (name, estimate) in poor_trackers() {
            let noisy: Vec<Markers> = (0..FRAMES)
                .map(|f| std::array::from_fn(|m| Some(estimate[f][m]? + (noise[f][m]? - exact[f][m]?))))
                .collect();
            wrong.extend(find(&noisy).map(|found| (name, seed, found.correction.kinds())));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn nothing_is_found_in_noise() {
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(200 + seed);
        // as large as a body, at one place or along the path, in metres or millimetres
        let scale = if seed % 2 == 0 { 1.0 } else { 1000.0 };
        let place = |time: f64| {
            if seed % 4 < 2 { Vector3::z() } else { walker(time)[0].map_or_else(Vector3::zeros, |at| at.coords) }
        };
        let noise: Vec<Markers> = (0..FRAMES)
            .map(|frame| {
                let middle = place(frame as f64 / RATE);
                std::array::from_fn(|_| Some(Point3::from(scale * (middle + 0.4 * normal(&mut random)))))
            })
            .collect();
        let found = find(&noise).map(|found| found.correction.kinds()).unwrap_or_default();
        // only the unit can be known from the size
        assert!(found.iter().all(|kind| scale != 1.0 && *kind == MisreadingKind::Units), "{seed}: {found:?}");
    }
}

#[test]
fn correct_and_incomparable_estimates_have_no_misreading() {
    assert_eq!(find(&truth()), None);
    assert_eq!(find(&vec![[None; 15]; FRAMES]), None);
    let few: Vec<Markers> = mapped(&truth(), |point| AxisOrder::Y_UP.set_from_file().transpose() * point)
        .into_iter()
        .map(|markers| std::array::from_fn(|marker| markers[marker].filter(|_| marker < 2)))
        .collect();
    assert_eq!(find(&few), None, "two markers do not determine axes");
}

#[test]
fn an_error_of_depth_is_not_another_origin_but_an_offset_that_cameras_see_is() {
    let camera = Point3::new(6.0, -4.0, 1.4);
    let deeper = |share: f64| mapped(&noisy(0.02, 21), |point| point + share * (point - camera));
    let one = [vec![camera]];
    assert!(find(&deeper(0.1)).is_some(), "without cameras it could be another origin");
    assert_eq!(find_with_cameras(&[deeper(0.1)], &one), None);
    assert_eq!(find_with_cameras(&[deeper(-0.1)], &one), None);
    let pair = [vec![camera, camera + Vector3::new(0.1, 0.1, 0.0)]];
    assert_eq!(find_with_cameras(&[deeper(0.1)], &pair), None, "cameras side by side see depth no better than one");
    let kinds = |found: Option<Misreading>| found.map(|found| found.correction.kinds());
    let moved = mapped(&noisy(0.02, 22), |point| point + Vector3::new(0.5, 0.9, 0.0));
    assert_eq!(kinds(find_with_cameras(&[moved], &one)), Some(vec![MisreadingKind::Offset]));
    let around = [vec![camera, Point3::new(4.0, 6.0, 1.4)]];
    assert_eq!(kinds(find_with_cameras(&[deeper(0.1)], &around)), Some(vec![MisreadingKind::Offset]));
    let turned = mapped(&deeper(0.1), |point| AxisOrder::Y_UP.set_from_file().transpose() * point);
    let found = kinds(find_with_cameras(&[turned], &one)).unwrap();
    assert!(found.contains(&MisreadingKind::Axes), "{found:?}");
}

#[test]
fn the_majority_of_repetitions_decides_whichever_they_are() {
    let turn = |estimate: Vec<Markers>| mapped(&estimate, |point| AxisOrder::Y_UP.set_from_file().transpose() * point);
    for lost in 0..5 {
        let estimate = |seed: u64| {
            if seed == lost {
                // lost after 50 frames
                noisy(0.05, seed).into_iter().enumerate().map(|(f, m)| if f < 50 { m } else { walker(0.8) }).collect()
            } else {
                noisy(0.05, seed)
            }
        };
        let all: Vec<Vec<Markers>> = (0..5).map(|seed| turn(estimate(seed))).collect();
        let found = find_in_repetitions(&all).map(|found| found.correction.kinds());
        assert_eq!(found, Some(vec![MisreadingKind::Axes]), "repetition {lost}");
    }
}

#[test]
fn a_bias_along_the_path_does_not_change_the_shift() {
    let ahead = |metres: f64| {
        let of = |frame: usize| {
            let (now, next) = (walker(frame as f64 / RATE), walker((frame + 1) as f64 / RATE));
            let step = (next[0].unwrap() - now[0].unwrap()).normalize() * metres;
            now.map(|marker| marker.map(|point| point + step))
        };
        (0..FRAMES).map(of).collect::<Vec<Markers>>()
    };
    let shift = |estimate: Vec<Markers>| find(&estimate).map(|found| found.correction.shift);
    assert_eq!(shift(delayed(&ahead(-0.02), 6)), Some(-6));
    assert_eq!(shift(delayed(&ahead(0.02), 6)), Some(-6));
    assert_eq!(shift(delayed(&ahead(-0.02), 2)), None, "a filter's delay, and a bias");
}

/// The walker on a straight path: its pose is the same after 66 frames.
fn straight_walker(time: f64) -> Markers {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -0.4 * time);
    let place = Vector3::new(3.0 * (0.4 * time).sin() - 1.0, 3.0 - 3.0 * (0.4 * time).cos(), 0.0);
    walker(time)
        .map(|marker| marker.map(|point| Point3::from(turn * (point.coords - place) + Vector3::x() * 1.2 * time)))
}

#[test]
fn a_shift_at_the_end_of_those_searched_is_found_and_the_end_is_told() {
    let truth: Vec<Markers> = (0..FRAMES).map(|frame| straight_walker(frame as f64 / RATE)).collect();
    for shift in [59_i64, 60, -60] {
        let markers = delayed(&truth, -shift);
        let swapped: Vec<Markers> = markers.iter().map(with_sides_exchanged).collect();
        let given = vec![GivenPositions { markers: &markers, swapped: &swapped, roots: None }];
        let case = MisreadingCase { frames_per_second: RATE, truth: &truth, given, cameras: &[], scales: vec![0.001] };
        let found = find_misreading(&case).unwrap_or_else(|| panic!("{shift}"));
        assert_eq!(found.correction, Correction { shift, ..Correction::none() }, "{shift}");
        assert_eq!(found.longest_shift, 60);
    }
}
