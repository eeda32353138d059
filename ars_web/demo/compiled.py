"""The one way in which this package compiles functions."""

from numba import njit

compiled = njit(nogil=True, error_model="numpy")
"""Without the interpreter's lock, so that threads share the frames out, and with IEEE division.

Nothing is cached on disk: numba looks at the caller's source only, and would go on using shapes as they were before
an edit. The recording is made once, so that little is lost."""
