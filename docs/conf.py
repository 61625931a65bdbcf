"""How the documentation is built: `make docs`."""

from __future__ import annotations

from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

project = "Energy Margin"
author = "The authors of Energy Margin"
copyright = author
version = release = installed("energymargin")

extensions = [
    "myst_nb",
    "sphinx_copybutton",
    "sphinx_design",
]

# Markdown: headings are targets of links, and a link without a target is an error (-W).
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = "off"  # the outputs are stored in the notebooks; the tests run them

smartquotes = False  # "--option" is one

html_theme = "furo"
html_title = f"Energy Margin {version}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1c5d8c", "color-brand-content": "#1c5d8c"},
    "dark_css_variables": {"color-brand-primary": "#7fb9e3", "color-brand-content": "#7fb9e3"},
}
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True


def write_pages(app: Any, _: Exception | None) -> None:
    """Pages that turn and play, which guides have in a frame: a push, a balance, three grasps."""
    import numpy as np

    import energymargin as em

    folder = Path(app.outdir) / "pages"
    folder.mkdir(exist_ok=True)
    em.viewer.view("push").save(folder / "push.html")
    em.viewer.view("balance", trajectory=4, frame=16).save(folder / "balance.html")
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=6)  # the README's
    bar = em.grasps.GraspObject(em.Box((0.04, 0.18, 0.03)), mass=0.4, friction=0.7)
    poses = np.array([np.diag([1.0, -1.0, -1.0, 1.0])] * 3)
    poses[:, 1, 3], poses[:, 2, 3] = (0.0, 0.03, 0.06), 0.01
    grasps = em.grasps.GraspSet(poses, names=("middle", "beside", "end"))
    belief = em.grasps.GraspBelief(pose=[0.005] * 3 + [0.05] * 3)
    scores = em.grasps.score(grasps, hand, bar, "lift", belief=belief, rollouts=30)
    em.viewer.view(scores).save(folder / "grasps.html")


def setup(app: Any) -> None:
    """Writes the pages once the others are there."""
    app.connect("build-finished", write_pages)
