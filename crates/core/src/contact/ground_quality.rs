//! Summary measures of ground contact.

use std::fmt;

use super::{GroundContact, GroundContacts};

/// Summary of a motion's ground contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundQuality {
    /// Mean speed of standing feet along the ground, mm/s; 0 if no foot ever stands.
    pub skate_mm_per_s: f64,
    /// Greatest depth of any link under the ground, mm.
    pub penetration_mm: f64,
    /// Greatest height of a standing foot above the ground, mm.
    pub float_mm: f64,
    /// Share of frames in which a foot stands.
    pub standing: f64,
}

impl GroundQuality {
    /// Summarises these contacts.
    pub fn from_contacts(contacts: &GroundContacts) -> Self {
        let stands: Vec<&GroundContact> =
            contacts.feet.iter().flat_map(|foot| &foot.frames).filter(|contact| contact.in_contact).collect();
        let skate: f64 = stands.iter().map(|contact| 1000.0 * contact.slip_m_per_s()).sum();
        let all = contacts.links.iter().flat_map(|link| &link.frames);
        let frames = contacts.feet[0].frames.len();
        let standing = (0..frames).filter(|&f| contacts.feet.iter().any(|foot| foot.frames[f].in_contact)).count();
        Self {
            // an empty sum is -0
            skate_mm_per_s: skate / stands.len().max(1) as f64 + 0.0,
            penetration_mm: all.map(|contact| 1000.0 * contact.penetration_m()).fold(0.0, f64::max),
            float_mm: stands.iter().map(|contact| 1000.0 * contact.gap_m).fold(0.0, f64::max),
            standing: standing as f64 / frames.max(1) as f64,
        }
    }
}

impl fmt::Display for GroundQuality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.standing == 0.0 {
            return write!(
                f,
                "no foot ever stands, the deepest point is {:.1} mm under the ground",
                self.penetration_mm
            );
        }
        write!(
            f,
            "standing feet skate {:.1} mm/s and float up to {:.1} mm, the deepest point is {:.1} mm under the ground",
            self.skate_mm_per_s, self.float_mm, self.penetration_mm
        )
    }
}
