"""The annotations of a picture: title, time, a scale bar, colour bars. By Pillow, in bands above and below the view."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

    from .quantities import Scale


INK, LIGHT = (25, 25, 25), (255, 255, 255)
NAMES = 5  # of filaments, written at a bar
TOP, FOOT = 0.07, 0.13  # heights of the bands, of the picture's


class Words(NamedTuple):
    """The annotations that do not change from one picture of a film to the next."""

    title: str
    bars: tuple[Scale, ...]
    unit: str  # of length
    pixel: float  # its length
    note: str = ""


def bands(height: int) -> tuple[int, int]:
    """Pixels of the band above and of the one below."""
    return round(TOP * height), round(FOOT * height)


def lettered(view: np.ndarray, height: int, words: Words, time: str) -> np.ndarray:
    """The view (h, width, 3) between its bands: a picture (height, width, 3)."""
    from PIL import Image, ImageDraw

    top, _ = bands(height)
    width = view.shape[1]
    page = Image.new("RGB", (width, height), LIGHT)
    page.paste(Image.fromarray(view), (0, top))
    pen = ImageDraw.Draw(page)
    large, small = _font(round(0.034 * height)), _font(round(0.026 * height))
    edge = round(0.02 * width)
    pen.text((width - edge, top // 2), time, INK, large, "rm")
    room = width - 3 * edge - pen.textlength(time, large)
    fitting = _fitting(pen, words.title, height, room)
    pen.text((edge, top // 2), _shortened(pen, words.title, fitting, room), INK, fitting, "lm")
    foot = top + view.shape[0]
    _scale_bar(pen, small, (edge, foot), 0.22 * width, height, words)
    share = (0.72 * width - edge) / max(len(words.bars), 1)
    for i, bar in enumerate(words.bars):
        left = 0.28 * width + i * share
        _colour_bar(page, pen, small, (round(left), foot), round(share - 4 * edge), height, bar)
    for k, line in enumerate(reversed(_lines(pen, words.note, small, width - 2 * edge))):
        at = (width - edge, foot - (0.012 + 0.034 * k) * height)
        left, up, right, low = pen.textbbox(at, line, small, "rb")
        pen.rectangle([(left - 6, up - 4), (right + 6, low + 4)], LIGHT)
        pen.text(at, line, INK, small, "rb")
    return np.asarray(page)


def _lines(pen: ImageDraw, note: str, font: FreeTypeFont, room: float) -> list[str]:
    """A note in lines that fit, a new one where a part of it ends."""
    lines: list[str] = []
    for part in filter(None, note.split("; ")):
        if lines and pen.textlength(f"{lines[-1]}; {part}", font) <= room:
            lines[-1] += f"; {part}"
        else:
            lines.append(part)
    return lines


def _font(size: int) -> FreeTypeFont:
    """The letters that come with matplotlib."""
    from matplotlib.font_manager import findfont
    from PIL import ImageFont

    return ImageFont.truetype(findfont("DejaVu Sans"), size)


def _fitting(pen: ImageDraw, text: str, height: int, room: float) -> FreeTypeFont:
    """Letters small enough for a text, but no smaller than can be read."""
    for size in (0.026, 0.022, 0.019):
        font = _font(round(size * height))
        if pen.textlength(text, font) <= room:
            return font
    return font


def _shortened(pen: ImageDraw, text: str, font: FreeTypeFont, room: float) -> str:
    if pen.textlength(text, font) <= room:
        return text
    while text and pen.textlength(text + " ...", font) > room:
        text = text.rpartition(" ")[0] if " " in text else text[:-1]
    return text + " ..."


def _scale_bar(pen: ImageDraw, font: FreeTypeFont, at: tuple[int, int], room: float, height: int, words: Words) -> None:
    """A bar of 1, 2 or 5 times a power of ten, the longest in the room, with its length."""
    most = 0.8 * room * words.pixel
    power = 10.0 ** np.floor(np.log10(most))
    length = max(k * power for k in (1.0, 2.0, 5.0) if k * power <= most)
    x, y = at[0], at[1] + round(0.04 * height)
    end = x + round(length / words.pixel)
    thick = max(2, height // 240)
    pen.line([(x, y), (end, y)], INK, thick)
    for place in (x, end):
        pen.line([(place, y - 2 * thick), (place, y + 2 * thick)], INK, thick)
    unit = "" if words.unit == "1" else f" {words.unit}"
    pen.text(((x + end) / 2, y + round(0.015 * height)), f"{length:g}{unit}", INK, font, "mt")


def _colour_bar(
    page: Image, pen: ImageDraw, font: FreeTypeFont, at: tuple[int, int], width: int, height: int, bar: Scale
) -> None:
    """A strip of the colours with three numbers under it and its words above."""
    from PIL.Image import fromarray

    from .quantities import colours

    thick = round(0.02 * height)
    x, y = at[0], at[1] + round(0.045 * height)
    row = colours(bar.colours)(np.linspace(0, 1, width))[:, :3]
    page.paste(fromarray(np.tile((255 * row).astype(np.uint8), (thick, 1, 1))), (x, y))
    pen.rectangle([(x, y), (x + width, y + thick)], outline=INK)
    pen.text((x + width / 2, y - round(0.008 * height)), bar.label, INK, font, "mb")
    for share, text in _marks(bar):
        pen.text((x + share * width, y + thick + round(0.008 * height)), text, INK, font, "mt")


def _marks(bar: Scale) -> list[tuple[float, str]]:
    """Places along a bar and their numbers, with a sign at ends that values lie beyond; or names, some of many."""
    if bar.names:
        count = len(bar.names)
        picked = range(count) if count <= NAMES else (0, count - 1)
        return [((k + 0.5) / count, bar.names[k]) for k in picked]
    signs = {0.0: "\u2264 " if bar.below else "", 1.0: "\u2265 " if bar.above else ""}
    return [(share, f"{signs.get(share, '')}{bar.low + share * (bar.high - bar.low):.3g}") for share in (0.0, 0.5, 1.0)]
