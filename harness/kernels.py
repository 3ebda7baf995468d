"""The kernels that numerical libraries compute with: the same on every processor of a kind, so that numbers are the same.

BLAS, among others, chooses its kernels by the processor. Which rounding errors a product has depends on that.
"""

from __future__ import annotations

import platform
from collections.abc import MutableMapping

# The oldest kernels: all processors of the kind have them. For these small matrices they are no slower.
_OPENBLAS = {"x86_64": "Prescott", "AMD64": "Prescott", "aarch64": "ARMV8", "arm64": "ARMV8"}


def kernels() -> dict[str, str]:
    """Variables of the environment that fix the kernels of OpenBLAS, MKL and PyTorch. They count before these are loaded."""
    fixed = {"MKL_CBWR": "COMPATIBLE", "ATEN_CPU_CAPABILITY": "default"}
    core = _OPENBLAS.get(platform.machine())
    return {**fixed, "OPENBLAS_CORETYPE": core} if core else fixed


def fix_kernels(environ: MutableMapping[str, str]) -> None:
    """Set these variables, also where they have another value: numbers are not to depend on it."""
    environ.update(kernels())
