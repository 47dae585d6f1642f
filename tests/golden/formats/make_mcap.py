"""Writes the MCAP files of the tests from recording.csv beside it: python3 make_mcap.py

Needs mcap 1.6, mcap-ros2-support 0.6, rosbags 0.11, lz4 and zstandard.
"""
import csv
import json
import pathlib
import shutil
import tempfile
import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as BagWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = pathlib.Path(__file__).parent
START = 1_700_000_000 * 10**9  # [ns]
SPARSE = IndexType.NONE
LINE = "=" * 80
TIME = f"{LINE}\nMSG: builtin_interfaces/Time\n# seconds and nanoseconds\nint32 sec\nuint32 nanosec\n"
HEADER = f"{LINE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{TIME}"
JOINTS = f"std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{HEADER}"

with open(HERE / "recording.csv", newline="") as file:
    ROWS = [
        (round(float(r["time_s"]) * 1e9), float(r["voltage_V"]), float(r["current_A"]), float(r["speed_rad_s"]))
        for r in csv.DictReader(file)
    ]


def stamp(time):
    return {"stamp": {"sec": time // 10**9, "nanosec": time % 10**9}, "frame_id": "base"}


def joint_state(time, names, position=(), velocity=(), effort=()):
    lists = {"position": list(position), "velocity": list(velocity), "effort": list(effort)}
    return {"header": stamp(time), "name": list(names), **lists}


def motor(name, rows, compression, chunk_size):
    """The recording as ROS 2 messages, all at the same times."""
    with open(HERE / name, "wb") as file:
        writer = Ros2Writer(file, chunk_size=chunk_size, compression=compression)
        number = writer.register_msgdef("std_msgs/msg/Float64", "float64 data")
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
        for ns, voltage, current, speed in rows:
            at = START + ns
            writer.write_message("/motor/voltage", number, {"data": voltage}, at)
            writer.write_message("/motor/current", number, {"data": current}, at)
            writer.write_message("/joint_states", joints, joint_state(at, ["shaft"], velocity=[speed]), at)
        writer.finish()


motor("recording.mcap", ROWS, CompressionType.ZSTD, 8 << 10)
motor("lz4.mcap", ROWS[:100], CompressionType.LZ4, 4 << 10)
motor("uncompressed.mcap", ROWS[:100], CompressionType.NONE, 4 << 10)

# Types of rosbags, which encodes messages in both byte orders, and a type with all kinds of members.
STORE = get_typestore(Stores.ROS2_HUMBLE)
INNER = "uint8 level\nfloat64 value\n"
MIXED = """# All kinds of members.
uint8 ON=1
string NAME = "a # b"
bool on
int8 i8 -5
uint8 u8
byte octet
char letter
int16 i16
uint16 u16
int32 i32 # a comment
uint32 u32
int64 i64
uint64 u64
float32 f32
float64 f64 1.5
string text "x = 1"
string<=8 short_text
float64[3] axis [1.0, 2.0, 3.0]
int16[<=4] few
float64[] many
string[] words
test_msgs/Inner inner
test_msgs/Inner[2] pair
test_msgs/Inner[] list
builtin_interfaces/Time time
builtin_interfaces/Duration span
std_msgs/Empty nothing
uint8 last
"""
STORE.register(get_types_from_msg(INNER, "test_msgs/msg/Inner"))
STORE.register(get_types_from_msg(MIXED, "test_msgs/msg/Mixed"))
# The definitions as text, with constants and default values, which rosbags would leave out.
MIXED_TEXT = (
    MIXED
    + f"{LINE}\nMSG: test_msgs/Inner\n{INNER}{LINE}\nMSG: std_msgs/Empty\n"
    + f"{TIME}{LINE}\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
)


def type_of(name):
    return STORE.types[name]


def mixed(k):
    inner = type_of("test_msgs/msg/Inner")
    pair = [inner(k, 0.5 * k), inner(k + 1, -0.5 * k)]
    return type_of("test_msgs/msg/Mixed")(
        on=k % 2 == 1, i8=-k, u8=200 + k, octet=k, letter=250, i16=-300 - k, u16=60000 + k, i32=-(2**31) + k,
        u32=2**32 - 1 - k, i64=-(2**53) + k, u64=2**53 - k, f32=np.float32(0.1), f64=k / 3, text="x" * k,
        short_text="ab", axis=np.array([k, 0.1, -k], dtype=np.float64), few=np.arange(k % 5, dtype=np.int16),
        many=np.arange(k, dtype=np.float64) / 7, words=["a"] * k, inner=inner(k, k / 9), pair=pair, list=pair[: k % 3],
        time=type_of("builtin_interfaces/msg/Time")(k, 5), span=type_of("builtin_interfaces/msg/Duration")(-k, 7),
        nothing=type_of("std_msgs/msg/Empty")(), last=77,
    )  # fmt: skip


class Log:
    """Writer of a file with channels by topic."""

    def __init__(self, name, **options):
        self.file = open(HERE / name, "wb")
        self.writer = Writer(self.file, **options)
        self.writer.start(profile="ros2", library="make_mcap")
        self.channels = {}

    def channel(self, topic, encoding, schema=None):
        number = 0
        if schema:
            name, kind, text = schema
            number = self.writer.register_schema(name=name, encoding=kind, data=text.encode())
        self.channels[topic] = self.writer.register_channel(topic=topic, message_encoding=encoding, schema_id=number)

    def ros2(self, topic, name):
        self.channel(topic, "cdr", (name, "ros2msg", STORE.generate_msgdef(name, ros_version=2)[0]))

    def add(self, topic, time, data):
        self.writer.add_message(self.channels[topic], START + time, bytes(data), START + time)

    def cdr(self, topic, time, message, little_endian=True):
        self.add(topic, time, STORE.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))

    def close(self):
        self.writer.finish()
        self.file.close()


def float64(value):
    return type_of("std_msgs/msg/Float64")(value)


# Both byte orders; messages outside of chunks.
log = Log("types.mcap", use_chunking=False)
for topic in ("/little", "/big"):
    log.channel(topic, "cdr", ("test_msgs/msg/Mixed", "ros2msg", MIXED_TEXT))
for k in range(6):
    log.cdr("/little", k * 10**6, mixed(k))
    log.cdr("/big", k * 10**6, mixed(k), little_endian=False)
log.close()

# JSON messages with and without a schema, uncompressed, without summary, indices and checksums.
log = Log(
    "json.mcap", compression=CompressionType.NONE, index_types=SPARSE, repeat_channels=False, repeat_schemas=False,
    use_statistics=False, use_summary_offsets=False, enable_crcs=False,
)  # fmt: skip
log.channel("/telemetry", "json", ("telemetry", "jsonschema", '{"type": "object"}'))
log.channel("/plain", "json")
for k, (ns, voltage, current, speed) in enumerate(ROWS[:120]):
    motor_state = {"speed": speed, "on": k % 2 == 0, "name": "m1", "limits": [k, -k]}
    message = {"voltage": voltage, "current": current, "motor": motor_state, "fault": None}
    if k == 110:
        message["late"] = 1
    log.add("/telemetry", ns, json.dumps(message).encode())
    log.add("/plain", ns + 500_000, b"%d" % k if k != 5 else b"NaN")
log.close()

# Voltage every 20 ms, current every 2 ms, speed every 4 ms and 1 ms later.
log = Log("clocks.mcap", chunk_size=2 << 10)
for topic in ("/motor/voltage", "/motor/current", "/motor/speed"):
    log.ros2(topic, "std_msgs/msg/Float64")
for k, (ns, voltage, current, speed) in enumerate(ROWS[:100]):
    if k % 10 == 0:
        log.cdr("/motor/voltage", ns, float64(voltage))
    log.cdr("/motor/current", ns, float64(current))
    if k % 2 == 0:
        log.cdr("/motor/speed", ns + 10**6, float64(speed))
log.close()

# Joints in changing order, some of them missing, and headers 5 ms before the time of logging.
log = Log("joints.mcap", compression=CompressionType.LZ4, chunk_size=1 << 10)
log.ros2("/joint_states", "sensor_msgs/msg/JointState")
log.ros2("/unnamed", "sensor_msgs/msg/JointState")
NAMES = ["wheel_left", "wheel_right", "arm/tilt"]
VALUES = {"wheel_left": 1.0, "wheel_right": 2.0, "arm/tilt": 3.0}
for k in range(12):
    names = NAMES[k % 3 :] + NAMES[: k % 3]
    if k == 7:
        names.remove("wheel_right")
    velocity = [VALUES[name] + k / 10 for name in names]
    position = [] if k == 4 else [-v for v in velocity]
    at = START + k * 10**7
    header = type_of("std_msgs/msg/Header")(type_of("builtin_interfaces/msg/Time")(at // 10**9, at % 10**9), "base")
    state = type_of("sensor_msgs/msg/JointState")
    log.cdr("/joint_states", k * 10**7 + 5 * 10**6, state(header, names, np.array(position), np.array(velocity), np.array([])))
    header = type_of("std_msgs/msg/Header")(type_of("builtin_interfaces/msg/Time")(0, 0), "")
    log.cdr("/unnamed", k * 10**7, state(header, [], np.array([]), np.array([float(k)]), np.array([])))
log.close()

# Topics that cannot be read, an attachment, metadata, messages out of order, and a second channel of a topic.
log = Log("others.mcap", chunk_size=512)
log.writer.add_metadata("robot", {"name": "test"})
log.channel("/protobuf", "protobuf", ("foxglove.Log", "protobuf", "x"))
log.channel("/ros1", "ros1", ("std_msgs/Float64", "ros1msg", "float64 data"))
log.channel("/idl", "cdr", ("std_msgs/msg/Float64", "ros2idl", "module std_msgs {};"))
log.channel("/unknown", "cdr", ("a_msgs/msg/A", "ros2msg", "b_msgs/B member"))
log.channel("/wide", "cdr", ("a_msgs/msg/Wide", "ros2msg", "float64 before\nwstring text\nfloat64 after"))
log.ros2("/words", "std_msgs/msg/String")
log.ros2("/silent", "std_msgs/msg/Float64")
log.ros2("/array", "std_msgs/msg/Float64MultiArray")
log.ros2("/battery", "sensor_msgs/msg/BatteryState")
log.ros2("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
log.ros2("/short", "geometry_msgs/msg/Vector3")
for k in range(8):
    for topic in ("/protobuf", "/ros1", "/idl", "/unknown"):
        log.add(topic, k * 1000, b"\0\1\0\0" + bytes(8))
    log.cdr("/words", k * 1000, type_of("std_msgs/msg/String")("word"))
    layout = type_of("std_msgs/msg/MultiArrayLayout")([], 0)
    # 6, 7, 4, 5, 2, 3, 0, 1
    at = (3 - k // 2) * 2 + k % 2
    log.cdr("/array", at * 1000, type_of("std_msgs/msg/Float64MultiArray")(layout, np.arange(k % 4) + at / 2))
    header = type_of("std_msgs/msg/Header")(type_of("builtin_interfaces/msg/Time")(7, 0), "")
    battery = type_of("sensor_msgs/msg/BatteryState")
    numbers = [np.float32(x) for x in (12.5 + k, 25, -1.5 * k, 1, 2, 3, 0.5)]
    cells = [np.array([4, 5], dtype=np.float32), np.array([], dtype=np.float32)]
    log.cdr("/battery", k * 1000, battery(header, *numbers, 1, 2, 3, True, *cells, "slot", "1"))
    log.add("/wide", k * 1000, b"\0\1\0\0" + np.float64(k).tobytes() + bytes(20))
    data = np.array([k, -k, 2 * k], dtype=np.float64).tobytes()
    log.add("/short", k * 1000, b"\0\1\0\0" + (data[:20] if k == 3 else data))
    if k == 4:
        log.channel("/array", "cdr", ("std_msgs/Float64MultiArray", "ros2msg",
                                      STORE.generate_msgdef("std_msgs/msg/Float64MultiArray", ros_version=2)[0]))  # fmt: skip
        log.writer.add_attachment(START, START, "photo", "image/jpeg", bytes(1000))
log.close()

# A recording by another writer.
with tempfile.TemporaryDirectory() as folder:
    bag = pathlib.Path(folder) / "bag"
    writer = BagWriter(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        kinds = ("std_msgs/msg/Float64", "sensor_msgs/msg/Imu")
        number, imu = (writer.add_connection(topic, kind, typestore=STORE) for topic, kind in zip(("/voltage", "/imu"), kinds))
        for k, (ns, voltage, *_) in enumerate(ROWS[:20]):
            at = START + ns
            writer.write(number, at, STORE.serialize_cdr(float64(voltage), kinds[0]))
            header = type_of("std_msgs/msg/Header")(type_of("builtin_interfaces/msg/Time")(at // 10**9, at % 10**9), "imu")
            vector = type_of("geometry_msgs/msg/Vector3")
            rotation = type_of("geometry_msgs/msg/Quaternion")(0.0, 0.0, 0.0, 1.0)
            covariance = np.arange(9.0)
            rates, accelerations = vector(0.0, 0.0, k / 3), vector(1.0, 2.0, 9.81)
            message = type_of(kinds[1])(header, rotation, covariance, rates, covariance, accelerations, covariance)
            writer.write(imu, at, STORE.serialize_cdr(message, kinds[1]))
    shutil.copy(next(bag.glob("*.mcap")), HERE / "rosbags.mcap")
