"""Prints docs/command-line.md from what the commands say: python docs/command_line.py > docs/command-line.md"""

import os
import re
import subprocess
import sys

INTRODUCTION = """\
# The command line

`ars-web COMMAND`, also `python -m ars_web COMMAND`. `python docs/command_line.py` prints this page.

- Exit status: 0 done, 2 wrong arguments, 130 stopped by Ctrl-C, 1 anything else. What went wrong is one line on stderr.
- Results go to stdout, progress and notes to stderr: a bar on a terminal, plain lines elsewhere.
- `--json` prints JSON on stdout and nothing else there.
- `SESSION` is a session's id or its unique name.
- The sessions folder is `./sessions`, or what `ARS_WEB_SESSIONS` or `--sessions` says.
- The options of `export` are the HTTP API's with dashes: `frames.step` is `--frames-step`, `split.by` is `--split-by`.
  Only `sessions`, the further sessions to merge, is `--merge`: `--sessions` is the sessions folder everywhere.
"""


def usage(*command: str) -> str:
    """What `ars-web COMMAND --help` prints, 100 columns wide."""
    environment = {**os.environ, "COLUMNS": "100"}
    line = [sys.executable, "-m", "ars_web", *command, "--help"]
    return subprocess.run(line, capture_output=True, text=True, check=True, env=environment).stdout.strip()


def commands(*group: str) -> list[tuple[str, ...]]:
    """All commands below a group, in the order in which its help lists them."""
    _, _, listed = usage(*group).partition("Commands:\n")
    found: list[tuple[str, ...]] = []
    for name in re.findall(r"^  ([\w-]+)", listed, flags=re.MULTILINE):
        found.extend(commands(*group, name) or [(*group, name)])
    return found


def page() -> str:
    """The page as Markdown."""
    sections = [f"## {' '.join(command)}\n\n```text\n{usage(*command)}\n```\n" for command in commands()]
    return "\n".join([INTRODUCTION, *sections])


if __name__ == "__main__":
    sys.stdout.write(page())
