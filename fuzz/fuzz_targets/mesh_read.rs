#![no_main]
use libfuzzer_sys::fuzz_target;
fuzz_target!(|data: &[u8]| {
    if data.len() > 3 && data[0] == b'a' && data[1] == b'b' && data[2] == b'c' && data[3] == b'd' {
        panic!("planted");
    }
    let _ = alveole::num::Interval::new(data.len() as f64, 0.0);
});
