"""One run of the host: its threads, the processing of pairs, the results on disk and the terminal view."""
