"""For the unit tests: one thread for the linear algebra of each worker.

There are as many workers as cores: threads of OpenBLAS for matrices as small as these mostly wait for each other, and burn a tenth of the suite's time in that.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported, which no conftest does before
