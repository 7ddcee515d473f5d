//! When something counts as standing on the ground.

use super::ContactError;

/// Thresholds with hysteresis. All are lengths, speeds and times, none is a number of frames, so that the same motion gets the
/// same labels at any frame rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRule {
    /// Contact begins below this gap to the ground, metres.
    pub enter_gap_m: f64,
    /// And below this speed of the lowest point, m/s.
    pub enter_speed_m_per_s: f64,
    /// It ends above this gap, metres.
    pub leave_gap_m: f64,
    /// Or above this speed, m/s.
    pub leave_speed_m_per_s: f64,
    /// Speeds are means over this time, half before the instant and half after it, seconds (at least one frame each way).
    pub speed_window_s: f64,
    /// Contacts that last less are none, seconds.
    pub shortest_s: f64,
}

impl Default for ContactRule {
    fn default() -> Self {
        Self {
            enter_gap_m: 0.02,
            enter_speed_m_per_s: 0.25,
            leave_gap_m: 0.04,
            leave_speed_m_per_s: 0.45,
            speed_window_s: 1.0 / 15.0,
            shortest_s: 0.05,
        }
    }
}

impl ContactRule {
    /// Whether the thresholds make sense.
    ///
    /// # Errors
    /// [`ContactError::Rule`] names the one that does not.
    pub fn check(&self) -> Result<(), ContactError> {
        let positive = "a finite number above 0";
        let not_less = "not less than the threshold at which contact begins";
        let checks = [
            ("enter_gap_m", self.enter_gap_m, self.enter_gap_m > 0.0, positive),
            ("enter_speed_m_per_s", self.enter_speed_m_per_s, self.enter_speed_m_per_s > 0.0, positive),
            ("leave_gap_m", self.leave_gap_m, self.leave_gap_m >= self.enter_gap_m, not_less),
            (
                "leave_speed_m_per_s",
                self.leave_speed_m_per_s,
                self.leave_speed_m_per_s >= self.enter_speed_m_per_s,
                not_less,
            ),
            ("speed_window_s", self.speed_window_s, self.speed_window_s > 0.0, positive),
            ("shortest_s", self.shortest_s, self.shortest_s >= 0.0, "a finite number, 0 or more"),
        ];
        match checks.into_iter().find(|(_, found, sound, _)| !(*sound && found.is_finite())) {
            Some((key, found, _, expected)) => Err(ContactError::Rule { key, expected, found }),
            None => Ok(()),
        }
    }

    /// How many frames the window of speeds reaches to either side.
    pub(super) fn speed_reach(&self, frames_per_second: f64) -> usize {
        (libm::round(0.5 * self.speed_window_s * frames_per_second) as usize).max(1)
    }

    /// Whether each frame is in contact, by its gap (metres) and the speed of its lowest point (m/s).
    pub(super) fn label(&self, frames: &[(f64, f64)], frames_per_second: f64) -> Vec<bool> {
        let mut standing = false;
        let mut labels: Vec<bool> = frames
            .iter()
            .map(|&(gap, speed)| {
                standing = match standing {
                    true => gap <= self.leave_gap_m && speed <= self.leave_speed_m_per_s,
                    false => gap < self.enter_gap_m && speed < self.enter_speed_m_per_s,
                };
                standing
            })
            .collect();
        for stance in super::stances(&labels) {
            if (stance.len() as f64) < self.shortest_s * frames_per_second {
                labels[stance].fill(false);
            }
        }
        labels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_begins_low_and_slow_and_ends_high_or_fast() {
        let rule = ContactRule::default();
        let frames = [
            (0.010, 0.30), // low, too fast
            (0.030, 0.10), // slow, too high
            (0.010, 0.20), // both: begins
            (0.035, 0.40), // would not begin, but goes on
            (0.010, 0.46), // too fast: ends
            (0.010, 0.40), // would go on, but does not begin
            (-0.02, 0.10), // under the ground is low enough
            (-0.02, 0.10),
            (0.041, 0.10), // too high: ends
        ];
        let expected = [false, false, true, true, false, false, true, true, false];
        assert_eq!(rule.label(&frames, 30.0), expected);
    }

    #[test]
    fn contacts_shorter_than_50_ms_are_none() {
        let frames: Vec<(f64, f64)> =
            [1, 1, 0, 0, 0, 1, 1, 1].iter().map(|&on| (0.1 - 0.1 * f64::from(on), 0.0)).collect();
        let kept = |fps| ContactRule::default().label(&frames, fps).iter().filter(|&&on| on).count();
        assert_eq!([kept(30.0), kept(50.0), kept(120.0)], [5, 3, 0]);
    }

    #[test]
    fn thresholds_that_make_no_sense_are_named() {
        let rule = ContactRule { leave_gap_m: 0.01, ..ContactRule::default() };
        let message = rule.check().unwrap_err().to_string();
        assert_eq!(message, "leave_gap_m: expected not less than the threshold at which contact begins, found 0.01");
        assert!(ContactRule { enter_gap_m: f64::NAN, ..ContactRule::default() }.check().is_err());
        assert_eq!(ContactRule::default().check(), Ok(()));
    }
}
