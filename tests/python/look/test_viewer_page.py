"""A page of the viewer in a real browser: Chromium, without a window, and without a network."""

import io
from contextlib import contextmanager

import numpy as np
import pytest
from browsers import watched_page
from command_line import run
from futures import carried
from PIL import Image

import energymargin as em
from energymargin.look.viewer import view

PATIENCE = 60e3  # ms; a busy machine draws a frame in seconds


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Files: a push with two frames, a plan with a horizon."""
    folder = tmp_path_factory.mktemp("pages")
    dataset = em.datasets.generate("push", trajectories=3, frames=5, seed=1)
    view(dataset, trajectory=2, frame=1, every=4, nodes=150).save(folder / "push.html")
    view(carried(), nodes=40).save(folder / "carried.html")
    return folder


@contextmanager
def opened(chromium, path):
    """A page that had no error when it closes, and asked nothing of the network."""
    with watched_page(chromium, (900, 500)) as (page, wrong):
        page.set_default_timeout(PATIENCE)
        page.context.set_offline(True)
        page.goto(path.as_uri())
        yield page
        assert wrong == []


def picture(page):
    """The scene, shape (height, width, 3)."""
    shot = page.locator("#picture").screenshot(timeout=PATIENCE)
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def changed(one, other):
    """The number of pixels that are not alike."""
    return int((np.abs(one - other).max(axis=2) > 24).sum())


def move(page, share):
    """Moves the slider of moments to a share of its length."""
    page.locator("#moment").evaluate(
        "(one, share) => { one.value = Math.round(share * one.max);"
        " one.dispatchEvent(new Event('input')); }",
        share,
    )


def test_it_turns_under_the_mouse_and_back(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        before, box = picture(page), page.locator("canvas").bounding_box()
        assert len(np.unique(before.reshape(-1, 3), axis=0)) > 50  # it is a picture
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        for way in (120, -120):
            page.mouse.move(*middle)
            page.mouse.down()
            page.mouse.move(middle[0] + way, middle[1])
            page.mouse.up()
            turned = picture(page)
            if way > 0:
                assert changed(before, turned) > 2000
        assert changed(before, turned) < 0.02 * before[..., 0].size


def test_it_plays_the_escape_to_its_end(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        page.locator("#track").select_option("escape")
        before = picture(page)
        page.get_by_role("button", name="Play").click()
        last = page.locator("#moment").get_attribute("max")
        page.wait_for_function(f"document.getElementById('moment').value === '{last}'")
        page.get_by_role("button", name="Play").wait_for()  # it has ended
        assert changed(before, picture(page)) > 500
        move(page, 0.0)
        assert changed(before, picture(page)) == 0


def test_a_move_by_hand_stops_what_is_played(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        page.evaluate("track().times.forEach((t, k, all) => { all[k] = 1e6 * t; })")
        page.get_by_role("button", name="Play").click()
        page.get_by_role("button", name="Stop").wait_for()
        move(page, 0.0)
        page.get_by_role("button", name="Play").wait_for()
        assert page.locator("#moment").input_value() == "0"


def test_the_tree_grows_with_its_nodes(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        page.locator("#track").select_option("growth of the tree")
        assert page.locator("#caption").inner_text() == "node 150"
        whole = picture(page)
        move(page, 0.0)
        assert page.locator("#caption").inner_text() == "node 1"
        assert changed(whole, picture(page)) > 200


def test_what_is_not_wanted_goes_and_comes_back(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        whole = picture(page)
        for name in ("nodes", "edges", "capture set", "objects"):
            page.get_by_label(name, exact=True).uncheck()
            assert changed(whole, picture(page)) > 50, name
            page.get_by_label(name, exact=True).check()
            assert changed(whole, picture(page)) == 0, name


def test_another_frame_is_chosen_from_the_list(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        first, before = page.locator("#shot").input_value(), picture(page)
        assert first == "1" and page.locator("#shot option").count() == 3
        page.locator("#shot").select_option("0")
        page.get_by_text("t = 0.00 s", exact=True).first.wait_for()
        assert changed(before, picture(page)) > 500
        page.locator("#shot").select_option(first)
        assert changed(before, picture(page)) == 0


def test_the_future_is_played_and_is_marked_where_it_leaves(pages, chromium):
    with opened(chromium, pages / "carried.html") as page:
        page.get_by_text("undisturbed it leaves at 0.35 s").wait_for()
        page.locator("#track").select_option("undisturbed future")
        before = picture(page)
        move(page, 1.0)
        assert page.locator("#caption").inner_text() == "0.60 s ahead"
        assert changed(before, picture(page)) > 200  # pusher and box are elsewhere


def test_a_narrow_page_has_its_words_below(pages, chromium):
    with opened(chromium, pages / "push.html") as page:
        page.set_viewport_size({"width": 420, "height": 800})
        scene, words = (page.locator(one).bounding_box() for one in ("#picture", "#words"))
        assert words["y"] >= scene["y"] + scene["height"]
        assert scene["width"] == pytest.approx(420, abs=20)


def test_what_a_page_plays_is_a_picture_that_moves(tmp_path):
    """In a process of its own: the browser of the other tests is still open in this one."""
    done = run("view", "push", "--nodes", 60, "--size", "420x400", "-o", "p.gif", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    with Image.open(tmp_path / "p.gif") as moving:
        pictures = []
        for number in range(moving.n_frames):
            moving.seek(number)
            pictures.append(np.asarray(moving.convert("RGB")).astype(int))
        assert moving.info["loop"] == 0 and moving.size[0] == 420
    assert len(pictures) > 10 and changed(pictures[0], pictures[-1]) > 200
    assert (tmp_path / "p.gif").stat().st_size < 500_000
