"""One thread for the linear algebra of each worker of the unit tests.

There are as many workers as cores. With matrices as small as these OpenBLAS's threads mostly wait for each other, which costs a tenth of the suite's time.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported, which no conftest does earlier
