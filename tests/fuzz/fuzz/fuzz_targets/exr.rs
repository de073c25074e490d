//! `mica_fuzz::exr` under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    mica_fuzz::exr(bytes);
});
