use nalgebra::Vector3;

use super::super::super::gpdm_graph::GraphSettings;
use super::super::super::pose_chart::distance;
use super::super::settings::{InterTransition, JumpRule};
use super::*;
use skiagraph_core::body::{Motion, rotation_about};
use skiagraph_core::rng::{Purpose, stream};

/// A gait of 40 frames a cycle whose stride grows from cycle to cycle.
fn gait(body: &Humanoid, frames: usize) -> Motion {
    let poses = (0..frames)
        .map(|t| {
            let (phase, growth) = (t as f64 * std::f64::consts::TAU / 40.0, 1.0 + t as f64 * 0.01);
            let mut pose = body.zero_pose();
            for (i, angle) in pose.joint_angles.iter_mut().enumerate() {
                let dof = &body.degrees_of_freedom[i];
                let middle = 0.5 * (dof.lower + dof.upper);
                *angle = middle + 0.15 * growth * (phase + 0.8 * i as f64).sin();
            }
            let heading = rotation_about(&Vector3::z_axis(), 0.3);
            pose.world_from_root = Isometry3::from_parts(
                Vector3::new(0.02 * t as f64, 0.006 * t as f64, 0.95 + 0.02 * (2.0 * phase).cos()).into(),
                heading,
            );
            pose
        })
        .collect();
    Motion { frames_per_second: 60.0, poses }
}

fn learned() -> (Humanoid, Motion, Arc<GpdmGraph>) {
    let body = Humanoid::tracker25().unwrap();
    let motion = gait(&body, 90);
    let settings = GraphSettings { threshold_per_joint: 1e-4, ..GraphSettings::default() };
    let graph = GpdmGraph::learn(&body, std::slice::from_ref(&motion), &settings).unwrap();
    (body, motion, Arc::new(graph))
}

fn learned_model(settings: LatentSettings) -> (LatentModel, Motion) {
    let (body, motion, graph) = learned();
    (LatentModel::new(body, graph, settings).unwrap(), motion)
}

/// Particles stay on the manifold: an offset may lead a pose past a model.
fn without_noise() -> LatentSettings {
    LatentSettings { noise_floor: 0.0, start_jitter: 0.0, residual_scale: 0.0, ..LatentSettings::default() }
}

/// Jumps to frames nearer than a distance.
fn near(threshold: f64) -> LatentSettings {
    let rule = JumpRule::StayWeighted;
    let transition = InterTransition::Graph { rule, threshold, width: 0.02, velocity_weight: 0.02 };
    LatentSettings { transition, ..LatentSettings::default() }
}

/// The pose and its rate in a training frame of the recording.
fn recorded(graph: &GpdmGraph, segment: usize, row: usize) -> PoseRate {
    let rotations = &graph.segments[segment].rotations;
    PoseRate::between(&rotations[row - 1], rotations[row].clone(), graph.frames_per_second)
}

fn follow(model: &LatentModel, motion: &Motion, seed: u64) -> Vec<LatentParticle> {
    let mut rng = stream(seed, Purpose::MotionModel, 0, 0, 0);
    let mut particles = vec![model.sample_initial(&motion.poses[0], 0, 1, &mut rng)];
    for _ in 1..motion.poses.len() {
        let next = model.propagate(&particles[particles.len() - 1], &[], &mut rng);
        particles.push(next);
    }
    particles
}

#[test]
fn particles_pass_through_all_models() {
    let (model, motion) = learned_model(without_noise());
    assert!(model.graph.segments.len() >= 2, "one model would test nothing");
    for seed in 1..3 {
        let visited: std::collections::BTreeSet<usize> =
            follow(&model, &motion, seed).iter().map(|p| p.segment).collect();
        assert_eq!(visited.len(), model.graph.segments.len(), "visited {visited:?}");
    }
}

#[test]
fn natural_edges_lead_only_from_the_end_of_a_segment_to_the_next() {
    let (body, _, graph) = learned();
    let model = LatentModel::new(body, graph.clone(), LatentSettings::default()).unwrap();
    for segment in 0..graph.segments.len() - 1 {
        let rows = graph.segments[segment].rotations.len();
        let leaves = |row: usize| {
            let mut rng = stream(4, Purpose::MotionModel, 0, 0, 0);
            let moving = recorded(&graph, segment, row);
            // nothing is near enough for a jump
            jump(&graph, &model.jumps, &near(0.0), (segment, row), (&moving, None), &mut rng)
        };
        assert_eq!(leaves(rows - 1), Some(Candidate { segment: segment + 1, row: 0 }));
        assert_eq!(leaves(rows / 2), None);
    }
}

#[test]
fn the_root_walks_as_in_training_from_any_start() {
    let (model, motion) = learned_model(LatentSettings { root_noise_scale: 1.0, ..without_noise() });
    let mut elsewhere = motion.clone();
    let shift = Isometry3::new(Vector3::new(3.0, -2.0, 0.0), Vector3::z() * 1.2);
    elsewhere.poses.iter_mut().for_each(|pose| pose.world_from_root = shift * pose.world_from_root);
    let particles = follow(&model, &elsewhere, 2);
    let (last, truth) = (&particles[60].pose.world_from_root, &elsewhere.poses[60].world_from_root);
    let error = (last.translation.vector - truth.translation.vector).norm();
    assert!(error < 0.15, "{error} m after a walk of 1.25 m");
}

#[test]
fn a_switching_model_leaves_at_its_constant_rate() {
    let transition = InterTransition::Switching { probability: 0.2 };
    // a particle that lands at the end of a model would leave it for the next at once
    let settings = LatentSettings { transition, natural_edges: false, ..LatentSettings::default() };
    let (model, motion) = learned_model(settings);
    let (mut left, mut total) = (0, 0);
    for seed in 0..20 {
        for pair in follow(&model, &motion, seed).windows(2) {
            left += u32::from(pair[0].segment != pair[1].segment);
            total += 1;
        }
    }
    let rate = f64::from(left) / f64::from(total);
    assert!((rate - 0.2).abs() < 4.0 * (0.2_f64 * 0.8 / f64::from(total)).sqrt(), "{rate} over {total} frames");
}

#[test]
fn difference_is_the_inverse_of_step() {
    let (model, motion) = learned_model(LatentSettings::default());
    let particle = model.sample_initial(&motion.poses[5], 0, 1, &mut stream(3, Purpose::MotionModel, 0, 0, 0));
    let step: Vec<f64> = (0..model.deviations().len()).map(|i| 0.01 * (i as f64 - 2.0)).collect();
    let mut found = vec![0.0; step.len()];
    model.difference(&particle, &model.step(&particle, &step), &mut found);
    assert!(step.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
}

#[test]
fn a_model_of_another_body_is_refused() {
    let (_, _, graph) = learned();
    let error = LatentModel::new(Humanoid::actor().unwrap(), graph, LatentSettings::default()).unwrap_err();
    assert!(error.to_string().contains("degrees of freedom"), "{error}");
}

#[test]
fn particles_propagated_together_equal_those_propagated_one_by_one_to_the_bit() {
    let (body, motion, graph) = learned();
    let rules = [
        InterTransition::None,
        InterTransition::Switching { probability: 0.3 },
        InterTransition::default(),
        InterTransition::Graph { rule: JumpRule::Literal, threshold: 0.3, width: 0.02, velocity_weight: 0.0 },
    ];
    for transition in rules {
        let settings = LatentSettings { transition, ..LatentSettings::default() };
        let model = LatentModel::new(body.clone(), graph.clone(), settings).unwrap();
        let rng = |frame, i| stream(9, Purpose::MotionModel, frame, 0, i);
        // more than one batch, and an incomplete last one
        let count = 2 * BATCH + 37;
        let sample = |i| model.sample_initial(&motion.poses[2], i, count, &mut rng(0, i as u64));
        let mut together: Vec<LatentParticle> = (0..count).map(sample).collect();
        for frame in 1..8 {
            let mut rngs: Vec<ChaCha8Rng> = (0..count as u64).map(|i| rng(frame, i)).collect();
            let alone = together.iter().zip(rngs.clone()).map(|(p, mut rng)| model.propagate(p, &[], &mut rng));
            let alone: Vec<LatentParticle> = alone.collect();
            together = model.propagate_all(&together, &[], &mut rngs);
            for (a, b) in alone.iter().zip(&together) {
                assert_eq!((a.segment, a.recovered), (b.segment, b.recovered), "{transition:?}, frame {frame}");
                let parts = [a, b].map(|particle| (&particle.latent, &particle.offset, &particle.pose));
                assert_eq!(parts[0], parts[1], "{transition:?}, frame {frame}");
            }
        }
    }
}

#[test]
fn a_particle_at_the_end_of_the_recording_goes_to_the_frame_with_the_most_similar_motion() {
    let (body, _, graph) = learned();
    let last = graph.segments.len() - 1;
    let here = &graph.segments[last].rotations;
    let row = here.len() - 1;
    let moving = recorded(&graph, last, row);
    let model = LatentModel::new(body, graph.clone(), LatentSettings::default()).unwrap();
    let [gone, stays] = [1.0, 0.0].map(|threshold| {
        let mut rng = stream(4, Purpose::MotionModel, 0, 0, 0);
        jump(&graph, &model.jumps, &near(threshold), (last, row), (&moving, None), &mut rng)
    });
    let gone = gone.unwrap();
    let (segment, pose) = (&graph.segments[gone.segment], &graph.segments[gone.segment].rotations[gone.row]);
    assert!(gone.row + 2 < segment.rotations.len(), "{gone:?} is itself an end");
    // a cycle of 40 frames ago the body was in much the same pose; half a cycle ago in another
    assert!(distance(pose, &here[row]) < 0.5 * distance(&graph.segments[0].rotations[0], &here[row]).max(0.2));
    assert_eq!(stays, None, "nothing is similar enough");
}

#[test]
fn at_the_end_of_a_recording_particles_continue_with_the_motion_that_was_seen() {
    let (body, _, graph) = learned();
    let model = LatentModel::new(body, graph.clone(), LatentSettings::default()).unwrap();
    let last = graph.segments.len() - 1;
    let row = graph.segments[last].rotations.len() - 1;
    let moving = recorded(&graph, last, row);
    let reversed: Vec<_> = moving.velocities.iter().map(|v| -v).collect();
    let transition =
        InterTransition::Graph { rule: JumpRule::StayWeighted, threshold: 1e6, width: 0.02, velocity_weight: 1e3 };
    let settings = LatentSettings { transition, ..LatentSettings::default() };
    let far_from_reversed = |seen: Option<&[nalgebra::Vector3<f64>]>| {
        let mut rng = stream(4, Purpose::MotionModel, 0, 0, 0);
        let at = jump(&graph, &model.jumps, &settings, (last, row), (&moving, seen), &mut rng).unwrap();
        let velocities = model.jumps.frame(at).velocities.iter().zip(&reversed);
        velocities.map(|(a, b)| (a - b).norm_squared()).sum::<f64>()
    };
    assert!(far_from_reversed(Some(&reversed)) < 0.5 * far_from_reversed(None));
}

#[test]
fn the_first_particles_without_jitter_have_exactly_the_start_pose() {
    let settings = LatentSettings { start_jitter: 0.0, residual_scale: 0.5, ..LatentSettings::default() };
    let (model, motion) = learned_model(settings);
    let mut start = motion.poses[7].clone();
    start.joint_angles.iter_mut().for_each(|angle| *angle += 0.01);
    let particle = model.sample_initial(&start, 0, 1, &mut stream(3, Purpose::MotionModel, 0, 0, 0));
    assert!((&particle.pose.joint_angles - &start.joint_angles).amax() < 1e-9);
    let (a, b) = (particle.pose.world_from_root, start.world_from_root);
    assert!((a.translation.vector - b.translation.vector).norm() < 1e-9 && a.rotation.angle_to(&b.rotation) < 1e-7);
}

#[test]
fn a_jump_to_any_frame_keeps_the_pose() {
    let (model, motion) = learned_model(LatentSettings::default());
    let particle = follow(&model, &motion, 5).swap_remove(20);
    for (segment, s) in model.graph.segments.iter().enumerate() {
        for row in [0, s.rotations.len() / 2, s.rotations.len() - 1] {
            let departure = model.depart_from(Candidate { segment, row }, &particle);
            let mean = model.observation(segment, &departure.latent);
            let pose = model.roots.stand(&model.stand(&mean, &departure.offset), &particle.place.root);
            let (a, b) = (pose.world_from_root, particle.pose.world_from_root);
            assert!((&pose.joint_angles - &particle.pose.joint_angles).amax() < 1e-9, "model {segment}, row {row}");
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-9);
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7);
            // jumps compare the mean of the new model, so that a jump is not a velocity
            assert!(distance(&departure.rotations, &model.graph.chart.rotations_of(&mean)) < 1e-12);
        }
    }
}

#[test]
fn a_jump_without_offsets_lands_on_the_manifold() {
    let (model, motion) = learned_model(LatentSettings { residual_scale: 0.0, ..LatentSettings::default() });
    let particle = follow(&model, &motion, 5).swap_remove(20);
    assert!(model.depart_from(Candidate { segment: 0, row: 3 }, &particle).offset.is_empty());
}

#[test]
fn the_frequency_of_jumps_with_shared_weights_is_independent_of_the_number_of_candidates() {
    let (_, _, graph) = learned();
    let moving = recorded(&graph, 0, 10);
    let jumps = |rule: JumpRule, copies: usize| -> Vec<bool> {
        let mut graph = GpdmGraph::clone(&graph);
        graph.candidates = vec![Candidate { segment: 1, row: 5 }; copies];
        let transition = InterTransition::Graph { rule, threshold: 10.0, width: 5.0, velocity_weight: 0.0 };
        let settings = LatentSettings { transition, ..LatentSettings::default() };
        let jumps = Jumps::new(&graph, &training_means(&graph));
        let jumps = |seed| {
            let mut rng = stream(seed, Purpose::MotionModel, 0, 0, 0);
            jump(&graph, &jumps, &settings, (0, 10), (&moving, None), &mut rng).is_some()
        };
        (0..300).map(jumps).collect()
    };
    let one = jumps(JumpRule::StayWeighted, 1);
    assert!(one.contains(&true) && one.contains(&false));
    assert_eq!(jumps(JumpRule::StayShared, 1), one);
    assert_eq!(jumps(JumpRule::StayShared, 40), one);
    let count = |jumps: Vec<bool>| jumps.into_iter().filter(|j| *j).count();
    assert!(count(jumps(JumpRule::StayWeighted, 40)) > count(one));
}

#[test]
fn distances_below_a_limit_equal_fully_computed_ones() {
    let (_, _, graph) = learned();
    let rows = 1..graph.segments[0].rotations.len();
    let moving: Vec<PoseRate> = rows.map(|row| recorded(&graph, 0, row)).collect();
    let (mut below, mut above) = (0, 0);
    for (a, b) in moving.iter().flat_map(|a| moving.iter().map(move |b| (a, b))) {
        for (limit, weight) in [(0.1, 0.0), (0.4, 0.0), (0.4, 0.02), (2.0, 0.02)] {
            let full = Some(a.distance(b, weight)).filter(|d| *d < limit);
            assert_eq!(a.distance_below(b, weight, limit), full);
            (below, above) = (below + usize::from(full.is_some()), above + usize::from(full.is_none()));
        }
    }
    assert!(below > 100 && above > 100, "{below} below, {above} above");
}

/// Whether a particle in the middle of the first model jumps, with its pose and its mean replaced by those of frames
/// of the recording's second model; `None` keeps those of the first.
fn jumps_with(pose_like: Option<Candidate>, mean_like: Option<Candidate>) -> bool {
    let (body, motion, graph) = learned();
    let mut graph = GpdmGraph::clone(&graph);
    let target = Candidate { segment: 1, row: 5 };
    graph.candidates = vec![target];
    let rule =
        InterTransition::Graph { rule: JumpRule::StayWeighted, threshold: 1e-3, width: 1e9, velocity_weight: 0.0 };
    let settings = LatentSettings { transition: rule, ..LatentSettings::default() };
    let model = LatentModel::new(body, Arc::new(graph), settings).unwrap();
    let own = Candidate { segment: 0, row: 10 };
    let mut particle = follow(&model, &motion, 5).swap_remove(1);
    let mean = |at: Candidate| model.observation(at.segment, &model.training_latent(at));
    particle.segment = own.segment;
    particle.latent = model.training_latent(own);
    particle.mean = mean(mean_like.unwrap_or(own));
    particle.moving.rotations = model.graph.chart.rotations_of(&particle.mean);
    particle.pose = model.graph.chart.place(&mean(pose_like.unwrap_or(own)), &particle.place.root);
    // within the threshold a particle stays as often as it jumps
    let jumps = |seed| {
        model.depart(&particle, None, &mut stream(seed, Purpose::MotionModel, 0, 0, 0)).segment == target.segment
    };
    (0..20).any(jumps)
}

#[test]
fn a_particle_jumps_if_its_own_pose_is_near_and_not_if_the_maps_mean_is() {
    let target = Candidate { segment: 1, row: 5 };
    assert!(jumps_with(Some(target), None), "the pose is the candidate's, the mean rests elsewhere");
    assert!(!jumps_with(None, Some(target)), "the mean is the candidate's, the pose is elsewhere");
    assert!(!jumps_with(None, None));
}

#[test]
fn a_jump_leads_to_the_pose_of_the_maps_mean_not_to_the_recorded_one() {
    let (body, _, graph) = learned();
    let model = LatentModel::new(body, graph.clone(), LatentSettings::default()).unwrap();
    let mut apart = 0.0;
    for (segment, s) in graph.segments.iter().enumerate() {
        for row in 0..s.rotations.len() {
            let at = Candidate { segment, row };
            let mapped = graph.chart.rotations_of(&model.observation(segment, &model.training_latent(at)));
            let known = model.jumps.frame(at);
            assert!(distance(&known.rotations, &mapped) < 1e-12, "model {segment}, row {row}");
            apart += distance(&known.rotations, &s.rotations[row]);
            // the velocity is that of the means: by hand, rotation vectors from row to row divided by a frame's time
            let before = Candidate { segment, row: row.max(1) - 1 };
            let after = Candidate { segment, row: row.max(1) };
            let [a, b] = [before, after].map(|at| model.observation(segment, &model.training_latent(at)));
            let (a, b) = (graph.chart.rotations_of(&a), graph.chart.rotations_of(&b));
            for ((a, b), velocity) in a.iter().zip(&b).zip(&known.velocities) {
                assert!((skiagraph_core::body::rotation_vector(&(a.inverse() * b)) * 60.0 - velocity).norm() < 1e-6);
            }
        }
    }
    assert!(apart > 1e-9, "the map interpolates the recording, so nothing is tested");
}

#[test]
fn a_jump_moves_no_foothold() {
    let (model, motion) = learned_model(LatentSettings::default());
    let particle = follow(&model, &motion, 5).swap_remove(20);
    let moved = |departure: TransitionSource| {
        let mut rng = stream(9, Purpose::MotionModel, 0, 0, 0);
        let journey = PendingParticle { index: 0, state: &particle, departure, rng: &mut rng };
        let arrived = model.advance(&mut [journey]).swap_remove(0).1;
        arrived.place.footholds.unwrap().places().map(|place| place.translation.vector)
    };
    let stays = TransitionSource {
        segment: particle.segment,
        latent: particle.latent.clone(),
        before: particle.before.clone(),
        offset: particle.offset.clone(),
        rotations: particle.moving.rotations.clone(),
    };
    let (here, there) = (moved(stays), moved(model.depart_from(Candidate { segment: 1, row: 3 }, &particle)));
    assert_eq!(here, there);
}

#[test]
fn in_a_joint_model_no_motion_leads_into_the_next() {
    let body = Humanoid::tracker25().unwrap();
    let (one, mut other) = (gait(&body, 60), gait(&body, 50));
    other.poses.reverse();
    let settings = GraphSettings { single: true, joint: true, ..GraphSettings::default() };
    let graph = GpdmGraph::learn(&body, &[one, other], &settings).unwrap();
    let graph = Arc::new(graph);
    let transition = InterTransition::None;
    let settings = LatentSettings { transition, ..LatentSettings::default() };
    let model = LatentModel::new(body, graph.clone(), settings).unwrap();
    // velocities are those of steps within a motion
    let at = |row: usize| model.jumps.frame(Candidate { segment: 0, row });
    assert_eq!(at(60).velocities, at(61).velocities);
    let across = PoseRate::between(&at(59).rotations, at(60).rotations.clone(), 60.0);
    assert_ne!(at(60).velocities, across.velocities);
    assert_eq!(model.frame_before(Candidate { segment: 0, row: 60 }).row, 60);
    assert_eq!(model.frame_before(Candidate { segment: 0, row: 61 }).row, 60);
    // a particle leaves for another frame at the end of both motions, and nowhere else
    let leaves = |row: usize| {
        let mut rng = stream(4, Purpose::MotionModel, 0, 0, 0);
        jump(&graph, &model.jumps, &settings, (0, row), (at(row), None), &mut rng)
    };
    for row in [58, 59, 108, 109] {
        let gone = leaves(row).unwrap().row;
        assert!(![58, 59, 108, 109].contains(&gone), "from {row} to {gone}");
    }
    assert!([0, 30, 57, 60, 90].iter().all(|row| leaves(*row).is_none()));
}

/// A particle in the middle of the gait that can descend, and its model.
fn underway() -> (LatentModel, LatentParticle) {
    let (model, motion) = learned_model(LatentSettings::default());
    let model = model.with_descent();
    let particle = follow(&model, &motion, 3).swap_remove(30);
    (model, particle)
}

/// Evidence for the pose `target`, with this weight for every number of a step.
fn says(body: &Humanoid, here: &Pose, target: &Pose, weight: f64) -> NormalEquations {
    let mut towards = vec![0.0; body.step_len()];
    body.difference(here, target, &mut towards);
    let towards = nalgebra::DVector::from_vec(towards);
    NormalEquations {
        matrix: nalgebra::DMatrix::identity(towards.len(), towards.len()) * weight,
        gradient: -weight * &towards,
        cost: weight * towards.norm_squared(),
        weight,
        residuals: towards.len(),
        prior_weight: 1.0,
    }
}

fn apart(body: &Humanoid, a: &Pose, b: &Pose) -> f64 {
    let mut step = vec![0.0; body.step_len()];
    body.difference(a, b, &mut step);
    step.iter().map(|s| s * s).sum::<f64>().sqrt()
}

#[test]
fn a_descent_without_evidence_leads_to_the_models_prediction() {
    let (model, particle) = underway();
    let body = model.body.clone();
    let nothing = |state: &LatentParticle| says(&body, &state.pose, &state.pose, 0.0);
    let mut state = particle.clone();
    let mut moved = Vec::new();
    for _ in 0..4 {
        let next = model.descend(&state, &particle.pose, nothing(&state)).unwrap();
        moved.push(apart(&body, &state.pose, &next.pose));
        state = next;
    }
    assert!(moved[0] > 1e-3 && moved[3] < 1e-3 * moved[0], "{moved:?}");
}

#[test]
fn a_descent_finds_a_pose_supported_by_model_and_evidence() {
    let (model, particle) = underway();
    let body = model.body.clone();
    let expected = particle.expected.clone().unwrap();
    // Another particle with the same prediction.
    let mut rng = stream(9, Purpose::MotionModel, 0, 0, 0);
    let offset = model.residuals[particle.segment].next(&particle.offset, &mut rng);
    let step: Vec<f64> = [0.3 * expected.deviation, -0.5 * expected.deviation, 0.0]
        .into_iter()
        .chain(offset.iter().zip(&particle.offset).map(|(a, b)| a - b))
        .chain([0.004, -0.003, 0.002])
        .collect();
    let target = model.step(&particle, &step).pose;
    let before = apart(&body, &particle.pose, &target);
    let mut state = particle;
    for _ in 0..8 {
        let evidence = says(&body, &state.pose, &target, 1e9);
        state = model.descend(&state, &target, evidence).unwrap();
    }
    let after = apart(&body, &state.pose, &target);
    assert!(before > 0.02 && after < 0.02 * before, "{before} became {after}");
}

#[test]
fn particles_with_and_without_descent_are_identical_to_the_bit() {
    let (model, motion) = learned_model(LatentSettings::default());
    let [one, other] = [model.clone(), model.with_descent()].map(|model| follow(&model, &motion, 5));
    assert!(one.iter().zip(&other).all(|(a, b)| a.pose == b.pose));
    assert!(one.iter().all(|particle| particle.expected.is_none()) && other[1].expected.is_some());
}
