"""How this package compiles functions."""

from numba import njit

compiled = njit(nogil=True, error_model="numpy")
"""Without the interpreter's lock, so that threads share the frames out, and with IEEE division.

Nothing is cached on disk: numba looks at the caller's source only, and would go on using shapes as they were before
an edit. The recording is made once, so that little is lost."""

copied_in = njit(nogil=True, error_model="numpy", inline="always")
"""The same for what has one caller or is short: it becomes a part of its callers before they are compiled, which
spares compiling it for itself."""
