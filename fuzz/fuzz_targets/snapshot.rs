//! Blocks of saved tiles.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::snapshot(bytes);
});
