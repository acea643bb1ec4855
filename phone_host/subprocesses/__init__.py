"""Our programs that the host starts as child processes and always ends."""
