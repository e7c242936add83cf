//! What each thread did, for `--trace`: Chrome's JSON of complete events, which ui.perfetto.dev and chrome://tracing open.

use super::Summary;
use crate::rank::trace::RankTrace;
use serde_json::{Value, json};
use std::io::Write as _;

/// The file: a process for each rank, a thread for each of its threads, and what they did as slices, those of a thread in
/// order and each before what lies within it. Times are in microseconds since the first slice.
///
/// Ranks and threads are numbered from 1: viewers keep 0 for the system's idle process, and mix up what is told of it.
pub(crate) fn to_json(summary: &Summary, ranks: &[RankTrace]) -> Vec<u8> {
    let origin = ranks.iter().flat_map(|rank| &rank.slices).map(|slice| slice.start).min().unwrap_or(0);
    let doubt = ranks.iter().map(|rank| rank.doubt).max().unwrap_or(0);
    let about = json!({
        "program": format!("atoll {}", summary.version),
        "scene": summary.scene,
        "bodies": summary.bodies,
        "ranks": summary.ranks,
        "threads": summary.threads,
        "transport": summary.transport,
        "slices_left_out": left_out(ranks),
        "clocks_differ_by_at_most_us": doubt as f64 * 1e-3,
    });
    let mut text = Vec::new();
    let mut first = true;
    let mut line = |text: &mut Vec<u8>, event: std::fmt::Arguments<'_>| {
        let comma = if std::mem::take(&mut first) { "" } else { "," };
        write!(text, "{comma}\n{event}").expect("memory takes any text");
    };
    write!(text, "{{\"displayTimeUnit\":\"ms\",\"otherData\":{about},\"traceEvents\":[")
        .expect("memory takes any text");
    for (rank, trace) in ranks.iter().enumerate() {
        let pid = rank + 1;
        let named = |what: &str, tid: usize, args: Value| json!({"ph": "M", "name": what, "pid": pid, "tid": tid, "args": args});
        line(&mut text, format_args!("{}", named("process_name", 1, json!({"name": format!("rank {rank}")}))));
        line(&mut text, format_args!("{}", named("process_sort_index", 1, json!({"sort_index": pid}))));
        for thread in 0..summary.threads {
            let tid = thread + 1;
            line(&mut text, format_args!("{}", named("thread_name", tid, json!({"name": format!("thread {thread}")}))));
            line(&mut text, format_args!("{}", named("thread_sort_index", tid, json!({"sort_index": tid}))));
        }
        let words: Vec<Value> = trace.names.iter().map(|name| name.as_str().into()).collect();
        // Another version may have sent a number of no word.
        let word = |number: u16| words.get(usize::from(number)).unwrap_or(&Value::Null);
        for slice in &trace.slices {
            let (name, tid) = (word(slice.name), u64::from(slice.thread) + 1);
            let (start, length) = (Micros(slice.start.abs_diff(origin)), Micros(slice.nanos));
            let args = slice.of.map(|(key, value)| format!(",\"args\":{{{}:{value}}}", word(key))).unwrap_or_default();
            line(
                &mut text,
                format_args!(
                    "{{\"ph\":\"X\",\"name\":{name},\"pid\":{pid},\"tid\":{tid},\"ts\":{start},\"dur\":{length}{args}}}"
                ),
            );
        }
    }
    text.extend_from_slice(b"\n]}\n");
    text
}

/// How many slices there was no room for.
pub(crate) fn left_out(ranks: &[RankTrace]) -> u64 {
    ranks.iter().map(|rank| rank.left_out).sum()
}

/// Nanoseconds, written as microseconds to the last digit.
struct Micros(u64);

impl std::fmt::Display for Micros {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:03}", self.0 / 1000, self.0 % 1000)
    }
}
