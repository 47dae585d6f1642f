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

/// Executes an instruction that writes a register.
#[expect(clippy::too_many_lines, reason = "a table of the operations")]
#[inline(always)]
pub(super) fn execute<const C: usize, const FMA: bool>(
    instruction: &Instruction,
    r: &mut [Register<C>],
    scalars: &[f64],
) {
    use Operation as Is;
    let [a, b, c, d, e, f, g] = instruction.registers.map(usize::from);
    let to = usize::from(instruction.target);
    let scalar = |n: usize| scalars[usize::from(instruction.scalars[n])];
    macro_rules! each {
        ($part:ident => $value:expr) => {
            for $part in 0..C {
                r[to][$part] = $value;
            }
        };
    }
    match instruction.operation {
        Is::Copy => each!(p => r[a][p]),
        Is::Broadcast => {
            let value = [scalar(0); WIDTH];
            each!(_p => value);
        }
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
        Is::Products2 => each!(p => {
            let first = zip(&r[c][p], &r[d][p], |x, y| x * y);
            multiply_add::<FMA>(&r[a][p], &r[b][p], &first)
        }),
        Is::Products3 => each!(p => {
            let first = zip(&r[e][p], &r[f][p], |x, y| x * y);
            let second = multiply_add::<FMA>(&r[c][p], &r[d][p], &first);
            multiply_add::<FMA>(&r[a][p], &r[b][p], &second)
        }),
        Is::AddProduct => each!(p => multiply_add::<FMA>(&r[b][p], &r[c][p], &r[a][p])),
        Is::AddProducts2 => each!(p => {
            let first = multiply_add::<FMA>(&r[d][p], &r[e][p], &r[a][p]);
            multiply_add::<FMA>(&r[b][p], &r[c][p], &first)
        }),
        Is::AddProducts3 => each!(p => {
            let first = multiply_add::<FMA>(&r[f][p], &r[g][p], &r[a][p]);
            let second = multiply_add::<FMA>(&r[d][p], &r[e][p], &first);
            multiply_add::<FMA>(&r[b][p], &r[c][p], &second)
        }),
        Is::SubtractProduct => each!(p => multiply_add::<FMA>(&map(&r[b][p], |x| -x), &r[c][p], &r[a][p])),
        Is::Linear1 => {
            let k = scalar(0);
            each!(p => scale_add::<FMA>(k, &r[b][p], &r[a][p]));
        }
        Is::Linear2 => {
            let [k, l] = [0, 1].map(scalar);
            each!(p => scale_add::<FMA>(l, &r[c][p], &scale_add::<FMA>(k, &r[b][p], &r[a][p])));
        }
        Is::Linear3 => {
            let [k, l, m] = [0, 1, 2].map(scalar);
            each!(p => {
                let first = scale_add::<FMA>(k, &r[b][p], &r[a][p]);
                scale_add::<FMA>(m, &r[d][p], &scale_add::<FMA>(l, &r[c][p], &first))
            });
        }
        Is::Linear4 => {
            let [k, l, m, n] = [0, 1, 2, 3].map(scalar);
            each!(p => {
                let first = scale_add::<FMA>(l, &r[c][p], &scale_add::<FMA>(k, &r[b][p], &r[a][p]));
                scale_add::<FMA>(n, &r[e][p], &scale_add::<FMA>(m, &r[d][p], &first))
            });
        }
        Is::Affine1 => {
            let [k, l] = [0, 1].map(scalar);
            each!(p => scale_add::<FMA>(l, &r[a][p], &[k; WIDTH]));
        }
        Is::Affine2 => {
            let [k, l, m] = [0, 1, 2].map(scalar);
            each!(p => scale_add::<FMA>(m, &r[b][p], &scale_add::<FMA>(l, &r[a][p], &[k; WIDTH])));
        }
        Is::Scale1 => {
            let k = scalar(0);
            each!(p => map(&r[a][p], |x| k * x));
        }
        Is::Scale2 => {
            let [k, l] = [0, 1].map(scalar);
            each!(p => scale_add::<FMA>(l, &r[b][p], &map(&r[a][p], |x| k * x)));
        }
        Is::Function(function) => match function {
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
        },
        // Outputs and memories are handled by the loop over the samples.
        Is::Output | Is::Delay | Is::DelayRate | Is::Average | Is::AverageRate => {}
    }
}
