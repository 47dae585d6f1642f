// What the drive makes of the voltage that it is told, and what drives the motor over a segment.
// Constants: limits of the brushes and of friction, then the fields of Drive.

struct Drive {
    load: Lanes,
    offset: Lanes,
    deadband: Lanes,
    saturation: Lanes,
    reverse: Lanes,
}

fn load_drive(constants: u32) -> Drive {
    return Drive(
        maps[constants + 2u], maps[constants + 3u], maps[constants + 4u], maps[constants + 5u], maps[constants + 6u],
    );
}

fn terminal(drive: Drive, voltage: Lanes) -> Lanes {
    let size = abs(voltage);
    let left = select(drive.saturation, size, size < drive.saturation) - drive.deadband;
    let given = select(Lanes(), left, left > Lanes());
    return select(given, -(drive.reverse * given), voltage < Lanes()) + drive.offset;
}

// What the inputs of a segment add at each step; where the voltage comes late, what the torque does.
fn gain(at: u32, drive: Drive, input: vec4<Scalar>) -> Lanes2 {
    let torque = drive.load + input.z;
    let g = Lanes2(maps[at + 8u] * torque, maps[at + 9u] * torque);
    if DELAYED {
        return g;
    }
    let start = terminal(drive, Lanes(input.x));
    let end = terminal(drive, Lanes(input.y));
    return Lanes2(
        maps[at + 6u] * end + (maps[at + 4u] * start + g.i),
        maps[at + 7u] * end + (maps[at + 5u] * start + g.w),
    );
}
