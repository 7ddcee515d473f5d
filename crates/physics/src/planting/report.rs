//! Report of planting.

use std::fmt;

use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::contact::{ContactError, GroundContacts, GroundQuality, link_frames};

/// Smallest reported lift of the whole body, metres.
const LEAST_REPORTED: f64 = 0.001;

/// The changes made by planting.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlantingReport {
    /// Contact before.
    pub before: GroundQuality,
    /// Contact after, in the stances of the changed motion.
    pub after: GroundQuality,
    /// Contact after, in the stances of the original motion.
    pub after_in_old_stances: GroundQuality,
    /// Lift of the whole motion before planting, mm; 0 for a motion that was not underground.
    pub raised_mm: f64,
    /// Greatest lift of the whole body including the feet, where its joints were not sufficient, mm.
    pub lifted_mm: f64,
    /// Number of frames in which the whole body was lifted by more than a millimetre.
    pub lifted_frames: usize,
    /// Mean distance by which joints were moved in addition, over all joints and frames, mm.
    pub moved_mm: f64,
    /// Greatest distance by which a joint was moved in addition.
    pub moved_most: MostMoved,
    /// Greatest change of each degree of freedom, radians (metres if prismatic), in the body's order; at most 0.35.
    pub angle_changes: Vec<f64>,
}

/// The link with the greatest change.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MostMoved {
    /// Distance, mm.
    pub mm: f64,
    /// Name of the link.
    pub link: String,
    /// Frame number.
    pub frame: usize,
}

impl fmt::Display for PlantingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.raised_mm > 0.0 {
            write!(f, "the motion was underground and is raised by {:.0} mm as a whole; ", self.raised_mm)?;
        }
        let greatest = self.angle_changes.iter().copied().fold(0.0, f64::max);
        let MostMoved { mm, link, frame } = &self.moved_most;
        write!(
            f,
            "before: {}; fixed: {}; joints moved by {:.1} mm on average, {mm:.1} mm at most ({link}, set frame {frame} from 0), angles by {:.1} \
             degrees at most",
            self.before,
            self.after,
            self.moved_mm,
            greatest.to_degrees()
        )?;
        if self.lifted_frames > 0 {
            let (most, frames) = (self.lifted_mm, self.lifted_frames);
            write!(
                f,
                "; to keep it out of the ground the whole body is lifted, by up to {most:.0} mm in {frames} frames"
            )?;
        }
        Ok(())
    }
}

/// `before` are the contacts of the original motion, `on_ground` those after raising, `after` those of the planted
/// one; `lifts` are those of the whole body in metres.
pub(super) fn report(
    body: &Humanoid,
    [old, planted]: [&Motion; 2],
    [before, on_ground, after]: [&GroundContacts; 3],
    raised_m: f64,
    lifts: &[f64],
) -> Result<PlantingReport, ContactError> {
    let mut in_old_stances = after.clone();
    for (foot, as_was) in in_old_stances.feet.iter_mut().zip(&on_ground.feet) {
        foot.frames.iter_mut().zip(&as_was.frames).for_each(|(frame, as_was)| frame.in_contact = as_was.in_contact);
    }
    let (mut sum, mut count, mut most) = (0.0, 0_usize, MostMoved::default());
    let pairs = link_frames(body, old)?.into_iter().zip(link_frames(body, planted)?);
    for (frame, (old, new)) in pairs.enumerate() {
        for (link, (a, b)) in old.0.iter().zip(&new.0).enumerate() {
            let mm = 1000.0 * (a.translation.vector - b.translation.vector).norm();
            (sum, count) = (sum + mm, count + 1);
            if mm > most.mm {
                most = MostMoved { mm, link: body.links[link].name.clone(), frame };
            }
        }
    }
    let mut angle_changes = vec![0.0_f64; body.degrees_of_freedom.len()];
    for (old, new) in old.poses.iter().zip(&planted.poses) {
        for (change, (a, b)) in angle_changes.iter_mut().zip(old.joint_angles.iter().zip(&new.joint_angles)) {
            *change = change.max((a - b).abs());
        }
    }
    Ok(PlantingReport {
        before: GroundQuality::from_contacts(before),
        after: GroundQuality::from_contacts(after),
        after_in_old_stances: GroundQuality::from_contacts(&in_old_stances),
        raised_mm: 1000.0 * raised_m,
        lifted_mm: 1000.0 * lifts.iter().copied().fold(0.0, f64::max),
        lifted_frames: lifts.iter().filter(|lift| **lift > LEAST_REPORTED).count(),
        moved_mm: sum / count.max(1) as f64,
        moved_most: most,
        angle_changes,
    })
}
