"""How the loops in `*_kernels.py` are compiled: when first called, without checks for division by zero.

numba's cache notices a change only in the file of the `entry` that it keeps, so kernels call only kernels of their
own file; where that would be too long, the entries' file holds digests of the others, as `raster_kernels.py` does.
"""

from numba import njit

entry = njit(cache=True, nogil=True, error_model="numpy")
"""Called from Python; kept on disk; other threads run beside it."""

# numba's stubs leave these two options out.
part = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)  # pyright: ignore[reportCallIssue]
"""Called by an entry only. That it cannot be called from Python spares a quarter of the time to compile."""
