"""For all tests: a property has no time limit, since how long an example takes says what else the machine does.

In CI the examples are the same ones each time (hypothesis' own profile for it), so that a red run is red again; anywhere else new ones are tried.
"""

import os

from hypothesis import settings

settings.register_profile("untimed", settings.get_profile("ci" if os.environ.get("CI") else "default"), deadline=None)
settings.load_profile("untimed")
