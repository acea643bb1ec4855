"""Tests of the native library: every instruction set of this processor against numpy, with and without sanitizers, and on ARM under qemu-user."""
