"""The pages of the site, one module a kind; `tests/make_site.py` writes them."""
