"""What an object's colours are, and those beside it: mixtures learnt where the truth is known, used where it is not.

OpenCV's GrabCut learns the mixtures of colours, five each, and cuts by them; here the two steps are apart, so that
what was learnt from one photograph can cut another.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

MOST_PIXELS = 4000
"""Of the object, and of what is beside it, that a mixture is learnt from: more do not change it."""

_COLUMNS = 64


@dataclass(frozen=True, eq=False)
class ColourModels:
    """Two mixtures of five Gaussians, as OpenCV's `grabCut` keeps them."""

    background: Float[np.ndarray, "1 65"]
    foreground: Float[np.ndarray, "1 65"]

    @classmethod
    def learnt(
        cls, foreground: UInt8[np.ndarray, "n 3"], background: UInt8[np.ndarray, "m 3"], *, seed: int = 0
    ) -> "ColourModels":
        """The mixtures of pixels of an object and of pixels beside it; at least one of each. The same pixels and seed
        give the same."""
        rng = np.random.default_rng(seed)
        inside, outside = _strip(foreground, rng), _strip(background, rng)
        trimap = np.full((len(inside) + len(outside), _COLUMNS), cv2.GC_BGD, dtype=np.uint8)
        trimap[: len(inside)] = cv2.GC_FGD
        models = cls(np.zeros((1, 65)), np.zeros((1, 65)))
        # Its clusters begin from random centres.
        cv2.setRNGSeed(seed)
        strips = np.ascontiguousarray(np.concatenate([inside, outside]))
        # All is known: what it does beside learning has nothing to decide.
        cv2.grabCut(strips, trimap, (0, 0, 1, 1), models.background, models.foreground, 2, cv2.GC_INIT_WITH_MASK)
        return models

    def cut(self, lab: UInt8[np.ndarray, "h w 3"], possible: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
        """The object's pixels among those that are possible: the cut that fits both mixtures and the edges best."""
        trimap = np.where(possible, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
        # It takes the mixtures as they are, and writes them back the same.
        background, foreground = self.background.copy(), self.foreground.copy()
        cv2.grabCut(lab, trimap, (0, 0, 1, 1), background, foreground, 1, cv2.GC_EVAL_FREEZE_MODEL)
        return trimap == cv2.GC_PR_FGD


def _strip(pixels: UInt8[np.ndarray, "n 3"], rng: np.random.Generator) -> UInt8[np.ndarray, "r 64 3"]:
    """Some of the pixels as rows of an image; few are repeated until they fill one."""
    chosen = pixels[rng.permutation(len(pixels))[:MOST_PIXELS]]
    rows = max(1, len(chosen) // _COLUMNS)
    return np.resize(chosen, (rows, _COLUMNS, 3))
