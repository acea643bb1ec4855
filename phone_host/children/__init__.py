"""Programs of ours that the host starts, and that are gone when it has done with them."""
