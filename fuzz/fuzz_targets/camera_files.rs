#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| targets::camera_files(data));
