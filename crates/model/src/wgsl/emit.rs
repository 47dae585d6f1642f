//! Instructions as statements.

use super::precision::ShaderPrecision;
use crate::graph::Unary;
use crate::program::{Instruction, Operation, Program};
use crate::step::Substep;
use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;

/// Writes the instructions of a program as statements. A register is a constant that each write defines anew; states are variables.
pub(super) struct Emitter<'p> {
    program: &'p Program,
    precision: ShaderPrecision,
    /// The expression of each register at this place.
    names: HashMap<u16, String>,
    states: BTreeSet<u16>,
    made: usize,
    pub text: String,
}

impl<'p> Emitter<'p> {
    pub fn new(program: &'p Program, precision: ShaderPrecision) -> Self {
        let states: BTreeSet<u16> = program.states.iter().map(|(state, _)| *state).collect();
        let mut names: HashMap<u16, String> =
            (0..).zip(&program.states).map(|(n, (state, _))| (*state, format!("state{n}"))).collect();
        names.extend((0..).zip(&program.parameters).map(|(n, (register, _))| (*register, format!("parameter{n}"))));
        Self { program, precision, names, states, made: 0, text: String::new() }
    }

    /// Returns the expression of a register.
    pub fn name(&self, register: u16) -> Option<&str> {
        self.names.get(&register).map(String::as_str)
    }

    /// Writes an instruction; uniforms are read from the row that begins at the variable `row`. Returns `None` if shaders do not have
    /// the operation.
    pub fn instruction(&mut self, of: &Instruction, row: &str) -> Option<()> {
        let value = self.expression(of, row)?;
        self.assign(of.target, &value);
        Some(())
    }

    fn assign(&mut self, target: u16, value: &str) {
        if self.states.contains(&target) {
            let _ = writeln!(self.text, "        {} = {value};", self.names[&target]);
            return;
        }
        let name = format!("v{}", self.made);
        self.made += 1;
        let _ = writeln!(self.text, "        let {name} = {value};");
        self.names.insert(target, name);
    }

    fn scalar(&self, number: u16, row: &str) -> Option<String> {
        let number = usize::from(number);
        let constants = &self.program.constants;
        match constants.get(number) {
            Some(value) => self.precision.literal(*value),
            // The shader loads those of its own row once.
            None if row == "row" => Some(format!("uniform{}", number - constants.len())),
            None => Some(format!("rows[{row} + {}u]", number - constants.len())),
        }
    }

    fn expression(&self, of: &Instruction, row: &str) -> Option<String> {
        use Operation as Is;
        let read: Vec<&str> = of.read().iter().map(|register| self.name(*register)).collect::<Option<_>>()?;
        let r = |n: usize| read.get(n).copied().unwrap_or("");
        let k = |n: usize| self.scalar(of.scalars[n], row);
        // a + k b + l c + …, the scalars with the registers after the first one.
        let linear = |terms: usize| {
            (0..terms).try_fold(r(0).to_owned(), |sum, n| Some(format!("fma({}, {}, {sum})", k(n)?, r(n + 1))))
        };
        let products = |sum: String, first: usize| {
            (first..read.len()).step_by(2).fold(sum, |sum, n| format!("fma({}, {}, {sum})", r(n), r(n + 1)))
        };
        Some(match of.operation {
            Is::Copy => r(0).to_owned(),
            Is::Broadcast => k(0)?,
            Is::Add => format!("{} + {}", r(0), r(1)),
            Is::Subtract => format!("{} - {}", r(0), r(1)),
            Is::Multiply => format!("{} * {}", r(0), r(1)),
            Is::Divide => format!("{} / {}", r(0), r(1)),
            Is::Reciprocal => format!("Scalar(1.0) / {}", r(0)),
            Is::Negative => format!("-{}", r(0)),
            Is::Min => format!("select({1}, {0}, {0} < {1})", r(0), r(1)),
            Is::Max => format!("select({1}, {0}, {0} > {1})", r(0), r(1)),
            Is::SelectLess => format!("select({}, {}, {} < {})", r(3), r(2), r(0), r(1)),
            Is::SelectLessEqual => format!("select({}, {}, {} <= {})", r(3), r(2), r(0), r(1)),
            Is::Power => format!("power({}, {})", r(0), r(1)),
            Is::Atan2 => format!("angle({}, {})", r(0), r(1)),
            Is::Function(function) => called(function, r(0)),
            Is::Products2 | Is::Products3 => products(format!("{} * {}", r(0), r(1)), 2),
            Is::AddProduct | Is::AddProducts2 | Is::AddProducts3 => products(r(0).to_owned(), 1),
            Is::SubtractProduct => format!("fma(-{}, {}, {})", r(1), r(2), r(0)),
            Is::Linear1 => linear(1)?,
            Is::Linear2 => linear(2)?,
            Is::Linear3 => linear(3)?,
            Is::Linear4 => linear(4)?,
            Is::Affine1 => format!("fma({}, {}, {})", k(1)?, r(0), k(0)?),
            Is::Affine2 => format!("fma({}, {}, fma({}, {}, {}))", k(2)?, r(1), k(1)?, r(0), k(0)?),
            Is::Scale1 => format!("{} * {}", k(0)?, r(0)),
            Is::Scale2 => format!("fma({}, {}, {} * {})", k(1)?, r(1), k(0)?, r(0)),
            Is::Output | Is::Memory(_) | Is::MemoryRate(_) => return None,
        })
    }

    /// Writes the delay `at` of the body: over a step of a regular clock a delayed signal has two values, which are computed again from
    /// the inputs of their samples. Returns `None` if the signal depends on more than inputs and parameters.
    pub fn delay(&mut self, at: usize) -> Option<()> {
        let of = self.program.body[at];
        let [signal, delay, latency] = [0, 1, 2].map(|n| of.registers[n]);
        let (delay, latency) = (self.name(delay)?.to_owned(), self.name(latency)?.to_owned());
        let slice = self.slice(at, signal)?;
        let own = format!("{at}");
        let (_, Substep { place, of: parts }) = of.memory();
        let parts = if parts == 0 { Substep::JUMP } else { parts };
        let [place, parts] = [place, parts].map(|number| format!("Scalar({number}.0)"));
        let _ = writeln!(
            self.text,
            "        let late{own} = max({delay}, Scalar(0.0)) / rows[0];\n        let whole{own} = floor(late{own});\n        \
             let back{own} = i32(min(whole{own}, Scalar(1e9)));\n        \
             let recent{own} = HEAD + u32(max(i32(n) - back{own}, 0)) * ROW;\n        \
             let older{own} = HEAD + u32(max(i32(n) - back{own} - 1, 0)) * ROW;"
        );
        let values = ["recent", "older", "HEAD"].map(|row| {
            let row = if row == "HEAD" { row.to_owned() } else { format!("{row}{own}") };
            self.again(&slice, signal, &row)
        });
        let [recent, older, first] = values;
        let (recent, older, first) = (recent?, older?, first?);
        let _ = writeln!(
            self.text,
            "        let part{own} = clamp(fma(late{own} - whole{own}, {parts}, -{place}), Scalar(0.0), Scalar(1.0));\n        \
             let mean{own} = fma(part{own}, {older} - {recent}, {recent});\n        \
             let begin{own} = rows[1] / rows[0] + late{own} + {latency} / rows[0];\n        \
             let held{own} = select(Scalar(0.0), clamp(fma(begin{own} - Scalar(n), {parts}, -{place}), Scalar(0.0), Scalar(1.0)), {latency} > Scalar(0.0));"
        );
        self.assign(of.target, &format!("fma(held{own}, {first} - mean{own}, mean{own})"));
        Some(())
    }

    /// Returns the instructions of the body before `at` that compute a register from inputs and parameters, in their order.
    fn slice(&self, at: usize, register: u16) -> Option<Vec<usize>> {
        let mut needed = BTreeSet::from([register]);
        let mut slice = Vec::new();
        for n in (0..at).rev() {
            let one = &self.program.body[n];
            if one.operation != Operation::Output && needed.remove(&one.target) {
                if one.operation.has_memory() {
                    return None;
                }
                needed.extend(one.read());
                slice.push(n);
            }
        }
        slice.reverse();
        (!needed.iter().any(|register| self.states.contains(register))).then_some(slice)
    }

    /// Writes a slice with the inputs of another row and returns the name of its result.
    fn again(&mut self, slice: &[usize], result: u16, row: &str) -> Option<String> {
        let kept = self.names.clone();
        for n in slice {
            let instruction = self.program.body[*n];
            self.instruction(&instruction, row)?;
        }
        let name = self.name(result)?.to_owned();
        self.names = kept;
        Some(name)
    }
}

/// Returns the call of a function.
fn called(function: Unary, x: &str) -> String {
    match function {
        Unary::Negative => format!("-{x}"),
        Unary::Reciprocal => format!("Scalar(1.0) / {x}"),
        Unary::Sin => format!("sine({x}, 0)"),
        Unary::Cos => format!("sine({x}, 1)"),
        Unary::Tan => format!("tangent({x})"),
        Unary::Exp => format!("exponential({x})"),
        Unary::Log => format!("logarithm({x})"),
        Unary::Sqrt => format!("sqrt({x})"),
        Unary::Abs => format!("abs({x})"),
        Unary::Sign => {
            format!("select(select(Scalar(0.0), Scalar(-1.0), {x} < Scalar(0.0)), Scalar(1.0), {x} > Scalar(0.0))")
        }
        Unary::Tanh => format!("hyperbolic_tangent({x})"),
        Unary::Atan => format!("arc_tangent({x})"),
    }
}
