use super::*;
use crate::test_bodies::person;

fn answer(line: &str) -> Result<Reply, String> {
    read_answer(line, 0, &person()).map(|reply| reply.unwrap())
}

#[test]
fn an_answer_to_an_earlier_frame_is_ignored() {
    let read = |line: &str| read_answer(line, 5, &person());
    for line in [
        r#"{"type":"pose","frame":4,"markers":{"nose":[0,0,0]}}"#,
        r#"{"type":"pose","frame":4}"#,
        r#"{"frame":0,"confidence":7}"#,
    ] {
        assert_eq!(read(line), Ok(None), "{line}");
    }
    assert!(read(r#"{"type":"pose","frame":5}"#).is_err());
    assert!(read(r#"{"type":"lost","frame":5}"#).unwrap().is_some());
}

#[test]
fn markers_joints_and_angles_are_read_and_null_is_ignored() {
    let markers =
        answer(r#"{"type":"pose","frame":3,"markers":{"pelvis":[0,1,2.5],"head_top":null},"confidence":0.5,"x":1}"#);
    let markers = markers.unwrap();
    assert_eq!((markers.frame, markers.confidence), (3, Some(0.5)));
    assert_eq!(markers.pose, Some(RepliedPose::Markers(Named::from([("pelvis".to_owned(), [0.0, 1.0, 2.5])]))));
    assert_eq!(answer(r#"{"type":"lost","frame":0}"#).unwrap().pose, None);
    let angles = vec![0.25; person().degrees_of_freedom.len()];
    let read = answer(&format!(r#"{{"type":"pose","frame":0,"root":[0,0,1,1,0,0,0],"angles":{angles:?}}}"#)).unwrap();
    assert_eq!(read.pose, Some(RepliedPose::Angles { root: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], angles }));
}

#[test]
fn invalid_messages_have_clear_errors() {
    for (line, part) in [
        ("loading weights...", "print messages to standard error"),
        ("[1,2]", "JSON object"),
        ("{\"frame\":1}", "\"type\""),
        ("{\"type\":\"pose\"}", "\"frame\""),
        ("{\"type\":\"pose\",\"frame\":-1}", "\"frame\""),
        ("{\"type\":\"pose\",\"frame\":0}", "exactly one of"),
        ("{\"type\":\"dance\",\"frame\":0}", "\"dance\""),
        ("{\"type\":\"pose\",\"frame\":0,\"markers\":{\"nose\":[0,0,0]}}", "\"nose\" is unknown"),
        ("{\"type\":\"pose\",\"frame\":0,\"markers\":{\"pelvis\":[0,0]}}", "[x, y, z]"),
        ("{\"type\":\"pose\",\"frame\":0,\"markers\":{\"pelvis\":[0,0,1e300]}}", "[x, y, z]"),
        ("{\"type\":\"pose\",\"frame\":0,\"markers\":{\"pelvis\":[0,0,NaN]}}", "JSON object per line"),
        ("{\"type\":\"pose\",\"frame\":0,\"markers\":{}}", "answer \"lost\""),
        ("{\"type\":\"pose\",\"frame\":0,\"root\":[0,0,0,0,0,0,0],\"angles\":[]}", "length 0.000"),
        ("{\"type\":\"pose\",\"frame\":0,\"root\":[0,0,0,1,0,0,0],\"angles\":[1]}", "angles: expected"),
        ("{\"type\":\"lost\",\"frame\":0,\"confidence\":7}", "confidence"),
    ] {
        let error = answer(line).unwrap_err();
        assert!(error.contains(part), "{line}: {error}");
    }
    assert!(read_ready("{\"type\":\"ready\",\"protocol\":\"skiagraph.tracker/9\"}", PROTOCOL).is_err());
    let ready = "{\"type\":\"ready\",\"name\":\"mine\"}";
    assert_eq!(read_ready(ready, PROTOCOL).unwrap().name.as_deref(), Some("mine"));
    assert!(read_ready(ready, TIMED_PROTOCOL).unwrap_err().contains("reads the camera poses of every frame"));
    let hostile =
        "{\"type\":\"ready\",\"name\":\"\\u001b[2Ja\\nb\",\"version\":\"LONG\"}".replace("LONG", &"9".repeat(900));
    let read = read_ready(&hostile, PROTOCOL).unwrap();
    assert_eq!(read.name.as_deref(), Some("\u{fffd}[2Ja b"));
    assert_eq!(read.version.map(|version| version.chars().count()), Some(200));
    let ready = "{\"type\":\"ready\",\"protocol\":\"skiagraph.tracker/2\"}";
    assert!(read_ready(ready, TIMED_PROTOCOL).is_ok() && read_ready(ready, PROTOCOL).is_err());
}

#[test]
fn run_lengths_begin_with_the_empty_pixels_and_fill_the_image() {
    let mut mask = Mask::new(4, 2);
    [(0, 0), (1, 0), (3, 1)].into_iter().for_each(|(x, y)| mask.set(x, y, true));
    assert_eq!(run_lengths(&mask), [0, 2, 5, 1]);
    assert_eq!(run_lengths(&Mask::new(4, 2)), [8]);
    let wrapping = Mask::from_fn(4, 2, |x, y| x + 4 * y >= 2 && x + 4 * y < 7);
    assert_eq!(run_lengths(&wrapping), [2, 5, 1], "a run continues in the next row");
    assert_eq!(run_lengths(&Mask::from_fn(4, 2, |_, _| true)), [0, 8]);
}
