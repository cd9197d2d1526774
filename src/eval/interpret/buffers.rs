//! Which buffer holds the value of which operation.
//!
//! Operations are taken in the order in which they run; a buffer is free again after the last use
//! of its value. A value never shares a buffer with an operand of its own operation.

use crate::eval::tape::{Position, Tape};

/// Numbers of buffers by operation.
#[derive(Clone, Debug)]
pub(super) struct Allocation {
    /// The buffer of each operation, numbered within its pool.
    pub of: Vec<Option<u32>>,
    /// Number of buffers in each pool.
    pub counts: Vec<u32>,
}

/// Assigns buffers to operations: `pool` names the pool of an operation that needs one, `keep` says
/// whether its value must last to the end.
pub(super) fn allocate(
    tape: &Tape,
    pool: impl Fn(Position) -> Option<usize>,
    keep: impl Fn(Position) -> bool,
) -> Allocation {
    let mut last: Vec<Position> = tape.positions().collect();
    for p in tape.positions() {
        for o in tape.op(p).operands().iter() {
            last[o.index()] = p;
        }
    }
    let mut of = vec![None; tape.len()];
    let mut counts: Vec<u32> = Vec::new();
    let mut free: Vec<Vec<u32>> = Vec::new();
    for p in tape.positions() {
        if let Some(pool) = pool(p) {
            while counts.len() <= pool {
                counts.push(0);
                free.push(Vec::new());
            }
            of[p.index()] = Some(free[pool].pop().unwrap_or_else(|| {
                counts[pool] += 1;
                counts[pool] - 1
            }));
        }
        let operands = tape.op(p).operands();
        for (i, &o) in operands.iter().enumerate() {
            let again = operands[..i].contains(&o);
            if let (Some(pool), Some(buffer)) = (pool(o), of[o.index()])
                && last[o.index()] == p
                && !keep(o)
                && !again
            {
                free[pool].push(buffer);
            }
        }
    }
    Allocation { of, counts }
}
