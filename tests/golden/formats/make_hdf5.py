"""Writes the HDF5 files and MAT-files of level 7.3 of the tests: python3 make_hdf5.py.

Needs h5py, numpy, pandas with tables, and hdf5storage. MATLAB is not needed: write_mat follows the layout of its files, and
hdf5storage writes one independently.
"""
import csv
import datetime
import os
import subprocess
import sys

import h5py
import hdf5storage
import numpy as np
import pandas as pd

NAMES = ["time_s", "voltage_V", "current_A", "speed_rad_s"]
UNITS = ["s", "V", "A", "rad/s"]
rows = list(csv.DictReader(open("recording.csv")))
RECORDING = {name: np.array([float(row[name]) for row in rows]) for name in NAMES}
N = 12
T = np.arange(N) * 0.002
HEADER = "MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 ."


def fixed(obj, name, text):
    """Writes an attribute as MATLAB does: text of fixed length, marked as ending with a zero, which it does not."""
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(len(text))
    kind.set_strpad(h5py.h5t.STR_NULLTERM)
    space = h5py.h5s.create(h5py.h5s.SCALAR)
    h5py.h5a.create(obj.id, name.encode(), kind, space).write(np.array(text.encode(), dtype=f"S{len(text)}"), mtype=kind)


def user_block(path):
    """Writes the header of a MAT-file of level 7.3 into the first 512 bytes of a file."""
    with open(path, "r+b") as file:
        file.write(HEADER.encode().ljust(116) + bytes(8) + b"\x00\x02IM")


CLASSES = {"f8": "double", "f4": "single", "b1": "logical"}


def matlab(group, name, value, **storage):
    """Writes a variable; HDF5 has the dimensions of an array in reverse order."""
    value = np.atleast_2d(np.asarray(value))
    kind = value.dtype.str[1:]
    if kind[0] == "U":
        codes = np.array([[ord(c) for c in str(value[0, 0])]], dtype="u2").T
        data = group.create_dataset(name, data=codes)
        fixed(data, "MATLAB_class", "char")
        data.attrs["MATLAB_int_decode"] = np.int32(2)
        return data
    data = group.create_dataset(name, data=value.T.astype("u1" if kind == "b1" else value.dtype), **storage)
    fixed(data, "MATLAB_class", CLASSES.get(kind) or value.dtype.name)
    if kind == "b1":
        data.attrs["MATLAB_int_decode"] = np.int32(1)
    return data


def structure(group, name, fields):
    made = group.create_group(name)
    fixed(made, "MATLAB_class", "struct")
    names = np.empty(len(fields), dtype=object)
    for at, field in enumerate(fields):
        names[at] = np.array([c.encode() for c in field], dtype="S1")
    made.attrs.create("MATLAB_fields", names, dtype=h5py.vlen_dtype(np.dtype("S1")))
    return made


def column(values):
    return np.asarray(values).reshape(-1, 1)


# The recording, as h5py and MATLAB store it.
with h5py.File("recording.h5", "w") as f:
    for name, unit in zip(NAMES, UNITS):
        data = f.create_dataset(name, data=RECORDING[name], chunks=(201,), compression="gzip", shuffle=True)
        data.attrs["units"] = unit
with h5py.File("recording_v73.mat", "w", userblock_size=512) as f:
    for name in NAMES:
        matlab(f, name, column(RECORDING[name]), chunks=(1, 401), compression=3)
user_block("recording_v73.mat")

# Numbers of all types; `expected` has the first two values of each.
with h5py.File("types.h5", "w") as f:
    for size in "i1 u1 <i2 >i2 <u2 >u2 <i4 >i4 <u4 >u4 <i8 >i8 <u8 >u8 <f2 >f2 <f4 >f4 <f8 >f8".split():
        low = np.iinfo(size).min if "f" not in size else np.finfo(size).min
        name = size.replace("<", "le_").replace(">", "be_")
        f[name] = np.concatenate([[low, 1], np.arange(N - 2)]).astype(size)
    f["i8max"] = np.full(N, 2**63 - 1)
    f["u8max"] = np.full(N, 2**64 - 1, dtype="u8")
    f["bool"] = np.arange(N) % 3 == 0
    f.create_dataset("enum", data=np.arange(N) % 3 - 1, dtype=h5py.enum_dtype({"A": -1, "B": 0, "C": 1}, basetype="i2"))
    space = h5py.h5s.create_simple((N,))
    bits = h5py.h5t.STD_I32LE.copy()
    bits.set_precision(12)
    bits.set_offset(4)
    data = h5py.h5d.create(f.id, b"int12", bits, space)
    data.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(N, dtype="i4") - 6)
    brain = h5py.h5t.IEEE_F32LE.copy()
    brain.set_fields(15, 7, 8, 0, 7)
    brain.set_size(2)
    data = h5py.h5d.create(f.id, b"bfloat16", brain, space)
    data.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(N, dtype="f4") / 4)
    data = h5py.h5d.create(f.id, b"bitfield", h5py.h5t.STD_B8LE, space)
    data.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(N, dtype="u1"), mtype=h5py.h5t.STD_B8LE)
    f["long_double"] = T.astype(np.longdouble)

# All kinds of storage, in the formats of the oldest and of the newest version of the library.
for version in ["earliest", "latest"]:
    with h5py.File(f"storage_{version}.h5", "w", libver=version) as f:
        f["contiguous"] = T
        compact = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        compact.set_layout(h5py.h5d.COMPACT)
        data = h5py.h5d.create(f.id, b"compact", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((N,)), compact)
        data.write(h5py.h5s.ALL, h5py.h5s.ALL, T)
        KINDS = {
            "one_chunk": dict(chunks=(N,)),
            "one_chunk_gzip": dict(chunks=(N,), compression="gzip"),
            "chunks": dict(chunks=(5,)),
            "gzip": dict(chunks=(5,), compression="gzip"),
            "shuffled": dict(chunks=(5,), compression="gzip", shuffle=True),
            "checked": dict(chunks=(5,), compression="gzip", shuffle=True, fletcher32=True),
            "fletcher32": dict(chunks=(5,), fletcher32=True),
            "extendible": dict(chunks=(1,), maxshape=(None,)),
            "extendible_gzip": dict(chunks=(2,), maxshape=(None,), compression="gzip"),
            "lzf": dict(chunks=(N,), compression="lzf", shuffle=True),
        }
        FEW = ["chunks", "shuffled", "checked"]
        for name, kind in KINDS.items():
            if version == "latest" or name in FEW:
                f.create_dataset(name, data=T, **kind)
        if version == "latest":
            f.create_dataset("szip", data=T, chunks=(N,), compression="szip")
            plain = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            plain.set_chunk((5,))
            plain.set_filter(h5py.h5z.FILTER_NBIT, 0)
            data = h5py.h5d.create(f.id, b"nbit", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((N,)), plain)
            data.write(h5py.h5s.ALL, h5py.h5s.ALL, T)
        f.create_dataset("scaleoffset", data=np.arange(N) * 7, chunks=(5,), scaleoffset=0)
        table = np.arange(3.0 * N).reshape(N, 3)
        f["matrix"] = table
        f.create_dataset("matrix_chunks", data=table, chunks=(5, 2), compression="gzip")
        if version == "latest":
            f.create_dataset("matrix_extendible", data=table, chunks=(5, 2), maxshape=(None, None), compression="gzip")
        f["row"] = T.reshape(1, N)
        f["column"] = T.reshape(N, 1)
        f.create_dataset("unwritten", shape=(N,), dtype="f8", fillvalue=4.5)
        f.create_dataset("unwritten_chunks", shape=(N,), dtype="f8", chunks=(5,), fillvalue=-1.5)
        part = f.create_dataset("part", shape=(N,), dtype="f8", chunks=(5,), fillvalue=-1.0)
        part[5:10] = T[:5]

# Groups, links, units and constants.
for version in ["earliest", "latest"]:
    with h5py.File(f"groups_{version}.h5", "w", libver=version) as f:
        f["log/motor/speed"] = T
        f["log/motor/speed"].attrs["unit"] = np.bytes_("rad/s")
        for at in range(9):
            f["log/motor/speed"].attrs[f"note{at}"] = at
        f["log/time"] = T
        f["log/time"].attrs["UNITS"] = "s"
        f["log/phases"] = np.arange(3.0 * N).reshape(N, 3)
        f["log/phases"].attrs["units"] = ["A", "V", ""]
        many = f.create_group("many")
        for at in range(10):
            many[f"c{at:02}"] = T + at
        ordered = f.create_group("ordered", track_order=True)
        for name in "zyx":
            ordered[name] = T
        f["again"] = f["log/time"]
        f["log/up"] = f["/"]
        f["log/alias"] = h5py.SoftLink("/log/time")
        f["soft"] = h5py.SoftLink("/log/time")
        f["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
        f["kind"] = np.dtype("<f8")
        f.create_dataset("of_kind", data=T, dtype=f["kind"])
        f["fs"] = 500.0
        f["pole_pairs"] = np.array([[7]], dtype="i4")
        f.attrs["resistance"] = 0.25
        f.attrs["count"] = np.int64(3)
        f.attrs["title"] = "test bench"
        f["short"] = np.arange(3.0)
        f["packed"] = np.arange(N, dtype="i2")
        f["packed"].attrs["scale_factor"] = 0.1

# Datasets that are not read, and why.
with h5py.File("unread.h5", "w", libver="latest") as f:
    f["t"] = T
    layout = h5py.VirtualLayout((N,), "f8")
    layout[:] = h5py.VirtualSource(f["t"])
    f.create_virtual_dataset("virtual", layout)
    f.create_dataset("outside", shape=(N,), dtype="f8", external=[("values.bin", 0, 8 * N)])
    f["complex"] = T * 1j
    h5py.h5d.create(f.id, b"complex_2", h5py.h5t.COMPLEX_IEEE_F64LE, h5py.h5s.create_simple((N,)))
    f["text"] = "motor"
    f["texts"] = np.array([b"ab"] * N)
    f["references"] = np.array([f["t"].ref], dtype=h5py.ref_dtype)
    f.create_dataset("lists", shape=(2,), dtype=h5py.vlen_dtype("f8"))
    f["opaque"] = np.arange(N).astype("M8[us]").astype(h5py.opaque_dtype("M8[us]"))
    f["cube"] = np.zeros((2, 3, 4))
    f["wide"] = np.zeros((2, 70), dtype="u1")
    f["empty"] = np.zeros(0)
    f["none"] = h5py.Empty("f8")
    pipeline = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    pipeline.set_chunk((N,))
    pipeline.set_filter(32001, h5py.h5z.FLAG_OPTIONAL, (2, 2, 8, 8 * N))
    f.create_dataset("huge", shape=(10**9,), dtype="f8", chunks=(1000,))
    f.create_dataset("large", shape=(10**7,), dtype="f8")
    f["dimension"] = np.zeros(N)
    f["dimension"].attrs["NAME"] = "This is a netCDF dimension but not a netCDF variable.        12"
    f["/".join(["deep"] * 40)] = T
    h5py.h5d.create(f.id, b"blosc", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((N,)), pipeline)

# Structured arrays, of h5py and of pandas.
FIELDS = [("t", "f8"), ("id", ">i2"), ("on", "?"), ("name", "S3"), ("abc", "f4", (3,)), ("pos", [("x", "f8"), ("y", "f8")])]
records = np.zeros(N, dtype=FIELDS)
records["t"], records["id"], records["on"] = T, np.arange(N) - 5, np.arange(N) % 2
records["abc"], records["pos"]["y"] = np.arange(3 * N).reshape(N, 3), T * 2
for version in ["earliest", "latest"]:
    with h5py.File(f"compound_{version}.h5", "w", libver=version) as f:
        f["log"] = records
        f.create_dataset("chunked", data=records, chunks=(5,), compression="gzip")
        f["one"] = records[1]
        f["pairs"] = np.zeros((2, N), dtype=[("a", "f8"), ("b", "f8")])
frame = pd.DataFrame({"time": T, "speed": T * 3, "n": np.arange(N)})
STORE = dict(format="table", index=False, complevel=1, complib="zlib")
frame.to_hdf("pandas.h5", key="log", data_columns=True, **STORE)
frame.to_hdf("pandas.h5", key="blocks", **STORE)

# A log of four columns that grow together, in chunks one after the other.
with h5py.File("growing.h5", "w", libver="latest") as f:
    made = [f.create_dataset(name, shape=(0,), maxshape=(None,), chunks=(50,), dtype="f8") for name in NAMES]
    for start in range(0, 400, 50):
        for data in made:
            data.resize(start + 50, axis=0)
            data[start:] = RECORDING[data.name[1:]][start : start + 50]
        f.flush()
# Datasets one after the other.
with h5py.File("contiguous.h5", "w", libver="latest") as f:
    for name in ["a", "b", "c"]:
        f[name] = np.arange(100.0)
    f["d"] = np.arange(300.0).reshape(100, 3)
# A file that is not closed.
subprocess.run([sys.executable, "-c", """
import h5py, numpy as np, os
f = h5py.File("unclosed.h5", "w", libver="latest")
data = f.create_dataset("x", data=np.arange(12.0), chunks=(5,), maxshape=(None,))
f.swmr_mode = True
data.flush()
os._exit(0)
"""])

# Variables of all classes of MATLAB.
with h5py.File("mixed_v73.mat", "w", userblock_size=512) as f:
    matlab(f, "t", column(T))
    matlab(f, "row", T.reshape(1, N))
    matlab(f, "i8", column(np.arange(N, dtype="i1") - 6))
    matlab(f, "u64", column(np.arange(N, dtype="u8") << 50))
    matlab(f, "f32", column(T.astype("f4")))
    matlab(f, "on", column(np.arange(N) % 2 == 0))
    matlab(f, "m", np.arange(3.0 * N).reshape(N, 3), chunks=(2, 5), compression=3)
    matlab(f, "fs", 500.0)
    matlab(f, "short", column([1.0, 2.0, 3.0]))
    matlab(f, "wide", np.zeros((2, 70), dtype="u1"))
    f.create_dataset("cube", data=np.zeros((4, 3, 2)))
    fixed(f["cube"], "MATLAB_class", "double")
    matlab(f, "label", "motor")
    complex_numbers = np.zeros((1, N), dtype=[("real", "f8"), ("imag", "f8")])
    fixed(f.create_dataset("z", data=complex_numbers), "MATLAB_class", "double")
    empty = f.create_dataset("empty", data=np.zeros(2, dtype="u8"))
    fixed(empty, "MATLAB_class", "double")
    empty.attrs["MATLAB_empty"] = np.uint8(1)
    out = structure(f, "out", ["time", "signals"])
    matlab(out, "time", column(T * 2))
    signals = structure(out, "signals", ["values", "label"])
    refs = f.create_group("#refs#")
    values, labels = [], []
    for at in range(2):
        values.append(matlab(refs, "ab"[at], column(T * (at + 3))).ref)
        labels.append(matlab(refs, "cd"[at], "first second".split()[at]).ref)
    signals.create_dataset("values", data=np.array(values, dtype=h5py.ref_dtype).reshape(2, 1))
    signals.create_dataset("label", data=np.array(labels, dtype=h5py.ref_dtype).reshape(2, 1))
    cell = f.create_dataset("mixed", data=np.array(values, dtype=h5py.ref_dtype).reshape(2, 1))
    fixed(cell, "MATLAB_class", "cell")
    for name, kind in [("ts", "timeseries"), ("tt", "timetable")]:
        thing = f.create_dataset(name, data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4"))
        fixed(thing, "MATLAB_class", kind)
        thing.attrs["MATLAB_object_decode"] = np.int32(3)
    sparse = f.create_group("sparse")
    fixed(sparse, "MATLAB_class", "double")
    sparse.attrs["MATLAB_sparse"] = np.uint64(3)
    sparse["data"] = T
    sparse["ir"] = np.arange(N, dtype="u8")
    sparse["jc"] = np.array([0, N], dtype="u8")
    f.create_group("#subsystem#").create_dataset("MCOS", data=T)
user_block("mixed_v73.mat")
with h5py.File("object_v73.mat", "w", userblock_size=512) as f:
    thing = f.create_dataset("ts", data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4"))
    fixed(thing, "MATLAB_class", "timeseries")
    thing.attrs["MATLAB_object_decode"] = np.int32(3)
    matlab(f, "fs", 500.0)
user_block("object_v73.mat")

# The same classes by an independent writer.
if os.path.exists("hdf5storage_v73.mat"):
    os.remove("hdf5storage_v73.mat")
several = np.zeros((1, 2), dtype=[("values", object), ("name", object)])
for at in range(2):
    several[0, at] = (column(T * (at + 3)), "name")
hdf5storage.writes(
    {
        "/t": column(T),
        "/i16": column(np.arange(N, dtype="i2") - 6),
        "/on": column(np.arange(N) % 2 == 0),
        "/m": np.arange(3.0 * N).reshape(N, 3),
        "/fs": np.float64(500.0),
        "/label": "motor",
        "/z": column(T * 1j),
        "/s": {"speed": column(T * 5), "deep": {"u": column(T * 6)}},
        "/several": several,
        "/cell": np.array([1.0, "a"], dtype=object),
    },
    filename="hdf5storage_v73.mat",
    matlab_compatible=True,
    store_python_metadata=False,
)
user_block("hdf5storage_v73.mat")
