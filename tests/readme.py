"""Runs the commands of the console blocks (lines that begin with "$ ") of the README and of docs/ in this folder, and compares what they print
with the lines that the documents show: those below a command in its block, and those of a text block that follows the console block
directly, which is of its last command. A line is in order among the printed ones; "…" stands for any text, and a number may differ by two
units of its last digit. tests/run is left out, because it calls this script.
"""

import re
import subprocess
import sys
from pathlib import Path

NUMBER = re.compile(r"(?<![A-Za-z_])-?\d+(?:\.\d+)?(?:e-?\d+)?")
COMMANDS_MIN = 5
# Their numbers depend on the machine.
VARYING = re.compile(r"^  (device|time) ")


def blocks(text):
    """Yields the commands of a document, each with the lines that it is expected to print."""
    fences = list(re.finditer(r"^```(\w*)\n(.*?)^```\n", text, re.S | re.M))
    for fence, after in zip(fences, fences[1:] + [None]):
        if fence[1] != "console":
            continue
        commands = []
        for line in fence[2].splitlines():
            if line.startswith("$ "):
                commands.append((line[2:], []))
            elif commands:
                commands[-1][1].append(line)
        if after and after[1] == "text" and not text[fence.end() : after.start()].strip() and commands:
            commands[-1][1].extend(after[2].splitlines())
        yield from commands


def numbers(line):
    return NUMBER.findall(line)


def last_digit(number):
    digits, _, exponent = number.partition("e")
    decimals = len(digits.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)


def is_alike(expected, printed):
    """Returns true if a printed line is the expected one."""
    parts = [NUMBER.sub("\0", part) for part in expected.split("…")]
    pattern = ".*".join(re.escape(re.sub(r"\s+", " ", part)) for part in parts)
    pattern = pattern.replace(re.escape("\0"), f"({NUMBER.pattern})")
    found = re.fullmatch(pattern, re.sub(r"\s+", " ", printed))
    pairs = zip(numbers(expected), found.groups()) if found else []
    return bool(found) and all(abs(float(a) - float(b)) <= 2.001 * last_digit(a) for a, b in pairs)


def missing(expected, printed):
    """Returns the first expected line that is not printed after the others; None if all are."""
    rest = iter(printed)
    for line in expected:
        if line.strip() and not VARYING.match(line) and not any(is_alike(line, other) for other in rest):
            return line
    return None


def main():
    documents = [Path("README.md"), *sorted(Path("docs").glob("*.md"))]
    commands = [(path, *one) for path in documents for one in blocks(path.read_text())]
    if len(commands) < COMMANDS_MIN:
        sys.exit("tests/readme: README and docs show too few commands")
    compared = 0
    for path, command, expected in commands:
        if command.startswith("tests/run"):
            continue
        print(f"$ {command}", flush=True)
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, errors="replace")
        if done.returncode != 0:
            sys.exit(done.stdout)
        lines = done.stdout.splitlines()
        print("\n".join(f"    {line}" for line in lines[-3:]), flush=True)
        absent = missing(expected, lines)
        if absent is not None:
            sys.exit(f"{done.stdout}\ntests/readme: {path} shows a line that `{command}` does not print:\n{absent}")
        compared += sum(1 for line in expected if line.strip())
    print(f"{len(commands)} commands run, {compared} lines compared")


if __name__ == "__main__":
    main()
