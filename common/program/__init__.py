"""What both programs share for the command line, settings file, log and signals."""
