"""A segmenter whose weights a user supplies, as an ONNX file that OpenCV reads.

What the network must be: one input, 1 x 3 x 320 x 320 float32, the part of the photograph round the prompt as red,
green, blue, each value / 255, less ImageNet's mean (0.485, 0.456, 0.406) and divided by its deviation (0.229, 0.224,
0.225); its first output, 1 x 1 x h x w float32, how likely each pixel is the object, 0 to 1, at any resolution. That is
what networks for salient objects have, U-2-Net and IS-Net among them, as far as they are exported for that size.

The prompt is told to the network by the part alone that it is shown. Strokes are kept to afterwards: what lies under
one on the object is the object, and under one beside it is not.
"""

import threading
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from ars_web.errors import BadFile
from ars_web.masks.grab_cut import without_flecks
from ars_web.masks.prompt_part import prompt_part
from ars_web.masks.segmenter import SegmentPrompt

SIDE = 320
"""Pixels of the network's input."""

MEAN = np.array([0.485, 0.456, 0.406])
DEVIATION = np.array([0.229, 0.224, 0.225])

INSIDE = 0.5
"""How likely a pixel of the object is at least."""


class OnnxSegmenter:
    """A network read from a file; for any number of threads, one at a time."""

    def __init__(self, path: Path) -> None:
        """Raises BadFile for a file that is missing or holds no such network: it is tried once."""
        self._path = path
        self._lock = threading.Lock()
        if not path.is_file():
            raise BadFile(path, "there is no such file; name the segmenter's ONNX file")
        try:
            self._network = cv2.dnn.readNetFromONNX(str(path))
        except cv2.error as error:
            raise BadFile(path, f"OpenCV cannot read it as an ONNX network: {error.err}") from error
        self._likely(np.zeros((SIDE, SIDE, 3), dtype=np.uint8))

    def segment(self, image: UInt8[np.ndarray, "h w 3"], prompt: SegmentPrompt) -> Bool[np.ndarray, "h w"]:
        """As `Segmenter.segment`."""
        height, width = image.shape[:2]
        part = prompt_part(prompt, width=width, height=height, longest_side=SIDE, square=True)
        found = (self._likely(part.of(image)) >= INSIDE) & part.within_reach
        on_object = np.zeros_like(found)
        for drawn in prompt.inside:
            on_object |= part.painted(drawn)
        found |= on_object
        for drawn in prompt.outside:
            found &= ~part.painted(drawn)
        return part.in_photograph(without_flecks(found, kept=on_object & found), width=width, height=height)

    def _likely(self, part: UInt8[np.ndarray, "320 320 3"]) -> Float32[np.ndarray, "320 320"]:
        """How likely each pixel is the object."""
        normal: Float[np.ndarray, "320 320 3"] = (part[..., ::-1] / 255.0 - MEAN) / DEVIATION
        blob = np.ascontiguousarray(normal.transpose(2, 0, 1)[None], dtype=np.float32)
        try:
            with self._lock:
                self._network.setInput(blob)
                # The first of several outputs is the finest.
                outputs = self._network.forward(self._network.getUnconnectedOutLayersNames()[:1])
        except cv2.error as error:
            raise BadFile(
                self._path, f"the network does not take a 1 x 3 x {SIDE} x {SIDE} input: {error.err}"
            ) from error
        output = np.asarray(outputs[0])
        if output.ndim != 4 or output.shape[:2] != (1, 1) or not np.isfinite(output).all():
            raise BadFile(self._path, f"the network's first output must be 1 x 1 x h x w, not {list(output.shape)}")
        return cv2.resize(output[0, 0], (SIDE, SIDE), interpolation=cv2.INTER_LINEAR)
