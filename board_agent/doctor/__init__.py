"""board-agent doctor: what keeps a board from streaming."""
