"""The page of `energymargin view` in a real browser: Chromium, without a window."""

import io
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from browsers import watch
from futures import carried
from PIL import Image

import energymargin as em
from energymargin.look.viewer import view
from energymargin.look.viewer.search import ReplayedWay
from energymargin.look.viewer.texts import NAMES

SLIDERS = ("trajectory", "frame", "nodes", "lambda", "moment")  # from the top of the panel
VIEWPORT = {"width": 720, "height": 420}
SCENE = {"x": 0, "y": 0, "width": 380, "height": 420}  # of the page, without the panel
PATIENCE = 60.0  # s; a busy machine draws a frame in seconds


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=3, frames=5, seed=1)


@pytest.fixture(scope="module")
def seen(dataset, chromium):
    """A scored state on a page that several tests use; each puts things back."""
    with view(dataset, trajectory=2, frame=1, nodes=150) as viewer:
        viewer.page.score()
        viewer.page.wait()
        with opened(chromium, viewer.url) as page:
            ready(page)
            yield viewer, page


@contextmanager
def opened(chromium, url):
    """A page that had no error when it closes."""
    page = chromium.new_page(viewport=VIEWPORT)
    wrong = watch(page)
    try:
        page.goto(f"{url}?fixedDpr=1")  # else it is drawn coarser when the machine is slow
        yield page
        assert wrong == []
    finally:
        page.close()


def ready(page):
    page.get_by_role("button", name="Score this state").wait_for(timeout=1e3 * PATIENCE)
    page.add_style_tag(content="[class*=mantine-Notification] { display: none !important }")


def slide(page, name, share):
    """Clicks on a slider, at that share of its length: its arrow keys turn the camera as well."""
    track = page.locator(".mantine-Slider-track").nth(SLIDERS.index(name))
    track.scroll_into_view_if_needed()
    box = track.bounding_box()
    page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.05)


def picture(seen):
    """The scene as it is once it no longer changes, shape (height, width, 3)."""
    viewer, page = seen
    viewer.page.wait()
    before, end = None, time.monotonic() + PATIENCE
    while time.monotonic() < end:
        now = page.screenshot(clip=SCENE, timeout=1e3 * PATIENCE)
        if now == before:
            return np.asarray(Image.open(io.BytesIO(now)).convert("RGB")).astype(int)
        before = now
        page.wait_for_timeout(300)
    raise AssertionError("the page does not come to rest")


def changed(one, other):
    """The number of pixels that are not alike."""
    return int((np.abs(one - other).max(axis=2) > 24).sum())


def becomes_other(seen, before, least):
    """At least so many pixels change."""
    until(lambda: changed(before, picture(seen)) >= least, "another picture")


def becomes_again(seen, before):
    until(lambda: changed(before, picture(seen)) < 50, "the picture as it was")


def score_rows(page, name):
    return page.locator(f'tr:has(td:text("{NAMES[name]}"))')


def shown_score(page, name):
    return score_rows(page, name).first.locator("td").nth(1).inner_text()


def shows(page, name, score):
    """Whether the page shows this score; its last digit may be rounded either way."""
    return float(shown_score(page, name)) == pytest.approx(score, abs=6e-4)


def test_the_tree_is_there_and_goes_when_it_is_not_wanted(seen):
    page = seen[1]
    whole = picture(seen)
    for name in ("nodes", "edges", "capture set", "objects"):
        page.get_by_label(name, exact=True).last.uncheck(force=True)
        becomes_other(seen, whole, 50)
        page.get_by_label(name, exact=True).last.check(force=True)
        becomes_again(seen, whole)


def test_the_frame_slider_moves_the_bodies_and_its_words(seen):
    viewer, page = seen
    frames = viewer.page._frames
    before = picture(seen)
    slide(page, "frame", 0.75)
    page.get_by_text(f"t = {frames.times[3]:.2f} s").wait_for()
    page.get_by_text("Not scored yet.").wait_for()
    becomes_other(seen, before, 500)
    slide(page, "frame", 0.25)
    page.get_by_text(f"t = {frames.times[1]:.2f} s").wait_for()
    becomes_again(seen, before)


def test_the_trajectory_slider_shows_another(seen):
    viewer, page = seen
    before = picture(seen)
    slide(page, "trajectory", 0.5)
    until(lambda: viewer.page._trajectory == 1, "another trajectory")
    becomes_other(seen, before, 500)
    slide(page, "trajectory", 1.0)
    until(lambda: viewer.page._trajectory == 2, "back again")
    becomes_again(seen, before)


def test_the_moment_slider_replays_the_way_out(seen):
    viewer, page = seen
    way = viewer.page.scored.way_out
    before = picture(seen)
    slide(page, "moment", 1.0)
    page.get_by_text(f"At this moment: {way.costs[-1]:.3g} J, {way.times[-1]:.2f} s").wait_for()
    becomes_other(seen, before, 500)
    slide(page, "moment", 0.0)
    page.get_by_text("At this moment: 0 J, 0.00 s").wait_for()
    becomes_again(seen, before)


def test_a_number_that_is_typed_out_of_range_is_put_back(seen):
    viewer, page = seen
    panel, boxes = viewer.page._panel, page.locator(".mantine-NumberInput-input")
    for name, slider, typed, kept in (
        ("frame", panel.frame, "-4", 0),
        ("frame", panel.frame, "9", 4),
        ("frame", panel.frame, "1", 1),
        ("moment", panel.escape.slider, "-9", 0),
        ("lambda", panel.rate, "-3", 0),
        ("lambda", panel.rate, "5", 5),
        ("nodes", panel.nodes, "-5", 1),
        ("nodes", panel.nodes, "150", 150),
    ):
        box = boxes.nth(SLIDERS.index(name))
        box.fill("")
        box.press_sequentially(typed)
        box.press("Enter")

        def is_put_back(slider=slider, box=box, kept=kept):
            return slider.value == kept == float(box.input_value() or "nan")

        until(is_put_back, f"{name} {typed}")
    assert viewer.page._frame == 1


@contextmanager
def long_replay(page):
    """The way out there and back again so often that no machine sees its end while a test runs."""
    scored = page.scored
    short = scored.way_out
    there = np.arange(len(short.times))
    moments = np.resize(np.concatenate([there, there[::-1]]), 10_000)
    times = 0.03 * np.arange(len(moments))  # five minutes
    with page._lock:  # as every callback of the page does
        vars(scored)["way_out"] = ReplayedWay(times, short.states[moments], short.costs[moments])
        page._show_scored()
    try:
        yield
    finally:
        page._panel.escape.stop()
        page._panel.escape.join()
        with page._lock:
            vars(scored)["way_out"] = short
            page._show_scored()


def test_a_replay_stops_where_somebody_moves_it(seen):
    viewer, page = seen
    moment = viewer.page._panel.escape.slider
    seen_there = page.get_by_role("slider").nth(SLIDERS.index("moment"))
    with long_replay(viewer.page):
        for _ in range(3):
            page.get_by_role("button", name="Replay the escape").click()
            until(lambda: moment.value > 5, "it moves")
            slide(page, "moment", 0.0)
            until(lambda: not viewer.page._panel.escape.playing, "it stops")
            assert moment.value <= 1  # where it was moved to
            until(lambda: seen_there.get_attribute("aria-valuenow") == str(moment.value), "seen")
            page.wait_for_timeout(100)
            assert moment.value <= 1


def test_a_replay_stops_at_once_however_long_a_moment_is(seen):
    viewer, _ = seen
    player, way = viewer.page._panel.escape, viewer.page.scored.way_out
    player.set_up(1e6 * way.times)
    player.press()
    player.stop()
    until(lambda: not player.playing, "it stops")
    player.set_up(way.times)


def test_lambda_and_nodes_change_the_score_at_once(seen):
    viewer, page = seen
    problem, seed = viewer.page.scored.problem, em.stream(0, 2 * 5 + 1)
    slide(page, "lambda", 0.0)  # all nodes are as likely
    expected = em.capture_score(problem, nodes=150, seed=seed, rate=0.0).capture
    until(lambda: shows(page, "capture", expected), "lambda 0")
    slide(page, "nodes", 0.03)
    until(lambda: viewer.page._panel.nodes.value < 150, "fewer nodes")

    def shown_is_of_its_nodes():  # the slider may still be on its way
        nodes = viewer.page._panel.nodes.value
        expected = em.capture_score(problem, nodes=nodes, seed=seed, rate=0.0).capture
        return shows(page, "capture", expected)

    until(shown_is_of_its_nodes, "fewer nodes")


def test_a_state_is_scored_live(dataset, chromium):
    expected = em.capture_score(dataset.problems([0])[0], nodes=60, seed=em.stream(0, 0))
    shown = view(dataset, trajectory=0, frame=0, nodes=60)
    with shown as viewer, opened(chromium, viewer.url) as page:
        ready(page)
        page.get_by_text("Not scored yet.").wait_for()
        page.get_by_role("button", name="Score this state").click()
        score_rows(page, "capture").wait_for(timeout=1e3 * PATIENCE)
        assert shown_score(page, "capture") == f"{expected.capture:.3f}"
        assert shown_score(page, "success") == f"{expected.success:.3f}"
        page.get_by_role("button", name="Score all frames").click()
        until(lambda: not np.isnan(viewer.page._along()["capture"]).any(), "all frames")


def test_a_long_search_shows_its_progress_and_can_be_stopped(dataset, chromium):
    with view(dataset, nodes=500_000) as viewer, opened(chromium, viewer.url) as page:
        ready(page)
        page.get_by_role("button", name="Score this state").click()
        bar = page.locator("[role=progressbar]")
        bar.wait_for()
        until(lambda: float(bar.get_attribute("aria-valuenow") or 0) > 0, "progress")
        page.get_by_role("button", name="Stop").click()
        page.get_by_text("stopped early").wait_for(timeout=1e3 * PATIENCE)
        assert 0 < viewer.page.scored.capture.nodes < 500_000


def test_a_score_goes_on_while_no_browser_looks(dataset, chromium):
    with view(dataset, nodes=20_000) as viewer:
        with opened(chromium, viewer.url) as page:
            ready(page)
            page.get_by_role("button", name="Score this state").click()
            page.get_by_role("button", name="Stop").wait_for()
        viewer.page.wait()
        with opened(chromium, viewer.url) as page:
            page.get_by_text("20,000 of 20,000 nodes").wait_for(timeout=1e3 * PATIENCE)


def test_a_scene_without_effector_is_shown_and_scored(chromium):
    scene = em.Scene()
    scene.add_plane("table")
    at = (0, 0, 0.05)
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1, position=at, role="object")
    captured = em.regions.Ball("object", center=at, radius=0.1)
    bounds = {"force": (9, 9, 0), "torque": (0, 0, 0), "duration": 0.2}
    problem = em.Problem(scene, scene.pack(), **bounds, captured=captured)
    with view(problem, nodes=40) as viewer, opened(chromium, viewer.url) as page:
        ready(page)
        page.get_by_role("button", name="Score this state").click()
        page.get_by_text("no effector, so no force score").wait_for(timeout=1e3 * PATIENCE)
        assert score_rows(page, "force").count() == 0


def test_the_future_of_a_state_is_replayed_and_its_probability_scored_live(chromium):
    with view(carried(), nodes=40) as viewer, opened(chromium, viewer.url) as page:
        ready(page)
        page.get_by_text("undisturbed it leaves at 0.35 s").wait_for(timeout=1e3 * PATIENCE)
        start = picture((viewer, page))
        page.get_by_role("button", name="Replay the future").click()
        page.get_by_text("0.60 s ahead").wait_for(timeout=1e3 * PATIENCE)
        assert changed(start, picture((viewer, page))) > 200  # pusher and box are elsewhere
        page.get_by_role("button", name="Score this state").click()
        page.get_by_text("30 rollouts under random wrenches").wait_for(timeout=1e3 * PATIENCE)
        assert shown_score(page, "probability") == "0.000"
        assert shown_score(page, "effort") == "0 J"
        assert score_rows(page, "capture").count() == 0


def run(*arguments, **options):
    command = [sys.executable, "-c", "from energymargin.cli import main; main()", "view"]
    return subprocess.Popen(
        [*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


def test_the_command_says_where_it_serves_until_ctrl_c(chromium):
    process = run("push", "--nodes", "1000000")
    try:
        said = ""
        while "Ctrl-C ends it" not in said:
            said = process.stderr.readline()
            assert said, "it ended"
        address = re.search(r"http://127\.0\.0\.1:\d+/", said)[0]
        with opened(chromium, address) as page:
            page.get_by_role("button", name="Stop").wait_for(timeout=1e3 * PATIENCE)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, rest = process.communicate(timeout=PATIENCE)
        assert time.monotonic() - begin < 3.0  # 0.2 s, or more on a busy machine
        assert process.returncode == 0
        assert rest.strip() == "closed"
    finally:
        process.kill()


def test_ctrl_c_ends_a_screenshot_in_the_middle_of_its_search(tmp_path):
    path = tmp_path / "push.png"
    process = run("push", "--nodes", "1000000", "-o", str(path))
    try:
        while "Generating" not in process.stderr.readline():
            pass
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert said.strip() == "stopped"
        assert not path.exists()
    finally:
        process.kill()


def test_a_screenshot_has_the_size_and_the_scene(tmp_path):
    path = tmp_path / "push.png"
    process = run("push", "--nodes", "50", "-o", str(path), "--size", "900x600")
    _, said = process.communicate(timeout=3 * PATIENCE)
    assert process.returncode == 0, said
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert pixels.shape == (600, 900, 3)
    green = (pixels[..., 1] > 1.3 * pixels[..., 0]) & (pixels[..., 1] > pixels[..., 2])
    assert green.sum() > 100  # the effector


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nothing",), "is neither a problem file"),
        (("push", "--size", "big", "-o", "x.png"), "--size is 'big', expected"),
        (("push", "--size", "9x9"), "expected 100 to 8192 pixels"),
        (("push", "-o", "no/where.png"), "there is no folder no"),
        (("push", "-o", "push.jpg"), "expected a name with .png"),
        (("push", "-p", "colour=1"), "colour"),
        (("push", "--port", "0"), "port is 0, expected a whole number from 1 to 65535"),
        (("push", "--plan", "hold"), "--plan is hold, expected --frames beside it"),
        (("push", "--frames", "0"), "frames is 0"),
        (("push", "--frames", "2", "--plan", "dance"), 'Choose from: "script", "hold", "none"'),
    ],
)
def test_wrong_options_are_one_line(arguments, message, tmp_path):
    process = run(*arguments, cwd=tmp_path)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    lines = [line for line in said.splitlines() if "Generating" not in line and line.strip()]
    assert len(lines) == 1 and message in lines[0]
    assert list(tmp_path.iterdir()) == []


def test_an_along_is_a_slider_over_its_moments_with_their_scores(chromium):
    along = em.margin_profile(carried(), ahead=0.1, rollouts=20, effort=False)
    with view(along) as viewer, opened(chromium, viewer.url) as page:
        ready(page)
        shown = viewer.page._panel
        assert np.array_equal(shown._plot.data[1], along.probabilities)
        shown.frame.value = along.weakest.number
        page.get_by_text(f"t = {along.weakest.time:.2f} s").wait_for(timeout=1e3 * PATIENCE)
        page.get_by_text(f"{along.weakest.probability:.3f}").first.wait_for(timeout=1e3 * PATIENCE)
        viewer.page.score()
        viewer.page.wait()
        live = em.capture_probability(along.problems[along.weakest.number], rollouts=20, seed=0)
        assert viewer.page.scored.probability.captured == live.captured
