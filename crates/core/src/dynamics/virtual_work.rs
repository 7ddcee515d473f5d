//! The recursion of inverse dynamics against the principle of virtual work, which uses only kinematics.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{PointForce, inverse_dynamics};
use crate::body::{
    DegreeOfFreedom, Drive, Humanoid, Inertia, Joint, JointKind, Link, LinkFrames, Pose, ROOT_STEP, rotation_vector,
};
use crate::dynamics::GRAVITY;

/// Time between the poses of a finite difference, seconds.
const INSTANT: f64 = 1e-4;

/// tracker25 with a ball joint, a slider and a floating link on its head.
fn body_with_every_kind_of_joint() -> Humanoid {
    let mut body = Humanoid::tracker25().unwrap();
    let mut parent = body.links.iter().position(|link| link.name == "head").unwrap();
    for (number, freedoms) in [3, 1, 6].into_iter().enumerate() {
        let first = body.degrees_of_freedom.len();
        let kind = match freedoms {
            3 => JointKind::Spherical { first },
            1 => JointKind::Prismatic { axis: Vector3::y_axis(), drive: Drive::direct(first) },
            _ => JointKind::Floating { first },
        };
        for freedom in 0..freedoms {
            let mut like: DegreeOfFreedom = body.degrees_of_freedom[0].clone();
            like.name = format!("carried_{number}_{freedom}");
            body.degrees_of_freedom.push(like);
        }
        let parent_from_joint = Isometry3::new(Vector3::new(0.1, -0.2, 0.15), Vector3::new(0.3, 0.2, -0.4));
        body.joints.push(Joint { name: format!("carried_{number}_joint"), parent, parent_from_joint, kind });
        let tensor = Matrix3::new(0.05, 0.01, 0.0, 0.01, 0.04, -0.005, 0.0, -0.005, 0.03);
        let inertia = Inertia { mass: 2.0 + number as f64, centre_of_mass: Point3::new(0.02, 0.05, -0.1), tensor };
        body.links.push(Link { name: format!("carried_{number}"), solids: Vec::new(), inertia: Some(inertia) });
        parent = body.links.len() - 1;
    }
    body
}

/// Irregular numbers that no recursion could reproduce by accident.
fn numbers(count: usize, scale: f64, start: f64) -> Vec<f64> {
    (0..count).map(|i| scale * (start + 1.7 * i as f64).sin()).collect()
}

struct Swing {
    body: Humanoid,
    pose: Pose,
    rates: Vec<f64>,
    accelerations: Vec<f64>,
}

impl Swing {
    fn new(body: Humanoid) -> Self {
        let count = body.step_len();
        let pose = body.step(&body.zero_pose(), &numbers(count, 0.6, 0.3));
        Self { rates: numbers(count, 2.0, 1.1), accelerations: numbers(count, 15.0, 2.9), pose, body }
    }

    fn frames_at(&self, time: f64) -> LinkFrames {
        let along = |(rate, acceleration): (&f64, &f64)| rate * time + 0.5 * acceleration * time * time;
        let step: Vec<f64> = self.rates.iter().zip(&self.accelerations).map(along).collect();
        self.body.link_frames(&self.body.step(&self.pose, &step))
    }

    /// Of every link: mass times acceleration minus gravity, and rate of the angular momentum about the centre of
    /// mass; world.
    fn inertial(&self) -> Vec<Option<[Vector3<f64>; 2]>> {
        let [before, early, now, late, after] =
            [-1.0, -0.5, 0.0, 0.5, 1.0].map(|instants| self.frames_at(instants * INSTANT));
        let of_link = |(index, link): (usize, &Link)| {
            let inertia = link.inertia.as_ref()?;
            let centre = |frames: &LinkFrames| (frames[index] * inertia.centre_of_mass).coords;
            let accelerating = (centre(&after) - centre(&now) * 2.0 + centre(&before)) / (INSTANT * INSTANT);
            let momentum = |from: &LinkFrames, between: &LinkFrames, to: &LinkFrames| {
                let turning = rotation_vector(&(to[index].rotation * from[index].rotation.inverse())) / INSTANT;
                let turned = between[index].rotation;
                turned * (inertia.tensor * (turned.inverse() * turning))
            };
            let spun = (momentum(&now, &late, &after) - momentum(&before, &early, &now)) / INSTANT;
            Some([(accelerating + Vector3::z() * GRAVITY) * inertia.mass, spun])
        };
        self.body.links.iter().enumerate().map(of_link).collect()
    }

    /// The generalised force of one number of the step: the work of all forces when it alone changes (Kane).
    fn virtual_work(&self, inertial: &[Option<[Vector3<f64>; 2]>], external: &[PointForce], number: usize) -> f64 {
        let nudge = 1e-5;
        let [back, forth] = [-nudge, nudge].map(|by| {
            let mut step = vec![0.0; self.body.step_len()];
            step[number] = by;
            self.body.link_frames(&self.body.step(&self.pose, &step))
        });
        let now = self.frames_at(0.0);
        let moved = |link: usize, p: Point3<f64>| (forth[link] * p - back[link] * p) / (2.0 * nudge);
        let turned =
            |link: usize| rotation_vector(&(forth[link].rotation * back[link].rotation.inverse())) / (2.0 * nudge);
        let of_link = |(link, terms): (usize, &Option<[Vector3<f64>; 2]>)| match (terms, &self.body.links[link].inertia)
        {
            (Some([force, spun]), Some(inertia)) => {
                force.dot(&moved(link, inertia.centre_of_mass)) + spun.dot(&turned(link))
            }
            _ => 0.0,
        };
        let taken = |e: &PointForce| e.force.dot(&moved(e.link, now[e.link].inverse() * e.point));
        inertial.iter().enumerate().map(of_link).sum::<f64>() - external.iter().map(taken).sum::<f64>()
    }
}

#[test]
fn efforts_do_the_work_required_by_inertia_weight_and_contact() {
    for body in [Humanoid::tracker25().unwrap(), Humanoid::actor().unwrap(), body_with_every_kind_of_joint()] {
        let swing = Swing::new(body);
        let now = swing.frames_at(0.0);
        let external = [1, swing.body.links.len() - 1].map(|link| PointForce {
            link,
            point: now[link] * Point3::new(0.1, 0.2, -0.3),
            force: Vector3::new(120.0, -80.0, 400.0),
        });
        let found = inverse_dynamics(&swing.body, &now, &swing.rates, &swing.accelerations, &external);
        let root_moment = now[0].rotation.inverse() * found.root_moment;
        let efforts = found.root_force.iter().chain(root_moment.iter()).chain(&found.joints);
        let inertial = swing.inertial();
        assert_eq!(ROOT_STEP + found.joints.len(), swing.body.step_len());
        for (number, effort) in efforts.enumerate() {
            let expected = swing.virtual_work(&inertial, &external, number);
            let apart = (effort - expected).abs();
            assert!(apart < 1e-4 * (1.0 + expected.abs()), "{} {number}: {effort} {expected}", swing.body.name);
        }
    }
}
