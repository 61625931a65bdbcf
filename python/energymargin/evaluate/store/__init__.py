"""The SQLite file that has answers: a store of scores, and where long work goes on."""
