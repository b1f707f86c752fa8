"""Simulated participants driven in process: as in a study, without its server, waits and pages."""
