"""One package for each verb of phone-host: its options, its output and its exit code."""
