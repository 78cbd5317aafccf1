"""Pages in a real browser: Debian's Chromium, whose headless shell draws nothing but the page."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

COMMANDS = "chromium-headless-shell", "chromium", "chromium-browser"
CHROMIUM = next(filter(None, map(shutil.which, COMMANDS)), None)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def opening(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open files; afterwards, refuse errors in the console and requests to the outside."""
    contexts = []
    complaints = []

    def open_file(file: Path, **options: object) -> Page:
        context = chromium.new_context(**options)  # pyright: ignore[reportArgumentType]
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        outside = ("http:", "https:", "ws:", "wss:")
        page.on("request", lambda r: complaints.append(r.url) if r.url.startswith(outside) else 0)
        page.goto(file.as_uri())
        return page

    yield open_file
    for context in contexts:
        context.close()
    assert not complaints


@pytest.fixture
def open_page(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file in a page of its own."""
    with opening(chromium) as open_file:
        yield open_file


@pytest.fixture(scope="module")
def shared_page(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file once per size for all tests that do not mind what others did in the page."""
    with opening(chromium) as open_file:

        @cache
        def open_once(file: Path, width: int = 1280, height: int = 900, scheme: str = "light"):
            size = {"width": width, "height": height}
            return open_file(file, viewport=size, color_scheme=scheme)

        yield open_once
