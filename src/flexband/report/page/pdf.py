"""A web page as a PDF, printed by a browser without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from flexband.errors import InputError

BROWSERS = (
    "chromium", "chromium-browser", "chromium-headless-shell", "google-chrome",
    "google-chrome-stable", "chrome", "msedge", "microsoft-edge",
)  # fmt: skip
"""Programs that can print a page without a window."""


def print_pdf(page: Path, *, timeout: float = 120.0) -> Path:
    """Print a web page into a PDF beside it; raise `InputError` if that takes too long [s]."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise InputError(
            "a PDF needs Chromium, Chrome or Edge on the PATH; none is there. Open "
            f"'{page}' in a browser and print it"
        )
    file = page.with_suffix(".pdf")
    with tempfile.TemporaryDirectory() as profile:
        printed = Path(profile) / "report.pdf"
        root = ["--no-sandbox"] * (os.name == "posix" and os.geteuid() == 0)
        command = [
            browser, "--headless", *root, "--disable-gpu", f"--user-data-dir={profile}/user",
            "--no-pdf-header-footer", "--virtual-time-budget=30000", f"--print-to-pdf={printed}",
            page.resolve().as_uri(),
        ]  # fmt: skip
        try:
            done = subprocess.run(command, capture_output=True, timeout=timeout, check=False)
        except subprocess.TimeoutExpired:
            raise InputError(f"{browser} has not printed the report within {timeout:g} s") from None
        if not printed.is_file():
            reason = done.stderr.decode(errors="replace").strip().splitlines()
            raise InputError(f"{browser} has printed no PDF: {(reason or ['no reason given'])[-1]}")
        shutil.move(printed, file)
    return file
