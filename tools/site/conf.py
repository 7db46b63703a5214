"""The configuration of Sphinx, which tools/make_site.py runs on the gathered pages."""

import os

project = "Hairloom"
copyright = "The Hairloom developers"
release = version = os.environ["HAIRLOOM_VERSION"]
extensions = ["myst_parser"]
root_doc = "README"
#: anchors of headings as on GitHub, where the same pages are read
myst_heading_anchors = 4
templates_path = ["templates"]
html_theme = "furo"
html_title = f"Hairloom {release}"
html_copy_source = html_show_sphinx = False
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "versions.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "sidebar/scroll-end.html",
    ]
}
