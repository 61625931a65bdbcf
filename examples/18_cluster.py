"""Many states on a cluster: on Slurm by dask-jobqueue, or on Ray; with the bits of one machine.

`python examples/18_cluster.py slurm` asks Slurm for jobs; without a word it starts the same jobs as
processes of this machine (dask_jobqueue.local). `python examples/18_cluster.py ray` takes Ray.
It needs the extra [cluster] and dask-jobqueue, or ray.
"""

import concurrent.futures
import sys

import energymargin as em

JOB = {"cores": 1, "processes": 1, "memory": "2GB"}  # one thread a core


def on_dask(problems, slurm):
    """Scores of the workers that dask-jobqueue starts: by sbatch, or on this machine."""
    from dask.distributed import Client
    from dask_jobqueue import SLURMCluster
    from dask_jobqueue.local import LocalCluster

    on_slurm = {"queue": "normal", "walltime": "01:00:00"}  # of yours
    cluster = SLURMCluster(**JOB, **on_slurm) if slurm else LocalCluster(**JOB)
    with cluster, Client(cluster) as client:
        cluster.scale(jobs=2)  # or cluster.adapt(maximum_jobs=100)
        return em.score(problems, ["capture"], nodes=100, executor=em.executors.Dask(client))


class RayExecutor(concurrent.futures.Executor):
    """Ray's tasks as an Executor, which `executor=` takes everywhere."""

    def __init__(self):
        """Starts Ray here, or joins the cluster that RAY_ADDRESS names."""
        import ray

        ray.init(log_to_driver=False)
        self._ray, self._max_workers = ray, int(ray.cluster_resources()["CPU"])
        self._task = ray.remote(lambda function, args, kwargs: function(*args, **kwargs))

    def submit(self, function, /, *args, **kwargs):
        """A task of Ray, as a Future."""
        return self._task.remote(function, args, kwargs).future()

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Leaves the cluster."""
        self._ray.shutdown()


def main():
    """Scores twelve states of two pushes there and here."""
    problems = em.datasets.generate("push", trajectories=2, frames=6, seed=1).problems()
    word = sys.argv[1] if len(sys.argv) > 1 else ""
    if word == "ray":
        with RayExecutor() as executor:
            there = em.score(problems, ["capture"], nodes=100, executor=executor)
    else:
        there = on_dask(problems, slurm=word == "slurm")
    here = em.score(problems, ["capture"], nodes=100)
    same = (there["capture"] == here["capture"]).all()
    print(f"{len(problems)} states, {'the same bits' if same else 'other bits'} as on one machine")


if __name__ == "__main__":
    main()
