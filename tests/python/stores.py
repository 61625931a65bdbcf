"""Files of scores, looked at from outside while others write them: for tests."""

import sqlite3


def score_count(path):
    """How many scores there are; none before there is a file, or it has tables."""
    if not path.exists():
        return 0
    with sqlite3.connect(path, timeout=10) as file:
        tables = file.execute("SELECT count(*) FROM sqlite_master WHERE name = 'scores'")
        if tables.fetchone() == (0,):
            return 0
        return file.execute("SELECT count(*) FROM scores").fetchone()[0]
