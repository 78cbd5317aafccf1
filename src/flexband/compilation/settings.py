"""Numba's environment variables that machine code depends on, read without importing Numba."""

from __future__ import annotations

import os
from dataclasses import dataclass


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
