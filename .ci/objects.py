"""Add machine code to a wheel: for each instruction set, what a study compiles at first.

    python .ci/objects.py WHEEL

writes a wheel for Linux on x86-64, whatever the version of Python, beside the given one, which is
for all platforms. What the processor of this machine cannot run is left out, and said. What this
working tree has compiled of the same sources is taken from there.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

from numpy._core._multiarray_umath import __cpu_features__

SOURCE = Path(__file__).parents[1] / "src"

INSTRUCTION_SETS = {"x86-64-v3": "AVX2", "x86-64-v4": "AVX512_SKX"}
"""Instruction sets, and NumPy's name of what a processor must have."""
TAG = "py3-none-manylinux_2_17_x86_64"

COMPILE = """
import sys
from pathlib import Path
from shutil import copyfile
from flexband.compilation import caching
from flexband.study.compiling import PARTS

code = caching.Entry._code

def shipped(entry, kind, arguments):
    result = code(entry, kind, arguments)
    target, *kept = entry.files(caching._hash(kind))
    copyfile(next(filter(Path.exists, kept)), Path(sys.argv[1], target.name))
    return result

caching.Entry._code = shipped
for _, use in PARTS.values():
    use()
"""


def supported() -> list[str]:
    """Return the instruction sets of this processor; say which are left out."""
    for name, feature in INSTRUCTION_SETS.items():
        if not __cpu_features__.get(feature):
            print(f"{name}: left out, since this processor does not have {feature}")
    return [name for name, feature in INSTRUCTION_SETS.items() if __cpu_features__.get(feature)]


def objects(wheel: Path, name: str, folder: Path) -> None:
    """Write the objects of a wheel's entries for an instruction set to a folder."""
    home = folder / name
    with ZipFile(wheel) as archive:
        archive.extractall(home)
    kept = home / "kept" / "flexband"
    kept.mkdir(parents=True)
    for file in SOURCE.rglob("*.o"):
        shutil.copy(file, kept)
    environment = os.environ | {
        "PYTHONPATH": str(home),
        "NUMBA_CPU_NAME": name,
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(kept.parent),
    }
    command = [sys.executable, "-c", COMPILE, str(folder / "objects")]
    subprocess.run(command, env=environment, cwd=home, check=True)


def with_objects(wheel: Path, *, every: bool = True) -> Path:
    """Return a copy of a wheel that has objects for every instruction set, or for the last one."""
    name, version = wheel.stem.split("-")[:2]
    info = f"{name}-{version}.dist-info"
    result = wheel.with_name(f"{name}-{version}-{TAG}.whl")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "objects").mkdir()
        with ThreadPoolExecutor(2) as pool:
            names = supported()[0 if every else -1 :]
            list(pool.map(lambda cpu: objects(wheel, cpu, folder), names))
        with ZipFile(wheel) as archive:
            files = {entry: archive.read(entry) for entry in archive.namelist()}
        for file in sorted((folder / "objects").iterdir()):
            files[f"{name}/compilation/objects/{file.name}"] = file.read_bytes()
    tags = f"{info}/WHEEL"
    text = re.sub("Tag: .*", f"Tag: {TAG}", files[tags].decode())
    files[tags] = text.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false").encode()
    record = f"{info}/RECORD"
    del files[record]
    lines = [f"{entry},sha256={_digest(data)},{len(data)}\n" for entry, data in files.items()]
    files[record] = "".join([*lines, f"{record},,\n"]).encode()
    with ZipFile(result, "w", ZIP_DEFLATED) as archive:
        for entry, data in files.items():
            archive.writestr(entry, data)
    return result


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


if __name__ == "__main__":
    print(with_objects(Path(sys.argv[1])))
