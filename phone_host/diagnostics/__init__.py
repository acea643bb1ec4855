"""Rules that judge what a run or its images show, and the snapshot of a run that they read. Pure: values in, findings out."""
