"""Computation in C: built by the package's own build where there is a compiler, loaded by ctypes. `library` is the only door."""
