//! Elementary functions.
/// Sine.
#[must_use]
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}
/// Cosine.
#[must_use]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}
/// Exponential.
#[must_use]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}
/// Logarithm.
#[must_use]
pub fn log(x: f64) -> f64 {
    libm::log(x)
}
