//! The rule for ground contact.

use std::ops::Range;

use super::ContactError;

/// Thresholds with hysteresis in both directions of time: a contact is a period low and slow enough to *continue* that
/// contains, for a minimum time, a period low and slow enough to *begin*. With forward-only hysteresis, a single dip
/// of the speed between two frames of a slow camera would move or drop a stance.
///
/// All are lengths, speeds and times rather than frame counts, and times are interpolated between frames (gap and
/// speed are linear there), so the same motion gets the same labels at any frame rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRule {
    /// A contact begins below this gap to the ground, metres.
    pub enter_gap_m: f64,
    /// A contact begins below this speed of the lowest point at the same time, m/s.
    pub enter_speed_m_per_s: f64,
    /// A contact lasts while the gap is at most this, metres.
    pub leave_gap_m: f64,
    /// A contact lasts while the speed is at most this, m/s.
    pub leave_speed_m_per_s: f64,
    /// Speeds are means over this time, half before and half after, seconds (at least one frame each). At the
    /// beginning and end of a motion, the smaller of the means over the available half and over the nearest complete
    /// window is used.
    pub speed_window_s: f64,
    /// Contacts that are below the thresholds at which they begin for less than this time are ignored, unless they are
    /// cut off by the beginning or end of the motion; so are shorter breaks between two contacts. Seconds.
    pub shortest_s: f64,
    /// Whether hysteresis works in both directions of time. If not, a contact begins at the first frame below the
    /// thresholds at which it begins, as with a causal detector.
    pub looks_ahead: bool,
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
            looks_ahead: true,
        }
    }
}

impl ContactRule {
    /// Checks the thresholds.
    ///
    /// # Errors
    /// [`ContactError::Refused`] names the invalid threshold.
    pub fn check(&self) -> Result<(), ContactError> {
        let positive = "a finite number above 0";
        let not_less = "a value not less than the threshold at which contact begins";
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
        match checks.into_iter().find(|(_, found, valid, _)| !(*valid && found.is_finite())) {
            Some((key, found, _, expected)) => Err(ContactError::of_key(key, expected, found)),
            None => Ok(()),
        }
    }

    /// Describes the thresholds, for the protocols of metrics.
    pub fn describe(&self) -> String {
        let [enter_gap, leave_gap] = [self.enter_gap_m, self.leave_gap_m].map(thousandths);
        let [shortest, window] = [self.shortest_s, self.speed_window_s].map(thousandths);
        let hindsight = if self.looks_ahead { "" } else { ", told frame by frame without looking ahead" };
        format!(
            "contact comes at most {enter_gap} mm high and {} m/s fast for at least {shortest} ms, ends above {leave_gap} mm \
             or {} m/s for at least {shortest} ms (speeds are means over {window} ms){hindsight}",
            self.enter_speed_m_per_s, self.leave_speed_m_per_s
        )
    }

    /// Number of frames on either side of the window for speeds.
    pub(super) fn speed_reach(&self, frames_per_second: f64) -> usize {
        (libm::round(0.5 * self.speed_window_s * frames_per_second) as usize).max(1)
    }

    /// Whether each frame is in contact, by its gap (metres) and the speed of its lowest point (m/s).
    pub(super) fn label(&self, frames: &[(f64, f64)], frames_per_second: f64) -> Vec<bool> {
        self.label_at_pace(frames, frames_per_second, Pace::default())
    }

    /// As [`Self::label`], with speeds and times of the recording, which is played back at `pace`.
    pub(super) fn label_at_pace(&self, frames: &[(f64, f64)], frames_per_second: f64, pace: Pace<'_>) -> Vec<bool> {
        let comes = Thresholds { gap_m: self.enter_gap_m, speed_m_per_s: self.enter_speed_m_per_s };
        let lasts = Thresholds { gap_m: self.leave_gap_m, speed_m_per_s: self.leave_speed_m_per_s };
        if !self.looks_ahead {
            return self.label_at_once(frames, frames_per_second, pace, [&comes, &lasts]);
        }
        let mut labels: Vec<bool> = frames.iter().map(|frame| lasts.hold(*frame)).collect();
        let runs = stances(&labels);
        for run in &runs {
            let ends = [run.start, run.end - 1].map(|end| end == 0 || end + 1 == frames.len());
            let is_cut_off = ends[0] && comes.hold(frames[run.start]) || ends[1] && comes.hold(frames[run.end - 1]);
            let around = &frames[run.start.saturating_sub(1)..(run.end + 1).min(frames.len())];
            let below_s = comes.held(around) / frames_per_second * pace.at(run.start);
            let comes_at_all = frames[run.clone()].iter().any(|frame| comes.hold(*frame));
            if !(comes_at_all && (is_cut_off || below_s >= self.shortest_s)) {
                labels[run.clone()].fill(false);
            }
        }
        for pair in stances(&labels).windows(2) {
            let around = &frames[pair[0].end - 1..=pair[1].start];
            let away = (around.len() - 1) as f64 - lasts.held(around);
            let away_s = away / frames_per_second * pace.at(pair[0].end);
            if away_s < self.shortest_s {
                labels[pair[0].end..pair[1].start].fill(true);
            }
        }
        labels
    }

    fn label_at_once(
        &self,
        frames: &[(f64, f64)],
        frames_per_second: f64,
        pace: Pace<'_>,
        [comes, lasts]: [&Thresholds; 2],
    ) -> Vec<bool> {
        let on = |standing: &mut bool, frame: &(f64, f64)| {
            *standing = if *standing { lasts } else { comes }.hold(*frame);
            Some(*standing)
        };
        let mut labels: Vec<bool> = frames.iter().scan(false, on).collect();
        for stance in stances(&labels) {
            if (stance.len() as f64) * pace.at(stance.start) < self.shortest_s * frames_per_second {
                labels[stance].fill(false);
            }
        }
        labels
    }
}

/// Metres in millimetres, seconds in milliseconds, to a hundredth.
fn thousandths(value: f64) -> f64 {
    (1e5 * value).round() / 100.0
}

/// Upper limits of gap and speed.
struct Thresholds {
    gap_m: f64,
    speed_m_per_s: f64,
}

impl Thresholds {
    fn hold(&self, (gap, speed): (f64, f64)) -> bool {
        gap <= self.gap_m && speed <= self.speed_m_per_s
    }

    /// The time for which the limits hold, in frames: both quantities are linear between frames.
    fn held(&self, frames: &[(f64, f64)]) -> f64 {
        let between = |pair: &[(f64, f64)]| {
            let gap = part_below(pair[0].0, pair[1].0, self.gap_m);
            let speed = part_below(pair[0].1, pair[1].1, self.speed_m_per_s);
            (gap[1].min(speed[1]) - gap[0].max(speed[0])).max(0.0)
        };
        frames.windows(2).map(between).sum()
    }
}

/// The interval, within 0 to 1, in which the interpolation between two values is at most a threshold. A value may be
/// infinite.
fn part_below(from: f64, to: f64, threshold: f64) -> [f64; 2] {
    let crossing = || if from.is_finite() { (threshold - from) / (to - from) } else { 1.0 };
    match (from <= threshold, to <= threshold) {
        (true, true) => [0.0, 1.0],
        (true, false) => [0.0, crossing()],
        (false, true) => [crossing(), 1.0],
        (false, false) => [0.0, 0.0],
    }
}

/// Playback speed relative to the recording, per frame. Stances are found at the recording's own speed: a step played
/// at a quarter of its speed is still a step, although its foot then swings as slowly as a standing foot moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pace<'a>(
    /// One finite number above 0 per frame, 0.25 for a quarter of the recorded speed; empty for the recorded speed.
    pub &'a [f64],
);

impl Pace<'_> {
    /// Playback speed in a frame, relative to the recording.
    #[inline]
    pub fn at(&self, frame: usize) -> f64 {
        self.0.get(frame).copied().unwrap_or(1.0)
    }
}

/// Names of the tracks of the left and right foot.
pub const FOOT_NAMES: [&str; 2] = ["left foot", "right foot"];

/// Frames of one uninterrupted contact.
pub type Stance = Range<usize>;

/// The uninterrupted contacts of a list of labels, in order.
pub fn stances(in_contact: &[bool]) -> Vec<Stance> {
    let mut found: Vec<Stance> = Vec::new();
    for frame in (0..in_contact.len()).filter(|&frame| in_contact[frame]) {
        match found.last_mut() {
            Some(stance) if stance.end == frame => stance.end += 1,
            _ => found.push(frame..frame + 1),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_extends_around_a_time_that_is_low_and_slow_enough_to_begin() {
        let rule = ContactRule::default();
        let frames = [
            (0.010, 0.50), // low, too fast
            (0.030, 0.40), // too high to begin, low enough to continue: begins
            (0.010, 0.20),
            (0.010, 0.20),
            (0.010, 0.20),
            (0.035, 0.40),
            (0.010, 0.60), // too fast: ends
            (0.010, 0.60),
            (0.010, 0.60),
            (0.010, 0.40), // could continue, but never begins
            (0.010, 0.40),
            (0.041, 0.10), // too high
            (0.050, 0.50),
            (-0.02, 0.10), // under the ground is low enough
            (-0.02, 0.10),
        ];
        let expected = [0, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1, 1].map(|on| on == 1);
        assert_eq!(rule.label(&frames, 30.0), expected);
    }

    fn high_or_low(low: &[i32]) -> Vec<(f64, f64)> {
        low.iter().map(|&on| (0.1 - 0.1 * f64::from(on), 0.0)).collect()
    }

    #[test]
    fn contacts_and_breaks_shorter_than_50_ms_are_ignored() {
        // low for 2 frames and 0.2 of one on either side, high for 2 and 0.6 of one on either side
        let contact = high_or_low(&[0, 0, 1, 1, 0, 0]);
        let pause = high_or_low(&[1, 1, 1, 1, 1, 1, 0, 0, 1, 1, 1, 1, 1, 1]);
        let kept =
            |frames: &[(f64, f64)], fps| ContactRule::default().label(frames, fps).iter().filter(|x| **x).count();
        assert_eq!([20.0, 27.0, 29.0, 60.0].map(|fps| kept(&contact, fps)), [2, 2, 0, 0]);
        assert_eq!([20.0, 43.0, 45.0, 90.0].map(|fps| kept(&pause, fps)), [12, 12, 14, 14]);
    }

    #[test]
    fn a_contact_cut_off_by_the_motion_is_kept_however_short() {
        let frames = high_or_low(&[1, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
        let found = ContactRule::default().label(&frames, 120.0);
        assert_eq!(stances(&found), [0..1, 9..10]);
        assert_eq!(ContactRule::default().label(&[(0.0, 0.0)], 120.0), [true]);
    }

    #[test]
    fn infinite_distance_between_two_contacts_separates_them() {
        let far = (f64::INFINITY, 0.0);
        let frames = [[(0.0, 0.0); 6].as_slice(), &[far; 6], &[(0.0, 0.0); 6]].concat();
        assert_eq!(stances(&ContactRule::default().label(&frames, 60.0)), [0..6, 12..18]);
    }

    #[test]
    fn without_lookahead_a_contact_begins_when_it_is_certain() {
        let rule = ContactRule { looks_ahead: false, ..ContactRule::default() };
        let frames = [(0.01, 0.40), (0.01, 0.20), (0.01, 0.40), (0.01, 0.50), (0.01, 0.40), (0.01, 0.10)];
        assert_eq!(rule.label(&frames, 30.0), [false, true, true, false, false, false], "the last one is too short");
    }

    /// A speed that dips below the threshold between two frames of the slower camera.
    #[test]
    fn a_dip_between_two_frames_moves_no_label() {
        let dip = |t: f64| 0.1 * libm::exp(-((t - 13.0 / 120.0) / 0.005) * ((t - 13.0 / 120.0) / 0.005));
        let speed = |t: f64| if t < 0.25 { (0.9 - 6.0 * t).max(0.28) - dip(t) } else { 0.1 };
        let label = |fps: f64| {
            let frames: Vec<_> = (0..=(0.5 * fps) as usize).map(|i| (0.0, speed(i as f64 / fps))).collect();
            stances(&ContactRule::default().label(&frames, fps))[0].start as f64 / fps
        };
        let fastest = label(120.0);
        assert!([60.0, 30.0].iter().all(|fps| (label(*fps) - fastest).abs() <= 1.0 / 30.0 + 1e-9), "{fastest}");
    }

    #[test]
    fn invalid_thresholds_are_named() {
        let rule = ContactRule { leave_gap_m: 0.01, ..ContactRule::default() };
        let expected = "leave_gap_m: expected a value not less than the threshold at which contact begins, found 0.01";
        assert_eq!(rule.check().unwrap_err().to_string(), expected);
        assert!(ContactRule { enter_gap_m: f64::NAN, ..ContactRule::default() }.check().is_err());
        assert_eq!(ContactRule::default().check(), Ok(()));
    }
}
