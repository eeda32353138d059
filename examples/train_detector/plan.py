"""What the study trains, and on how much: the finding each set belongs to, and the two sizes of the study."""

from dataclasses import dataclass

from examples.train_detector.sets import Shape


@dataclass(frozen=True)
class Configuration:
    """One set to train on.

    Attributes:
        images: of all training scenes together.
        degrees: of azimuth that they are seen from.
        shape: what labels are drawn round.
    """

    images: int
    degrees: int
    shape: Shape = "hull"

    @property
    def name(self) -> str:
        """For folders and figures."""
        return f"{self.images}-of-{self.degrees}-{self.shape}"


@dataclass(frozen=True)
class Study:
    """How large the study is.

    Attributes:
        name: which of the two.
        size: of the rendered images.
        trained_size: that images are scaled to for the network.
        around, sector: views of each training scene from 360 and from 180 degrees.
        tested: views of the test scene.
        iterations: steps of each training.
        more: by number of images, all from 360 degrees with hull labels.
        fewer_around, more_in_sector: that are compared for the second finding.
        boxes: beside its hull twin for the third.
        seeds: trainings of each.
    """

    name: str
    size: tuple[int, int]
    trained_size: tuple[int, int]
    around: int
    sector: int
    tested: int
    iterations: int
    more: tuple[Configuration, ...]
    fewer_around: Configuration
    more_in_sector: Configuration
    boxes: Configuration
    seeds: int

    @property
    def hulls(self) -> Configuration:
        """The twin of `boxes`."""
        return Configuration(self.boxes.images, self.boxes.degrees, "hull")

    @property
    def configurations(self) -> tuple[Configuration, ...]:
        """All of them, each once."""
        wanted = (*self.more, self.fewer_around, self.more_in_sector, self.boxes, self.hulls)
        return tuple(dict.fromkeys(wanted))


SCENES = 2
"""That are filmed for training; a third is for the test."""

FULL = Study(
    name="full",
    size=(256, 192),
    trained_size=(128, 96),
    around=450,
    sector=250,
    tested=150,
    iterations=400,
    more=tuple(Configuration(n, 360) for n in (30, 100, 300, 900)),
    fewer_around=Configuration(300, 360),
    more_in_sector=Configuration(500, 180),
    boxes=Configuration(300, 360, "box"),
    seeds=2,
)

QUICK = Study(
    name="quick",
    size=(256, 192),
    trained_size=(128, 96),
    around=60,
    sector=100,
    tested=50,
    iterations=150,
    more=tuple(Configuration(n, 360) for n in (20, 120)),
    fewer_around=Configuration(120, 360),
    more_in_sector=Configuration(200, 180),
    boxes=Configuration(120, 360, "box"),
    seeds=1,
)


def frames_of(configuration: Configuration, study: Study) -> range:
    """Which frames of each scene a set is made of: the first of those from 360 degrees, or of those from 180, which
    come after them in the recording."""
    first = 0 if configuration.degrees == 360 else study.around
    return range(first, first + configuration.images // SCENES)
