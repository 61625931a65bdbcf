"""Files of scores as energymargin wrote them before: up to 0.5 of one dataset and one choice of
settings, then with one problem a state."""

import hashlib
import json
import sqlite3

from energymargin.scoring.settings import ALGORITHM

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


TABLES_3 = """
CREATE TABLE datasets (
    id INTEGER PRIMARY KEY, digest TEXT UNIQUE, task TEXT NOT NULL, parameters TEXT,
    states INTEGER NOT NULL, digest_2 TEXT
);
CREATE TABLE problems (id INTEGER PRIMARY KEY, digest BLOB NOT NULL UNIQUE);
CREATE TABLE states (
    dataset INTEGER NOT NULL REFERENCES datasets, number INTEGER NOT NULL,
    trajectory INTEGER NOT NULL, frame INTEGER NOT NULL,
    captured INTEGER NOT NULL, success INTEGER NOT NULL,
    captured_any INTEGER, success_any INTEGER, problem INTEGER REFERENCES problems,
    PRIMARY KEY (dataset, number)
) WITHOUT ROWID;
CREATE TABLE questions (
    id INTEGER PRIMARY KEY, metric TEXT NOT NULL, settings TEXT NOT NULL, algorithm TEXT NOT NULL,
    UNIQUE (metric, settings, algorithm)
);
CREATE TABLE scores (
    problem INTEGER NOT NULL REFERENCES problems, stream INTEGER NOT NULL,
    question INTEGER NOT NULL REFERENCES questions, value REAL NOT NULL, seconds REAL NOT NULL,
    PRIMARY KEY (problem, stream, question)
) WITHOUT ROWID;
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, dataset INTEGER NOT NULL REFERENCES datasets, settings TEXT NOT NULL
);
CREATE TABLE asked (
    run INTEGER NOT NULL REFERENCES runs, question INTEGER NOT NULL REFERENCES questions,
    PRIMARY KEY (run, question)
) WITHOUT ROWID;
CREATE TABLE scorers (
    id INTEGER PRIMARY KEY AUTOINCREMENT, host TEXT NOT NULL, process INTEGER NOT NULL,
    until REAL NOT NULL
);
CREATE TABLE claims (
    problem INTEGER NOT NULL, stream INTEGER NOT NULL, question INTEGER NOT NULL,
    scorer INTEGER NOT NULL REFERENCES scorers ON DELETE CASCADE,
    PRIMARY KEY (problem, stream, question)
) WITHOUT ROWID;
CREATE INDEX claims_of_scorer ON claims (scorer);
"""


def write_3(path, dataset, scores, questions, settings, *, states):
    """Version 3: the first `states` states have scores, the others have no problem yet.

    `questions`: the settings of each metric; `settings`: all of them.
    """
    problems = dataset.problems()
    with sqlite3.connect(path) as file:
        file.executescript(TABLES_3)
        file.execute(f"PRAGMA application_id = {0x454D7363}")
        file.execute("PRAGMA user_version = 3")
        file.execute(
            "INSERT INTO datasets VALUES (1, ?, ?, ?, ?, NULL)",
            (dataset.digest(), dataset.task, json.dumps(dataset.parameters), dataset.size),
        )
        file.execute("INSERT INTO runs VALUES (1, 1, ?)", (json.dumps(settings),))
        for question, metric in enumerate(scores, start=1):
            own = json.dumps(questions[metric], sort_keys=True)
            key = (question, metric, own, ALGORITHM)
            file.execute("INSERT INTO questions VALUES (?, ?, ?, ?)", key)
            file.execute("INSERT INTO asked VALUES (1, ?)", (question,))
        for number, label in enumerate(dataset.labels(0, dataset.size)):
            problem = number + 1 if number < states else None
            if problem is not None:
                digest = hashlib.sha256(problems[number].to_json().encode()).digest()
                file.execute("INSERT INTO problems VALUES (?, ?)", (problem, digest))
                rows = [
                    (problem, number, question, float(values[number]), 0.25 * (question == 1))
                    for question, values in enumerate(scores.values(), start=1)
                ]
                file.executemany("INSERT INTO scores VALUES (?, ?, ?, ?, ?)", rows)
            file.execute(
                "INSERT INTO states VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?)", (number, *label, problem)
            )
    file.close()
