"""Writes the ULog files of the tests: python3 make_ulog.py (needs numpy and pyulog).

pyulog cannot write new files. The bytes are written here after "ULog File Format" of PX4, and read with pyulog as a check.
"""
import struct
import numpy as np
from pyulog import ULog

HEADINGS = ["time_s", "voltage_V", "current_A", "speed_rad_s"]
TABLE = np.loadtxt("recording.csv", delimiter=",", skiprows=1)
MICROSECONDS = np.round(TABLE[:, 0] * 1e6).astype(np.uint64)
SYNC = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])


class Writer:
    """Writer of messages."""

    def __init__(self, start, incompatible=0, offsets=(0, 0, 0)):
        self.bytes = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start)
        self.message("B", bytes(8) + bytes([incompatible]) + bytes(7) + struct.pack("<3Q", *offsets))

    def message(self, kind, content):
        self.bytes += struct.pack("<HB", len(content), ord(kind)) + content

    def format(self, text):
        self.message("F", text.encode())

    def key(self, kind, key, content):
        self.message(kind, struct.pack("<B", len(key)) + key.encode() + content)

    def subscribe(self, number, name, instance=0):
        self.message("A", struct.pack("<BH", instance, number) + name.encode())

    def data(self, number, form, *values):
        self.message("D", struct.pack("<H" + form, number, *values))

    def save(self, name):
        open(name, "wb").write(self.bytes)
        return ULog(name)


def column(log, topic, field, instance=0):
    return log.get_dataset(topic, instance).data[field]


# The recording, in double precision.
log = Writer(0)
log.format("motor:uint64_t timestamp;double voltage_V;double current_A;double speed_rad_s;")
log.key("I", "char[3] sys_name", b"PX4")
log.key("P", "float MOT_KV", struct.pack("<f", 920))
log.key("P", "int32_t MOT_POLES", struct.pack("<i", 14))
log.subscribe(0, "motor")
for time, row in zip(MICROSECONDS, TABLE):
    log.data(0, "Q3d", time, *row[1:])
read = log.save("recording.ulg")
assert all(np.array_equal(column(read, "motor", name), TABLE[:, n]) for n, name in enumerate(HEADINGS) if n > 0)

# Nested formats, arrays, padding, several instances, a text, dropouts and changed parameters; the log starts at 5 s.
log = Writer(5_000_000)
log.format("esc_status:uint64_t timestamp;uint16_t counter;uint8_t[2] _padding0;esc_report[2] esc;char[4] name;"
           "bool armed;uint8_t[3] _padding1;")
log.format("esc_report:uint64_t timestamp;int32_t esc_rpm;float[2] esc_current;uint8_t[4] _padding0;")
log.format("attitude:uint64_t timestamp;float[4] q;int8_t a;int16_t b;int64_t c;uint32_t d;")
log.format("text_only:uint64_t timestamp;char[2] text;")
log.format("untimed:uint8_t value;")
log.format("unused:uint64_t timestamp;float x;")
log.message("M", bytes([0, 10]) + b"char[2] ab" + b"ab")
log.key("P", "float MOT_KV", struct.pack("<f", 0.1))
log.key("Q", "float MOT_KV", struct.pack("<f", 1))
log.key("P", "int32_t MOT_POLES", struct.pack("<i", -7))
log.subscribe(3, "attitude", 1)
log.subscribe(1, "esc_status")
log.subscribe(2, "attitude")
log.subscribe(4, "text_only")
log.subscribe(6, "unused")
for n in range(5):
    # The padding at the end is not logged.
    esc = [v for k in range(2) for v in (5_000_000 + n, 1000 * n + k, n + 0.5, -n)]
    log.data(1, "QHxxQiffxxxxQiffxxxx4s?", 5_000_000 + 10_000 * n, n, *esc, b"esc1", n % 2 == 1)
    for number, shift in ((2, 0), (3, 500)):
        log.data(number, "Q4fbhqI", 5_001_000 + shift + 10_000 * n, n, 0.1, -1, 2, -n, -300, -(2**53), 2**32 - 1)
    log.data(4, "Q2s", 5_000_500, b"ab")
    if n == 2:
        log.message("O", struct.pack("<H", 40))
        log.message("S", SYNC)
        log.message("O", struct.pack("<H", 260))
        log.key("P", "float MOT_KV", struct.pack("<f", 2.5))
        log.message("L", struct.pack("<BQ", ord("6"), 5_020_000) + b"parameter changed")
        log.message("z", b"of a later version")
read = log.save("nested.ulg")
assert read.changed_parameters == [(5_021_500, "MOT_KV", 2.5)] and sum(d.duration for d in read.dropouts) == 300
assert column(read, "esc_status", "esc[1].esc_rpm").tolist() == [1, 1001, 2001, 3001, 4001]
assert column(read, "attitude", "timestamp", 1)[0] == 5_001_500 and column(read, "attitude", "c")[0] == -(2**53)

# A log that ends within a message, with two sections appended, the first of which ends within a message too. pyulog forgets the
# subscriptions at the end of a section; they are repeated, with other numbers.
def appended(offsets):
    log = Writer(1_000_000, 1, offsets)
    log.format("motor:uint64_t timestamp;float x;")
    ends = []
    for section in range(3):
        log.subscribe(section, "motor")
        for n in range(4):
            log.data(section, "Qf", 1_000_000 + 1000 * (4 * section + n), 4 * section + n)
        if section < 2:
            log.data(section, "Qf", 0, 0)
            log.bytes = log.bytes[:-5 + section]
            ends.append(len(log.bytes))
    return log, ends


_, ends = appended((0, 0, 0))
log, _ = appended((*ends, 0))
read = log.save("appended.ulg")
assert [section.data["x"].tolist() for section in read.data_list] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]

# Damage between two synchronization messages.
log = Writer(0)
log.format("motor:uint64_t timestamp;float x;")
log.subscribe(0, "motor")
for n in range(12):
    if n in (4, 8):
        log.message("S", SYNC)
    if n == 6:
        log.bytes += b"\x00\x00\xff\xff\xff"
    log.data(0, "Qf", 1000 * n, n)
read = log.save("damaged.ulg")
assert column(read, "motor", "x").tolist() == [0, 1, 2, 3, 4, 5, 8, 9, 10, 11] and read.file_corruption
