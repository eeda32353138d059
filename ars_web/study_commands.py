"""The commands of `ars-web` that look at a session: its coverage, where to look next, a report.

They stand beside the commands of `cli.py`, in no group.
"""

import typer

app = typer.Typer(rich_markup_mode=None)
