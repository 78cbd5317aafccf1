"""Pages in a real browser: Debian's Chromium, without a window."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


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
    contexts, complaints = [], []

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
def opened(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file in a page of its own."""
    with opening(chromium) as open_file:
        yield open_file


@pytest.fixture(scope="module")
def shared(chromium: Browser) -> Iterator[Callable[[Path], Page]]:
    """Open a file once for all tests of a module that do not mind what others did in the page."""
    with opening(chromium) as open_file:
        yield cache(open_file)
