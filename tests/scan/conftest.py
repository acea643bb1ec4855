"""As for the unit tests: one thread for the linear algebra of each worker, and a log that no test leaves changed."""

from tests.unit.conftest import log_as_before

__all__ = ["log_as_before"]
