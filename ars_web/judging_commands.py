"""The commands of `ars-web` that judge labels: a session's beside a person's, a detector's beside true ones.

They stand beside the commands of `cli.py`, in no group.
"""

import typer

app = typer.Typer(rich_markup_mode=None)
