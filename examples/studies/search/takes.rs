//! Tracked recordings and their frames, and the recordings from which proposals are learned.

/// A take of CMU's database: test and training, frames of the file from 1 at 120 Hz.
pub(crate) struct Take {
    pub(crate) name: &'static str,
    pub(crate) what: &'static str,
    clip: &'static str,
    frames: [u32; 2],
    training: &'static str,
    training_frames: [u32; 2],
}

const fn take([name, what, clip, training]: [&'static str; 4], frames: [u32; 2], training_frames: [u32; 2]) -> Take {
    Take { name, what, clip, frames, training, training_frames }
}

/// Reported takes; none was used to develop the refinement.
pub(crate) const REPORTED: [Take; 9] = [
    take(["49_01", "walk", "49_01", "49_01"], [1, 300], [481, 652]),
    take(["02_03", "run", "02_03", "02_01"], [1, 173], [1, 343]),
    take(["02_04", "jump, balance", "02_04", "02_04"], [1, 240], [241, 483]),
    take(["16_22", "fast walk", "16_22", "16_15"], [1, 240], [1, 471]),
    take(["16_35", "run", "16_35", "16_36"], [1, 162], [1, 189]),
    take(["16_36", "run", "16_36", "16_35"], [1, 189], [1, 162]),
    take(["16_45", "fast run", "16_45", "16_36"], [1, 135], [1, 189]),
    take(["35_08", "walk", "35_08", "35_34"], [1, 240], [1, 415]),
    take(["35_34", "walk", "35_34", "35_08"], [1, 240], [1, 445]),
];

/// Takes on which the refinement was developed.
pub(crate) const TUNING: [Take; 7] = [
    take(["16_15", "walk", "16_15", "16_15"], [1, 240], [241, 471]),
    take(["35_02", "walk", "35_02", "35_02"], [1, 240], [241, 387]),
    take(["02_01", "walk", "02_01", "02_01"], [1, 220], [221, 343]),
    take(["ges", "gesture", "14_24", "14_24"], [1201, 1440], [1441, 1740]),
    take(["run", "run and stop", "16_57", "16_08"], [1, 240], [1, 239]),
    take(["jump", "jump", "16_03", "16_57"], [1, 240], [1, 268]),
    take(["sit", "sit down", "14_27_f0001-0900", "14_27_f0001-0900"], [1, 240], [241, 900]),
];

impl Take {
    /// As `[motion]` and `[[training.clips]]`, at `rate` frames a second.
    pub(crate) fn tables(&self, rate: f64) -> String {
        let part = |clip: &str, [first, last]: [u32; 2]| {
            format!(
                "clip = \"{clip}.amc\"\nskeleton = \"{}.asf\"\nfirst_frame = {first}\nlast_frame = {last}\nsource_hz = 120.0\n\
                 frames_per_second = {rate:?}\n",
                &clip[..2]
            )
        };
        let (test, training) = (part(self.clip, self.frames), part(self.training, self.training_frames));
        format!("[motion]\n{test}\n[[training.clips]]\n{training}")
    }

    /// Description for the page.
    pub(crate) fn describe(&self) -> String {
        let part = |clip: &str, [first, last]: [u32; 2]| format!("{clip} {first}-{last}");
        format!(
            "{} ({}): {}, learned from {}",
            self.name,
            self.what,
            part(self.clip, self.frames),
            part(self.training, self.training_frames)
        )
    }
}
