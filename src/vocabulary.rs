//! The one table of words.
