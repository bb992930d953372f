"""FMUs in processes of their own: whatever one of them does there, the importer and the other components go on.

    importer: RemoteFmu (remote.py)                            worker: FmuInstance, served by Worker (worker.py)
         |-- commands and answers as lines of JSON, over pipes (lines.py, process.py) --|
         |-- numbers, clock and journal in one block of shared memory (block.py) -------|

A worker is forked from the importer, which takes some milliseconds; a step is one empty line each way. Every wait has a deadline.
"""

from .isolation import Isolation

__all__ = ["Isolation"]
