"""How the pages of this folder become a site: `make docs`.

Sphinx rather than mkdocs-material: it reads the docstrings as they stand (numpydoc), its search
works from a folder without a server, and nothing on its pages comes from the network.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import made  # beside this file, which Sphinx does not look at

project = "zfcal"
author = "The zfcal contributors"
html_title = "zfcal"
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["blocks.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
language = "en"
# Indented blocks are commands.
highlight_language = "none"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["notebooks"]

# Links within a page lead to headings, as they do where the repository is read.
myst_heading_anchors = 4
napoleon_google_docstring = False
autodoc_typehints = "none"

# Nobody else's names: what a function returns is described in words.
nitpicky = False


def setup(app):
    """Put what is made from the code into the pages that ask for it."""
    app.connect("source-read", made.insert)
