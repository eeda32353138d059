"""Pictures of a report as JPEG."""

import cv2
import numpy as np
from jaxtyping import UInt8

_QUALITY = [cv2.IMWRITE_JPEG_QUALITY, 80]


def jpeg(picture: UInt8[np.ndarray, "h w 3"], *, longest: int | None = None) -> bytes:
    """A picture (BGR), made smaller where its longer side has more than so many pixels."""
    scale = 1.0 if longest is None else longest / max(picture.shape[:2])
    if scale < 1.0:
        height, width = (max(1, round(scale * side)) for side in picture.shape[:2])
        picture = np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    ok, content = cv2.imencode(".jpg", picture, _QUALITY)
    assert ok, "OpenCV cannot encode JPEG"
    return content.tobytes()
