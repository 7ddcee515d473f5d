//! The explanation in one sentence.

use super::explanation::{Cause, Explanation};
use super::player::Player;

/// Parts below this share of the error are not named.
const LEAST_SHARE: f64 = 0.02;

/// Longest description of a fault in the sentence, characters; longer ones are only in the table.
const LONGEST_FAULT: usize = 60;

/// `Of 41.2 mm, 33.0 mm come from the cameras (calibration_deg 1 °), and 8.2 mm remain with everything true.`
pub(super) fn sentence(of: &Explanation) -> String {
    let searched = of.causes.iter().any(|cause| cause.player == Player::Search);
    let blind = of.frames_without_image.filter(|_| searched).map_or_else(String::new, blind_frames);
    worded([of.error_mm, of.rest_mm], &of.causes, of.interaction_mm) + &blind
}

/// What the search's part means where there is nothing to search in.
fn blind_frames(frames: usize) -> String {
    format!(
        " No camera took an image for {frames} frame(s): the error there counts as the search's, although no search could \
         see the actor."
    )
}

/// The sentence for an error and what remains of it, mm.
fn worded([error_mm, rest_mm]: [f64; 2], causes: &[Cause], interaction_mm: Option<f64>) -> String {
    let is_named = |part: f64| part.abs() >= (LEAST_SHARE * error_mm).max(0.05);
    let mut causes: Vec<_> = causes.iter().filter(|cause| is_named(cause.error_mm)).collect();
    causes.sort_by(|a, b| b.error_mm.total_cmp(&a.error_mm));
    let mut parts: Vec<String> = causes
        .iter()
        .filter(|cause| cause.error_mm > 0.0)
        .enumerate()
        .map(|(index, cause)| {
            let is_short = (1..=LONGEST_FAULT).contains(&cause.fault.chars().count());
            let fault = if is_short { format!(" ({})", cause.fault) } else { String::new() };
            let verb = if index == 0 { " mm come" } else { "" };
            format!("{:.1}{verb} from the {}{fault}", cause.error_mm, cause.name)
        })
        .collect();
    let interaction = interaction_mm.filter(|interaction| is_named(*interaction));
    if let Some(interaction) = interaction.filter(|interaction| *interaction > 0.0) {
        parts.push(format!("{interaction:.1} from several of them together"));
    }
    if parts.is_empty() && causes.is_empty() {
        return format!("The error is {error_mm:.1} mm, and no input of the tracker explains any of it.");
    }
    let overlap = interaction
        .filter(|interaction| *interaction < 0.0)
        .map_or_else(String::new, |interaction| format!(", of which {:.1} mm are counted twice", -interaction));
    let harmful = || causes.iter().filter(|cause| cause.error_mm < 0.0);
    let less: String = harmful().map(|cause| format!(", less {:.1} by the {}", -cause.error_mm, cause.name)).collect();
    let mut words = if parts.is_empty() {
        format!("The error is {error_mm:.1} mm, and no input of the tracker makes it larger")
    } else {
        format!("Of {error_mm:.1} mm, {}{overlap}{less}", listed(&parts))
    };
    words += &format!("; {rest_mm:.1} mm remain with everything true.");
    words.extend(harmful().map(|cause| harm(cause)));
    words
}

/// A sentence on a negative part.
fn harm(cause: &Cause) -> String {
    let more = -cause.error_mm;
    match cause.player {
        Player::Search => format!(" The search ends {more:.1} mm nearer to the truth than a descent from the truth."),
        _ if cause.alone_mm <= -0.05 => {
            let alone = -cause.alone_mm;
            format!(
                " Correcting the {} alone would not have helped: the error would be {alone:.1} mm larger.",
                cause.name
            )
        }
        _ => format!(
            " Correcting the {} beside others would not have helped: it makes the error {more:.1} mm larger on average.",
            cause.name
        ),
    }
}

fn listed(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [head @ .., last] => format!("{} and {last}", head.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::errors::ErrorProfile;
    use crate::explain::explanation::CauseParts;

    fn cause(player: Player, name: &'static str, alone_mm: f64) -> Cause {
        Cause {
            player,
            name,
            fault: String::new(),
            error_mm: -2.04,
            interval: None,
            alone_mm,
            parts: CauseParts::new(&ErrorProfile::zero(0)),
        }
    }

    #[test]
    fn an_error_whose_only_parts_are_negative_is_not_called_unexplained() {
        let cameras = Cause { error_mm: -663.0, ..cause(Player::Cameras, "cameras", -663.0) };
        assert_eq!(
            worded([169.0, 832.0], &[cameras], None),
            "The error is 169.0 mm, and no input of the tracker makes it larger; 832.0 mm remain with everything true. \
             Correcting the cameras alone would not have helped: the error would be 663.0 mm larger."
        );
        let none = cause(Player::Cameras, "cameras", -2.04);
        let unexplained = worded([169.0, 171.0], &[none], None);
        assert_eq!(unexplained, "The error is 169.0 mm, and no input of the tracker explains any of it.");
    }

    #[test]
    fn frames_without_an_image_are_not_blamed_on_the_search_in_silence() {
        assert!(blind_frames(50).starts_with(" No camera took an image for 50 frame(s): the error there counts as"));
    }

    #[test]
    fn the_parts_of_the_sentence_add_up_to_the_error() {
        let silhouettes = Cause { error_mm: 62.1, ..cause(Player::Body, "silhouettes", 62.1) };
        let search = Cause { error_mm: -16.7, ..cause(Player::Search, "search", 5.1) };
        let words = worded([68.7, 5.0], &[silhouettes, search], Some(18.3));
        let first = "Of 68.7 mm, 62.1 mm come from the silhouettes and 18.3 from several of them together, less 16.7 by the \
                     search; 5.0 mm remain with everything true. The search ends 16.7 mm nearer";
        assert!(words.starts_with(first), "{words}");
    }

    #[test]
    fn a_negative_part_says_that_the_truth_would_not_have_helped() {
        let cameras = harm(&cause(Player::Cameras, "cameras", -5.57));
        assert_eq!(cameras, " Correcting the cameras alone would not have helped: the error would be 5.6 mm larger.");
        let beside = harm(&cause(Player::Cameras, "cameras", 0.3));
        assert!(beside.contains("cameras beside others") && beside.contains("2.0 mm larger on average"), "{beside}");
        let search = harm(&cause(Player::Search, "search", 0.0));
        assert_eq!(search, " The search ends 2.0 mm nearer to the truth than a descent from the truth.");
    }
}
