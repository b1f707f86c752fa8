"""The only room that speaks viser."""
