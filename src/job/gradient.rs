//! Derivatives of a solid's numbers by its parameters, and its numbers straight from the field.
//!
//! Every parameter that the job was read with has its entry, also one that nothing depends on. A
//! box that follows from the solid moves with the parameters, and with it the grid; a box that the
//! settings give does not, nor does a spacing that they give.

use super::kept::{Envelope, Kept, KeptRates};
use super::level_rates::LevelRates;
use super::{Error, Job, Report, Settings, Spacing};
use crate::contour::{self, Grid};
use crate::eval::rates::BoundRates;
use crate::eval::{Bound, interpret};
use crate::expr::{Graph, NodeId, ParameterId};
use crate::geom::Axis;
use crate::measure::quadrature::{self, Estimate};
use crate::measure::{self, GridMotion};
use crate::num::{Interval, Progress};
use std::time::{Duration, Instant};

/// The quantities of a solid that have derivatives; or the derivatives.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Quantities {
    /// Volume enclosed by the mesh.
    pub volume: f64,
    /// Area of the mesh.
    pub area: f64,
    /// Volume over that of the box that is contoured.
    pub relative_density: f64,
    /// Volume over that of the envelope; over the box where there is none.
    pub envelope_density: f64,
}

/// The derivatives by one parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct By<D> {
    /// Its name.
    pub parameter: String,
    /// The derivatives.
    #[serde(flatten)]
    pub derivatives: D,
}

/// Quantities of the mesh of a solid, and their derivatives.
///
/// These are of the mesh to rounding, as steps of the parameters show that move the surface by more
/// than a thousandth of the spacing: [`measure::gradient`](mod@crate::measure::gradient) says what
/// they are for shorter ones. What goes through a level that a density is solved for goes through
/// that of the solid itself, with likely errors of its own; the level that is solved for on a
/// coarse grid has another derivative, by the error of the grid.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Gradient {
    /// The quantities.
    #[serde(flatten)]
    pub quantities: Quantities,
    /// Their derivatives by each parameter, in the order in which the parameters were given.
    pub by: Vec<By<Quantities>>,
    /// Crossings of grid edges without a velocity of their own: where the field jumps or is flat,
    /// which are taken not to move, and where the edge grazes the surface, which move with its
    /// normal speed. The derivatives are those of the mesh only as far as there are none.
    pub unresolved: u64,
    /// What contouring did.
    pub report: Report,
}

/// Quantities of a solid straight from its field.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FieldMeasures {
    /// Volume in the box.
    pub volume: Estimate,
    /// Area of the surface, flat cuts by the box included.
    pub area: Estimate,
    /// Volume over that of the box.
    pub relative_density: Estimate,
    /// Volume of the envelope; see [`Measures`](super::Measures::envelope_volume).
    pub envelope_volume: Option<Estimate>,
    /// Volume over that of the envelope; over the box where there is none.
    pub envelope_density: Estimate,
    /// Derivatives by each parameter.
    pub by: Vec<By<FieldSlopes>>,
    /// Crossings of grid edges where the field jumps or is flat, which are taken not to move.
    pub unresolved: u64,
    /// What was done.
    pub report: Report,
}

/// Derivatives of the solid's own quantities by a parameter.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FieldSlopes {
    /// Of the volume.
    pub volume: Estimate,
    /// Of the volume over that of the box.
    pub relative_density: Estimate,
}

impl Job {
    /// Volume, area and densities of the solid's mesh with their derivatives by every parameter.
    ///
    /// The numbers are those of [`measure`](Self::measure) but for rounding, the derivatives those
    /// of these numbers: see [`measure::gradient`](mod@crate::measure::gradient). No mesh is kept.
    ///
    /// ```
    /// use alveole::job::{Job, Settings};
    /// use alveole::num::Progress;
    ///
    /// # fn main() -> Result<(), alveole::job::Error> {
    /// let job = Job::parse_with("gyroid dilate t box", &[("t", 0.35)])?;
    /// let found = job.gradient(&Settings::with_spacing(0.1), &Progress::new())?;
    /// println!("{} by t", found.by[0].derivatives.relative_density);
    /// # assert!((found.by[0].derivatives.relative_density - 0.32).abs() < 0.01);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn gradient(&self, settings: &Settings, progress: &Progress) -> Result<Gradient, Error> {
        let grid = self.grid(settings)?;
        let (values, densities) = self.solved(&grid, settings, progress)?;
        let Directions { slots, motions, levels } =
            self.directions(&grid, &values, settings, progress)?;
        let field = self.field_with_rates(&grid, values.clone());
        let (mut found, mut report) = field.gradient(&slots, &motions, settings, progress)?;
        report.densities = densities;
        levels.carry(&mut found.by, |rate, level, factor| {
            rate.volume += level.volume * factor;
            rate.area += level.area * factor;
        });
        let own = BoxVolume::new(&grid, &motions);
        let kept = self.envelope.envelope(&self.graph, &self.operands, &values);
        let envelope = match &kept {
            None => None,
            Some(kept) => {
                let field = envelope_with_rates(field, kept);
                let mut whole = field.gradient(&slots, &motions, settings, progress)?.0;
                levels.carry(&mut whole.by, |rate, level, factor| {
                    rate.volume += level.volume * factor;
                });
                Some(whole)
            }
        };
        let volume = found.totals.volume;
        let density = |k: usize, rate: f64, whole: f64, whole_rates: &dyn Fn(usize) -> f64| {
            (rate - volume / whole * whole_rates(k)) / whole
        };
        let in_box = |k: usize| own.rates[k];
        let by = (self.parameters().iter().zip(&found.by).enumerate())
            .map(|(k, ((name, _), rates))| {
                let relative_density = density(k, rates.volume, own.volume, &in_box);
                let envelope_density = match &envelope {
                    None => relative_density,
                    Some(whole) => {
                        density(k, rates.volume, whole.totals.volume, &|k| whole.by[k].volume)
                    }
                };
                let (volume, area) = (rates.volume, rates.area);
                By {
                    parameter: name.clone(),
                    derivatives: Quantities { volume, area, relative_density, envelope_density },
                }
            })
            .collect();
        let whole = envelope.as_ref().map_or(own.volume, |whole| whole.totals.volume);
        let quantities = Quantities {
            volume,
            area: found.totals.area,
            relative_density: volume / own.volume,
            envelope_density: volume / whole,
        };
        let unresolved = found.unresolved + envelope.map_or(0, |whole| whole.unresolved);
        Ok(Gradient { quantities, by, unresolved, report })
    }

    /// Volume, area and densities of the solid itself, with likely errors, and the derivatives of
    /// the volume by every parameter: see [`quadrature`].
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn field_measures(
        &self,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<FieldMeasures, Error> {
        let grid = self.grid(settings)?;
        let (values, densities) = self.solved(&grid, settings, progress)?;
        let Directions { slots, motions, levels } =
            self.directions(&grid, &values, settings, progress)?;
        let field = self.field_with_rates(&grid, values.clone());
        let (mut found, mut report) = field.quadrature(&slots, &motions, settings, progress)?;
        report.densities = densities;
        levels.carry(&mut found.volume_by, |rate, level, factor| {
            rate.value += level.value * factor;
            rate.error += level.error * factor.abs();
        });
        let own = BoxVolume::new(&grid, &motions);
        let over = |part: Estimate, whole: Estimate| {
            let value = part.value / whole.value;
            Estimate { value, error: (part.error + value * whole.error) / whole.value }
        };
        let box_volume = Estimate { value: own.volume, error: 0.0 };
        let relative_density = over(found.volume, box_volume);
        let kept = self.envelope.envelope(&self.graph, &self.operands, &values);
        let envelope_volume = match &kept {
            None => None,
            Some(kept) => {
                let field = envelope_with_rates(field, kept);
                let volume = if field.fills_the_box()? {
                    box_volume
                } else {
                    field.quadrature(&[], &[], settings, progress)?.0.volume
                };
                Some(volume)
            }
        };
        let by = (self.parameters().iter().zip(&found.volume_by).zip(&own.rates))
            .map(|(((name, _), &volume), rate)| {
                let Estimate { value, error } = relative_density;
                let relative_density = Estimate {
                    value: (volume.value - value * rate) / own.volume,
                    error: (volume.error + error * rate.abs()) / own.volume,
                };
                By {
                    parameter: name.clone(),
                    derivatives: FieldSlopes { volume, relative_density },
                }
            })
            .collect();
        Ok(FieldMeasures {
            volume: found.volume,
            area: found.area,
            relative_density,
            envelope_volume,
            envelope_density: over(found.volume, envelope_volume.unwrap_or(box_volume)),
            by,
            unresolved: found.unresolved,
            report,
        })
    }

    fn field_with_rates<'a>(&'a self, grid: &'a Grid, values: Vec<f64>) -> Field<'a> {
        let Self { graph, solid, program, rates, .. } = self;
        Field { job: self, graph, field: solid.field, program, rates, grid, values }
    }

    /// The directions in which derivatives are taken.
    fn directions(
        &self,
        grid: &Grid,
        values: &[f64],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Directions, Error> {
        let mut motions = self.motions(settings)?;
        let named = self.parameters().iter();
        let mut slots: Vec<_> = named.filter_map(|(name, _)| self.graph.slot(name)).collect();
        slots.extend(self.solid.fractions.iter().map(|fraction| fraction.level));
        motions.resize(slots.len(), GridMotion::default());
        let field = self.field_with_rates(grid, values.to_vec());
        let levels = LevelRates::new(&field, &slots, &motions, settings, progress)?;
        Ok(Directions { slots, motions, levels })
    }

    /// How each parameter moves the grid.
    fn motions(&self, settings: &Settings) -> Result<Vec<GridMotion>, Error> {
        let values = self.values();
        let names = self.parameters().iter();
        if settings.bounds.is_some() {
            return Ok(names.map(|_| GridMotion::default()).collect());
        }
        let size = self.bounds()?.size();
        let longest = size.max_element();
        let motion = |slot: ParameterId| {
            let [lo, hi] = self.solid.bounds_slope(&self.graph, &values, slot);
            let spacing = match settings.spacing {
                Spacing::Each(_) => [0.0; 3],
                // Where several sides are the longest, that which grows most will be.
                Spacing::Hundredth => {
                    let longest = (0..3).filter(|&a| size[a] == longest);
                    let rate = longest.map(|a| hi[a] - lo[a]).fold(f64::NEG_INFINITY, f64::max);
                    [rate / 100.0; 3]
                }
            };
            GridMotion { lo, hi, spacing }
        };
        Ok(names.filter_map(|(name, _)| self.graph.slot(name)).map(motion).collect())
    }
}

/// The directions in which derivatives are taken: the named parameters, then unknown levels.
struct Directions {
    slots: Vec<ParameterId>,
    /// How each moves the grid.
    motions: Vec<GridMotion>,
    levels: LevelRates,
}

/// The volume of a grid's box and its derivatives.
struct BoxVolume {
    volume: f64,
    rates: Vec<f64>,
}

impl BoxVolume {
    fn new(grid: &Grid, motions: &[GridMotion]) -> Self {
        let sides = Axis::ALL.map(|axis| {
            let line = grid.placed(axis);
            line[line.len() - 1] - line[0]
        });
        let volume = sides.iter().product::<f64>();
        let rate = |motion: &GridMotion| {
            (0..3).map(|a| volume / sides[a] * (motion.hi[a] - motion.lo[a])).sum()
        };
        Self { volume, rates: motions.iter().map(rate).collect() }
    }
}

/// The envelope in place of `field`.
fn envelope_with_rates<'a>(field: Field<'a>, envelope: &'a Envelope) -> Field<'a> {
    let (graph, program, rates) = (&envelope.graph, &envelope.program, &envelope.rates);
    Field { graph, field: envelope.field, program, rates, ..field }
}

/// A field of a job on a grid, with what was kept of it.
#[derive(Clone)]
pub(super) struct Field<'a> {
    pub(super) job: &'a Job,
    pub(super) graph: &'a Graph,
    pub(super) field: NodeId,
    pub(super) program: &'a Kept,
    pub(super) rates: &'a KeptRates,
    pub(super) grid: &'a Grid,
    /// The values of all parameters.
    pub(super) values: Vec<f64>,
}

impl Field<'_> {
    /// The mesh's totals with their derivatives by the parameters `slots`, which have `motions`.
    fn gradient(
        &self,
        slots: &[ParameterId],
        motions: &[GridMotion],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(measure::Gradient, Report), Error> {
        self.with_rates(slots, settings, |bound, rates, chosen| {
            measure::gradient(bound, rates, motions, self.grid, chosen, progress)
        })
    }

    /// The solid's totals; the derivatives of its volume by the parameters `slots`, which have
    /// `motions`.
    pub(super) fn quadrature(
        &self,
        slots: &[ParameterId],
        motions: &[GridMotion],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(measure::FieldMeasures, Report), Error> {
        self.with_rates(slots, settings, |bound, rates, chosen| {
            quadrature::quadrature(bound, rates, motions, self.grid, chosen, progress)
        })
    }

    /// Whether every node of the grid lies inside, by the range of the field over all of them.
    fn fills_the_box(&self) -> Result<bool, Error> {
        let sides = Axis::ALL.map(|axis| {
            let line = self.grid.sampled(axis);
            [Interval::new(line[0], line[line.len() - 1])]
        });
        let at = sides.each_ref().map(<[Interval; 1]>::as_slice);
        let mut range = [Interval::point(0.0)];
        interpret::enclose(self.graph, &[self.field], at, &self.values, &mut range)
            .map_err(contour::Error::from)?;
        Ok(range[0].is_inside())
    }

    /// The solid's volume and its derivatives by the parameters `slots`, which do not move the box.
    pub(super) fn volume(
        &self,
        slots: &[ParameterId],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(f64, Vec<f64>), Error> {
        let motions = vec![GridMotion::default(); slots.len()];
        let found = self.with_rates(slots, settings, |bound, rates, chosen| {
            quadrature::volume(bound, rates, &motions, self.grid, chosen, progress)
        });
        found.map(|(found, _)| found)
    }

    /// Readies the program and its derivatives by the parameters `slots`, and runs `work`.
    fn with_rates<R>(
        &self,
        slots: &[ParameterId],
        settings: &Settings,
        work: impl FnOnce(
            &Bound,
            &BoundRates,
            &contour::Settings,
        ) -> Result<(R, contour::Report), contour::Error>,
    ) -> Result<(R, Report), Error> {
        let start = Instant::now();
        let program = self.program.program(self.graph, self.field, settings.engine, self.grid)?;
        let rates = self.rates.rates(&program, slots, settings.engine)?;
        let compiling = start.elapsed();
        let tables = self.grid.tables();
        let rates = rates.bind(&tables, &self.values);
        let bound = program.bind(tables, &self.values);
        let binding = start.elapsed() - compiling;
        let chosen = contour::Settings { pruning: settings.pruning, memory: settings.memory };
        let (found, contour) = work(&bound, &rates, &chosen)?;
        if contour.triangles == 0 {
            return Err(Error::Empty { cells: self.grid.cells() });
        }
        let parsing: Duration = self.job.parsing;
        let report = Report::new(self.grid, contour, parsing, compiling, binding);
        Ok((found, Report { meshes: self.job.meshes().to_vec(), ..report }))
    }
}
