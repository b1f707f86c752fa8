"""Trainings: a queue in the database and the processes that serve it."""
