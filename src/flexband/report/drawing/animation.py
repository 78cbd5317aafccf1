"""An animation: the content of a GIF or MP4 file, which notebooks show."""

from __future__ import annotations

import shutil
import subprocess
from base64 import b64encode
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from itertools import chain
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from flexband.basics.checks import check_instance
from flexband.basics.files import replace_file
from flexband.errors import InputError
from flexband.report.drawing.canvas import COLORS

MOST_PICTURES_PER_SECOND = {".gif": 50.0, ".mp4": 240.0}
"""Suffix of a file -> how many pictures it can show in a second."""


@dataclass(frozen=True)
class Animation:
    """Moving pictures, which notebooks show.

    Attributes
    ----------
    content : that of a GIF or MP4 file.
    suffix : ".gif" or ".mp4".
    times : simulated times of the pictures [s], shape (pictures,).
    """

    content: bytes = field(repr=False)
    suffix: str
    times: np.ndarray = field(repr=False)

    def save(self, file: str | PathLike[str]) -> None:
        """Write the animation to a file of its suffix, complete or not at all.

        Raises
        ------
        InputError
            If the file has another suffix.
        """
        path = checked_file(file)
        if path.suffix.lower() != self.suffix:
            raise InputError(f"file must end in {self.suffix}, as it is made; got {path.name!r}")
        with replace_file(path) as partial:
            partial.write_bytes(self.content)

    def _repr_html_(self) -> str:
        """Return the animation for notebooks."""
        text = b64encode(self.content).decode()
        if self.suffix == ".gif":
            return f'<img alt="animation" src="data:image/gif;base64,{text}">'
        return f'<video controls loop src="data:video/mp4;base64,{text}"></video>'


def checked_file(file: object) -> Path:
    """Return the path of an animation's file; raise `InputError` if it cannot be written."""
    check_instance("file", file, str | PathLike, "a path that ends in .gif or .mp4")
    path = Path(file)  # type: ignore[arg-type]
    suffix = path.suffix.lower()
    if suffix not in MOST_PICTURES_PER_SECOND:
        raise InputError(f"file must end in .gif or .mp4; got {path.name!r}")
    if suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError(
            f"file {path.name!r} is written by ffmpeg, which is not installed: "
            "install ffmpeg, or write a .gif file"
        )
    return path


def gif(pictures: Iterator[np.ndarray], count: int, fps: float) -> bytes:
    """Return the content of a GIF file that repeats itself."""
    first = next(pictures)
    palette = _palette(first)
    frames = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in chain([first], pictures)
    )
    ends = np.round(100.0 * np.arange(count + 1) / fps)  # whole hundredths of a second
    content = BytesIO()
    next(frames).save(
        content, "GIF", save_all=True, append_images=frames, loop=0, optimize=False,
        duration=(10 * np.diff(ends).astype(int)).tolist(),
    )  # fmt: skip
    return content.getvalue()


def _palette(picture: np.ndarray) -> Image.Image:
    """Return the colours of all pictures: those of shapes, and the most frequent shades of one."""
    distinct = 16  # difference of two shades that are told apart
    shapes = np.array([to_rgb(color) for color in COLORS.values() if color != "none"])
    shapes = np.round(255 * np.concatenate([shapes, 0.6 + 0.4 * shapes])).astype(int)
    shades, counts = np.unique(picture.reshape(-1, 3) // distinct, axis=0, return_counts=True)
    frequent = distinct * shades[np.argsort(-counts)] + distinct // 2
    apart = np.abs(frequent[:, None] - shapes).max(axis=2).min(axis=1) >= distinct
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate([shapes, frequent[apart]])[:256].ravel().tolist())
    return palette


def mp4(pictures: Iterator[np.ndarray], fps: float) -> bytes:
    """Return the content of an MP4 file, which ffmpeg makes."""
    first = next(pictures)
    height, width, _ = first.shape
    with (
        TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        (Path(folder) / "messages").open("w+b") as messages,
    ):
        file = Path(folder) / "animation.mp4"
        raw = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {fps:.6f} -i -".split()
        # Players need this format of pixels, and the index at the beginning.
        encoding = ["-pix_fmt", "yuv420p", "-movflags", "+faststart"]
        process = subprocess.Popen(
            ["ffmpeg", "-loglevel", "error", "-y", *raw, *encoding, str(file)],
            stdin=subprocess.PIPE, stdout=messages, stderr=messages,
        )  # fmt: skip
        pipe = process.stdin
        assert pipe is not None
        try:
            with suppress(BrokenPipeError), pipe:  # its messages say why
                for picture in chain([first], pictures):
                    pipe.write(picture.tobytes())
            process.wait()
        finally:
            process.kill()  # if the drawing is interrupted
            process.wait()
        if process.returncode or not file.exists():
            messages.seek(0)
            reason = messages.read().decode(errors="replace").strip()
            raise InputError(f"ffmpeg has not made the animation: {reason or 'it says nothing'}")
        return file.read_bytes()
