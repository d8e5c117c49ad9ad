"""What every command shares: how it ends, what it prints and draws, what it can be told."""
