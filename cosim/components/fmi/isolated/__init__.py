"""FMUs in worker processes.

A crash, exit or hang of an FMU does not affect the importer and the other components.

Importer process: `IsolatedFmu` (isolated_fmu.py) is the component, based on `WorkerClient`
(worker_client.py), which sends commands; `WorkerProcess` (worker_process.py) starts the worker
process, waits for its answers and ends it.

Worker process: `Worker` (worker.py) executes the commands on one `FmuInstance`.

Both processes exchange
    - commands and answers, each one line of JSON, through pipes (pipes.py);
    - numeric values, the current time and the worker's journal through shared memory
      (shared_memory.py).

A worker process is forked from the importer, which takes some milliseconds. A step costs one empty
line in each direction. Every wait for an answer has a deadline.
"""

from .isolation import Isolation

__all__ = ["Isolation"]
