//! Frames of another rank.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::codec(bytes);
});
