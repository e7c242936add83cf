use super::*;
use crate::config::Config;
use crate::error::Exit;
use crate::plan::Plan;
use crate::rank::{Observer, StopFlag};
use crate::summary::Summary;
use std::collections::BTreeMap;

const PILE: &str = "[scene]\nkind = \"pile\"\nbodies = 200\n[run]\ntiles = [3, 2]\nsteps = 40\n";

fn live(overrides: &[(&str, &str)]) -> Live {
    Live::new(Plan::new(&Config::from_toml_str("test", PILE, overrides).unwrap()).unwrap())
}

/// What is shown of a run, and what it comes to.
fn frames(overrides: &[(&str, &str)], shown: Shown, is_live: bool) -> (Vec<Frame>, Summary) {
    let mut frames = Vec::new();
    let mut keep = |frame: &Frame| {
        frames.push(frame.clone());
        Ok(())
    };
    let (end, summary) = live(overrides).show(shown, is_live, Observer::default(), &mut keep).unwrap();
    assert_eq!(end, End::Complete);
    (frames, summary)
}

#[test]
fn steps_are_shown_from_the_first_to_the_last() {
    let shown = Shown { first: 4, every: 3, last: 12 };
    assert_eq!((shown.count(), shown.steps().collect::<Vec<_>>()), (3, vec![4, 7, 10]));
    assert_eq!((0..20).filter(|&step| shown.has(step)).collect::<Vec<_>>(), [4, 7, 10]);
    assert_eq!(Shown::only(0).steps().collect::<Vec<_>>(), [0]);
}

#[test]
fn any_ranks_show_the_same_and_nobody_who_watches_changes_a_bit() {
    let all = Shown { first: 0, every: 8, last: 40 };
    let unwatched = crate::run(&Config::from_toml_str("test", PILE, &[]).unwrap()).unwrap();
    let by_id = |frame: &Frame| -> BTreeMap<u64, (Vec<u8>, u16, bool)> {
        let live = frame.live.as_ref().unwrap();
        let rows = frame.bodies.iter().zip(live.contacts.iter().zip(&live.asleep));
        rows.map(|(row, (contacts, asleep))| (row.id, (bytemuck::bytes_of(row).to_vec(), *contacts, *asleep))).collect()
    };
    let (alone, _) = frames(&[], all, true);
    assert_eq!(alone.iter().map(|frame| frame.step).collect::<Vec<_>>(), [0, 8, 16, 24, 32, 40]);
    for ranks in ["1", "2", "4"] {
        let (seen, summary) = frames(&[("ranks", ranks)], all, true);
        assert_eq!((&summary.state_hash, &summary.contact_hash), (&unwatched.state_hash, &unwatched.contact_hash));
        for (frame, expected) in seen.iter().zip(&alone) {
            assert_eq!((frame.step, by_id(frame)), (expected.step, by_id(expected)), "{ranks}");
            let (of, live) = (|live: &crate::look::frame::Live| (live.points.len(), live.ghosts.len()), &frame.live);
            assert_eq!(live.as_ref().map(of), expected.live.as_ref().map(of));
            let told: Vec<u32> = frame.ranks.iter().map(|(rank, _)| *rank).collect();
            assert_eq!(told, (0..ranks.parse().unwrap()).collect::<Vec<_>>());
            assert_eq!(frame.ranks.last().unwrap().1, 200);
        }
    }
    // Each contact of two bodies is counted by both, and shown once, also over a border.
    let last = alone[5].live.as_ref().unwrap();
    let counted: usize = last.contacts.iter().map(|count| usize::from(*count)).sum();
    let (points, least) = (last.points.len(), counted.div_ceil(2));
    assert!(points > 100 && points >= least && points < counted && !last.ghosts.is_empty(), "{points} of {counted}");
}

#[test]
fn only_what_is_asked_for_is_told_and_run() {
    let (seen, summary) = frames(&[("ranks", "2")], Shown::only(7), false);
    assert_eq!((seen.len(), seen[0].step, summary.steps), (1, 7, 7));
    assert!(seen[0].live.is_none() && seen[0].bodies.len() == 200);
}

#[test]
fn whoever_cannot_go_on_showing_stops_the_run() {
    let mut shows = 0;
    let mut fails = |_: &Frame| {
        shows += 1;
        Err(RunError::Output { path: "film.gif".into(), reason: "no space left".to_owned() })
    };
    let all = Shown { first: 0, every: 1, last: 100_000 };
    let error = live(&[("ranks", "3")]).show(all, false, Observer::default(), &mut fails).unwrap_err();
    assert_eq!((error.exit(), shows), (Exit::Output, 1));
}

#[test]
fn a_run_that_is_stopped_or_fails_says_so() {
    let all = Shown { first: 0, every: 1, last: 100_000 };
    let stop = StopFlag::default();
    let observer = Observer { stop: stop.clone(), ..Observer::default() };
    let mut stops = |frame: &Frame| {
        if frame.step == 5 {
            stop.request();
        }
        Ok(())
    };
    assert_eq!(live(&[("ranks", "2")]).show(all, false, observer, &mut stops).unwrap().0, End::Interrupted);
    let panic_at = "1@9".parse().ok();
    let observer = Observer { panic_at, ..Observer::default() };
    let error = live(&[("ranks", "3")]).show(all, false, observer, &mut |_| Ok(())).unwrap_err();
    assert_eq!(error.exit(), Exit::PeerLost, "{error}");
    assert!(error.to_string().starts_with("rank 1 was lost after 9 of 100000 steps"), "{error}");
}
