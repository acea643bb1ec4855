"""The language of a link: messages, their bytes, and the state machine that speaks it."""
