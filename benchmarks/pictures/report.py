"""The picture of a report in the documentation: what a browser shows of the main example's."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "images" / "report.png"
WIDTH = 1100
HEIGHT = 1946


def main() -> None:
    """Run the study and take the picture."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        sys.exit("Chromium is required: install Debian's package chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        study = "examples/slider_crank.py"
        run = ["-m", "flexband", "run", study, "--output", folder]
        subprocess.run([sys.executable, *run], cwd=ROOT, check=True)
        chromium = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto((Path(folder) / "report.html").as_uri())
        page.locator("svg.main-svg").first.wait_for()
        page.wait_for_timeout(500)
        page.screenshot(path=PICTURE)
        chromium.close()
    print(PICTURE)


if __name__ == "__main__":
    main()
