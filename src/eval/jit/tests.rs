//! The compiled engine against the interpreter.

use crate::eval::Engine;

crate::eval::suite::conformance!(Engine::Compiled);
