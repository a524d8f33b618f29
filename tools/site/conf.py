# Configures Sphinx, which turns the guides into a web site. tools/site/build gathers the sources and calls Sphinx.
import os

project = "bristle"
author = "the bristle project"
release = os.environ.get("BRISTLE_VERSION", "")
copyright = author
extensions = ["myst_parser"]
html_theme = "furo"
html_title = f"bristle {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_extra_path = ["extra"]  # adds the interactive page, and the HTML of the headers
templates_path = ["_templates"]
html_sidebars = {"**": ["sidebar/brand.html", "sidebar/search.html", "site_links.html", "sidebar/scroll-start.html",
                        "sidebar/navigation.html", "sidebar/scroll-end.html"]}
html_context = {"with_page": bool(os.environ.get("BRISTLE_WITH_PAGE"))}
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
source_suffix = {".md": "markdown"}
myst_heading_anchors = 6  # makes heading anchors as GitHub does
myst_enable_extensions = []
highlight_language = "none"
suppress_warnings = ["myst.header"]  # lets a README begin below the first heading level
pygments_style = "friendly"
