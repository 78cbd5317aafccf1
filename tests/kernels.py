"""The kernels of OpenBLAS that this processor can run: their sums differ by rounding.

`python -m tests.kernels` prints one that is not the current one, or nothing on other processors.
"""

import os

from numpy._core._multiarray_umath import __cpu_features__

FEATURES = {"Haswell": "AVX2", "SkylakeX": "AVX512_SKX", "Nehalem": "SSE42"}
"""Core type, as `OPENBLAS_CORETYPE` has it, and what it needs, the most common ones first."""


def other_kernels() -> list[str]:
    """Return the core types that the processor supports, without the one that the user has set.

    Unless one is set, OpenBLAS takes that of the processor, which is the first or the second.
    """
    supported = [name for name, feature in FEATURES.items() if __cpu_features__.get(feature)]
    return [name for name in supported if name != current(supported)]


def current(supported: list[str]) -> str:
    """Return the core type in use."""
    newest = "SkylakeX" if "SkylakeX" in supported else "Haswell"
    return os.environ.get("OPENBLAS_CORETYPE") or newest


if __name__ == "__main__":
    print(*other_kernels()[:1])
