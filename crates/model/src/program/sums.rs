//! Sums of products as fused instructions.

use super::compile::Compiler;
use super::instruction::Operation;
use crate::graph::{Binary, Id, Node, Unary};

/// A term of a sum; scalars have a factor, registers a sign.
#[derive(Debug, Clone, Copy)]
enum Term {
    Scalar(Id, f64),
    Register(Id, bool),
    Scaled(Id, f64, Id),
    Product([Id; 2], bool),
}

/// The terms of a sum by kind, as registers and scalars.
#[derive(Default)]
struct Parts {
    plus: Vec<u16>,
    minus: Vec<u16>,
    /// Scalar and register.
    scaled: Vec<(u16, u16)>,
    products: Vec<[u16; 2]>,
    negative_products: Vec<[u16; 2]>,
    scalar: Option<u16>,
}

impl Compiler<'_> {
    /// Makes the operands of a node that is a sum, without the sum.
    pub(super) fn operands_of(&mut self, root: Id) {
        if self.is_lane(root) && !self.graph.is_fixed(root) && is_sum(self.graph.node(root)) {
            let terms = self.terms(root);
            self.make_operands(&terms);
        }
    }

    /// Makes a sum and returns its register.
    pub(super) fn sum(&mut self, root: Id) -> u16 {
        let terms = self.terms(root);
        self.make_operands(&terms);
        let parts = self.parts(terms);
        if let Parts { plus, minus, scaled, products, negative_products, scalar: None } = &parts
            && scaled.is_empty()
            && products.is_empty()
            && negative_products.is_empty()
        {
            match (&plus[..], &minus[..]) {
                ([a], [b]) => return self.put(Operation::Subtract, &[*a, *b], &[]),
                ([a, b], []) => return self.put(Operation::Add, &[*a, *b], &[]),
                ([], [a]) => return self.put(Operation::Negative, &[*a], &[]),
                _ => {}
            }
        }
        self.add_parts(parts)
    }

    /// Returns the terms of a sum. Sums that are used several times are terms, and so are values of parameters alone within a sum
    /// that is computed for each sample.
    fn terms(&self, root: Id) -> Vec<Term> {
        let mut terms = Vec::new();
        let mut open = vec![(root, 1.0)];
        while let Some((id, sign)) = open.pop() {
            if !self.is_lane(id) {
                terms.push(Term::Scalar(id, sign));
                continue;
            }
            let is_shared = self.uses.get(id as usize).is_some_and(|uses| *uses > 1);
            let is_of_setup = self.graph.is_fixed(id) && !self.is_setup;
            match self.graph.node(id) {
                _ if id != root && (is_shared || is_of_setup) => terms.push(Term::Register(id, sign < 0.0)),
                Node::Binary(Binary::Add, a, b) => open.extend([(b, sign), (a, sign)]),
                Node::Binary(Binary::Subtract, a, b) => open.extend([(b, -sign), (a, sign)]),
                Node::Unary(Unary::Negative, a) => open.push((a, -sign)),
                Node::Binary(Binary::Multiply, a, b) => terms.push(match (self.is_lane(a), self.is_lane(b)) {
                    (false, _) => Term::Scaled(a, sign, b),
                    (_, false) => Term::Scaled(b, sign, a),
                    _ => Term::Product([a, b], sign < 0.0),
                }),
                _ => terms.push(Term::Register(id, sign < 0.0)),
            }
        }
        terms
    }

    fn make_operands(&mut self, terms: &[Term]) {
        for term in terms {
            match *term {
                Term::Scalar(..) => {}
                Term::Register(id, _) | Term::Scaled(_, _, id) => {
                    self.register(id);
                }
                Term::Product(operands, _) => operands.iter().for_each(|id| {
                    self.register(*id);
                }),
            }
        }
    }

    fn parts(&mut self, terms: Vec<Term>) -> Parts {
        let mut parts = Parts::default();
        let mut sum: Option<Id> = None;
        for term in terms {
            match term {
                Term::Scalar(id, sign) => {
                    let signed = if sign < 0.0 { self.graph.negative(id) } else { id };
                    sum = Some(match sum {
                        Some(sum) => self.graph.add(sum, signed),
                        None => signed,
                    });
                }
                Term::Register(id, false) => parts.plus.push(self.register(id)),
                Term::Register(id, true) => parts.minus.push(self.register(id)),
                Term::Scaled(scalar, factor, id) => {
                    let scalar = self.scalar(scalar, factor);
                    parts.scaled.push((scalar, self.register(id)));
                }
                Term::Product(operands, false) => parts.products.push(operands.map(|id| self.register(id))),
                Term::Product(operands, true) => self.negative_product(operands, &mut parts),
            }
        }
        parts.scalar = sum.map(|sum| self.scalar(sum, 1.0));
        parts
    }

    /// Adds a product to subtract; a factor of parameters alone is negated once, in the setup.
    fn negative_product(&mut self, operands: [Id; 2], parts: &mut Parts) {
        let fixed = operands.iter().position(|id| self.graph.is_fixed(*id) && !self.is_setup);
        match fixed {
            Some(n) => {
                let negative = self.graph.negative(operands[n]);
                let product = [negative, operands[1 - n]].map(|id| self.register(id));
                parts.products.push(product);
            }
            None => parts.negative_products.push(operands.map(|id| self.register(id))),
        }
    }

    /// Makes the instructions of a sum, the cheapest order first: scalars, scaled registers, products.
    fn add_parts(&mut self, parts: Parts) -> u16 {
        let Parts { plus, minus, scaled, products, negative_products, mut scalar } = parts;
        let one = self.constant(1.0);
        let minus_one = self.constant(-1.0);
        let mut plus = plus.into_iter();
        let mut sum: Option<u16> = plus.next();
        let mut scaled: Vec<(u16, u16)> =
            scaled.into_iter().chain(plus.map(|a| (one, a))).chain(minus.into_iter().map(|a| (minus_one, a))).collect();
        if sum.is_none() {
            let first: Vec<(u16, u16)> = scaled.drain(..scaled.len().min(2)).collect();
            sum = match (scalar.take(), &first[..]) {
                (Some(s), [(k, a)]) => Some(self.put(Operation::Affine1, &[*a], &[s, *k])),
                (Some(s), [(k, a), (l, b)]) => Some(self.put(Operation::Affine2, &[*a, *b], &[s, *k, *l])),
                (Some(s), _) => Some(self.put(Operation::Broadcast, &[], &[s])),
                (None, [(k, a)]) => Some(self.put(Operation::Scale1, &[*a], &[*k])),
                (None, [(k, a), (l, b)]) => Some(self.put(Operation::Scale2, &[*a, *b], &[*k, *l])),
                (None, _) => None,
            };
        }
        if let Some(scalar) = scalar {
            let register = self.put(Operation::Broadcast, &[], &[scalar]);
            scaled.push((one, register));
        }
        const LINEAR: [Operation; 4] = [Operation::Linear1, Operation::Linear2, Operation::Linear3, Operation::Linear4];
        for group in scaled.chunks(4) {
            let (scalars, registers): (Vec<u16>, Vec<u16>) = group.iter().copied().unzip();
            let registers: Vec<u16> = sum.into_iter().chain(registers).collect();
            sum = Some(self.put(LINEAR[group.len() - 1], &registers, &scalars));
        }
        for group in products.chunks(3) {
            let flat = group.concat();
            sum = Some(match sum {
                None => {
                    let operation = [Operation::Multiply, Operation::Products2, Operation::Products3][group.len() - 1];
                    self.put(operation, &flat, &[])
                }
                Some(sum) => {
                    let operation =
                        [Operation::AddProduct, Operation::AddProducts2, Operation::AddProducts3][group.len() - 1];
                    self.put(operation, &[&[sum], &flat[..]].concat(), &[])
                }
            });
        }
        for [a, b] in negative_products {
            sum = Some(match sum {
                Some(sum) => self.put(Operation::SubtractProduct, &[sum, a, b], &[]),
                None => {
                    let product = self.put(Operation::Multiply, &[a, b], &[]);
                    self.put(Operation::Negative, &[product], &[])
                }
            });
        }
        // A sum has terms.
        sum.unwrap_or(0)
    }
}

fn is_sum(node: Node) -> bool {
    matches!(
        node,
        Node::Binary(Binary::Add | Binary::Subtract | Binary::Multiply, ..) | Node::Unary(Unary::Negative, _)
    )
}
