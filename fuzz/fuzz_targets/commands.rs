//! What is done to a world while it runs.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::commands(bytes);
});
