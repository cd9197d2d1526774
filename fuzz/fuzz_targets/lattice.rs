//! Lattice files: whatever the bytes, either a fault that says where, or a cell with a field.
//!
//! The text is read in every format. Of a small cell that comes out the field is made, with and
//! without fillets.
#![no_main]

use alveole::cellular::struts::Sizes;
use alveole::cellular::struts::file::{Format, read};
use alveole::expr::Graph;
use libfuzzer_sys::fuzz_target;
use std::hint::black_box;

/// Most struts and plates of a cell whose field is made.
const MOST_ELEMENTS: usize = 40;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    for format in [Format::Plain, Format::Json, Format::Ltcx] {
        let cell = match read(&text, format) {
            Ok(cell) => cell,
            Err(fault) => {
                assert!(!fault.to_string().is_empty());
                continue;
            }
        };
        let count = cell.struts().len() + cell.plates().len();
        assert!(count > 0);
        black_box(cell.nodes());
        if count > MOST_ELEMENTS {
            continue;
        }
        for fillet in [0.0, 0.1] {
            let mut graph = Graph::new();
            let [size, fillet] = [0.1, fillet].map(|value| graph.constant(value));
            let sizes = Sizes { radius: size, thickness: size, fillet };
            let solid = cell.solid(&mut graph, sizes);
            assert!(solid.extent(&graph, &[]).lipschitz >= 1.0);
        }
    }
});
