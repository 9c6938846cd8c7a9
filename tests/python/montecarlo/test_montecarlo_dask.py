"""The same study on a cluster: same bits, also when a worker dies; errors when all are gone."""

import pytest

from axisight import BackendError, InputError
from axisight import montecarlo as mc
from montecarlo_data import blocks, dask_cluster, kill, same_bits, small_study

distributed = pytest.importorskip("distributed")

LONG = {"runs": 200, "block_runs": 4}


@pytest.fixture
def cluster(tmp_path):
    with dask_cluster(tmp_path) as found:
        yield found


def present(address: str, count: int) -> None:
    with distributed.Client(address, timeout=20, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=30)


def test_a_killed_worker_changes_no_bit(cluster, tmp_path):
    address, _, workers = cluster
    present(address, 2)
    done = []

    def sabotage(state):
        done.append(state.done)
        if len(done) == 3:
            kill(workers[0])

    out = tmp_path / "out"
    far = mc.run(small_study(**LONG), out=out, backend="dask", scheduler=address, progress=sabotage)
    assert workers[0].returncode == -9
    assert done[2] < done[-1] == 200
    same_bits(far, mc.run(small_study(**LONG)))


def test_without_workers_the_study_stops_and_resumes(cluster, tmp_path):
    address, _, workers = cluster
    present(address, 2)
    out = tmp_path / "out"

    def sabotage(state):
        for worker in workers:
            kill(worker)

    options = {"backend": "dask", "scheduler": address, "patience_s": 2.0}
    with pytest.raises(BackendError, match=r"at least one worker.*resume") as caught:
        mc.run(small_study(**LONG), out=out, progress=sabotage, **options)
    assert address in str(caught.value)
    assert 1 <= len(blocks(out)) < 50
    same_bits(mc.run(small_study(**LONG), out=out, resume=True), mc.run(small_study(**LONG)))


def test_scheduler_out_of_reach(tmp_path):
    options = {"backend": "dask", "scheduler": "tcp://127.0.0.1:9", "patience_s": 1.0}
    with pytest.raises(BackendError, match=r"tcp://127\.0\.0\.1:9: cannot be reached"):
        mc.run(small_study(), out=tmp_path, **options)
    with pytest.raises(InputError, match="scheduler: expected the address"):
        mc.run(small_study(), backend="dask")


def test_a_scheduler_that_dies(cluster, tmp_path):
    address, scheduler, _ = cluster
    present(address, 2)
    options = {"backend": "dask", "scheduler": address, "patience_s": 3.0}
    with pytest.raises(BackendError, match="resume"):
        mc.run(
            small_study(**LONG), out=tmp_path / "o", progress=lambda _: kill(scheduler), **options
        )
    same_bits(
        mc.run(small_study(**LONG), out=tmp_path / "o", resume=True), mc.run(small_study(**LONG))
    )
