//! Interval subdivision of the grid down to bricks.
