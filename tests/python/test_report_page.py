"""The page of a report in a browser."""

import io
import json
import re

import pytest
from browsers import watched_page
from PIL import Image


def test_the_page_works_in_a_browser_without_a_network(pushes_report, chromium):
    with watched_page(chromium) as (page, wrong):
        page.context.set_offline(True)
        page.goto((pushes_report / "report.html").as_uri())
        page.wait_for_selector("#along .main-svg")
        assert page.locator(".plot .main-svg").count() >= 3 * page.locator(".plot").count()
        assert all(page.evaluate("[...document.images].map((one) => one.naturalWidth > 0)"))

        curve = "document.querySelector('#along .trace.scatter path.js-line').getAttribute('d')"
        before = page.evaluate(curve)
        page.locator("#select-along").select_option(index=3)
        page.wait_for_function(f"{curve} !== {json.dumps(before)}")

        mark = page.locator("#along .trace.scatter .point").first
        mark.scroll_into_view_if_needed()
        box = mark.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2 + 30, box["y"] + 40)
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.wait_for_selector("#along .hoverlayer .hovertext")
        said = page.locator("#along .hoverlayer").text_content()
        assert re.search(r"frame \d", said) and "captured" in said
        assert wrong == []


def boxes_apart(page, one, other):
    a, b = (page.locator(of).first.bounding_box() for of in (one, other))
    return a["y"] + a["height"] <= b["y"] or b["y"] + b["height"] <= a["y"]


@pytest.mark.parametrize("width", [1400, 500])
def test_the_tool_bar_is_beside_the_legend_and_no_tip_covers_a_picture(
    pushes_report, chromium, width
):
    with watched_page(chromium, (width, 900)) as (page, wrong):
        page.goto((pushes_report / "report.html").as_uri())
        page.locator("#roc").hover()
        page.wait_for_selector("#roc .modebar--hover .modebar-btn", state="visible")
        for name in ("roc", "pr", "along", "histogram-0"):
            assert boxes_apart(page, f"#{name} .modebar", f"#{name} .legend")
            assert boxes_apart(page, f"#{name} .legend", f"#{name} .nsewdrag")
        assert page.locator("#roc .modebar-btn").count() == 4
        page.locator("#roc .legendtoggle").first.click()
        page.wait_for_function("document.querySelector('#roc').data[0].visible === 'legendonly'")
        assert page.locator(".plotly-notifier .notifier-note").count() == 0
        assert wrong == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_page_shows_that_a_table_goes_on_and_pictures_are_framed(
    pushes_report, chromium, scheme
):
    def edge():
        """Brightness of the right edge of the table, between two of its rows."""
        with Image.open(io.BytesIO(table.screenshot())) as image:
            return image.convert("L").getpixel((image.width - 1, image.height // 2 + 3))

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
