"""What both programs need of a command line, a settings file, a log and signals."""
