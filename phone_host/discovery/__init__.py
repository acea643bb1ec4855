"""The host's boards: discovery and enrolment."""
