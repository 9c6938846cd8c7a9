"""Work on a Dask cluster, for studies and fleets."""

from axisight.cluster.on_cluster import on_cluster

__all__ = ["on_cluster"]
