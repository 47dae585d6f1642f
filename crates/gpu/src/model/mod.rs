//! Models of users on a GPU: a shader made from the program of the model simulates one candidate per invocation.
//!
//! Parameters, among them matrix exponentials, are computed in f64 on the CPU. A shader is compared with the evaluation of the graph
//! for some candidates of the problem before its first use.

mod check;
mod loaded;
mod on_device;
#[cfg(test)]
mod tests;
mod unit;

pub(crate) use on_device::ModelsOnDevice;
