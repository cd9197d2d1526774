//! A field with its bounds, growth and origin; primitives; set, offset and motion operations.
