"""Parallel work on a Dask cluster or in processes, for studies, fleets and the benchmark."""

from axisight.cluster.on_cluster import on_cluster

__all__ = ["on_cluster"]
