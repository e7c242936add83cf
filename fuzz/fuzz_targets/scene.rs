//! Files of scenes.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::scene(bytes);
});
