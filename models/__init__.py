"""The learning core: always this, never a database class (``…Row``) or a wire class (``…In``).

Nothing here knows of the web, of SQL or of the browser.
"""
