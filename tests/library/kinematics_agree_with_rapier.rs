//! Forward kinematics against rapier's reduced-coordinate multibody: another implementation, in single precision.

use rand::RngExt;
use rapier3d::prelude::*;
use skiagraph_core::body::{Humanoid, JointKind, Pose};
use skiagraph_core::rng::{Purpose, stream};

/// `world_from_link` translations of all links as rapier computes them.
fn rapier_positions(body: &Humanoid, pose: &Pose) -> Vec<[f64; 3]> {
    let mut world = PhysicsWorld::new();
    let insert = |world: &mut PhysicsWorld, builder: RigidBodyBuilder| {
        world.insert_body(builder.can_sleep(false).additional_mass(1.0))
    };
    let root = insert(&mut world, RigidBodyBuilder::dynamic().pose(isometry(&pose.world_from_root)));
    let mut links = vec![root];
    let mut driven = Vec::new();
    for joint in &body.joints {
        let child = insert(&mut world, RigidBodyBuilder::dynamic());
        let origin = isometry(&joint.parent_from_joint);
        let (data, angle) = match &joint.kind {
            JointKind::Fixed => {
                (GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES).local_frame1(origin).build(), None)
            }
            JointKind::Revolute { axis, drive } => {
                let axis = Vector::new(axis.x as f32, axis.y as f32, axis.z as f32);
                let along = rapier3d::math::Pose::from_rotation(Rotation::from_rotation_arc(Vector::X, axis));
                let data = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
                    .local_frame1(origin * along)
                    .local_frame2(along)
                    .build();
                (data, Some(pose.joint_angles[drive.degree_of_freedom]))
            }
            other => panic!("unexpected {other:?} in a shipped robot"),
        };
        let handle = world.multibody_joints.insert(links[joint.parent], child, data, true).unwrap();
        driven.extend(angle.map(|angle| (handle, angle)));
        links.push(child);
    }
    let index = world.multibody_joints.rigid_body_link(root).unwrap().multibody;
    let assembly: Vec<(usize, f64)> = driven
        .iter()
        .map(|(handle, angle)| {
            let (multibody, link) = world.multibody_joints.get(*handle).unwrap();
            (multibody.link(link).unwrap().assembly_id(), *angle)
        })
        .collect();
    let multibody = world.multibody_joints.get_multibody_mut(index).unwrap();
    multibody.forward_kinematics(&world.bodies, true);
    let mut displacement = vec![0.0; multibody.ndofs()];
    assembly.iter().for_each(|(id, angle)| displacement[*id] = *angle as Real);
    multibody.apply_displacements(&displacement);
    multibody.forward_kinematics(&world.bodies, false);
    multibody.update_rigid_bodies(&mut world.bodies, true);
    let position = |handle: &RigidBodyHandle| world.bodies[*handle].translation();
    links.iter().map(position).map(|p| [f64::from(p.x), f64::from(p.y), f64::from(p.z)]).collect()
}

fn isometry(from: &nalgebra::Isometry3<f64>) -> rapier3d::math::Pose {
    let (t, q) = (from.translation, from.rotation);
    rapier3d::math::Pose::from_parts(
        Vector::new(t.x as f32, t.y as f32, t.z as f32),
        Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32),
    )
}

#[test]
fn every_link_of_the_shipped_robots_is_where_rapier_places_it() {
    for body in [Humanoid::tracker25().unwrap(), Humanoid::actor().unwrap()] {
        for draw in 0..20 {
            let mut rng = stream(draw, Purpose::Initialisation, 0, 0, 0);
            let mut pose = body.zero_pose();
            pose.world_from_root = nalgebra::Isometry3::new(
                nalgebra::Vector3::new(0.3, -0.2, 0.9),
                nalgebra::Vector3::new(0.1, 0.2, rng.random_range(-3.0..3.0)),
            );
            for (angle, dof) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
                *angle = rng.random_range(dof.lower.max(-3.0)..=dof.upper.min(3.0));
            }
            let frames = body.link_frames(&pose);
            for (link, expected) in rapier_positions(&body, &pose).iter().enumerate() {
                let apart = (frames[link].translation.vector - nalgebra::Vector3::from(*expected)).norm();
                assert!(apart < 5e-6, "{} {}: {apart} m apart", body.name, body.links[link].name);
            }
        }
    }
}
