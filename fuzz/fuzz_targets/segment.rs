//! Segments of recordings.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::segment(bytes);
});
