"""The page of a report in a browser."""

import io

import numpy as np
import pytest
from browsers import watched_page
from PIL import Image


def test_the_page_works_in_a_browser_without_a_network(pushes_report, chromium):
    with watched_page(chromium) as (page, wrong):
        page.context.set_offline(True)
        page.goto((pushes_report / "report.html").as_uri())
        assert all(page.evaluate("[...document.images].map((one) => one.naturalWidth > 0)"))
        shown = page.locator("#along img:visible")
        before = shown.get_attribute("alt")
        page.locator("#select-along").select_option(index=3)
        assert shown.count() == 1 and shown.get_attribute("alt") != before
        assert page.locator("#roc img:visible").count() == 1
        assert wrong == []


def test_without_scripts_all_pictures_are_shown(pushes_report, chromium):
    page = chromium.new_context(java_script_enabled=False).new_page()
    page.goto((pushes_report / "report.html").as_uri())
    assert page.locator("#along img:visible").count() == page.locator("#along img").count() == 12


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_page_shows_that_a_table_goes_on_and_pictures_are_framed(
    pushes_report, chromium, scheme
):
    def edge():
        """Brightness near the right edge of the table, of most of its rows."""
        with Image.open(io.BytesIO(table.screenshot())) as image:
            return np.median(np.asarray(image.convert("L"))[:, -4].astype(float))

    with watched_page(chromium, (500, 900)) as (page, _):
        page.emulate_media(color_scheme=scheme)
        page.goto((pushes_report / "report.html").as_uri())
        table = page.locator("#tables .scroll").first
        goes_on = edge()
        table.evaluate("one => one.scrollLeft = one.scrollWidth")
        assert abs(goes_on - edge()) > 20
        card, image = (page.locator(one).first.bounding_box() for one in (".card", ".card img"))
        assert card["x"] + 5 < image["x"]
        assert image["x"] + image["width"] + 5 < card["x"] + card["width"]
