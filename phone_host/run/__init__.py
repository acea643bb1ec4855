"""One run of the host: its threads, what it does with a pair, what it leaves on disk and shows in a terminal."""
