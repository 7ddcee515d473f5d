//! Converts URDF joints to axes, degrees of freedom and drives.

use std::collections::HashMap;

use nalgebra::{Unit, Vector3};
use roxmltree::Node;
use urdf_rs::JointType;

use super::UrdfError;
use super::document::{Document, child};
use super::tree::Tree;
use crate::body::{DegreeOfFreedom, Drive, JointKind};

/// The allowed motion of every joint, and the degrees of freedom.
pub(super) struct Axes {
    kinds: Vec<Option<JointKind>>,
    pub(super) degrees_of_freedom: Vec<DegreeOfFreedom>,
}

impl Axes {
    /// The motion of the file's joint with this index.
    pub(super) fn kind(&self, joint: usize) -> JointKind {
        self.kinds[joint].clone().unwrap_or(JointKind::Fixed)
    }
}

/// Reads all joints in the tree's order; assumptions are added to `notes`.
pub(super) fn read(
    document: &Document<'_>,
    robot: &urdf_rs::Robot,
    tree: &Tree,
    notes: &mut Vec<String>,
) -> Result<Axes, UrdfError> {
    let mut axes = Axes { kinds: vec![None; robot.joints.len()], degrees_of_freedom: Vec::new() };
    let in_order: Vec<usize> = tree.links.iter().filter_map(|&l| tree.joint_above[l]).collect();
    let mimics =
        |index: usize| robot.joints[index].mimic.is_some() && robot.joints[index].joint_type != JointType::Fixed;
    for &index in in_order.iter().filter(|&&i| !mimics(i)) {
        let (joint, node) = (&robot.joints[index], document.joint(index));
        let first = axes.degrees_of_freedom.len();
        axes.kinds[index] = Some(match joint.joint_type {
            JointType::Fixed => {
                if let Some(mimic) = &joint.mimic {
                    let name = &joint.name;
                    notes.push(format!("joint `{name}`: fixed, so <mimic joint=\"{}\"> is ignored", mimic.joint));
                }
                JointKind::Fixed
            }
            JointType::Revolute | JointType::Continuous | JointType::Prismatic => {
                axes.degrees_of_freedom.push(limited(node, joint, notes));
                single_axis(document, node, joint, Drive::direct(first))?
            }
            JointType::Spherical => {
                axes.degrees_of_freedom.extend(free(&joint.name, &["x", "y", "z"]));
                JointKind::Spherical { first }
            }
            JointType::Floating => {
                axes.degrees_of_freedom.extend(free(&joint.name, &["x", "y", "z", "rx", "ry", "rz"]));
                JointKind::Floating { first }
            }
            JointType::Planar => {
                let problem = "planar joints are only supported between a root without geometry and the body; \
                               write two prismatic and one continuous joint";
                return Err(document.refuse(node, problem));
            }
        });
    }
    let by_name: HashMap<&str, usize> = robot.joints.iter().enumerate().map(|(i, j)| (j.name.as_str(), i)).collect();
    for &index in in_order.iter().filter(|&&i| mimics(i)) {
        let drive = mimicked(document, robot, &by_name, &axes, index)?;
        axes.kinds[index] = Some(single_axis(document, document.joint(index), &robot.joints[index], drive)?);
    }
    Ok(axes)
}

fn free<'a>(name: &'a str, suffixes: &'a [&str]) -> impl Iterator<Item = DegreeOfFreedom> + 'a {
    suffixes.iter().map(move |suffix| DegreeOfFreedom::unlimited(&format!("{name}.{suffix}")))
}

/// The degree of freedom of a joint with one axis. A speed or effort of zero means unknown.
fn limited(node: Node<'_, '_>, joint: &urdf_rs::Joint, notes: &mut Vec<String>) -> DegreeOfFreedom {
    let name = joint.name.clone();
    let stated = |value: f64| if value > 0.0 { value } else { f64::INFINITY };
    let has_limit = child(node, "limit").is_some();
    let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
    if joint.joint_type != JointType::Continuous {
        if has_limit {
            (lower, upper) = (joint.limit.lower, joint.limit.upper);
            if lower == upper {
                notes.push(format!("joint `{name}`: limits are {lower} to {upper}, so it is locked"));
            }
        } else {
            notes.push(format!("joint `{name}`: no <limit>, assumed unlimited"));
        }
    }
    let (max_velocity, max_effort) = if has_limit {
        (stated(joint.limit.velocity), stated(joint.limit.effort))
    } else {
        (f64::INFINITY, f64::INFINITY)
    };
    DegreeOfFreedom { name, lower, upper, max_velocity, max_effort }
}

fn single_axis(
    document: &Document<'_>,
    node: Node<'_, '_>,
    joint: &urdf_rs::Joint,
    drive: Drive,
) -> Result<JointKind, UrdfError> {
    let Some(axis) = Unit::try_new(Vector3::from(joint.axis.xyz.0), 1e-6) else {
        let place = child(node, "axis").unwrap_or(node);
        return Err(document.refuse(place, "the axis is zero; expected a direction such as xyz=\"0 0 1\""));
    };
    match joint.joint_type {
        JointType::Revolute | JointType::Continuous => Ok(JointKind::Revolute { axis, drive }),
        JointType::Prismatic => Ok(JointKind::Prismatic { axis, drive }),
        _ => Err(document.refuse(node, "only revolute, continuous and prismatic joints may mimic")),
    }
}

/// Follows a chain of mimics to the degree of freedom at its end: `m1 * (m2 * q + o2) + o1`.
fn mimicked(
    document: &Document<'_>,
    robot: &urdf_rs::Robot,
    by_name: &HashMap<&str, usize>,
    axes: &Axes,
    start: usize,
) -> Result<Drive, UrdfError> {
    let place = |index: usize| child(document.joint(index), "mimic").unwrap_or(document.joint(index));
    let (mut multiplier, mut offset) = (1.0, 0.0);
    let mut index = start;
    for _ in 0..robot.joints.len() {
        let Some(mimic) = &robot.joints[index].mimic else {
            return match axes.kinds[index] {
                Some(JointKind::Revolute { drive, .. } | JointKind::Prismatic { drive, .. }) => {
                    Ok(Drive { multiplier, offset, ..drive })
                }
                _ => Err(document
                    .refuse(place(start), format!("mimics `{}`, which has no single axis", robot.joints[index].name))),
            };
        };
        offset += multiplier * mimic.offset.unwrap_or(0.0);
        multiplier *= mimic.multiplier.unwrap_or(1.0);
        index = by_name.get(mimic.joint.as_str()).copied().ok_or_else(|| {
            document.refuse(place(index), format!("mimics joint `{}`, which does not exist", mimic.joint))
        })?;
    }
    Err(document.refuse(place(start), "mimics itself through other joints; let one joint of the cycle move freely"))
}
