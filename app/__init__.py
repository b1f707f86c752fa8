"""The service: FastAPI, the live arm, the trainings, the data."""
