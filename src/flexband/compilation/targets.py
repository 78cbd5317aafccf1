"""The machines that objects are made for, as this processor and Numba's variables have it.

These variables of the environment are read without importing Numba.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache

from llvmlite import binding

ENTRY = "flexband_entry"
"""The only symbol that an object defines for others."""

INSTRUCTION_SETS = {
    "x86-64-v4": "avx512f avx512bw avx512cd avx512dq avx512vl avx2 bmi bmi2 f16c fma lzcnt movbe",
    "x86-64-v3": "avx2 bmi bmi2 f16c fma lzcnt movbe",
    "x86-64": "",
}
"""Names that LLVM knows, with the features that a processor must have, the largest first."""


def _text(name: str, default: str = "") -> str:
    return os.environ.get(f"NUMBA_{name}") or default


def _switch(name: str, default: str = "0") -> bool:
    return _text(name, default) != "0"


@dataclass
class Settings:
    """What Numba's documentation says of the variables of these names."""

    boundscheck: bool = _switch("BOUNDSCHECK")
    enable_avx: bool = _switch("ENABLE_AVX", "1")
    cpu_name: str = _text("CPU_NAME")
    cpu_features: str = _text("CPU_FEATURES")


SETTINGS = Settings()


@cache
def instruction_set() -> tuple[str, str]:
    """Return the name of an instruction set or a processor, and further features, for LLVM.

    NUMBA_CPU_NAME and NUMBA_CPU_FEATURES take the place of what this processor has.
    """
    name = SETTINGS.cpu_name
    features = SETTINGS.cpu_features
    if name or features:
        return name or binding.get_host_cpu_name(), features or ""
    if not binding.get_process_triple().startswith("x86_64"):
        return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    has = binding.get_host_cpu_features() if SETTINGS.enable_avx else {}
    sets = INSTRUCTION_SETS.items()
    return next(name for name, requirements in sets if all(map(has.get, requirements.split()))), ""


def target_machine() -> binding.TargetMachine:
    """Return LLVM's description of the machine that objects are for."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = instruction_set()
    target = binding.Target.from_triple(binding.get_process_triple())
    return target.create_target_machine(
        cpu=name, features=features, opt=3, reloc="static", codemodel="large"
    )
