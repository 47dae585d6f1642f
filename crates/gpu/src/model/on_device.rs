//! Problems of models on a device, those that were evaluated last.

use super::super::device::Device;
use super::check::check;
use super::loaded::Loaded;
use motorfit_core::Result;
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::wgsl::ShaderPrecision;

/// Number of problems that stay on the device: the criteria of a comparison.
const PROBLEMS_MAX: usize = 16;

/// Problems on a device by their numbers, the last used at the end; without units where shaders cannot evaluate them.
#[derive(Default)]
pub(crate) struct ModelsOnDevice(Vec<(u64, Option<Loaded>)>);

impl ModelsOnDevice {
    /// Returns a problem on the device; `None` if shaders cannot evaluate it. Where it is new, it is put there, and the shaders are compared
    /// with the graph of the model.
    pub(crate) fn get(
        &mut self,
        device: &Device,
        problem: &ModelProblem,
        precision: ShaderPrecision,
    ) -> Result<Option<&mut Loaded>> {
        let number = problem.number();
        let own = match self.0.iter().position(|(known, _)| *known == number) {
            Some(place) => self.0.remove(place),
            None => {
                let mut loaded = Loaded::new(device, problem, precision)?;
                let is_checked = match &mut loaded {
                    Some(loaded) => check(device, loaded, problem, precision)?,
                    None => false,
                };
                (number, loaded.filter(|_| is_checked))
            }
        };
        if self.0.len() == PROBLEMS_MAX {
            self.0.remove(0);
        }
        self.0.push(own);
        Ok(self.0.last_mut().and_then(|(_, loaded)| loaded.as_mut()))
    }

    /// Forgets all problems, after the device failed.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}
