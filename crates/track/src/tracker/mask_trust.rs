//! How far a camera's masks are believed, from how the last estimates differed from them.

use skiagraph_core::raster::Overlap;

/// Factors on the evidence of one camera's masks, in (0, 1].
///
/// Background subtraction loses what has the colour of the background, and shows other people. Both are differences in
/// one direction: what the masks lack is nowhere else in them, whereas a limb that the tracker lost is outside the mask
/// in one place and leaves a part of the mask uncovered in another. So a direction is believed less the more it exceeds
/// the other one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MaskTrust {
    /// For the body outside the mask, in energies and descents.
    pub(super) lacking: f64,
    /// For the mask outside the body, in energies.
    pub(super) extra: f64,
}

impl MaskTrust {
    pub(super) const FULL: Self = Self { lacking: 1.0, extra: 1.0 };

    /// The factor for a residual: positive where the body is outside the mask. What is too much has its full pull here,
    /// or limbs would not leave the trunk.
    pub(super) fn in_residual(self, value: f64) -> f64 {
        if value > 0.0 { self.lacking } else { 1.0 }
    }

    /// The factor for contours, which differ in both directions.
    pub(super) fn of_contour(self) -> f64 {
        self.lacking.min(self.extra)
    }
}

/// The differences of one camera's masks from the estimates of the last frames.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MaskErrors {
    /// Share of the body that is outside the mask, and of the mask outside the body; `None` before the first frame.
    shares: Option<[f64; 2]>,
}

/// Weight of a new frame in the mean over the last ones.
const NEW_FRAME: f64 = 0.2;
/// Share that is outside even of good masks: bodies are never quite right.
const USUAL: f64 = 0.02;

impl MaskErrors {
    /// Adds the comparison of a mask with the body at the frame's estimate.
    pub(super) fn add(&mut self, overlap: &Overlap) {
        if overlap.both == 0 {
            return;
        }
        let share = |part: u64| part as f64 / (part + overlap.both) as f64;
        let new = [share(overlap.only_model), share(overlap.only_observed)];
        let old = self.shares.unwrap_or(new);
        self.shares = Some([0, 1].map(|i| old[i] + NEW_FRAME * (new[i] - old[i])));
    }

    /// What is lacking is doubted more than what is too much: a limb that is not seen cannot be found, but of two
    /// people in a mask one has to be covered.
    pub(super) fn trust(self) -> MaskTrust {
        let Some([lacking, extra]) = self.shares else { return MaskTrust::FULL };
        let ratio = |own: f64, other: f64| ((other + USUAL) / own.max(USUAL)).min(1.0);
        MaskTrust { lacking: ratio(lacking, extra).powi(2), extra: ratio(extra, lacking) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trust(only_model: u64, only_observed: u64) -> MaskTrust {
        let mut errors = MaskErrors::default();
        errors.add(&Overlap { both: 1000, only_model, only_observed });
        errors.trust()
    }

    #[test]
    fn a_lost_limb_is_no_reason_to_doubt_the_mask() {
        for apart in [0, 10, 100, 1000] {
            assert_eq!(trust(apart, apart), MaskTrust::FULL);
        }
        assert_eq!(MaskErrors::default().trust(), MaskTrust::FULL);
        let mut nowhere = MaskErrors::default();
        nowhere.add(&Overlap { both: 0, only_model: 500, only_observed: 2 });
        assert_eq!(nowhere.trust(), MaskTrust::FULL);
    }

    #[test]
    fn the_more_a_mask_lacks_the_less_it_is_believed_and_the_more_slowly_in_time() {
        let lacking: Vec<f64> = [0, 100, 200, 400].map(|pixels| trust(pixels, 5).lacking).to_vec();
        assert!(lacking[0] == 1.0 && lacking.is_sorted_by(|a, b| a > b) && lacking[3] > 0.0, "{lacking:?}");
        let extra = trust(5, 400);
        assert!(extra.lacking == 1.0 && extra.extra < 0.2 && extra.extra > trust(400, 5).lacking, "{extra:?}");
        let mut errors = MaskErrors::default();
        errors.add(&Overlap { both: 1000, only_model: 0, only_observed: 0 });
        errors.add(&Overlap { both: 1000, only_model: 400, only_observed: 5 });
        assert!(errors.trust().lacking > lacking[3]);
    }
}
