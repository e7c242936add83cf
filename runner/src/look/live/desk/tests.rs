//! Pages at a desk, without any.

use super::*;
use crate::look::picture::ColorBy;

const NOW: Duration = Duration::ZERO;

fn look(x: f64) -> Wish {
    Wish::Look { view: [x, 0.0, x + 1.0, 1.0].into(), size: [4, 4], color: ColorBy::Kind }
}

/// Long enough for the next frame.
fn rest() {
    std::thread::sleep(FRAME + Duration::from_millis(5));
}

#[test]
fn a_page_gets_a_frame_once_it_has_drawn_the_last_or_looks_elsewhere() {
    let desk = Desk::new(0.0);
    assert!(!desk.is_wanted() && desk.due(0).is_empty());
    let page = desk.open().unwrap();
    assert!(desk.due(0).is_empty(), "it looks at nothing yet");
    desk.hear(page, look(0.0));
    assert!(desk.is_wanted());
    let [due] = desk.due(0)[..] else { panic!("one page looks") };
    desk.give(&due, vec![vec![1]]);
    assert!(desk.due(1).is_empty(), "the first is not drawn");
    assert_eq!(desk.next(page, NOW), Ready::Frame(vec![vec![1]]));
    rest();
    assert!(desk.due(1).is_empty() && desk.rests(1).is_none(), "nor is it now");
    desk.hear(page, Wish::Ack { frame: due.number });
    assert!(desk.due(0).is_empty(), "nothing has changed");
    assert_eq!((desk.due(1).len(), desk.rests(1)), (1, Some(NOW)));
    desk.hear(page, look(1.0));
    assert_eq!(desk.due(0).len(), 1);
    desk.close(page);
    assert!(desk.due(1).is_empty() && !desk.is_wanted());
    assert_eq!(desk.next(page, NOW), Ready::Closed);
}

#[test]
fn what_a_page_has_seen_coarsely_it_gets_again() {
    let desk = Desk::new(0.0);
    let page = desk.open().unwrap();
    desk.hear(page, look(0.0));
    let give = |coarseness: u32| {
        let [due] = desk.due(7)[..] else { panic!("a frame is due") };
        desk.give(&Due { gaze: Gaze { coarseness, ..due.gaze }, ..due }, vec![vec![1]]);
        desk.hear(page, Wish::Ack { frame: due.number });
        rest();
        due.glimpsed
    };
    assert_eq!([give(4), give(1)], [false, true]);
    assert!(desk.due(7).is_empty(), "now it is as fine as can be");
    desk.hear(page, look(1.0));
    assert_eq!([give(2), give(2), give(1)], [false, true, true]);
}

#[test]
fn who_leaves_a_world_that_stands_still_lets_it_go_on() {
    let desk = Desk::new(0.0);
    let (one, other) = (desk.open().unwrap(), desk.open().unwrap());
    desk.hear(one, Wish::Step { by: 2 });
    desk.hear(one, Wish::Speed { times: 0.5 });
    desk.hear(one, Wish::Pick { source: 0, at: [1.0, 2.0] });
    assert_eq!(desk.take_pace(), Pace { playing: false, times: 0.5, by: 2, seek: None });
    desk.close(one);
    assert_eq!(desk.take_pace(), Pace { playing: false, times: 0.5, by: 0, seek: None });
    assert_eq!(desk.picked(), Some(Pick::At(0, [1.0, 2.0], 0.0)));
    desk.close(other);
    assert_eq!(desk.take_pace(), Pace { playing: true, times: 0.0, by: 0, seek: None });
    assert_eq!(desk.picked(), None);
}

#[test]
fn what_pages_want_done_is_a_line_each_though_it_cannot_be_read() {
    let desk = Desk::new(0.0);
    let page = desk.open().unwrap();
    assert_eq!(desk.take_commands(7), None);
    for line in ["{\"remove\":\n3}", "{\"add\": {\"x\": 1e10,\n\"y\": 0}}", "{\"until\": 9}"] {
        desk.hear(page, Wish::Command { line: line.to_owned() });
    }
    let expected = "0\t{\"step\":7,\"remove\":3}\n0\t{\"add\": {\"x\": 1e10, \"y\": 0}}\n0\t{\"until\": 9}\n";
    assert_eq!(desk.take_commands(7), Some(expected.as_bytes().to_vec()));
    assert!(!desk.has_commands());
}

#[test]
fn there_is_room_for_so_many_pages_and_so_many_words() {
    let desk = Desk::new(0.0);
    let pages: Vec<_> = std::iter::from_fn(|| desk.open()).collect();
    assert_eq!(pages.len(), MOST_PAGES);
    (0..1000).for_each(|i| desk.tell(&Say::Difference { step: Some(i) }));
    let Ready::Texts(texts) = desk.next(pages[0], NOW) else { panic!("much was said") };
    assert_eq!((texts.len(), texts.last().unwrap().as_str()), (MOST_TEXTS, r#"{"type":"difference","step":999}"#));
    desk.end();
    assert_eq!(desk.next(pages[0], NOW), Ready::Texts(vec![r#"{"type":"over"}"#.to_owned()]));
    assert_eq!(desk.next(pages[0], NOW), Ready::Closed);
    assert!(matches!(desk.next(pages[1], NOW), Ready::Texts(_)), "what was said before is");
    desk.close(pages[1]);
    assert_eq!(desk.open(), None);
}
