"""What can be asked for, as requests and the groups of options that they share; and what does it, whoever asks."""
