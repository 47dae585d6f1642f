// The drive: deadband, saturation, a different gain for negative voltages, offset. Same operations in Rust: crates/motor/src/drive.rs.

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

// Returns the motor voltage for a commanded voltage.
fn output(drive: Drive, voltage: Lanes) -> Lanes {
    let size = abs(voltage);
    let reached = select(size, drive.saturation, drive.saturation < size);
    let left = reached - drive.deadband;
    let given = select(Lanes(), left, left > Lanes());
    let signed = select(given, -(drive.negative_gain * given), voltage < Lanes());
    return signed + drive.offset;
}
