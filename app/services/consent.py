"""What people agree to: the protocol's Markdown, named by its content."""

import hashlib

from markdown_it import MarkdownIt

from app.schemas.protocol import Protocol

# No HTML of the text's own gets through, and no link but of the kinds that lead to pages and mail.
_MARKDOWN = MarkdownIt("commonmark", {"html": False})


def version_of(protocol: Protocol) -> str:
    """The name of exactly this text: the first half of its SHA-256."""
    return hashlib.sha256(protocol.consent.encode()).hexdigest()[:32]


def html_of(protocol: Protocol) -> str:
    """The text as HTML that is safe to show."""
    html: str = _MARKDOWN.render(protocol.consent)
    return html
