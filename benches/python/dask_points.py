"""What a point of a sweep costs more on Dask than in one process: processor time of all processes. Needs the
package and ``dask[distributed]``.

    python benches/python/dask_points.py [POINTS]
"""

import os
import signal
import sys
from time import perf_counter, process_time

from package import pendulum

import holonom as hn


def last(result: hn.Result) -> float:
    """The height of the lower body at the end, m."""
    return float(result["lower"].position[-1, 2])


def main() -> None:
    """Prints a line for each."""
    import distributed

    points = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    model = pendulum().replace({"simulation.end": 1.0})  # 500 steps
    keys = {"body.lower.mass": (0.5, 1.5), "body.upper.mass": (0.8, 1.2)}
    plan, outputs = hn.plan(keys, sample="sobol", n=points, seed=3), {"last": last}

    def alone() -> tuple[float, hn.SweepTable]:
        begin = process_time()
        table = hn.sweep(model, plan, outputs, threads=1)
        return process_time() - begin, table

    own, one = min((alone() for _ in range(3)), key=lambda found: found[0])
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with distributed.Client(cluster) as client:
            client.run(lambda: __import__("holonom") and None)

            def everywhere() -> float:
                return process_time() + sum(client.run(process_time).values())

            costs, clocks = [], []
            for _ in range(4):
                begin, clock = everywhere(), perf_counter()
                assert hn.sweep(model, plan, outputs, executor=client) == one
                clocks.append(perf_counter() - clock)
                costs.append(everywhere() - begin)
            killed: list[int] = []

            def kill(ended: int, of: int) -> None:
                if ended > of // 4 and not killed:
                    killed.append(next(iter(client.run(os.getpid).values())))
                    os.kill(killed[0], signal.SIGKILL)

            clock = perf_counter()
            assert hn.sweep(model, plan, outputs, executor=client, progress=kill) == one and killed
            restarted = perf_counter() - clock
    per = 1e3 / points
    print(f"{points} points, equal tables: {per * own:.2f} ms of processor time a point in one process, on Dask {per * (min(costs) - own):+.2f}; "
          f"by the clock {per * min(clocks):.2f} ms a point, {per * restarted:.2f} with a worker killed")


if __name__ == "__main__":
    main()
