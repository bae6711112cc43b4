#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stereology_fuzz::labels(bytes));
