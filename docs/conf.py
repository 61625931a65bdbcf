"""How the documentation is built: `make docs`."""

from __future__ import annotations

from importlib.metadata import version as installed

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
