"""What the API's description shows as examples."""

from typing import Any

AT = "2026-11-24T10:02:31+00:00"
ID = "6f1c6f9e-2f0e-4a51-9f3c-0a6f6f0f7d11"
OTHER_ID = "0c1f5b0e-7f0c-4a43-8d5e-6a0c5a0b3f21"
STEP = {"key": "block/avoid/2", "kind": "block", "title": "Go round: way of steering 2 of 3"}
YAML = "title: Which way?\ntasks:\n  - task: avoid\nstrategies: [no-align, all-priors]\n"
PROTOCOL: dict[str, Any] = {
    "title": "Which way?",
    "tasks": [{"task": "avoid"}],
    "strategies": ["no-align", "all-priors"],
}
STUDY: dict[str, Any] = {
    "id": ID,
    "title": "Which way?",
    "state": "open",
    "created_at": AT,
    "version": 1,
    "participants": {"active": 3, "completed": 8, "abandoned": 1, "withdrawn": 0},
    "wanted": 12,
}
LINE: dict[str, Any] = {
    "id": ID,
    "label": "P-7",
    "study_id": OTHER_ID,
    "version": 1,
    "external_id": None,
    "created_at": AT,
    "seen_at": AT,
    "state": "active",
    "excluded": None,
    "step": STEP,
    "place": 8,
    "of": 14,
    "is_opened": True,
    "is_connected": True,
    "answers": 7,
    "training": "succeeded",
    "drives": 1,
    "driven_s": 20.1,
}
WHOLE: dict[str, Any] = LINE | {
    "order": ["all-priors", "no-align"],
    "answers_given": [
        {
            "query_id": OTHER_ID,
            "task": "avoid",
            "position": 1,
            "repeats": None,
            "h": [0.1, -0.9],
            "thinking_time_s": 2.4,
            "answered_at": AT,
            "hand_path": [[0.55, 0.0, 0.3], [0.55, 0.04, 0.3]],
        }
    ],
    "consistency": {"avoid": {"pairs": 2, "mean_angle_deg": 11.3, "mean_length_difference": 0.08}},
    "trainings": [
        {
            "id": OTHER_ID,
            "task": "avoid",
            "state": "succeeded",
            "fraction": 1.0,
            "queued_at": AT,
            "training_s": 0.6,
            "error": None,
            "strategies": {"all-priors": {"curve": [[0, 1.9], [200, 0.02]]}},
        }
    ],
    "responses": [
        {
            "step": "questions/avoid/1/steering",
            "questionnaire": "steering",
            "item": "easy",
            "value": 6,
            "answered_at": AT,
        }
    ],
    "notes": [{"id": OTHER_ID, "author": "ada", "text": "Was late.", "written_at": AT}],
    "events": [{"kind": "consent", "at": AT}],
}
LIVE: dict[str, Any] = {
    "participant_id": ID,
    "label": "P-7",
    "study_id": OTHER_ID,
    "step": STEP,
    "mode": "driving",
    "is_connected": True,
    "drive_id": OTHER_ID,
    "progress": None,
}
JOB: dict[str, Any] = {
    "id": OTHER_ID,
    "participant_id": ID,
    "label": "P-7",
    "study_id": OTHER_ID,
    "task": "avoid",
    "state": "running",
    "fraction": 0.4,
    "attempt": 1,
    "error": None,
    "queued_at": AT,
    "ended_at": None,
    "training_s": None,
}
CHOICES: dict[str, Any] = {
    "tasks": [
        {"name": "avoid", "title": "Go round", "has_goal": True, "labels": 7, "unlabelled": 1000}
    ],
    "strategies": [{"name": "all-priors", "title": "Answers and priors", "is_learned": True}],
    "orders": [{"name": "williams", "title": "Williams design (balanced)"}],
    "questionnaires": [{"name": "steering", "title": "How was it to steer like this?"}],
    "template": PROTOCOL,
}
