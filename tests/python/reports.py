"""Reports of small stores, and their pages, parsed."""

import base64
from html.parser import HTMLParser
from xml.etree import ElementTree

from energymargin import datasets, report
from energymargin.evaluate.searches import SearchSettings
from energymargin.store import ScoreStore, score_dataset

SETTINGS = SearchSettings(nodes=15, seed=3)
OPTIONS = report.Options(draws=200, pictures=1)
METRICS = ("capture", "success", "effort/est", "effort/rrt", "force")


class Svg:
    """A picture of a data URI."""

    def __init__(self, source):
        kind, _, data = source.partition(",")
        assert kind == "data:image/svg+xml;base64"
        self._root = ElementTree.fromstring(base64.b64decode(data))

    @property
    def texts(self):
        return ["".join(one.itertext()) for one in self._root.iter() if one.tag.endswith("}text")]


class Document(HTMLParser):
    """A page, taken apart."""

    def __init__(self, path):
        super().__init__()
        self.elements, self.rows, self.pictures = [], [], {}
        self._text, self._within = [], []
        self.feed(path.read_text())
        self.text = " ".join(" ".join(self._text).split())

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._within.append((tag, dict(attrs)))
        figure = next((a.get("id") for t, a in reversed(self._within) if t == "figure"), None)
        if tag == "img" and figure:
            self.pictures.setdefault(figure, []).append(Svg(dict(attrs)["src"]))
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append([])

    def handle_endtag(self, tag):
        while self._within and self._within.pop()[0] != tag:
            pass

    def handle_data(self, data):
        tags = [tag for tag, _ in self._within]
        if not {"style", "script"} & set(tags) and data.strip():
            self._text.append(data.strip())
            if "tr" in tags:
                self.rows[-1][-1].append(data.strip())

    def row(self, name):
        """The cells of the longest row of that name; each is a list of its lines."""
        return max((row[1:] for row in self.rows if row[0] == [name]), key=len)

    def attributes(self, name):
        return [attrs[name] for _, attrs in self.elements if attrs.get(name)]


def pushes(folder):
    """Puts a dataset of 12 pushes, its scores, and their report into a folder."""
    dataset = datasets.generate("push", trajectories=12, frames=6, seed=1)
    dataset.save(folder / "push.h5")
    score_dataset(dataset, folder / "push-scores.db", settings=SETTINGS)
    report.write(folder / "push-scores.db", folder / "report.html", options=OPTIONS)


def scores(path):
    with ScoreStore(path) as store:
        return store.run().labelled_scores()


def written(folder, run=None, progress=None, **options):
    chosen = report.Options(**{"draws": 9, "pictures": 0, "trajectories": 1, **options})
    path = folder / "r.html"
    report.write(folder / "push-scores.db", path, run=run, options=chosen, progress=progress)
    return Document(folder / "r.html")
