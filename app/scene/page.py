"""viser's page, for the iframe: without its panels, its key bindings and its habit of giving up.

The page is viser's own file, read from the installed package; what is added to it:

* a style that hides all but the canvas (there is no setting for that);
* keys go to the page around it, so that a click into the picture does not take the keyboard away;
* it believes to have the focus: viser reconnects only then, and the focus is outside the iframe;
* it tells the page around it when its connection opens and closes.
"""

from functools import cache
from pathlib import Path

import viser

CONTENT_SECURITY_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "worker-src 'self' blob:; connect-src 'self' data: blob:; object-src 'none'; "
    "base-uri 'none'; frame-ancestors 'self'"
)

_ADDED = """
<style>
#root :not(canvas):not(:has(canvas)) { display: none !important; }
body > :not(#root):not(script):not(style) { display: none !important; }
html, body { overflow: hidden; }
</style>
<script>
(() => {
  const tell = (type) => window.parent.postMessage(
    { source: 'joymap-scene', type }, window.location.origin);
  document.hasFocus = () => true;
  for (const kind of ['keydown', 'keyup', 'keypress']) {
    window.addEventListener(kind, (event) => {
      event.stopImmediatePropagation();
      const { key, code, location, repeat, ctrlKey, shiftKey, altKey, metaKey } = event;
      const copy = new KeyboardEvent(kind, { key, code, location, repeat, ctrlKey, shiftKey,
        altKey, metaKey, bubbles: true, cancelable: true });
      if (!window.parent.dispatchEvent(copy)) event.preventDefault();
    }, { capture: true });
  }
  const PlainWorker = window.Worker;
  window.Worker = class extends PlainWorker {
    constructor(...args) {
      super(...args);
      this.addEventListener('message', (event) => {
        const type = event.data && event.data.type;
        if (type === 'connected' || type === 'closed') tell(type);
      });
    }
  };
})();
</script>
"""


@cache
def scene_page() -> str:
    """The page for the iframe."""
    source = Path(viser.__file__).parent / "client" / "build" / "index.html"
    before, mark, after = source.read_text(encoding="utf-8").partition("</head>")
    if not mark:
        raise RuntimeError("viser's page has no </head>; it is not the version joymap was made for")
    return before + _ADDED + mark + after
