//! COCO's compressed run lengths (`maskApi.c`): alternating runs of background and foreground, column by column, each
//! as the difference from the run before the last, six bits per character.

use skiagraph_core::raster::Mask;

pub(super) fn encode(mask: &Mask) -> String {
    let counts = counts(mask);
    let mut text = String::new();
    for (index, count) in counts.iter().enumerate() {
        let mut rest = if index > 2 { count - counts[index - 2] } else { *count };
        loop {
            let five = (rest & 0x1f) as u8;
            rest >>= 5;
            let more = if five & 0x10 != 0 { rest != -1 } else { rest != 0 };
            text.push(char::from(48 + five + if more { 0x20 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}

/// Run lengths, background first.
fn counts(mask: &Mask) -> Vec<i64> {
    let (mut counts, mut run, mut figure) = (Vec::new(), 0, false);
    for x in 0..mask.width() {
        for y in 0..mask.height() {
            if mask.get(x, y) != figure {
                counts.push(run);
                (run, figure) = (0, !figure);
            }
            run += 1;
        }
    }
    counts.push(run);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_begin_with_the_background_and_go_down_the_columns() {
        // figure: (0, 0), (0, 1) and (1, 2) of a 2 x 3 image, column by column 1 1 0 0 0 1
        let mask = Mask::from_fn(2, 3, |x, y| (x, y) == (0, 0) || (x, y) == (0, 1) || (x, y) == (1, 2));
        assert_eq!(counts(&mask), [0, 2, 3, 1]);
        // pycocotools: encode(numpy.asfortranarray([[1, 0], [1, 0], [0, 1]], numpy.uint8))["counts"]
        assert_eq!(encode(&mask), "023O");
        assert_eq!(encode(&Mask::new(2, 3)), "6");
        // a run of 307200 takes four characters
        assert_eq!(encode(&Mask::new(640, 480)), "PP\\9");
    }
}
