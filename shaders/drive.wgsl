// The drive: deadband, saturation, a gain of its own for negative voltages, offset. Twin: src/motor/drive.rs.

struct Drive {
    deadband: Lanes,
    saturation: Lanes,
    negative_gain: Lanes,
    offset: Lanes,
}

fn load_drive(constants: u32) -> Drive {
    return Drive(
        maps[constants + AT_vd], maps[constants + AT_vs], maps[constants + AT_gn], maps[constants + AT_v0],
    );
}

// The voltage at the motor for a commanded one.
fn output(drive: Drive, voltage: Lanes) -> Lanes {
    let size = abs(voltage);
    let reached = select(size, drive.saturation, drive.saturation < size);
    let left = reached - drive.deadband;
    let given = select(Lanes(), left, left > Lanes());
    let signed = select(given, -(drive.negative_gain * given), voltage < Lanes());
    return signed + drive.offset;
}
