"""A scanned page: how bright each dot is, and how far apart the dots lie."""

from __future__ import annotations

import io
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.files import read_bytes
from truearm.limits import LIMITS, refuse_beyond
from truearm.units import to_si

if TYPE_CHECKING:
    from PIL.Image import Image

_FORMATS: Final = ("PNG", "JPEG", "TIFF")
#: Dots per inch that scanners have. Programs write 72 or 96 where they do not know.
_RESOLUTIONS: Final = (100.0, 4800.0)
#: Shortest edge of a page [m].
_SHORTEST_EDGE: Final = 0.02
_TURNED: Final = (5, 6, 7, 8)  # EXIF orientations in which rows and columns are exchanged


@dataclass(frozen=True, eq=False)
class Page:
    """A page as it was scanned."""

    source: str  #: The file.
    brightness: NDArray[np.uint8]  #: 0 black to 255 white, ``(rows, columns)``, the uppermost row first.
    pitch: tuple[float, float]  #: Distance of dots along x and y [m].

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        rows, columns = self.brightness.shape
        return columns * self.pitch[0], rows * self.pitch[1]


def read_page(path: Path, dpi: float | tuple[float, float] | None = None) -> Page:
    """Read a PNG, JPEG or TIFF of one page.

    Args:
        dpi: Dots per inch, along x and y if they differ; what the file says if None.

    Raises:
        InputError: If the file is no such image, damaged, of several pages, too large or too small, or if nothing says
            its resolution or that is none of a scanner's (100 to 4800).
    """
    image, declared = _opened(path)
    given = declared if dpi is None else (dpi if isinstance(dpi, tuple) else (dpi, dpi))
    if given is None:
        raise InputError(
            "the file does not say its resolution",
            where=str(path),
            cure="Give the dots per inch of the scan, `dpi`, or scan again and keep the file as the scanner wrote it.",
        )
    if not all(math.isfinite(value) and _RESOLUTIONS[0] <= value <= _RESOLUTIONS[1] for value in given):
        raise InputError(
            "this is no resolution of a scan",
            parameter=None if dpi is None else "dpi",
            where=str(path) if dpi is None else None,
            came=" x ".join(f"{value:g} dpi" for value in given),
            allowed=f"{_RESOLUTIONS[0]:g} to {_RESOLUTIONS[1]:g} dots per inch",
            cure="Give the dots per inch of the scan, `dpi`." if dpi is None else "Scan at 300 dpi.",
        )
    inch = to_si(1.0, "in")
    page = Page(source=str(path), brightness=_brightness(image, path), pitch=(inch / given[0], inch / given[1]))
    if min(page.size) < _SHORTEST_EDGE:
        raise InputError(
            "the page is too small",
            where=str(path),
            came=" x ".join(f"{1e3 * edge:.1f} mm" for edge in page.size),
            allowed=f"{1e3 * _SHORTEST_EDGE:g} mm or more",
            cure="Check the resolution, or scan the whole page.",
        )
    return page


def _opened(path: Path) -> tuple[Image, tuple[float, float] | None]:
    """Return the image, upright, and the resolution along x and y that its file declares."""
    from PIL import Image, ImageOps

    content = read_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there are many dots is refused below, by the same count
            image = Image.open(io.BytesIO(content), formats=_FORMATS)
            refuse_beyond("pixels", image.width * image.height, where=str(path))
            pages = getattr(image, "n_frames", 1)
            image.load()
            orientation = image.getexif().get(0x0112, 1)
            declared = image.info.get("dpi")
            upright = ImageOps.exif_transpose(image)
    except InputError:
        raise
    except Image.DecompressionBombError as error:  # beyond twice Pillow's own limit, whatever ours is
        raise InputError(
            f"the image has more than {2 * (Image.MAX_IMAGE_PIXELS or 0) / 1e6:.0f} million dots",
            where=str(path),
            cure=LIMITS["pixels"].cure,
        ) from error
    except Exception as error:  # Pillow's decoders fail in many ways on damaged files
        raise InputError(
            "the file is no image that can be read, or it is damaged",
            where=str(path),
            allowed=", ".join(_FORMATS),
            cure="Scan again and save the page in one of these formats.",
        ) from error
    if pages > 1:
        raise InputError("the file has several pages", where=str(path), came=pages, cure="Save the page on its own.")
    if declared is None:
        return upright, None
    x, y = (float(value) for value in declared)
    return upright, (y, x) if orientation in _TURNED else (x, y)


def _brightness(image: Image, path: Path) -> NDArray[np.uint8]:
    from PIL import Image

    if image.mode.startswith("I;16"):  # Pillow would clip at 255
        return np.asarray(np.asarray(image) // 257, dtype=np.uint8)
    if image.mode in ("I", "F", "LAB"):
        raise InputError(
            "this kind of image holds no brightness that can be read",
            where=str(path),
            came=f"mode {image.mode}",
            cure="Scan in grey or colour, 8 bits.",
        )
    if image.has_transparency_data:
        seen = image if image.mode in ("RGBA", "LA") else image.convert("RGBA")
        page = Image.new("L", image.size, 255)
        page.paste(seen.convert("L"), mask=seen.getchannel("A"))
        return np.asarray(page)
    return np.asarray(image.convert("L"))
