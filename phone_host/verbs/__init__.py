"""One module for each verb of phone-host: its options, what it prints, its exit code."""
