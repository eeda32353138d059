"""A small detector: four levels of plain convolutions, the upper two joined again on a grid of a quarter of the image.

106,000 weights. It needs no anchors and no pretrained backbone; `targets.py` says what its planes mean.
"""

import pickle
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from ars_web.errors import BadFile
from examples.train_detector.targets import STRIDE

RARE = 0.05
"""What the heat is before any training: most cells are no object's middle (Lin et al. 2017)."""


def _block(inputs: int, outputs: int, *, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class Detector(nn.Module):
    """From images (n, 3, height, width), values within -1 and 1, to heat before the sigmoid (n, c, h, w) and sides in
    pixels (n, 4, h, w)."""

    def __init__(self, class_count: int, *, width: int = 12) -> None:
        super().__init__()
        w = width
        self.fine = nn.Sequential(_block(3, w, stride=2), _block(w, 2 * w, stride=2))
        self.middle = nn.Sequential(_block(2 * w, 4 * w, stride=2), _block(4 * w, 4 * w))
        self.coarse = nn.Sequential(_block(4 * w, 4 * w, stride=2), _block(4 * w, 4 * w), _block(4 * w, 4 * w))
        self.from_fine = nn.Conv2d(2 * w, 2 * w, 1)
        self.from_middle = nn.Conv2d(4 * w, 2 * w, 1)
        self.from_coarse = nn.Conv2d(4 * w, 4 * w, 1)
        self.joined = _block(2 * w, 2 * w)
        self.heat = nn.Conv2d(2 * w, class_count, 1)
        self.sides = nn.Conv2d(2 * w, 4, 1)
        nn.init.constant_(self.heat.bias, -torch.log(torch.tensor(1 / RARE - 1)).item())
        nn.init.constant_(self.sides.bias, 1.0)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        fine = self.fine(images)
        middle = self.middle(fine)
        coarse = self.coarse(middle)
        middle = middle + functional.interpolate(self.from_coarse(coarse), size=middle.shape[-2:])
        joined = self.joined(
            self.from_fine(fine) + functional.interpolate(self.from_middle(middle), size=fine.shape[-2:])
        )
        # Of STRIDE pixels each, so that what is learnt is near 1; bounded, since an early step can be wild.
        return self.heat(joined), STRIDE * torch.exp(self.sides(joined).clamp(-4, 5))


def heat_loss(logits: Tensor, heat: Tensor) -> Tensor:
    """The focal loss of CenterNet (Zhou et al. 2019, equation 1), an object."""
    said = torch.sigmoid(logits).clamp(1e-5, 1 - 1e-5)
    is_middle = heat == 1
    right = torch.log(said) * (1 - said) ** 2 * is_middle
    wrong = torch.log(1 - said) * said**2 * (1 - heat) ** 4 * ~is_middle
    return -(right.sum() + wrong.sum()) / is_middle.sum().clamp(min=1)


def sides_loss(said: Tensor, sides: Tensor, weights: Tensor) -> Tensor:
    """1 - GIoU (Rezatofighi et al. 2019) of the boxes said in each cell with those meant, by weight."""
    shared = (torch.minimum(said[:, :2], sides[:, :2]) + torch.minimum(said[:, 2:], sides[:, 2:])).clamp(min=0).prod(1)
    hull = (torch.maximum(said[:, :2], sides[:, :2]) + torch.maximum(said[:, 2:], sides[:, 2:])).clamp(min=0).prod(1)
    area = (said[:, :2] + said[:, 2:]).prod(1) + (sides[:, :2] + sides[:, 2:]).prod(1) - shared
    giou = shared / area.clamp(min=1e-6) - (hull - area) / hull.clamp(min=1e-6)
    return ((1 - giou) * weights).sum() / weights.sum().clamp(min=1)


def save(detector: Detector, file: Path, *, class_names: tuple[str, ...], size: tuple[int, int]) -> None:
    """Write the weights, with the classes and the size of images that they are for."""
    file.parent.mkdir(parents=True, exist_ok=True)
    torch.save({"weights": detector.state_dict(), "classes": list(class_names), "size": list(size)}, file)


def load(file: Path) -> tuple[Detector, tuple[str, ...], tuple[int, int]]:
    """A detector, its classes, and the size of images that it was trained on; nothing but numbers is unpickled.

    Raises:
        BadFile: it is no file that `save` wrote.
    """
    try:
        content = torch.load(file, weights_only=True)
        names, (width, height) = tuple(content["classes"]), content["size"]
        detector = Detector(len(names))
        detector.load_state_dict(content["weights"])
    except (OSError, KeyError, TypeError, ValueError, RuntimeError, EOFError, pickle.UnpicklingError) as error:
        raise BadFile(file, f"holds no weights of this detector: {error}") from error
    return detector.to(memory_format=torch.channels_last).eval(), names, (width, height)
