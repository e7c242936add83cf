//! What pages send to `atoll view`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::page(bytes);
});
