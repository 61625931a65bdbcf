import signal
from pathlib import Path

import pytest
from hypothesis import settings

from energymargin.base import plausibility

# In the background of a shell Ctrl-C is ignored, also in the processes that the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples each time; `make fuzz` looks for new ones, many more of them.
settings.register_profile("test", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("fuzz", deadline=None, max_examples=3000, print_blob=True)
settings.load_profile("test")


# Studies, kills, tutorials, examples, benchmarks: `make test` leaves them to `make check-all`.
LONG = {
    "act",
    "act_grasp",
    "act_scoop",
    "audit",
    "bench",
    "bench_contact",
    "bounds",
    "bowl",
    "ceiling",
    "closed_forms",
    "contact_grips",
    "contact_motion",
    "contact_rest",
    "contact_walls",
    "critical_replicas",
    "docs",
    "durability",
    "engines",
    "examples",
    "foresight",
    "guard_study",
    "left_out",
    "mesh_cavities",
    "mujoco_rare",
    "perturbation",
    "policies_known",
    "properties_proofs",
    "published",
    "scale",
    "table1",
    "table2",
    "tutorials",
    "viewer_page",
    "walls",
}


@pytest.fixture(autouse=True)
def warnings_of_before():
    """Are forgotten: a scene warns once, whichever test is the first to make it."""
    plausibility._known.clear()


def pytest_configure():
    """A file of `LONG` that is gone is an error."""
    gone = LONG - {file.stem[5:] for file in Path(__file__).parent.glob("*/test_*.py")}
    if gone:
        raise pytest.UsageError(f"LONG names files that are gone: {', '.join(sorted(gone))}")


def pytest_collection_modifyitems(items):
    """Files with tests in a browser come last: Playwright keeps an event loop in this thread, and
    other tests need one of their own."""
    for item in items:
        if item.path.stem.removeprefix("test_") in LONG:
            item.add_marker("long")
    in_browser = {item.path for item in items if "chromium" in item.fixturenames}
    items.sort(key=lambda item: item.path in in_browser)


@pytest.fixture(scope="session")
def chromium():
    """The browser of all tests in a process."""
    from energymargin.look.viewer.page import headless_page

    with headless_page() as page:
        yield page.context.browser


@pytest.fixture(scope="session")
def topple():
    """A small dataset: 2 trajectories of 3 frames."""
    from energymargin import datasets

    return datasets.generate("topple", trajectories=2, frames=3, seed=0)


@pytest.fixture(scope="session")
def topple_scores(topple):
    """Its scores with the settings of the tests of stores."""
    from stores import SETTINGS

    import energymargin as em

    return em.score(topple.problems(), settings=SETTINGS)


@pytest.fixture(scope="session")
def pushes_report(tmp_path_factory):
    """A folder with a dataset of 12 pushes, its scores, and their report."""
    from reports import pushes

    folder = tmp_path_factory.mktemp("report")
    pushes(folder)
    return folder


@pytest.fixture(scope="module")
def mesh_cache(tmp_path_factory):
    """The cache folder of a file's tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ENERGYMARGIN_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
