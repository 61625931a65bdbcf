"""How the documentation is built: `make docs`."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))

project = "Energy Margin"
author = "The authors of Energy Margin"
copyright = author
version = release = installed("energymargin")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "myst_nb",
    "sphinx_copybutton",
    "sphinx_design",
    "docstrings",
    "commands",
    "constants",
    "headers",
    "problem_schema",
]
exclude_patterns = ["_ext"]

# Markdown: headings are targets of links, and a link without a target is an error (-W).
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = "off"  # the outputs are stored in the notebooks; the tests run them

# The interface in Python. A type of another library, or of a module within a public one, has no
# page here; all other types have to have one.
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", r"(?!energymargin).*"),
    ("py:.*", r"energymargin\._core.*"),
    ("py:.*", r"energymargin(\.\w+){3,}"),  # of a module within a public one
]
smartquotes = False  # "--option" is one
default_role = "code"  # `x` is code in docstrings, as in Markdown
autoclass_content = "both"  # constructors of the compiled module say their arguments themselves
autodoc_member_order = "bysource"
autodoc_default_options = {"undoc-members": True}  # a plain value may say it all by its name
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = False
toc_object_entries_show_parents = "hide"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

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
