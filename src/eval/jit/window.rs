//! How the loops over a brick step through memory.
//!
//! What depends on two axes is computed once a brick, the rest plane by plane. Values on x and
//! another axis lie in rows of sixteen along x, values on y and z in rows along y: a row for every
//! number along y, or along z if they depend on that and one other axis. Tables hold a
//! row of numbers for every brick along their axis.

use super::body::{Body, Index, Pointer};
use super::call::Base;
use super::calls::{PLANE, ROW};
use super::layout::Home;
use super::segment::{Access, LANES};
use super::tiles::STRIDE;
use crate::expr::AxisSet;
use crate::geom::Axis;

/// Bytes of a number.
const NUMBER: usize = size_of::<f64>();
/// Vectors in a row.
pub(super) const VECTORS: usize = ROW / LANES;

/// The axes x and y.
pub(super) fn across() -> AxisSet {
    AxisSet::only(Axis::X).union(AxisSet::only(Axis::Y))
}

/// Whether values on `axes` are those on z and one other axis.
pub(super) fn is_edge(axes: AxisSet) -> bool {
    axes.len() == 2 && axes.contains(Axis::Z)
}

/// The addresses that a loop's body reads and writes at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    tables: [Pointer; 3],
    uniforms: Pointer,
    /// The first lane of values in a row for each plane.
    line: Pointer,
    /// The first lane of values in rows.
    row: Pointer,
    /// The present row's entry of values along y.
    column: Pointer,
    /// The first lane of values in bricks.
    volume: Pointer,
    /// The sign word of the present row.
    pub(super) signs: Pointer,
    /// The first of the present row of results.
    pub(super) values: Pointer,
}

impl Window {
    /// Plane `plane`, or what comes before the planes.
    pub(super) fn new(body: &mut Body<'_>, plane: Option<Index>) -> Self {
        let scratch = body.base(Base::Scratch);
        let mut window = Self {
            tables: Axis::ALL.map(|axis| body.base(Base::Table(axis))),
            uniforms: body.base(Base::Uniforms),
            line: scratch,
            row: scratch,
            column: scratch,
            volume: scratch,
            signs: body.base(Base::Signs),
            values: body.base(Base::Values),
        };
        if let Some(plane) = plane {
            let z = &mut window.tables[Axis::Z.index()];
            *z = body.advance(*z, plane, NUMBER);
            window.line = body.advance(window.line, plane, ROW * NUMBER);
            window.column = window.line;
            window.volume = body.advance(window.volume, plane, PLANE * NUMBER);
            window.values = body.advance(window.values, plane, PLANE * NUMBER);
            window.signs = body.advance(window.signs, plane, ROW * size_of::<u16>());
        }
        window
    }

    /// Row `row` of the plane.
    pub(super) fn in_row(mut self, body: &mut Body<'_>, row: Index) -> Self {
        let y = &mut self.tables[Axis::Y.index()];
        *y = body.advance(*y, row, NUMBER);
        self.column = body.advance(self.column, row, NUMBER);
        for rows in [&mut self.row, &mut self.volume, &mut self.values] {
            *rows = body.advance(*rows, row, ROW * NUMBER);
        }
        self.signs = body.advance(self.signs, row, size_of::<u16>());
        self
    }

    /// Group `group` of `vectors` vectors of the row, for values at rate `rate`.
    pub(super) fn in_group(
        mut self,
        body: &mut Body<'_>,
        rate: AxisSet,
        group: Index,
        vectors: usize,
    ) -> Self {
        let along = if rate.contains(Axis::X) { Axis::X } else { Axis::Y };
        let stride = vectors * LANES * NUMBER;
        let table = &mut self.tables[along.index()];
        for lanes in [table, &mut self.line, &mut self.row, &mut self.volume, &mut self.values] {
            *lanes = body.advance(*lanes, group, stride);
        }
        self
    }

    /// Where a loop at rate `rate` finds a value on `axes`.
    pub(super) fn access(&self, home: Home, axes: AxisSet, rate: AxisSet) -> Option<Access> {
        let along_x = rate.contains(Axis::X);
        Some(match home {
            Home::Register => return None,
            Home::Constant(value) => Access::Constant(value),
            Home::Uniform(number) => Access::Splat(self.uniforms, number),
            Home::Table(axis, number) => {
                let along = if along_x { Axis::X } else { Axis::Y };
                let table = self.tables[axis.index()];
                if axis == along {
                    Access::Lanes(table, number * STRIDE)
                } else {
                    Access::Splat(table, number * STRIDE)
                }
            }
            Home::Buffer(first) => {
                if across().is_subset(axes) {
                    Access::Lanes(self.row, first)
                } else if along_x && !axes.contains(Axis::X) {
                    Access::Splat(self.column, first)
                } else {
                    Access::Lanes(self.line, first)
                }
            }
            Home::Volume(first) => Access::Lanes(self.volume, first),
        })
    }
}
