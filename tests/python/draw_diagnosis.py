"""Draws the first screen of a report and its first figures: tools/docs/diagnosis.png.

Run: draw_diagnosis.py REPORT PNG
"""

from __future__ import annotations

import base64
import io
import sys
from pathlib import Path

from PIL import Image
from test_report_browser import LAPTOP, Browser


def main(page: Path, path: Path) -> None:
    """A picture of the page down to the end of its first pair of figures."""
    browser = Browser()
    try:
        browser.open(page.resolve())
        place = "document.querySelector('.pair').getBoundingClientRect()"
        end = float(browser.do(f"return {place}.bottom + scrollY"))
        clip = {"x": 0, "y": 0, "width": LAPTOP[0], "height": end, "scale": 1}
        told = {"captureBeyondViewport": True, "format": "png", "clip": clip}
        shot = browser.driver.execute_cdp_cmd("Page.captureScreenshot", told)
    finally:
        browser.driver.quit()
    picture = Image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("RGB")
    picture.quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
