"""Files of scores as energymargin wrote them up to 0.5: one dataset, one choice of settings."""

import json
import sqlite3

from energymargin.settings import ALGORITHM

TABLES = """
CREATE TABLE settings (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE states (
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL,
    captured INTEGER NOT NULL, success INTEGER NOT NULL, seconds REAL,
    captured_any INTEGER, success_any INTEGER,
    PRIMARY KEY (trajectory, frame)
) WITHOUT ROWID;
CREATE TABLE scores (
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL, metric TEXT NOT NULL, value REAL NOT NULL,
    PRIMARY KEY (trajectory, frame, metric),
    FOREIGN KEY (trajectory, frame) REFERENCES states
) WITHOUT ROWID;
"""


def write(path, dataset, scores, settings, *, states=None, version=2, made_by=ALGORITHM):
    """The first `states` states have scores, by metric; the others have none yet."""
    states = dataset.size if states is None else states
    with sqlite3.connect(path) as file:
        file.executescript(TABLES)
        file.execute(f"PRAGMA application_id = {0x454D7363}")
        file.execute(f"PRAGMA user_version = {version}")
        settings = {
            "task": dataset.task,
            "dataset": dataset.digest_of_version_2(),
            **settings,
            "metrics": sorted(scores),
            "energymargin": made_by,
        }
        file.executemany(
            "INSERT INTO settings VALUES (?, ?)",
            [(name, json.dumps(value)) for name, value in settings.items()],
        )
        for number, label in enumerate(dataset.labels(0, dataset.size)):
            trajectory, frame, *labels = label
            seconds = 0.25 if number < states else None
            file.execute(
                "INSERT INTO states VALUES (?, ?, ?, ?, ?, ?, ?)",
                (trajectory, frame, *labels[:2], seconds, *labels[2:]),
            )
            if number < states:
                file.executemany(
                    "INSERT INTO scores VALUES (?, ?, ?, ?)",
                    [(trajectory, frame, m, float(values[number])) for m, values in scores.items()],
                )
        if version == 1:
            for column in ("captured_any", "success_any"):
                file.execute(f"ALTER TABLE states DROP COLUMN {column}")
    file.close()
