//! The shader of a model as text, for readers.

use super::layout::Layout;
use super::precision::ShaderPrecision;
use super::shader::{ShaderSettings, shader};
use crate::IntegrationMethod;
use crate::definition::Model;
use crate::program::{Roots, compile};
use crate::step::{Step, StepSettings};
use motorfit_core::{Error, Result};

impl Model {
    /// Returns the WGSL shader that evaluates candidates of the model with one step of the Runge–Kutta method per sample, whose length is
    /// the last input. Problems have their own shaders, with their sampling period and method.
    ///
    /// # Errors
    /// Returns a data error if the model has a moving average or a delay of a delayed signal, which shaders do not have, or its step needs
    /// too many registers.
    pub fn wgsl(&self, precision: ShaderPrecision) -> Result<String> {
        let settings = StepSettings {
            method: IntegrationMethod::RungeKutta,
            substeps: 1,
            step_s: None,
            is_first_order_hold: false,
        };
        let Step { mut graph, next, milestones, outputs, memories, initial, .. } = Step::new(self, &settings);
        let roots = Roots {
            next: &next,
            milestones: &milestones,
            initial: &initial,
            outputs: &outputs,
            results: &[],
            memories: &memories,
        };
        let text = compile(&mut graph, &roots).and_then(|program| {
            let layout = Layout::new(&program, &vec![true; outputs.len()], false);
            shader(&program, &layout, &ShaderSettings { precision, is_absolute: false, workgroup: 64 })
        });
        text.ok_or_else(|| {
            let message =
                format!("the model {} has no shader: it has a moving average, a delay of a delayed signal, or too many operations", self.name());
            Error::data(message, "Populations of such a model are evaluated on the CPU.")
        })
    }
}
