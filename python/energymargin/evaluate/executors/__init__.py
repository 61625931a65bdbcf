"""Where problems are scored: on threads, in processes, or by the workers of a Dask cluster.

The scores are the same, to the last bit.
"""
