#!/usr/bin/env python3
"""cmake/docs/build.py [--output FOLDER] [--only FOLDER_OF_FIRN]: builds the reference and the guide with Doxygen, into
build/docs/html by default, and fails where something is wrong: a public name without a sentence, a command that Doxygen
does not understand, a link that leads nowhere. What Doxygen says falsely is listed in false_warnings.txt. With --only
just the warnings of one of firn's folders (or headers) count.

A public name is what is declared in namespace firn or below it, outside of a namespace `detail`.
"""
import argparse
import html.parser
import re
import shutil
import subprocess
import sys
import urllib.parse
from pathlib import Path

docs = Path(__file__).resolve().parent
root = docs.parent.parent

# Members that policies and records have by agreement, and what they are. A header need not say it again.
agreed = [
    (r"static constexpr const char\* name\b", "The name in states, programs for a GPU and messages."),
    (r"static constexpr (auto|std::tuple<>) parameters\(\)", "The parameters, each with its name, unit and member."),
    (r"static constexpr auto fields\(\)", "The fields of a particle's state, each with its name, unit and member."),
    (r"static constexpr int dimension\b", "The number of dimensions of space: 2 or 3."),
    (r"using scalar_type =", "The type of the numbers it computes with."),
    (r"(friend )?(constexpr )?bool operator==\(const \w+&(, const \w+&)?\) (const )?= default;", "Equal in all members."),
]
agreed = [(re.compile(r"( *)(\[\[\w+\]\] )?(" + pattern + ")"), sentence) for pattern, sentence in agreed]

# The rooms of firn, in the order in which a reader meets them.
rooms = {
    "simulation": "Simulation", "material": "Materials", "boundary": "Boundaries", "kernel": "Kernels",
    "transfer": "Transfers", "force": "Force forms", "field": "Acceleration fields",
    "lagrangian": "Particles, soft bodies and cloth", "io": "States and files", "data": "Particles, grids and shapes",
    "core": "Vectors, errors, threads", "math": "Mathematics", "stage": "Stages: formulas",
    "exec": "Stages: loops", "wgsl": "Programs for a GPU", "webgpu": "Running on a GPU", "sort": "Engine room: sorting",
    "simd": "Engine room: SIMD lanes",
}


def prepared(text, room):
    """The header as Doxygen is to see it: the comment of the file under \\file, agreed members with their sentences,
    everything in the group of its room."""
    match = re.search(r"^/// \\file ", text, re.M)
    if match:
        text = text[: match.start()] + "/// " + text[match.end():]
        text = text.replace("#pragma once", "/// \\file\n#pragma once", 1)
    lines = []
    for line in text.split("\n"):
        if not (lines and lines[-1].lstrip().startswith("///")) and "///<" not in line:
            for pattern, sentence in agreed:
                found = pattern.match(line)
                if found:
                    lines.append(f"{found.group(1)}/// {sentence}")
                    break
        lines.append(line)
    return f"/// \\addtogroup {room}\n/// @{{\n" + "\n".join(lines) + "\n/// @}\n"


def prepare(output):
    source = output / "input"
    shutil.rmtree(source, ignore_errors=True)
    for header in sorted((root / "include/firn").rglob("*.hpp")):
        path = header.relative_to(root / "include")
        if "vendor" in path.parts:
            continue
        room = path.parts[1] if len(path.parts) > 2 else "simulation"
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        (source / path).write_text(prepared(header.read_text(), room))
    groups = "".join(f"/// \\defgroup {room} {title}\n" for room, title in rooms.items())
    (source / "rooms.dox").write_text(groups)
    return source


def warnings(log, source):
    """What Doxygen complains of and is not known to be false, with paths of firn's headers."""
    false = [line for line in (docs / "false_warnings.txt").read_text().split("\n") if line and line[0] != "#"]
    told, unused = [], set(false)
    for line in log.read_text().split("\n"):
        line = line.replace(f"{source}/", "")
        if "warning:" not in line and "error:" not in line:
            continue
        known = [text for text in false if text in line]
        unused.difference_update(known)
        if not known:
            told.append(line)
    return sorted(set(told)), sorted(unused)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=root / "build/docs")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    output = options.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    source = prepare(output)
    shutil.rmtree(output / "html", ignore_errors=True)
    text = (docs / "Doxyfile.in").read_text()
    for name, value in {"INPUT": source, "OUTPUT": output, "ROOT": root, "DOCS": docs}.items():
        text = text.replace(f"@{name}@", str(value))
    (output / "Doxyfile").write_text(text)
    subprocess.run(["doxygen", output / "Doxyfile"], check=True)
    told, unused = warnings(output / "warnings.txt", source)
    if options.only:
        told = [line for line in told if line.startswith(f"firn/{options.only}")]
    for line in told:
        print(line)
    print(f"{len(told)} warnings")
    return 1 if told else 0


if __name__ == "__main__":
    sys.exit(main())
