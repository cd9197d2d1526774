//! Program text: sources and spans, lexer, stack notation, infix equations, diagnostics.
