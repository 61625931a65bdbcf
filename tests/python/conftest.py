import signal

import pytest
from hypothesis import settings

# In the background of a shell Ctrl-C is ignored, also in the processes that the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples each time; `make fuzz` looks for new ones, many more of them.
settings.register_profile("test", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("fuzz", deadline=None, max_examples=3000, print_blob=True)
settings.load_profile("test")


@pytest.fixture(scope="module")
def chromium():
    """The browser of a file's tests. Playwright keeps an event loop while it is open, so others
    that need one in the same process come after it."""
    from energymargin.viewer.browser import headless_page

    with headless_page() as page:
        yield page.context.browser
