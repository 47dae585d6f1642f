//! One instruction on all lanes.

use super::functions::{atan, atan2, exp, log, power, sine, tanh};
use super::register::{Register, Vector, WIDTH};
use motorfit_model::graph::Unary;
use motorfit_model::program::{Instruction, Operation};

#[inline(always)]
fn multiply_add<const FMA: bool>(a: &Vector, b: &Vector, c: &Vector) -> Vector {
    let mut result = [0.0; WIDTH];
    for lane in 0..WIDTH {
        result[lane] = if FMA { a[lane].mul_add(b[lane], c[lane]) } else { a[lane] * b[lane] + c[lane] };
    }
    result
}

#[inline(always)]
fn scale_add<const FMA: bool>(scale: f64, b: &Vector, c: &Vector) -> Vector {
    multiply_add::<FMA>(&[scale; WIDTH], b, c)
}

#[inline(always)]
fn map(a: &Vector, function: impl Fn(f64) -> f64) -> Vector {
    let mut result = [0.0; WIDTH];
    for lane in 0..WIDTH {
        result[lane] = function(a[lane]);
    }
    result
}

#[inline(always)]
fn zip(a: &Vector, b: &Vector, function: impl Fn(f64, f64) -> f64) -> Vector {
    let mut result = [0.0; WIDTH];
    for lane in 0..WIDTH {
        result[lane] = function(a[lane], b[lane]);
    }
    result
}

#[inline(always)]
fn choose(a: &Vector, b: &Vector, [then, otherwise]: [&Vector; 2], holds: impl Fn(f64, f64) -> bool) -> Vector {
    let mut result = *otherwise;
    for lane in 0..WIDTH {
        if holds(a[lane], b[lane]) {
            result[lane] = then[lane];
        }
    }
    result
}

/// Executes a function of the register `a`.
#[inline(always)]
fn call<const C: usize, const FMA: bool>(function: Unary, r: &mut [Register<C>], [a, to]: [usize; 2]) {
    macro_rules! each {
        ($part:ident => $value:expr) => {
            for $part in 0..C {
                r[to][$part] = $value;
            }
        };
    }
    match function {
        Unary::Negative => each!(p => map(&r[a][p], |x| -x)),
        Unary::Reciprocal => each!(p => map(&r[a][p], |x| 1.0 / x)),
        Unary::Sin => each!(p => map(&r[a][p], sine::<FMA, false>)),
        Unary::Cos => each!(p => map(&r[a][p], sine::<FMA, true>)),
        Unary::Tan => each!(p => map(&r[a][p], |x| sine::<FMA, false>(x) / sine::<FMA, true>(x))),
        Unary::Exp => each!(p => map(&r[a][p], exp::<FMA>)),
        Unary::Log => each!(p => map(&r[a][p], log::<FMA>)),
        Unary::Sqrt => each!(p => map(&r[a][p], f64::sqrt)),
        Unary::Abs => each!(p => map(&r[a][p], f64::abs)),
        Unary::Sign => each!(p => map(&r[a][p], |x| if x > 0.0 { 1.0 } else if x < 0.0 { -1.0 } else { x * 0.0 })),
        Unary::Tanh => each!(p => map(&r[a][p], tanh::<FMA>)),
        Unary::Atan => each!(p => map(&r[a][p], atan::<FMA>)),
    }
}

/// Executes an instruction that writes a register.
#[inline(always)]
pub(super) fn execute<const C: usize, const FMA: bool>(
    instruction: &Instruction,
    r: &mut [Register<C>],
    scalars: &[f64],
) {
    use Operation as Is;
    let [a, b, c, d, e, f, g, _] = instruction.registers.map(usize::from);
    let to = usize::from(instruction.target);
    let scalar = |n: usize| scalars[usize::from(instruction.scalars[n])];
    // The scalars of an instruction are read once for all parts.
    macro_rules! each {
        ($([$($scalar:ident),+])? $part:ident => $value:expr) => {{
            $(let [$($scalar),+] = std::array::from_fn(scalar);)?
            for $part in 0..C {
                r[to][$part] = $value;
            }
        }};
    }
    match instruction.operation {
        Is::Copy => each!(p => r[a][p]),
        Is::Broadcast => each!([k] _p => [k; WIDTH]),
        Is::Add => each!(p => zip(&r[a][p], &r[b][p], |x, y| x + y)),
        Is::Subtract => each!(p => zip(&r[a][p], &r[b][p], |x, y| x - y)),
        Is::Multiply => each!(p => zip(&r[a][p], &r[b][p], |x, y| x * y)),
        Is::Divide => each!(p => zip(&r[a][p], &r[b][p], |x, y| x / y)),
        Is::Reciprocal => each!(p => map(&r[a][p], |x| 1.0 / x)),
        Is::Negative => each!(p => map(&r[a][p], |x| -x)),
        Is::Min => each!(p => zip(&r[a][p], &r[b][p], |x, y| if x < y { x } else { y })),
        Is::Max => each!(p => zip(&r[a][p], &r[b][p], |x, y| if x > y { x } else { y })),
        Is::SelectLess => each!(p => choose(&r[a][p], &r[b][p], [&r[c][p], &r[d][p]], |x, y| x < y)),
        Is::SelectLessEqual => each!(p => choose(&r[a][p], &r[b][p], [&r[c][p], &r[d][p]], |x, y| x <= y)),
        Is::Power => each!(p => zip(&r[a][p], &r[b][p], power::<FMA>)),
        Is::Atan2 => each!(p => zip(&r[a][p], &r[b][p], atan2::<FMA>)),
        Is::Products2 => each!(p => multiply_add::<FMA>(&r[a][p], &r[b][p], &zip(&r[c][p], &r[d][p], |x, y| x * y))),
        Is::Products3 => each!(p => {
            let first = zip(&r[e][p], &r[f][p], |x, y| x * y);
            let second = multiply_add::<FMA>(&r[c][p], &r[d][p], &first);
            multiply_add::<FMA>(&r[a][p], &r[b][p], &second)
        }),
        Is::AddProduct => each!(p => multiply_add::<FMA>(&r[b][p], &r[c][p], &r[a][p])),
        Is::AddProducts2 => {
            each!(p => multiply_add::<FMA>(&r[b][p], &r[c][p], &multiply_add::<FMA>(&r[d][p], &r[e][p], &r[a][p])));
        }
        Is::AddProducts3 => each!(p => {
            let first = multiply_add::<FMA>(&r[f][p], &r[g][p], &r[a][p]);
            let second = multiply_add::<FMA>(&r[d][p], &r[e][p], &first);
            multiply_add::<FMA>(&r[b][p], &r[c][p], &second)
        }),
        Is::SubtractProduct => each!(p => multiply_add::<FMA>(&map(&r[b][p], |x| -x), &r[c][p], &r[a][p])),
        Is::Linear1 => each!([k] p => scale_add::<FMA>(k, &r[b][p], &r[a][p])),
        Is::Linear2 => each!([k, l] p => scale_add::<FMA>(l, &r[c][p], &scale_add::<FMA>(k, &r[b][p], &r[a][p]))),
        Is::Linear3 => each!([k, l, m] p => {
            let first = scale_add::<FMA>(k, &r[b][p], &r[a][p]);
            scale_add::<FMA>(m, &r[d][p], &scale_add::<FMA>(l, &r[c][p], &first))
        }),
        Is::Linear4 => each!([k, l, m, n] p => {
            let first = scale_add::<FMA>(l, &r[c][p], &scale_add::<FMA>(k, &r[b][p], &r[a][p]));
            scale_add::<FMA>(n, &r[e][p], &scale_add::<FMA>(m, &r[d][p], &first))
        }),
        Is::Affine1 => each!([k, l] p => scale_add::<FMA>(l, &r[a][p], &[k; WIDTH])),
        Is::Affine2 => each!([k, l, m] p => {
            scale_add::<FMA>(m, &r[b][p], &scale_add::<FMA>(l, &r[a][p], &[k; WIDTH]))
        }),
        Is::Scale1 => each!([k] p => map(&r[a][p], |x| k * x)),
        Is::Scale2 => each!([k, l] p => scale_add::<FMA>(l, &r[b][p], &map(&r[a][p], |x| k * x))),
        Is::Function(function) => call::<C, FMA>(function, r, [a, to]),
        // Outputs and memories are handled by the loop over the samples.
        Is::Output | Is::Memory(_) | Is::MemoryRate(_) => {}
    }
}
