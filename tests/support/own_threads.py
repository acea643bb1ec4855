"""The threads of this process that something must end."""

import threading


def own_threads() -> set[threading.Thread]:
    """Return all threads but the helpers of `phone_host.stereo.two_threads`, which stay as long as the process and begin when they are needed."""
    return {thread for thread in threading.enumerate() if not thread.name.startswith("second-of-two")}
