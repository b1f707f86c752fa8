"""How long tests wait for what must come. It is patience and no claim: slow machines are let be."""

PATIENCE_S = 180.0
