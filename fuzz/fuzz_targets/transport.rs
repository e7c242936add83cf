//! Messages of another rank within a collective call.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    atoll_tests::fuzz::transport(bytes);
});
