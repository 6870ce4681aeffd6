"""Processes that fork after the module has worked, and numbers of threads."""

import subprocess
import sys

import numpy as np
import pytest
import taxel

SETUP = """
import os, sys, threading
import numpy as np
import taxel
random = np.random.default_rng(1)
x = random.uniform(size=(3000, 5))
y = np.sin(3 * x[:, :1] + x[:, 1:2])
def work(_=0):
    return taxel.Model(8, refine=False, penalty=1e-6).fit(x, y).to_bytes()
predict = lambda _=0: known.predict(x).tobytes()
synth = lambda _=0: taxel.synth("press", 300).readings.tobytes()
def child(work, join=lambda pid: os.waitpid(pid, 0)[1]):
    wanted = work()
    pid = os.fork()
    if pid == 0:
        os._exit(0 if work() == wanted else 1)
    assert join(pid) == 0
def pool(wanted):
    import multiprocessing
    with multiprocessing.get_context("fork").Pool(2) as workers:
        assert workers.map(work, range(3)) == [wanted] * 3
def joblib(wanted):
    from joblib import Parallel, delayed
    assert Parallel(2, backend="multiprocessing")(delayed(work)() for _ in range(3)) == [wanted] * 3
def loader(wanted):
    import multiprocessing
    fork = multiprocessing.get_context("fork")
    batches, workers = fork.Queue(), []
    for _ in range(2):
        workers.append(fork.Process(target=lambda: [batches.put(predict()) for _ in range(3)]))
        workers[-1].start()
    assert [batches.get() for _ in range(6)] == [wanted] * 6
    [worker.join() for worker in workers]
def thread(work):
    found = []
    running = threading.Thread(target=lambda: found.append(child(work)))
    other = threading.Thread(target=work)
    other.start(), running.start(), running.join(), other.join()
    assert found == [None]
known = taxel.Model(8, refine=False, penalty=1e-6).fit(x, y)
"""
WAYS = {
    "os.fork": "child(work)",
    "multiprocessing": "pool(work())",
    "joblib": "joblib(work())",
    "workers of a loader": "loader(predict())",
    "a fork in a thread": "thread(work)",
    "after synth": "child(synth)",
    "after predict": "child(predict)",
}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows forks nothing")
@pytest.mark.parametrize("way", WAYS)
def test_a_forked_child_works_and_has_the_same_bits(way):
    subprocess.run([sys.executable, "-W", "ignore", "-c", SETUP + WAYS[way]], timeout=60, check=True)


def test_any_number_of_threads_gives_the_same_bits():
    x = np.random.default_rng(2).uniform(size=(2000, 6))
    y = np.sin(x @ np.arange(1, 7))
    models = [taxel.Model(8, refine=False, n_jobs=jobs).fit(x, y) for jobs in (1, 2, -1, None)]
    assert len({model.to_bytes() for model in models}) == 1
    assert len({model.predict(x).tobytes() for model in models}) == 1
    with pytest.raises(ValueError, match="n_jobs=0"):
        taxel.Model(8, n_jobs=0).fit(x, y)
