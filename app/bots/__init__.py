"""Simulated participants: they take part through the doors a browser has, and no other."""
