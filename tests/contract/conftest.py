"""One thread for the linear algebra, as in the unit tests: with matrices as small as these its threads mostly wait for each other."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported, which no conftest does earlier
