"""Writes the MDF files of the tests: python3 make_mdf.py (needs numpy and asammdf)."""
import csv
import struct
import zlib
import numpy as np
from asammdf import MDF, Signal
from datetime import datetime, timezone

NAMES = ["voltage_V", "current_A", "speed_rad_s"]
UNITS = {"voltage_V": "V", "current_A": "A", "speed_rad_s": "rad/s"}
rows = list(csv.DictReader(open("recording.csv")))
T = np.array([float(row["time_s"]) for row in rows])
V = {name: np.array([float(row[name]) for row in rows]) for name in NAMES}
N = len(T)
K = np.arange(N)


def new():
    mdf = MDF(version="4.10")
    mdf.header.start_time = datetime(2024, 1, 1, tzinfo=timezone.utc)
    return mdf


def save(mdf, name, compression=0):
    mdf.save(name, overwrite=True, compression=compression)
    mdf.close()


def recording():
    mdf = new()
    mdf.append([Signal(V[n], T, name=n, unit=UNITS[n]) for n in NAMES], acq_name="motor")
    return mdf


save(recording(), "recording.mf4")
save(recording(), "deflate.mf4", 1)
save(recording(), "transposed.mf4", 2)

# Two groups of different clocks, integers with conversions, names and comments.
LINEAR = {"a": 0.001, "b": -2.0}
mdf = new()
mdf.append(
    [
        Signal(np.round(V["current_A"] * 1000).astype(np.int16), T, name="current", unit="A", conversion=LINEAR),
        Signal(V["speed_rad_s"].astype(np.float32), T, name="speed", unit="rad/s"),
        Signal((K % 2).astype(np.uint8), T, name="on"),
    ],
    acq_name="fast",
)
SLOW = np.arange(40) * 0.02 + 0.005
TABLE = {"raw_0": 0, "phys_0": 10.0, "raw_1": 10, "phys_1": 20.0, "raw_2": 20, "phys_2": 0.0}
mdf.append(
    [
        Signal(np.arange(40).astype(np.uint64) << np.uint64(40), SLOW, name="u64"),
        Signal((np.arange(40) - 20).astype(np.int32), SLOW, name="i32"),
        Signal(np.arange(40).astype(np.float16), SLOW, name="f16"),
        Signal(np.arange(1, 41).astype(np.int16), SLOW, name="rational", conversion=dict(P1=0, P2=1, P3=0, P4=0, P5=0, P6=4)),
        Signal((np.arange(40) - 5).astype(np.int16), SLOW, name="interpolated", conversion={**TABLE, "interpolation": True}),
        Signal((np.arange(40) - 5).astype(np.int16), SLOW, name="nearest", conversion=TABLE),
        Signal(np.arange(40).astype(np.int16), SLOW, name="formula", conversion={"formula": "X1*2"}),
        Signal(np.arange(40) % 2, SLOW, name="state", conversion={"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on"}),
        Signal(np.array([b"a", b"bc"] * 20), SLOW, name="text", encoding="utf-8"),
        Signal(np.rec.fromarrays([np.zeros((40, 3), dtype=np.int16)], dtype=[("array", "(3,)<i2")]), SLOW, name="array"),
    ]
)
save(mdf, "groups.mf4")


class Writer:
    """Writer of blocks by hand, for files that asammdf does not write."""

    def __init__(self, ident):
        self.bytes = bytearray(ident.ljust(16) + b"by hand".ljust(8, b"\0") + bytes(4) + struct.pack("<H", 410) + bytes(34))
        self.block("HD", [0] * 6, struct.pack("<QhhBBBBdd", 0, 0, 0, 0, 0, 0, 0, 0, 0))

    def block(self, kind, links, data=b"", length=None):
        """Appends a block and returns its address."""
        self.bytes += bytes(-len(self.bytes) % 8)
        at = len(self.bytes)
        whole = 24 + 8 * len(links) + len(data)
        self.bytes += b"##" + kind.encode() + bytes(4) + struct.pack("<QQ", whole if length is None else length, len(links))
        self.bytes += struct.pack(f"<{len(links)}Q", *links) + data
        return at

    def link(self, at, index, to):
        struct.pack_into("<Q", self.bytes, at + 24 + 8 * index, to)

    def text(self, text, kind="TX"):
        return self.block(kind, [], text.encode() + bytes(8 - len(text.encode()) % 8))

    def cc(self, kind, values, count=None):
        return self.block("CC", [0] * 4, struct.pack("<BBHHHdd", kind, 0, 0, 0, count or len(values), 0, 0) + struct.pack(f"<{len(values)}d", *values))

    def cn(self, name, kind, place, bits, unit="", cc=0, channel=0, sync=0, flags=0, invalid=0):
        """Appends a channel; `place` are the byte and the bit at which it starts."""
        links = [0, 0, self.text(name), 0, cc, 0, self.text(unit) if unit else 0, 0]
        data = struct.pack("<BBBBIIIIBBH6d", channel, sync, kind, place[1], place[0], bits, flags, invalid, 0, 0, 0, *[0] * 6)
        return self.block("CN", links, data)

    def cg(self, channels, record, cycles, identity=0, invalid=0, name=""):
        for this, following in zip(channels, channels[1:]):
            self.link(this, 0, following)
        links = [0, channels[0], self.text(name) if name else 0, 0, 0, 0]
        return self.block("CG", links, struct.pack("<QQHHIII", identity, cycles, 0, 0, 0, record, invalid))

    def dg(self, groups, data, identity_bytes=0):
        for this, following in zip(groups, groups[1:]):
            self.link(this, 0, following)
        return self.block("DG", [0, groups[0], data, 0], struct.pack("<B7x", identity_bytes))

    def save(self, name, groups):
        self.link(64, 0, groups[0])
        for this, following in zip(groups, groups[1:]):
            self.link(this, 0, following)
        open(name, "wb").write(self.bytes)


REAL_LE, REAL_BE, UINT_LE, UINT_BE, INT_LE, INT_BE = 4, 5, 0, 1, 2, 3
MASTER = dict(channel=2, sync=1)

# An unsorted group with three kinds of records, one of varying length; times as integers, packed and big-endian numbers,
# invalid samples, two data blocks.
w = Writer(b"MDF     4.10")
fast = [
    w.cn("time", UINT_LE, (0, 0), 64, "s", w.cc(1, [0.0, 1e-9]), **MASTER),
    w.cn("speed", REAL_BE, (8, 0), 64, "rad/s"),
    w.cn("packed", INT_LE, (16, 3), 10),
    w.cn("flag", UINT_LE, (17, 5), 1),
    w.cn("be16", INT_BE, (18, 0), 16),
    w.cn("be24", UINT_BE, (20, 0), 24),
    w.cn("f32be", REAL_BE, (23, 0), 32, flags=2, invalid=1),
]
slow = [w.cn("time", REAL_LE, (0, 0), 32, "s", **MASTER), w.cn("current", INT_LE, (4, 0), 16, "A", w.cc(1, [0.0, 0.001]))]
slow += [w.cn("text", 7, (6, 0), 64, channel=1)]
varying = w.cg([0], 0, (N + 9) // 10, 3)
struct.pack_into("<H", w.bytes, varying + 24 + 48 + 16, 1)
w.link(slow[2], 5, varying)
records = []
START = 5_000_000_000
written = 0
for k in range(N):
    packed = (k % 1024 - 512 & 1023) << 3 | (k % 3 == 0) << 13
    fields = START + int(round(T[k] * 1000)) * 1_000_000, V["speed_rad_s"][k]
    record = struct.pack("<Q", fields[0]) + struct.pack(">d", fields[1]) + struct.pack("<H", packed)
    record += struct.pack(">h", k - 200) + (k * 40_000).to_bytes(3, "big") + struct.pack(">f", k / 4)
    records.append(struct.pack("<H", 1) + record + bytes([0b10 if k % 5 == 0 else 0]))
    if k % 10 == 0:
        text = b"*" * (k // 10)
        records.append(struct.pack("<HfhQ", 2, 5.5 + k / 256, int(round(V["current_A"][k] * 1000)), written))
        records.append(struct.pack("<HI", 3, len(text)) + text)
        written += 4 + len(text)
struct.pack_into("<I", w.bytes, varying + 24 + 48 + 24, written)
data = b"".join(records)
groups = [w.cg(fast, 27, N, 1, 1, "fast"), w.cg(slow, 14, (N + 9) // 10, 2, 0, "slow"), varying]
blocks = [w.block("DT", [], data[:5000]), w.block("DT", [], data[5000:])]
dl = w.block("DL", [0, *blocks], struct.pack("<B3xIQQ", 0, 2, 0, 5000))
w.save("unsorted.mf4", [w.dg(groups, dl, 2)])
mdf = MDF("unsorted.mf4")
assert np.array_equal(mdf.get("speed").samples, V["speed_rad_s"])
assert np.array_equal(mdf.get("packed").samples, K % 1024 - 512)
assert np.array_equal(mdf.get("be24").samples, K * 40_000)
assert np.allclose(mdf.get("current").samples, np.round(V["current_A"][::10], 3))
mdf.close()

# A file that was not closed: no number of records, no length of the data, and half a record at the end.
w = Writer(b"UnFinMF 4.10")
names = [w.cn("t", REAL_LE, (0, 0), 64, "s", **MASTER)]
names += [w.cn(name, REAL_LE, (8 + 8 * k, 0), 64, UNITS[name]) for k, name in enumerate(NAMES)]
dg = w.dg([w.cg(names, 32, 0)], 0)
data = b"".join(struct.pack("<4d", T[k], *(V[n][k] for n in NAMES)) for k in range(N))
w.link(dg, 2, w.block("DT", [], data[:-16], 24))
struct.pack_into("<HH", w.bytes, 60, 0b101, 0)
w.save("unfinished.mf4", [dg])


# Lists of compressed and other blocks with records across their borders, a time from the number of the record, a channel
# within a channel, a unit of the conversion, names in XML, and bytes before each record although there is one group alone.
def deflated(data, record=0):
    """Data of a block; with the length of a record, its columns are joined before."""
    joined = data
    if record:
        whole = len(data) // record * record
        joined = np.frombuffer(data[:whole], dtype=np.uint8).reshape(-1, record).T.tobytes() + data[whole:]
    packed = zlib.compress(joined, 9)
    return b"DT" + struct.pack("<BBIQQ", bool(record), 0, record, len(data), len(packed)) + packed


w = Writer(b"MDF     4.10")
inner = w.cn("inner", UINT_LE, (9, 0), 8)
outer = w.cn("outer", 10, (8, 0), 16)
w.link(outer, 1, inner)
linear = w.cc(1, [1.0, 0.5])
w.link(linear, 1, w.text("<CNunit><TX>m/s&amp;</TX></CNunit>", "MD"))
names = [
    w.cn("angle", REAL_LE, (0, 0), 64, channel=2, sync=2),
    w.cn("t", UINT_LE, (0, 0), 0, "s", w.cc(1, [0.25, 0.002]), channel=3, sync=1),
    w.cn("speed", REAL_LE, (0, 0), 64, "rad/s"),
    outer,
    w.cn("count", UINT_LE, (8, 0), 8, cc=linear),
    w.cn("lost", UINT_LE, (8, 0), 8, flags=1),
    w.cn("phase", 15, (0, 0), 64),
]
w.link(names[4], 2, w.text("<CNname><TX>number &lt;k&gt;</TX></CNname>", "MD"))
data = b"".join(struct.pack("<BdBB", 9, V["speed_rad_s"][k], k % 256, k % 7) for k in range(N))
cuts = [0, 1000, 1003, 2000, 3500, len(data)]
parts = [data[a:b] for a, b in zip(cuts, cuts[1:])]
blocks = [
    w.block("DZ", [], deflated(parts[0])),
    w.block("DT", [], parts[1]),
    w.block("DZ", [], deflated(parts[2], 11)),
    w.block("DZ", [], deflated(parts[3], 11)),
    w.block("DT", [], parts[4]),
]
after = w.block("DL", [0, *blocks[3:]], struct.pack("<B3xIQQ", 0, 2, cuts[3], cuts[4]))
dl = w.block("DL", [after, *blocks[:3]], struct.pack("<B3xIQQQ", 0, 3, *cuts[:3]))
hl = w.block("HL", [dl], struct.pack("<HB5x", 0, 0))
alone = w.dg([w.cg(names, 10, N, 9)], hl, 1)
# Groups that are left out: one without time, one of bus messages, and an empty one.
no_time = w.dg([w.cg([w.cn("x", REAL_LE, (0, 0), 64)], 8, 1)], w.block("DT", [], bytes(8)))
bus = w.cg([w.cn("t", REAL_LE, (0, 0), 64, "s", **MASTER)], 8, 1, name="CAN1")
struct.pack_into("<H", w.bytes, bus + 24 + 48 + 16, 2)
bus = w.dg([bus], w.block("DT", [], bytes(8)))
empty = [w.cn("t", REAL_LE, (0, 0), 64, "s", **MASTER), w.cn("x", REAL_LE, (8, 0), 64)]
w.save("lists.mf4", [alone, no_time, bus, w.dg([w.cg(empty, 16, 0)], 0)])
mdf = MDF("lists.mf4")
assert np.array_equal(mdf.get("speed").samples, V["speed_rad_s"])
assert np.allclose(mdf.get("speed").timestamps, 0.25 + 0.002 * K)
mdf.close()
