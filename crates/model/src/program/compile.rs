//! Compilation of a graph to a program.

use super::allocate::allocate;
use super::compiled::{Program, Uniforms};
use super::instruction::{Instruction, Operation, REGISTERS_MAX};
use crate::graph::{Binary, Comparison, Graph, Id, Leaf, Node, Unary};
use crate::step::{Memory, Substep};
use std::collections::HashMap;

/// Marks a scalar that is a uniform while the number of constants is not known.
const UNIFORM: u16 = 0x8000;

/// The values that a program computes.
pub struct Roots<'a> {
    /// New values of the states.
    pub next: &'a [Id],
    /// Intermediate values in the order in which they are computed before the new states.
    pub milestones: &'a [Id],
    /// Initial values of the states, of parameters alone.
    pub initial: &'a [Id],
    /// Outputs, from the states at the start of the step.
    pub outputs: &'a [Id],
    /// Further values of parameters alone.
    pub results: &'a [Id],
    /// Operations with a memory, by the numbers of their leaves.
    pub memories: &'a [Memory],
}

/// A compiled program; `None` if it needs too many registers.
pub(crate) type Compiled = Option<Program>;

/// Compiles a computation. The graph gains nodes.
pub fn compile(graph: &mut Graph, roots: &Roots<'_>) -> Compiled {
    let all: Vec<Id> = {
        let operands: Vec<Id> = roots.memories.iter().flat_map(|memory| memory.operands.clone()).collect();
        [roots.next, roots.milestones, roots.initial, roots.outputs, roots.results, &operands].concat()
    };
    let uses = graph.uses(&all);
    let mut compiler = Compiler {
        graph,
        uses,
        registers: HashMap::new(),
        pinned: Vec::new(),
        program: Program { outputs: roots.outputs.len(), memories: roots.memories.len(), ..Program::default() },
        memories: roots.memories,
        constants: HashMap::new(),
        uniforms: Vec::new(),
        is_setup: false,
    };
    compiler.run(roots);
    let Compiler { graph, pinned, mut program, uniforms, .. } = compiler;
    if pinned.len() > REGISTERS_MAX {
        return None;
    }
    let shift = u16::try_from(program.constants.len()).ok()?;
    let with_scalars = program.setup.iter_mut().chain(&mut program.body).filter(|one| !one.operation.has_memory());
    for instruction in with_scalars {
        for scalar in &mut instruction.scalars {
            if *scalar >= UNIFORM {
                *scalar = *scalar - UNIFORM + shift;
            }
        }
    }
    let (graph, roots) = graph.extract(&uniforms);
    program.uniforms = Uniforms { graph, roots };
    allocate(&mut program, &pinned);
    Some(program)
}

/// State of a compilation. Registers are virtual: each is written once.
pub(super) struct Compiler<'g> {
    pub graph: &'g mut Graph,
    /// Number of uses of each node.
    pub uses: Vec<u32>,
    registers: HashMap<Id, u16>,
    /// True for each register that keeps its value during the samples.
    pinned: Vec<bool>,
    program: Program,
    constants: HashMap<u64, u16>,
    uniforms: Vec<Id>,
    memories: &'g [Memory],
    /// True while instructions of the setup are made.
    pub is_setup: bool,
}

impl Compiler<'_> {
    fn run(&mut self, roots: &Roots<'_>) {
        let states: Vec<u16> = (0..roots.next.len()).map(|n| self.state(n)).collect();
        for root in roots.results {
            let register = self.in_setup(*root);
            self.program.results.push(register);
        }
        for (root, state) in roots.initial.iter().zip(&states) {
            let register = self.in_setup(*root);
            self.program.states.push((*state, register));
        }
        for (number, root) in (0..).zip(roots.outputs) {
            let register = self.register(*root);
            self.put_to(Operation::Output, number, &[register], &[]);
        }
        for root in roots.milestones {
            self.register(*root);
        }
        // Operands of all states precede the new states, most of which can then be written in place.
        for root in roots.next {
            self.operands_of(*root);
        }
        let next: Vec<u16> = roots.next.iter().map(|root| self.register(*root)).collect();
        self.write_states(&states, &next);
    }

    fn state(&mut self, number: usize) -> u16 {
        let id = self.graph.leaf(Leaf::State(u16::try_from(number).unwrap_or(u16::MAX)));
        let register = self.new_register(true);
        self.registers.insert(id, register);
        register
    }

    /// Returns the register of a node of parameters alone, computed in the setup.
    fn in_setup(&mut self, root: Id) -> u16 {
        self.is_setup = true;
        let register = self.register(root);
        self.is_setup = false;
        register
    }

    /// Makes the instructions that end a sample: the new states replace the old ones.
    fn write_states(&mut self, states: &[u16], next: &[u16]) {
        let mut moves: Vec<(u16, u16)> = Vec::new();
        for (number, (&value, &state)) in next.iter().zip(states).enumerate() {
            if value == state {
                continue;
            }
            let body = &mut self.program.body;
            let made = body.iter().position(|one| one.writes() && one.target == value);
            let is_shared =
                next.iter().enumerate().any(|(other, of)| other != number && *of == value) || next.contains(&state);
            let in_place = made.filter(|made| {
                let later = &body[made + 1..];
                !self.pinned[usize::from(value)] && !is_shared && !later.iter().any(|one| one.read().contains(&state))
            });
            match in_place {
                None => moves.push((value, state)),
                Some(made) => {
                    body[made].target = state;
                    for one in &mut body[made + 1..] {
                        one.read_mut().iter_mut().filter(|read| **read == value).for_each(|read| *read = state);
                    }
                }
            }
        }
        // A value that is itself a state may be overwritten before it is read.
        let sources: Vec<u16> = moves
            .iter()
            .map(|(value, _)| if states.contains(value) { self.put(Operation::Copy, &[*value], &[]) } else { *value })
            .collect();
        for ((_, state), source) in moves.into_iter().zip(sources) {
            self.put_to(Operation::Copy, state, &[source], &[]);
        }
    }

    /// Returns true if a node has a value for each lane, otherwise it is a scalar.
    pub fn is_lane(&self, id: Id) -> bool {
        self.graph.is_of_candidate(id)
    }

    fn new_register(&mut self, is_pinned: bool) -> u16 {
        let register = u16::try_from(self.pinned.len()).unwrap_or(u16::MAX);
        self.pinned.push(is_pinned);
        register
    }

    /// Returns the number of a scalar: a node without lanes times a factor.
    pub fn scalar(&mut self, id: Id, factor: f64) -> u16 {
        if let Some(value) = self.graph.value(id) {
            return self.constant(value * factor);
        }
        let factor = self.graph.constant(factor);
        let id = self.graph.multiply(factor, id);
        let known = self.uniforms.iter().position(|uniform| *uniform == id);
        let number = known.unwrap_or_else(|| {
            self.uniforms.push(id);
            self.uniforms.len() - 1
        });
        UNIFORM + u16::try_from(number).unwrap_or(u16::MAX - UNIFORM)
    }

    pub fn constant(&mut self, value: f64) -> u16 {
        let constants = &mut self.program.constants;
        *self.constants.entry(value.to_bits()).or_insert_with(|| {
            constants.push(value);
            u16::try_from(constants.len() - 1).unwrap_or(u16::MAX)
        })
    }

    /// Adds an instruction and returns its register.
    pub fn put(&mut self, operation: Operation, registers: &[u16], scalars: &[u16]) -> u16 {
        let target = self.new_register(self.is_setup);
        self.put_to(operation, target, registers, scalars);
        target
    }

    fn put_to(&mut self, operation: Operation, target: u16, registers: &[u16], scalars: &[u16]) {
        let mut instruction = Instruction { operation, target, registers: [0; 8], scalars: [0; 4] };
        instruction.registers[..registers.len()].copy_from_slice(registers);
        instruction.scalars[..scalars.len()].copy_from_slice(scalars);
        let list = if self.is_setup { &mut self.program.setup } else { &mut self.program.body };
        list.push(instruction);
    }

    /// Returns the register of a node, after the instructions that compute it. The depth of the recursion is that of the graph above
    /// the milestones, which is limited for models.
    pub fn register(&mut self, root: Id) -> u16 {
        if let Some(register) = self.registers.get(&root) {
            return *register;
        }
        self.make(root)
    }

    fn make(&mut self, id: Id) -> u16 {
        let is_setup = self.is_setup;
        self.is_setup = is_setup || self.graph.is_fixed(id);
        let register = self.emit(id);
        self.is_setup = is_setup;
        self.registers.insert(id, register);
        register
    }

    /// Makes an operation with a memory.
    fn remembered(&mut self, number: usize) -> u16 {
        let Some(memory) = self.memories.get(number) else { return 0 };
        let operation =
            if memory.is_rate { Operation::MemoryRate(memory.kind) } else { Operation::Memory(memory.kind) };
        let operands: Vec<u16> = memory.operands.iter().map(|id| self.register(*id)).collect();
        let Substep { place, of } = memory.substep;
        let own = u16::try_from(memory.shared.unwrap_or(number)).unwrap_or(u16::MAX);
        self.put(operation, &operands, &[own, place, of])
    }

    fn emit(&mut self, id: Id) -> u16 {
        if !self.is_lane(id) {
            let scalar = self.scalar(id, 1.0);
            return self.put(Operation::Broadcast, &[], &[scalar]);
        }
        match self.graph.node(id) {
            Node::Leaf(Leaf::Parameter(number)) => {
                let register = self.new_register(true);
                self.program.parameters.push((register, number));
                register
            }
            Node::Leaf(Leaf::Memory(number)) => self.remembered(usize::from(number)),
            // States have registers from the start; scalars were handled above.
            Node::Leaf(_) | Node::Constant(_) => 0,
            Node::Binary(Binary::Add | Binary::Subtract | Binary::Multiply, ..) | Node::Unary(Unary::Negative, _) => {
                self.sum(id)
            }
            Node::Unary(operator, a) => {
                let a = self.register(a);
                let operation = match operator {
                    Unary::Reciprocal => Operation::Reciprocal,
                    operator => Operation::Function(operator),
                };
                self.put(operation, &[a], &[])
            }
            Node::Binary(operator, a, b) => {
                let operands = [self.register(a), self.register(b)];
                let operation = match operator {
                    Binary::Divide => Operation::Divide,
                    Binary::Min => Operation::Min,
                    Binary::Max => Operation::Max,
                    Binary::Power => Operation::Power,
                    _ => Operation::Atan2,
                };
                self.put(operation, &operands, &[])
            }
            Node::Select(comparison, operands) => {
                let operands = operands.map(|operand| self.register(operand));
                let operation = match comparison {
                    Comparison::Less => Operation::SelectLess,
                    Comparison::LessEqual => Operation::SelectLessEqual,
                };
                self.put(operation, &operands, &[])
            }
        }
    }
}
