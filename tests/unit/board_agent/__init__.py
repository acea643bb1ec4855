"""Tests of board_agent."""
