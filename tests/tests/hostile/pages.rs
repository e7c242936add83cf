//! What pages send.

use crate::random::{below, change_bits, noise, one_of, rounds};
use atoll::scene::SplitMix64;
use atoll_tests::fuzz;

const WORDS: [&str; 16] = [
    "{\"do\":",
    "\"look\"",
    ",\"view\":",
    "[0,0,10,10]",
    "[-1e300,0,1e-300,1e3]",
    ",\"size\":",
    "[60,60]",
    "[8192,1]",
    "\"color\":",
    "\"spin\"",
    "}",
    ",",
    "\"pick\"",
    ",\"at\":[5,5]",
    "\"seek\"",
    "1e999",
];

/// A message of a client, masked with zeros.
fn message(kind: u8, text: &[u8]) -> Vec<u8> {
    let length = text.len() as u16;
    [&[0x80 | kind, 0x80 | 126][..], &length.to_be_bytes(), &[0; 4], text].concat()
}

fn look(random: &mut SplitMix64) -> String {
    let mut corner = || (below(random, 2001) as f64 - 1000.0) * 10_f64.powi(below(random, 20) as i32 - 12);
    let (x0, y0, x1, y1) = (corner(), corner(), corner(), corner());
    let color = one_of(random, &["kind", "speed", "spin", "tile", "rank", "contacts", "asleep"]);
    let size = [1 + below(random, 60), 1 + below(random, 60)];
    format!("{{\"do\":\"look\",\"view\":[{x0:e},{y0:e},{x1:e},{y1:e}],\"size\":{size:?},\"color\":\"{color}\"}}")
}

#[test]
fn any_messages_of_a_page() {
    let mut random = SplitMix64::after(7, 0);
    let mut looks = 0;
    for round in 0..rounds(20_000) {
        let text = match round % 3 {
            0 => (0..below(&mut random, 12)).map(|_| one_of(&mut random, &WORDS)).collect(),
            _ => look(&mut random),
        };
        let mut bytes = message(1, text.as_bytes());
        match round % 4 {
            0 => change_bits(&mut random, &mut bytes, 8 + text.len()),
            1 => bytes.extend(noise(&mut random, 30)),
            _ => {}
        }
        looks += usize::from(fuzz::page(&bytes)[1]);
    }
    assert!(looks > rounds(20_000) / 20, "{looks} looks");
}

#[test]
fn any_request() {
    let mut random = SplitMix64::after(8, 0);
    let mut requests = 0;
    for round in 0..rounds(20_000) {
        let mut bytes = b"GET /socket?token=12 HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\n\r\n".to_vec();
        let length = bytes.len();
        if round % 4 > 0 {
            change_bits(&mut random, &mut bytes, length);
        } else if round % 8 == 4 {
            bytes = noise(&mut random, 100);
        }
        requests += usize::from(fuzz::page(&bytes)[0]);
    }
    assert!(requests > rounds(20_000) / 10, "{requests} requests");
}
