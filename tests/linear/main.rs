//! The linear algebra, part by part, on small systems whose solutions are known.

mod dense;
mod krylov;
mod ldlt;
mod lu;
mod matrices;
mod nearly_symmetric;
mod pattern;
