"""The host on a phone: scripts and programs in a stand-in for Termux, under qemu-user. `make test-arm`, not part of CI."""
