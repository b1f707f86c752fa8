"""Words on the wire: ``…In`` and ``…Out``."""
