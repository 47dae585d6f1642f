//! Assignment of few registers to the many of a compilation, by a linear scan.

use super::compiled::Program;
use std::collections::HashMap;

/// Replaces virtual registers by as few as possible. Pinned ones keep theirs; another one is free again after its last use.
pub(super) fn allocate(program: &mut Program, pinned: &[bool]) {
    let mut place: HashMap<u16, u16> = HashMap::new();
    let mut count: u16 = 0;
    for (register, _) in (0..).zip(pinned).filter(|(_, is_pinned)| **is_pinned) {
        place.insert(register, count);
        count += 1;
    }
    let is_pinned = |register: u16| pinned.get(usize::from(register)).copied().unwrap_or(true);
    let mut last_use: HashMap<u16, usize> = HashMap::new();
    for (n, instruction) in program.body.iter().enumerate() {
        instruction.read().iter().for_each(|register| {
            last_use.insert(*register, n);
        });
    }
    let mut free: Vec<u16> = Vec::new();
    for (n, instruction) in program.body.iter_mut().enumerate() {
        let mut ended: Vec<u16> = Vec::new();
        for register in instruction.read_mut() {
            let is_ending = !is_pinned(*register) && last_use.get(register) == Some(&n);
            let own = place.get(register).copied().unwrap_or(0);
            if is_ending && !ended.contains(&own) {
                ended.push(own);
            }
            *register = own;
        }
        free.append(&mut ended);
        if instruction.writes() {
            instruction.target = *place.entry(instruction.target).or_insert_with(|| {
                free.pop().unwrap_or_else(|| {
                    count += 1;
                    count - 1
                })
            });
        }
    }
    let of = |register: u16| place.get(&register).copied().unwrap_or(0);
    for instruction in &mut program.setup {
        instruction.target = of(instruction.target);
        instruction.read_mut().iter_mut().for_each(|register| *register = of(*register));
    }
    program.parameters.iter_mut().for_each(|(register, _)| *register = of(*register));
    program.results.iter_mut().for_each(|register| *register = of(*register));
    program.states.iter_mut().for_each(|(state, initial)| (*state, *initial) = (of(*state), of(*initial)));
    program.registers = usize::from(count);
}
