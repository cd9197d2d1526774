//! The steps of a program: compiled functions, calls, and jumps over dead regions.

use super::CompileError;
use super::call::{Arguments, Code};
use super::calls::{Call, Staging};
use super::flow::{Flow, Item};
use crate::eval::regions::is_set;
use crate::eval::tape::Position;
use crate::expr::{Failure, Oracle};
use std::ops::Range;
use std::sync::Arc;

/// A step of a program.
#[derive(Clone, Debug)]
pub(super) enum Action {
    /// Run a compiled function, by number.
    Code(usize),
    /// Call precompiled code.
    Call(Call),
    /// Go on at action `to` if bit `bit` is clear, after filling buffers.
    Skip { bit: u32, to: usize, fills: Vec<Fill> },
}

/// A buffer that receives one number everywhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fill {
    pub(super) first: usize,
    pub(super) len: usize,
    pub(super) value: f64,
}

/// A function of more operations than this is divided: the time to compile one grows faster than
/// its length. A sum of five hundred waves compiles in a tenth of the time that it takes whole.
const LONGEST: usize = 150;

/// Turns the items of a flow into actions.
pub(super) trait Emit {
    /// Compiles the items at `items`, which hold no calls; `last` if they are the flow's last.
    fn code(&mut self, items: Range<usize>, last: bool) -> Result<usize, CompileError>;

    /// The call for an item.
    fn call(&self, ops: &[Position]) -> Call;

    /// The buffer of an operation that is skipped.
    fn fill(&self, loser: (Position, f64)) -> Option<Fill>;
}

/// The actions of `flow`; `conclude` if there is more to do than its items.
pub(super) fn actions(
    flow: &Flow,
    emit: &mut impl Emit,
    conclude: bool,
) -> Result<Vec<Action>, CompileError> {
    let mut actions = Vec::new();
    // Regions entered by actions: last item and number of the action.
    let mut open: Vec<(usize, usize)> = Vec::new();
    let (mut begin, mut at) = (0, 0);
    loop {
        let is_end = at == flow.items.len();
        let closes = open.last().is_some_and(|(end, _)| *end == at);
        let next = if is_end { at } else { flow.after(at) };
        let whole = !is_end && !flow.has_calls(at..next) && flow.ops(at..next) <= LONGEST;
        if closes || (!whole && !is_end) || flow.ops(begin..at) > LONGEST {
            if begin < at {
                actions.push(Action::Code(emit.code(begin..at, false)?));
            }
            begin = at;
        }
        while let Some((_, action)) = open.pop_if(|(end, _)| *end == at) {
            let here = actions.len();
            if let Action::Skip { to, .. } = &mut actions[action] {
                *to = here;
            }
        }
        if is_end {
            break;
        }
        match &flow.items[at] {
            _ if whole => at = next,
            Item::Segment(_) => at = next,
            Item::Call(ops) => {
                actions.push(Action::Call(emit.call(ops)));
                at = next;
                begin = at;
            }
            Item::Enter { bit, losers, .. } => {
                let fills = losers.iter().filter_map(|loser| emit.fill(*loser)).collect();
                open.push((next, actions.len()));
                actions.push(Action::Skip { bit: *bit, to: 0, fills });
                at += 1;
                begin = at;
            }
        }
    }
    if conclude || begin < at {
        actions.push(Action::Code(emit.code(begin..at, true)?));
    }
    Ok(actions)
}

/// What actions run on, besides the memory that compiled code reaches.
pub(super) struct Run<'a> {
    pub(super) code: &'a Code,
    pub(super) staging: &'a mut Staging,
    /// Lanes that calls are for.
    pub(super) lanes: usize,
    /// What calls ask.
    pub(super) oracles: &'a [Arc<dyn Oracle>],
}

impl Run<'_> {
    /// Runs `actions` for the steps `steps`; calls are for the first of them.
    pub(super) fn actions(
        &mut self,
        actions: &[Action],
        arguments: &mut Arguments<'_>,
        steps: Range<usize>,
    ) -> Result<(), Failure> {
        let mut at = 0;
        while let Some(action) = actions.get(at) {
            at += 1;
            match action {
                Action::Code(number) => self.code.call(*number, arguments, steps.clone()),
                Action::Call(call) => {
                    let plane = steps.start;
                    call.run(arguments, self.staging, self.oracles, plane, self.lanes)?;
                }
                Action::Skip { bit, to, fills } => {
                    if !is_set(arguments.activity, *bit) {
                        for fill in fills {
                            arguments.scratch[fill.first..][..fill.len].fill(fill.value);
                        }
                        at = *to;
                    }
                }
            }
        }
        Ok(())
    }
}
