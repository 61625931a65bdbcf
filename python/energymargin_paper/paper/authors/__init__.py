"""The data that the authors of the paper published, as datasets and scores of ours.

A folder holds the recordings of Table II and the simulated trajectories of Table I, with labels and
the authors' own scores. The data are not part of this library: a user clones them, and gives the
folder. docs/results/published.md has the details.

Each part, of `parts(folder)`, becomes a dataset of a task at the authors' parameters (`dataset`),
which is scored, evaluated, viewed and reported as any other, and labelled scores of theirs
(`labelled_scores`), which `add_scores` puts into a store as a run of its own.
"""

from energymargin_paper.paper.authors.folder import SIMULATED, parts
from energymargin_paper.paper.authors.reading import add_scores, dataset, labelled_scores

__all__ = ["SIMULATED", "add_scores", "dataset", "labelled_scores", "parts"]
