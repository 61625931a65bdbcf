"""Pages in a real browser, and what goes wrong on them."""

from contextlib import contextmanager

LOCAL = ("http://127.0.0.1", "ws://127.0.0.1", "http://localhost", "file://", "data:", "blob:")


@contextmanager
def watched_page(chromium, size=(1280, 800)):
    """A page without a window, and a list that gets its errors and what it asks of the network."""
    page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
    try:
        yield page, watch(page)
    finally:
        page.close()


def watch(page):
    """A list that gets the page's errors, and what it asks of other machines."""
    wrong = []
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request", lambda asked: None if asked.url.startswith(LOCAL) else wrong.append(asked.url)
    )
    return wrong
