"""What the study found: its figures as JSON, its curves, and the report."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from examples.train_detector.plan import Configuration, Study
from examples.train_detector.scores import Scores


@dataclass(frozen=True)
class Run:
    """One training.

    Attributes:
        configuration, seed: of what.
        labels: that it trained on.
        scores: in the test.
        seconds, processor_seconds: that training and test took.
    """

    configuration: Configuration
    seed: int
    labels: int
    scores: Scores
    seconds: float
    processor_seconds: float

    def write(self, file: Path) -> None:
        """As JSON, whole or not at all."""
        partial = file.with_suffix(".partial")
        partial.write_text(json.dumps(asdict(self), indent=1))
        partial.rename(file)

    @classmethod
    def read(cls, file: Path) -> "Run":
        """What `write` wrote."""
        told = json.loads(file.read_bytes())
        scores = told["scores"]
        return cls(
            **{
                **told,
                "configuration": Configuration(**told["configuration"]),
                "scores": Scores(**{**scores, "precision50": tuple(scores["precision50"])}),
            }
        )


@dataclass(frozen=True)
class Figures:
    """All that was found.

    Attributes:
        study: what was asked.
        tightness: of the labels of each shape, mean IoU with the true boxes.
        runs: every training.
    """

    study: Study
    tightness: dict[str, float]
    runs: tuple[Run, ...]


def write_findings(figures: Figures, out: Path) -> Sequence[Path]:
    """Write figures.json."""
    file = out / "figures.json"
    file.write_text(json.dumps(asdict(figures), indent=1))
    return [file]
