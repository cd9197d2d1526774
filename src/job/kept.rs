//! What is kept from one evaluation to the next: compiled programs and what no parameter changes.

use crate::contour::Grid;
use crate::eval::rates::Rates;
use crate::eval::{Engine, Program, ProgramError};
use crate::expr::{Graph, NodeId, ParameterId};
use crate::solid::Solid;
use std::sync::{Arc, Mutex, PoisonError};

/// Bricks of a grid that are interpreted sooner than their field is compiled.
///
/// Both times grow with the operators of the field, so the number does not depend on them.
const FEW_BRICKS: usize = 27;

/// The program of one field, made when it is first asked for.
///
/// A first evaluation on few bricks is interpreted, since it may be the last; for the second the
/// field is compiled. Parameter values are read when a program is bound, so it serves them all.
/// Its code is freed with it.
#[derive(Debug, Default)]
pub(super) struct Kept(Mutex<Option<(Engine, Program)>>);

impl Kept {
    /// The program of `field`, which must be the same at every call.
    pub(super) fn program(
        &self,
        graph: &Graph,
        field: NodeId,
        engine: Engine,
        grid: &Grid,
    ) -> Result<Program, ProgramError> {
        // Not locked while compiling, which runs on threads that may be asked for the same.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let previous = kept().clone();
        if let Some((_, program)) = previous.as_ref().filter(|(made_for, _)| *made_for == engine) {
            return Ok(program.clone());
        }
        let bricks = grid.bricks().iter().map(|&n| n as usize).product::<usize>();
        let is_passing = previous.is_none()
            && engine == Engine::Automatic
            && bricks <= FEW_BRICKS
            && !Program::is_huge(graph, field);
        let engine = if is_passing { Engine::Interpreter } else { engine };
        let program = Program::new(graph, field, engine)?;
        *kept() = Some((engine, program.clone()));
        Ok(program)
    }
}

/// The derivatives of one field by all parameters, made when they are first asked for.
#[derive(Debug, Default)]
pub(super) struct KeptRates(Mutex<Vec<(Asked, Rates)>>);

/// What derivatives were asked for.
type Asked = (Engine, Vec<ParameterId>);

impl KeptRates {
    /// The derivatives of `program`, which must be that of the same field at every call, by
    /// `parameters`.
    pub(super) fn rates(
        &self,
        program: &Program,
        parameters: &[ParameterId],
        engine: Engine,
    ) -> Result<Rates, ProgramError> {
        // Not locked while compiling; see `Kept`.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let asked: Asked = (engine, parameters.to_vec());
        let known = kept().iter().find(|(known, _)| *known == asked).cloned();
        if let Some((_, rates)) = known {
            return Ok(rates);
        }
        let rates = Rates::new(program, parameters, engine)?;
        kept().push((asked, rates.clone()));
        Ok(rates)
    }
}

/// The envelope of a solid, made when it is first asked for.
#[derive(Debug, Default)]
pub(super) struct KeptEnvelope(Mutex<Option<Arc<Envelope>>>);

impl KeptEnvelope {
    /// The intersection of those of `operands` that are bounded where parameter `i` is `values[i]`;
    /// `None` if there are none, or all are.
    pub(super) fn envelope(
        &self,
        graph: &Graph,
        operands: &[Solid],
        values: &[f64],
    ) -> Option<Arc<Envelope>> {
        let is_bounded = |operand: &Solid| operand.extent(graph, values).bounds.is_finite();
        let bounded: Vec<bool> = operands.iter().map(is_bounded).collect();
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(envelope) = kept.as_ref().filter(|envelope| envelope.bounded == bounded) {
            return Some(Arc::clone(envelope));
        }
        if bounded.iter().all(|&is| is) {
            return None;
        }
        let mut graph = graph.clone();
        let chosen = operands.iter().zip(&bounded).filter(|(_, is)| **is);
        let field = chosen.map(|(o, _)| o.field).reduce(|a, b| graph.max(a, b))?;
        let parameters = graph.parameters_of(&[field]);
        let (program, rates, measured) = (Kept::default(), KeptRates::default(), Mutex::default());
        let envelope = Envelope { bounded, graph, field, program, rates, parameters, measured };
        Some(Arc::clone(kept.insert(Arc::new(envelope))))
    }
}

/// The intersection of the bounded operands of a solid.
#[derive(Debug)]
pub(super) struct Envelope {
    /// Which of the operands these are.
    bounded: Vec<bool>,
    pub(super) graph: Graph,
    pub(super) field: NodeId,
    pub(super) program: Kept,
    pub(super) rates: KeptRates,
    /// The parameters that its field depends on.
    parameters: Vec<ParameterId>,
    /// Grid, parameter values and volume of the last measurement.
    measured: Mutex<Option<(Grid, Vec<f64>, f64)>>,
}

impl Envelope {
    /// The volume on `grid` for these parameter values, from `measure` where it is not known.
    pub(super) fn volume<E>(
        &self,
        grid: &Grid,
        values: &[f64],
        measure: impl FnOnce() -> Result<f64, E>,
    ) -> Result<f64, E> {
        let own: Vec<f64> = self.parameters.iter().map(|slot| values[slot.index()]).collect();
        // Not locked while measuring, which runs on threads that may be asked for the same.
        let measured = || self.measured.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known_grid, known_values, volume)) = measured().as_ref()
            && (known_grid, known_values) == (grid, &own)
        {
            return Ok(*volume);
        }
        let volume = measure()?;
        *measured() = Some((grid.clone(), own, volume));
        Ok(volume)
    }
}
