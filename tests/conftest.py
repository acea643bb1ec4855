"""For all tests: a property has no time limit, since how long an example takes says what else the machine does."""

from hypothesis import settings

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")
